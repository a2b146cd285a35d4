"""Tables of pandas, polars and pyarrow in and out: by name, row for row, or an error."""

from __future__ import annotations

import datetime
import decimal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import assert_same_pose, random_platforms, random_poses, seeds

import gough
from gough.columns import DEVIATIONS, EULER, EULER_DEG, LEGS, POSITION, QUATERNION
from gough.fk.solution import solution_columns
from gough.tables import as_readings

PLATFORM = gough.Platform.load("reference")
POSES = PLATFORM.sample_poses(12, seed=3)
READINGS = gough.leg_lengths(PLATFORM, POSES)

MAKERS: dict[str, Callable[[dict], Any]] = {
    "pandas": pd.DataFrame,
    "polars": pl.DataFrame,
    "pyarrow": pa.table,
}
libraries = pytest.mark.parametrize("library", MAKERS)


def columns_of(readings: np.ndarray) -> dict[str, np.ndarray]:
    return {name: np.ascontiguousarray(readings[:, i]) for i, name in enumerate(LEGS)}


def made(library: str, columns: dict) -> Any:
    return MAKERS[library](columns)


def values(frame: Any, names: tuple[str, ...]) -> np.ndarray:
    return np.stack([np.asarray(frame[name]) for name in names], axis=-1)


class ArrowOnly:
    """A table of a library that nobody here knows."""

    def __init__(self, table: pa.Table) -> None:
        self.columns, self._table = table.column_names, table

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self._table.__arrow_c_stream__(requested_schema)


# ---- readings in ----------------------------------------------------------------------


@libraries
def test_a_table_is_solved_like_its_array_and_answered_in_its_kind(library: str) -> None:
    shuffled = {"time": np.arange(12)} | dict(reversed(columns_of(READINGS).items()))
    shuffled["note"] = np.array(["a"] * 12)
    found = gough.solve(PLATFORM, made(library, shuffled))
    expected = gough.solve(PLATFORM, READINGS)
    np.testing.assert_array_equal(found.pose.position, expected.pose.position)
    np.testing.assert_array_equal(found.pose.wxyz, expected.pose.wxyz)
    np.testing.assert_array_equal(found.status, expected.status)
    frame = found.to_frame()
    assert type(frame) is type(made(library, {}))
    np.testing.assert_array_equal(values(frame, POSITION), expected.pose.position)


@given(seeds, st.integers(0, 7), st.sampled_from(sorted(MAKERS)))
def test_every_bit_passes_in_every_order(seed: int, rows: int, library: str) -> None:
    rng = np.random.default_rng(seed)
    readings = rng.standard_normal((rows, 6)) * 10.0 ** rng.integers(-30, 30, (rows, 6))
    readings[rng.random((rows, 6)) < 0.1] = np.nan
    columns = columns_of(readings) | {"other": np.zeros(rows)}
    order = rng.permutation(list(columns)).tolist()
    table = made(library, {name: columns[name] for name in order})
    np.testing.assert_array_equal(as_readings(table), readings)


def test_other_arrow_streams_batches_and_readers_are_tables() -> None:
    table = pa.table(columns_of(READINGS) | {"odd": pa.array([{"a": 1}] * 12)})
    chunked = pa.concat_tables([table.slice(0, 5), table.slice(5, 0), table.slice(5)])
    batch = table.combine_chunks().to_batches()[0]
    for given_as in (ArrowOnly(table), chunked, batch, table.to_reader(), table.slice(3)):
        first = 3 if given_as is not chunked and getattr(given_as, "num_rows", 12) == 9 else 0
        np.testing.assert_array_equal(as_readings(given_as), READINGS[first:])
    assert isinstance(gough.solve(PLATFORM, ArrowOnly(table)).to_frame(), pa.Table)


@libraries
@pytest.mark.parametrize("kind", ["int64", "uint16", "float32", "float16", "int8"])
def test_numbers_of_any_width_are_read(library: str, kind: str) -> None:
    rounded = (READINGS % 100).astype(kind)
    got = as_readings(made(library, columns_of(rounded)))
    assert got.dtype == np.float64
    np.testing.assert_array_equal(got, rounded.astype(np.float64))


def test_decimals_nullable_categories_and_objects_of_numbers_are_read() -> None:
    rounded = READINGS.round(2)
    exact = {n: [decimal.Decimal(str(v)) for v in c] for n, c in columns_of(rounded).items()}
    frame = pd.DataFrame(columns_of(rounded))
    arrow = pd.ArrowDtype(pa.float64())
    for table in (
        pd.DataFrame(exact), pl.DataFrame(exact), pa.table(exact), frame.convert_dtypes(),
        frame.astype(object), frame.astype("category"), frame.astype(arrow),
        pl.DataFrame(frame.to_dict("list")).lazy().collect(),
    ):  # fmt: skip
        np.testing.assert_allclose(as_readings(table), rounded, rtol=3e-16)


def with_gaps(library: str) -> Any:
    """Rows 1 and 4 lack a reading, row 2 has NaN, row 3 infinity."""
    columns: dict[str, list] = {name: list(c) for name, c in columns_of(READINGS[:6]).items()}
    columns["leg_2"][1] = columns["leg_6"][4] = None
    columns["leg_1"][2], columns["leg_3"][3] = np.nan, np.inf
    return made(library, columns)


@libraries
def test_absent_values_are_rows_without_an_answer(library: str) -> None:
    for table in (with_gaps(library), *([with_gaps("pandas").convert_dtypes()])):
        found = gough.solve(PLATFORM, table)
        bad = np.isin(np.arange(6), (1, 2, 3, 4))
        np.testing.assert_array_equal(found.status == gough.Status.INVALID_INPUT, bad)
        np.testing.assert_array_equal(np.isnan(found.pose.position[:, 0]), bad)
        assert found.usable[~bad].all()
        frame = found.to_frame("pandas")
        assert frame["status"].tolist() == ["converged", *["invalid_input"] * 4, "converged"]


@libraries
def test_a_column_without_any_value_is_all_invalid(library: str) -> None:
    table = made(library, columns_of(READINGS) | {"leg_4": [None] * 12})
    assert (gough.solve(PLATFORM, table).status == gough.Status.INVALID_INPUT).all()


@libraries
def test_a_table_without_rows_is_solved(library: str) -> None:
    found = gough.solve(PLATFORM, made(library, columns_of(READINGS[:0])))
    assert found.status.shape == (0,)
    assert len(found.to_frame("pandas")) == 0


# ---- readings that are refused --------------------------------------------------------

WRONG_COLUMNS = {
    "missing": ({"leg_3"}, {}, r"^legs: no column leg_3; expected leg_1 to leg_6, found leg_1, "),
    "another case": (set(LEGS), {"Leg_1": "leg_1"}, r"is 'Leg_1' meant as leg_1\?"),
    "blanks": ({"leg_5"}, {" leg_5": "leg_5"}, r"no column leg_5.*is ' leg_5' meant as leg_5\?"),
    "none": (set(LEGS), {"a": "leg_1"}, r"no leg columns; .*found a; rename the columns$"),
}


@libraries
@pytest.mark.parametrize("case", WRONG_COLUMNS)
def test_wrong_columns_are_named_with_what_there_is(library: str, case: str) -> None:
    dropped, added, told = WRONG_COLUMNS[case]
    columns = columns_of(READINGS)
    new = {name: columns[source] for name, source in added.items()}
    table = made(library, {n: c for n, c in columns.items() if n not in dropped} | new)
    for take in (gough.solve, gough.assembly_modes):
        with pytest.raises(gough.InputError, match=told) as caught:
            take(PLATFORM, table)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "table",
    [
        pd.DataFrame(READINGS),
        pd.DataFrame(READINGS, columns=list("abcdef")),
        pd.DataFrame(READINGS, columns=pd.MultiIndex.from_product([["leg"], range(6)])),
        pl.DataFrame(READINGS),
        pa.table(dict(zip("abcdef", READINGS.T, strict=True))),
        pd.DataFrame(READINGS).iloc[0].rename(lambda i: f"length {i}"),
    ],
    ids=["unnamed", "letters", "levels", "polars", "pyarrow", "row"],
)
def test_six_columns_of_other_names_are_never_guessed(table: Any) -> None:
    for call in (
        lambda: gough.solve(PLATFORM, table),
        lambda: gough.assembly_modes(PLATFORM, table),
        lambda: gough.certify(PLATFORM, table, POSES),
        lambda: gough.Tracker(PLATFORM).update(table),
    ):
        with pytest.raises(gough.InputError, match=r"^legs: no leg columns; expected leg_1 to leg"):
            call()


def test_a_doubled_column_is_an_error() -> None:
    doubled = pd.DataFrame(columns_of(READINGS))
    doubled = pd.concat([doubled, doubled[["leg_2"]]], axis=1)
    with pytest.raises(gough.InputError, match="two columns are called 'leg_2'"):
        gough.solve(PLATFORM, doubled)


NOT_NUMBERS = {
    "text": ["1.5"] * 12,
    "truth": [True] * 12,
    "dates": [datetime.datetime(2026, 1, 1)] * 12,
    "lists": [[1.0]] * 12,
}


@libraries
@pytest.mark.parametrize("what", NOT_NUMBERS)
def test_a_column_of_something_else_is_named(library: str, what: str) -> None:
    table = made(library, columns_of(READINGS) | {"leg_2": NOT_NUMBERS[what]})
    with pytest.raises(gough.InputError, match=r"^legs: column leg_2: holds .*, expected numbers"):
        gough.solve(PLATFORM, table)


def test_categories_mixtures_and_objects_are_named() -> None:
    frame = pd.DataFrame(columns_of(READINGS))
    words = ["low", "high"] * 6
    mixed = [1.0, "x"] * 6
    for column in (pd.Categorical(words), mixed, [object()] * 12, [1j] * 12, [{}] * 12):
        with pytest.raises(gough.InputError, match=r"^legs: column leg_5: .*expected numbers") as e:
            gough.solve(PLATFORM, frame.assign(leg_5=column))
        assert "\n" not in str(e.value)
    objects = pl.DataFrame(frame.to_dict("list") | {"leg_5": [object()] * 12})
    with pytest.raises(gough.InputError, match=r"^legs: column leg_5: holds .*expected numbers"):
        gough.solve(PLATFORM, objects)
    with pytest.raises(gough.InputError, match=r"^legs: column leg_5: holds .*row 1 has 'low'"):
        gough.solve(
            PLATFORM,
            pl.DataFrame(frame.to_dict("list") | {"leg_5": pl.Series(words, dtype=pl.Categorical)}),
        )


def test_a_table_that_has_not_been_computed_says_so() -> None:
    with pytest.raises(gough.InputError, match=r"LazyFrame .*\.collect\(\)"):
        gough.solve(PLATFORM, pl.DataFrame(columns_of(READINGS)).lazy())


# ---- rows and loops -------------------------------------------------------------------


def test_a_row_of_a_pandas_table_is_read_by_its_labels() -> None:
    frame = pd.DataFrame({"t": 1.0} | dict(reversed(columns_of(READINGS).items())))
    noted = frame.assign(note="text")  # makes rows of objects
    for row in (frame.iloc[4], noted.iloc[4]):
        np.testing.assert_array_equal(as_readings(row), READINGS[4])
        found = gough.solve(PLATFORM, row)
        assert found.status == gough.Status.CONVERGED
        tracker = gough.Tracker(PLATFORM)
        assert_same_pose(tracker.update(row), POSES[4], 1e-10)
    noted.loc[4, "leg_2"] = None
    assert gough.solve(PLATFORM, noted.iloc[4]).status == gough.Status.INVALID_INPUT


@pytest.mark.parametrize("make", [pd.Series, pl.Series, pa.array])
def test_six_bare_numbers_of_a_column_are_a_reading(make: Callable) -> None:
    np.testing.assert_array_equal(as_readings(make(READINGS[2].tolist())), READINGS[2])
    with pytest.raises(gough.GoughError, match=r"legs: expected \(\.\.\., 6\), got \(5,\)"):
        gough.solve(PLATFORM, make(READINGS[2, :5].tolist()))


def test_modes_and_certificates_take_tables() -> None:
    table = pd.DataFrame(columns_of(READINGS[:3]))
    modes = gough.assembly_modes(PLATFORM, table)
    np.testing.assert_array_equal(modes.row, gough.assembly_modes(PLATFORM, READINGS[:3]).row)
    assert gough.certify(PLATFORM, table, POSES[:3]).certified.all()


# ---- poses in -------------------------------------------------------------------------

ROTATIONS = {
    QUATERNION: POSES.wxyz,
    EULER: POSES.euler,
    EULER_DEG: np.degrees(POSES.euler),
}


def pose_columns(rotation: tuple[str, ...]) -> dict[str, np.ndarray]:
    columns = dict(zip(POSITION, POSES.position.T, strict=True))
    return columns | dict(zip(rotation, ROTATIONS[rotation].T, strict=True))


@libraries
@pytest.mark.parametrize("rotation", ROTATIONS, ids=lambda names: names[0])
def test_legs_of_a_table_of_poses(library: str, rotation: tuple[str, ...]) -> None:
    table = made(library, dict(reversed((pose_columns(rotation) | {"id": range(12)}).items())))
    legs = gough.leg_lengths(PLATFORM, table)
    assert type(legs) is np.ndarray
    np.testing.assert_allclose(legs, READINGS, rtol=1e-12)
    assert_same_pose(gough.Pose.from_frame(table), POSES, 1e-12)


@libraries
def test_rows_that_are_no_pose_have_no_legs(library: str) -> None:
    columns: dict[str, list] = {n: list(c) for n, c in pose_columns(QUATERNION).items()}
    columns["qx"][2] = None
    columns["qw"][5] *= 1.1
    legs = gough.leg_lengths(PLATFORM, made(library, columns))
    bad = np.isin(np.arange(12), (2, 5))
    assert np.isnan(legs[bad]).all()
    np.testing.assert_allclose(legs[~bad], READINGS[~bad], rtol=1e-12)


def test_tables_without_a_pose_are_explained() -> None:
    columns = pose_columns(EULER_DEG)
    told = r"^pose: no column y; expected x, y, z and one of .*found x, z, rx_deg"
    with pytest.raises(gough.InputError, match=told):
        gough.leg_lengths(PLATFORM, pd.DataFrame({n: c for n, c in columns.items() if n != "y"}))
    with pytest.raises(gough.InputError, match=r"^pose: no whole set of rotation columns"):
        gough.Pose.from_frame(pl.DataFrame({n: c for n, c in columns.items() if n != "rx_deg"}))
    for wrong in (POSES.matrix, [1.0] * 6, None):
        with pytest.raises(gough.GoughError, match=r"^pose: expected a Pose or a table .*found "):
            gough.leg_lengths(PLATFORM, wrong)


# ---- answers out ----------------------------------------------------------------------


@libraries
def test_an_array_is_answered_in_the_kind_asked_for(library: str) -> None:
    found = gough.solve(PLATFORM, READINGS, leg_noise=0.01, certify=True)
    frame = found.to_frame(library)  # pyright: ignore[reportArgumentType]
    assert type(frame) is type(made(library, {}))
    names = [*POSITION, *QUATERNION, "status", "residual", "iterations", *DEVIATIONS, "radius"]
    assert list(getattr(frame, "column_names", None) or frame.columns) == names
    np.testing.assert_array_equal(values(frame, QUATERNION), found.pose.wxyz)
    assert list(frame["status"].tolist() if library == "pandas" else frame["status"].to_pylist()
                if library == "pyarrow" else frame["status"]) == ["certified"] * 12  # fmt: skip
    assert found.covariance is not None
    spread = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    np.testing.assert_array_equal(values(frame, DEVIATIONS), spread)
    np.testing.assert_array_equal(np.asarray(frame["radius"]), found.radius)
    np.testing.assert_array_equal(np.asarray(frame["iterations"]), found.iterations)


def test_pandas_is_the_kind_for_arrays_and_can_be_changed_by_its_owner() -> None:
    frame = gough.solve(PLATFORM, READINGS).to_frame()
    assert isinstance(frame, pd.DataFrame)
    frame.loc[0, "x"] = 5.0
    frame["residual"] *= 2
    assert frame["x"].iloc[0] == 5.0


@pytest.mark.parametrize("angles", ["deg", "rad"])
def test_angles_in_place_of_quaternions(angles: Any) -> None:
    found = gough.solve(PLATFORM, READINGS)
    names = EULER_DEG if angles == "deg" else EULER
    frame = found.to_frame("polars", angles=angles)
    wanted = found.pose.euler if angles == "rad" else np.degrees(found.pose.euler)
    np.testing.assert_array_equal(values(frame, names), wanted)
    assert "qw" not in frame.columns
    assert_same_pose(gough.Pose.from_frame(frame), found.pose, 1e-12)


@pytest.mark.parametrize("batch", [(), (1,), (3, 1, 2, 1)])
def test_every_batch_is_a_row_for_each_pose(batch: tuple[int, ...]) -> None:
    count = int(np.prod(batch))
    found = gough.solve(PLATFORM, READINGS[:count].reshape(*batch, 6), leg_noise=1.0)
    frame = found.to_frame()
    assert len(frame) == count
    np.testing.assert_array_equal(values(frame, POSITION), found.pose.position.reshape(-1, 3))
    back = gough.Pose.from_frame(found.pose.to_frame("pyarrow"))
    np.testing.assert_array_equal(back.wxyz, found.pose.wxyz.reshape(-1, 4))


def test_a_pandas_index_stays_with_its_rows() -> None:
    labels = pd.date_range("2026-01-01", periods=12, freq="s", name="time")
    table = pd.DataFrame(columns_of(READINGS), index=labels)[::-1]
    found = gough.solve(PLATFORM, table)
    assert found.to_frame().index.equals(table.index)
    chosen = np.array([4, 0, 4])
    assert found[chosen].to_frame().index.equals(table.index[chosen])
    assert found[2:5].to_frame().index.equals(table.index[2:5])
    assert found[found.residual >= 0].to_frame().index.equals(table.index)
    assert found[-1].to_frame().index.tolist() == [table.index[-1]]
    assert len(found[None].to_frame()) == 12
    assert not isinstance(found.to_frame("polars"), pd.DataFrame)


def test_modes_as_a_table() -> None:
    readings = READINGS[:3].copy()
    readings[1] = np.nan
    labels = ["a", "b", "c"]
    modes = gough.assembly_modes(PLATFORM, pd.DataFrame(columns_of(readings), index=labels))
    frame = modes.to_frame()
    assert frame.index.tolist() == [labels[i] for i in modes.row]
    np.testing.assert_array_equal(frame["row"], modes.row)
    np.testing.assert_array_equal(frame["certified"], modes.certified)
    np.testing.assert_array_equal(frame["sigma_min"], modes.singularity_distance)
    assert set(frame["status"]) == {"complete"}
    single = modes[2].to_frame()
    assert single.index.tolist() == ["c"] * len(single)
    assert len(modes[1].to_frame()) == 0
    bare = gough.assembly_modes(PLATFORM, readings[0]).to_frame("polars", angles="deg")
    assert {"rx_deg", "radius", "error", "sign"} <= set(bare.columns)


def test_wrong_kinds_and_angles_are_named() -> None:
    found = gough.solve(PLATFORM, READINGS)
    with pytest.raises(gough.GoughError, match="kind: expected 'pandas', 'polars' or 'pyarrow'"):
        found.to_frame("excel")  # pyright: ignore[reportArgumentType]
    with pytest.raises(gough.GoughError, match="angles: expected one of 'deg'"):
        found.to_frame(angles="turns")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("kind", ["pandas", "polars"])
def test_a_library_that_is_missing_is_named(kind: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    found = gough.solve(PLATFORM, READINGS)
    monkeypatch.setitem(sys.modules, kind, None)
    with pytest.raises(gough.GoughError, match=f"pip install {kind}, or pass kind='pyarrow'"):
        found.to_frame(kind)


def test_the_columns_of_files_are_those_of_frames() -> None:
    found = gough.solve(PLATFORM, READINGS, leg_noise=0.1)
    assert list(solution_columns(found, "deg")) == found.to_frame("polars", angles="deg").columns


# ---- weight ---------------------------------------------------------------------------


@pytest.mark.process
@pytest.mark.parametrize(("library", "other"), [("polars", "pandas"), ("pyarrow", "pandas")])
def test_one_library_does_not_bring_another(library: str, other: str) -> None:
    make = {"polars": "polars.DataFrame", "pyarrow": "pyarrow.table"}[library]
    code = (  # pyarrow's own way from lists to arrays would import pandas
        f"import sys, numpy, gough, {library}\n"
        "from gough.tables import number_column\n"
        "p = gough.Platform.load('reference')\n"
        "legs = {f'leg_{i + 1}': number_column(v[None]) for i, v in enumerate(p.home_legs)}\n"
        f"frame = gough.solve(p, {make}(legs)).to_frame()\n"
        f"assert type(frame).__module__.startswith({library!r}), type(frame)\n"
        f"print({other!r} in sys.modules, 'torch' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False False\n"


@given(random_platforms, seeds)
def test_round_trip_of_any_machine(platform: gough.Platform, seed: int) -> None:
    poses = platform.sample_poses(3, seed=seed)
    assert_same_pose(gough.Pose.from_frame(poses.to_frame("polars")), poses, 1e-13)
    legs = gough.leg_lengths(platform, poses.to_frame("pyarrow"))
    np.testing.assert_array_equal(legs, gough.leg_lengths(platform, poses))


@given(seeds)
def test_frames_of_poses_keep_every_bit(seed: int) -> None:
    poses = random_poses(np.random.default_rng(seed), (4,), 1.0)
    back = gough.Pose.from_frame(poses.to_frame())
    np.testing.assert_array_equal(back.position, poses.position)
    np.testing.assert_allclose(back.wxyz, poses.wxyz, rtol=0, atol=1e-16)


def test_a_file_of_certified_poses_has_their_radius(tmp_path: Path) -> None:
    from gough.files import solve_file

    pq.write_table(pa.table(columns_of(READINGS)), tmp_path / "legs.parquet")
    out = tmp_path / "poses.parquet"
    solve_file(tmp_path / "legs.parquet", out, PLATFORM, leg_noise=0.1, certify=True)
    frame = gough.solve(PLATFORM, READINGS, leg_noise=0.1, certify=True).to_frame("pyarrow")
    assert pq.read_table(out).replace_schema_metadata(None).equals(frame)

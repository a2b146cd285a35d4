"""From files of readings to files of poses and back."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.csv as pacsv
import pyarrow.parquet as pq
import pytest

import gough
from gough.columns import DEVIATIONS, EULER, EULER_DEG, LEGS, POSITION, QUATERNION
from gough.errors import GoughError, InputError
from gough.files import Reading, inverse_file, solve_file
from gough.status import Status


def table(path) -> pa.Table:
    return pq.read_table(path) if path.suffix == ".parquet" else pacsv.read_csv(path)


def array(columns: pa.Table, names) -> np.ndarray:
    return np.stack([columns[name].to_numpy() for name in names], axis=-1)


WRITTEN = ["time", *POSITION, *QUATERNION, "status", "residual", "iterations"]


@pytest.mark.parametrize("source", ["legs_csv", "legs_parquet"])
@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_what_is_written_is_what_solve_returns_bit_for_bit(
    request, tmp_path, platform, readings, source, ending
):
    out = tmp_path / f"poses{ending}"
    path = request.getfixturevalue(source)
    report = solve_file(path, out, platform, reading=Reading(keep=("time",)))
    solution = gough.solve(platform, readings)
    found = table(out)
    assert found.column_names == WRITTEN
    np.testing.assert_array_equal(found["time"].to_numpy(), np.arange(len(readings)) * 0.5)
    np.testing.assert_array_equal(array(found, POSITION), solution.pose.position)
    np.testing.assert_array_equal(array(found, QUATERNION), solution.pose.wxyz)
    np.testing.assert_array_equal(found["residual"].to_numpy(), solution.residual)
    np.testing.assert_array_equal(found["iterations"].to_numpy(), solution.iterations)
    assert found["status"].to_pylist() == [Status(s).label for s in solution.status]
    assert report.rows == len(readings)
    assert report.failures == 0


@pytest.mark.parametrize("source", ["legs_csv", "legs_parquet"])
@pytest.mark.parametrize("rows", [1, 17, 64])
def test_the_size_of_blocks_changes_no_digit(request, tmp_path, platform, readings, source, rows):
    out = tmp_path / "poses.parquet"
    path = request.getfixturevalue(source)
    solve_file(path, out, platform, reading=Reading(keep=("time",), block_rows=rows))
    solution = gough.solve(platform, readings)
    found = table(out)
    np.testing.assert_array_equal(found["time"].to_numpy(), np.arange(len(readings)) * 0.5)
    np.testing.assert_array_equal(array(found, POSITION), solution.pose.position)
    # to one bit: NumPy rounds sums in short arrays otherwise than in long ones
    np.testing.assert_allclose(array(found, QUATERNION), solution.pose.wxyz, rtol=0, atol=3e-16)


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
@pytest.mark.parametrize("angles", [None, "rad", "deg"])
def test_legs_to_poses_to_legs(tmp_path, platform, readings, legs_csv, ending, angles):
    poses, back = tmp_path / f"poses{ending}", tmp_path / f"back{ending}"
    solve_file(legs_csv, poses, platform, angles=angles)
    names = {None: QUATERNION, "rad": EULER, "deg": EULER_DEG}[angles]
    assert table(poses).column_names[3 : 3 + len(names)] == list(names)
    report = inverse_file(poses, back, platform)
    np.testing.assert_allclose(array(table(back), LEGS), readings, rtol=0, atol=1e-10)
    assert table(back)["status"].to_pylist() == ["ok"] * len(readings)
    assert report.failures == 0


def test_invalid_numbers_are_rows_not_errors(tmp_path, platform, readings):
    legs = readings[:9].copy()
    legs[1, 2], legs[3, 0], legs[5, 5], legs[7, 1] = np.nan, np.inf, -1.0, 0.0
    path, out = tmp_path / "legs.parquet", tmp_path / "poses.parquet"
    pq.write_table(pa.table({name: legs[:, i] for i, name in enumerate(LEGS)}), path)
    report = solve_file(path, out, platform)
    bad = [1, 3, 5, 7]
    labels = table(out)["status"].to_pylist()
    assert [i for i, label in enumerate(labels) if label == "invalid_input"] == bad
    assert np.isnan(array(table(out), POSITION)[bad]).all()
    good = np.delete(np.arange(9), bad)
    solution = gough.solve(platform, readings[good])
    np.testing.assert_array_equal(array(table(out), POSITION)[good], solution.pose.position)
    assert report.failures == 4
    assert [text.split(",")[0] for text in report.invalid] == [
        "row 2: leg_3 is empty or not a number",
        "row 4: leg_1 is inf",
        "row 6: leg_6 is -1",
        "row 8: leg_2 is 0",
    ]


def test_bad_rows_are_marked_when_asked(tmp_path, platform, readings, legs_csv):
    lines = legs_csv.read_text().splitlines()
    lines[5], lines[9] = "2.0,one,2,3,4,5,6", "4.0,1"
    legs_csv.write_text("\n".join(lines))
    out = tmp_path / "poses.csv"
    out.write_text("old")
    with pytest.raises(InputError, match="line 6: column leg_1: found 'one'"):
        solve_file(legs_csv, out, platform)
    assert out.read_text() == "old"
    report = solve_file(legs_csv, out, platform, reading=Reading(("time",), keep_bad_rows=True))
    assert report.failures == 2
    assert report.invalid[0] == "line 6: column leg_1: found 'one', expected a number"
    assert report.invalid[1] == "line 10: found 2 fields, expected 7 as in the header"
    lines = out.read_text().splitlines()
    assert lines[5].startswith("2.0,nan,nan,nan,nan,nan,nan,nan,invalid_input,nan,")
    assert lines[9].startswith(",nan,")
    assert len(lines) == len(readings) + 1


def test_kept_columns_pass_unchanged(tmp_path, platform, readings):
    kept = {
        "when": pa.array(range(200), pa.timestamp("us")),
        "text": pa.array(['a,"b"\n', None] * 100),
        "small": pa.array([0.1] * 200, pa.float32()),
        "list": pa.array([[1, 2]] * 200),
        "kind": pa.array(["u", "v"] * 100).dictionary_encode(),
    }
    path, out = tmp_path / "legs.parquet", tmp_path / "poses.parquet"
    legs = {name: readings[:, i] for i, name in enumerate(LEGS)}
    pq.write_table(pa.table(kept | legs), path)
    solve_file(path, out, platform, reading=Reading(keep=(*kept, "leg_1"), block_rows=33))
    found = table(out)
    assert found.column_names[:6] == [*kept, "leg_1"]
    for name in [*kept, "leg_1"]:
        assert found[name].to_pylist() == table(path)[name].to_pylist()
        assert found[name].type == table(path)[name].type
    with pytest.raises(GoughError, match=r"column list .*write \.parquet"):
        solve_file(path, tmp_path / "poses.csv", platform, reading=Reading(keep=("list",)))
    solve_file(path, tmp_path / "p.csv", platform, reading=Reading(keep=("text", "kind")))
    assert table(tmp_path / "p.csv")["kind"].to_pylist() == ["u", "v"] * 100


@pytest.mark.parametrize(
    ("keep", "words"),
    [
        ("tme", "did you mean 'time'"),
        ("x", "has a column of that name"),
        ("status", "rename yours"),
    ],
)
def test_columns_that_cannot_be_kept(tmp_path, platform, legs_csv, keep, words):
    with pytest.raises(GoughError, match=words):
        solve_file(legs_csv, tmp_path / "poses.csv", platform, reading=Reading(keep=(keep,)))
    assert not (tmp_path / "poses.csv").exists()


def test_leg_noise_adds_standard_deviations(tmp_path, platform, readings, legs_csv):
    out = tmp_path / "poses.parquet"
    solve_file(legs_csv, out, platform, leg_noise=0.01)
    covariance = gough.solve(platform, readings, leg_noise=0.01).covariance
    assert covariance is not None
    expected = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    np.testing.assert_allclose(array(table(out), DEVIATIONS), expected, rtol=1e-12)


def test_files_of_another_platform_or_unit_are_refused(tmp_path, platform, legs_csv):
    poses = tmp_path / "poses.parquet"
    solve_file(legs_csv, poses, platform)
    metadata = pq.read_metadata(poses).metadata
    assert metadata[b"gough.platform"] == b"reference"
    assert metadata[b"gough.unit"] == b"mm"
    assert metadata[b"gough.digest"] == platform.digest.encode()
    camera = gough.Platform.load("rubin_camera")
    with pytest.raises(InputError, match=r"poses.parquet: its lengths are in \[mm\]"):
        inverse_file(poses, None, camera)
    bent = replace(platform, base=platform.base + np.eye(6, 3))
    with pytest.raises(InputError, match="another geometry, not for 'reference' as it is now"):
        inverse_file(poses, None, bent)
    with pytest.raises(InputError, match="platform 'reference', not for 'other'"):
        inverse_file(poses, None, replace(bent, name="other"))
    inverse_file(poses, None, bent, reading=Reading(ignore_platform=True))
    inverse_file(poses, None, platform.with_workspace(1.0, 1.0))  # the same joints still


def test_poses_that_are_none_are_rows_not_errors(tmp_path, platform):
    rows = ["x,y,z,qw,qx,qy,qz", "0,0,600,1,0,0,0", "0,0,600,0,0,0,0", "0,0,600,2,0,0,0"]
    rows += ["0,,600,1,0,0,0", "0,0,600,inf,0,0,0", "0,0,900,1,0,0,0", "0,0,600,-1,0,0,0"]
    path, out = tmp_path / "poses.csv", tmp_path / "legs.csv"
    path.write_text("\n".join(rows))
    report = inverse_file(path, out, platform)
    invalid = ["invalid_input"] * 4
    assert table(out)["status"].to_pylist() == ["ok", *invalid, "outside_workspace", "ok"]
    assert report.failures == 4
    assert report.invalid[0] == "line 3: the quaternion's length is 0, expected 1"
    assert report.invalid[2] == "line 5: y is empty or not a number, expected a finite number"


def test_a_pose_that_no_motor_reaches_is_named(tmp_path):
    path, out = tmp_path / "poses.csv", tmp_path / "legs.csv"
    path.write_text("x,y,z,rx,ry,rz\n0,0,0.177,0,0,0\n0,0,3,0,0,0\n")
    inverse_file(path, out, gough.Platform.load("reachy_mini"))
    assert table(out)["status"].to_pylist() == ["ok", "unreachable"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("leg_3", "strut3", "no column leg_3; expected leg_1 to leg_6, found time, leg_1"),
        ("leg_", "width", "no leg columns; expected leg_1 to leg_6, found time, width1"),
        ("time", "leg_1", "two columns are called 'leg_1'"),
    ],
)
def test_missing_and_double_columns(platform, legs_csv, old, new, words):
    legs_csv.write_text(legs_csv.read_text().replace(old, new))
    with pytest.raises(InputError, match=f"legs.csv: {words}"):
        solve_file(legs_csv, None, platform)


def test_missing_pose_columns(tmp_path, platform):
    path = tmp_path / "poses.csv"
    path.write_text("x,y,z,rx,ry\n0,0,0,0,0\n")
    with pytest.raises(InputError, match="no whole set of rotation columns; expected one of qw"):
        inverse_file(path, None, platform)
    path.write_text("x,y,qw,qx,qy,qz\n0,0,1,0,0,0\n")
    with pytest.raises(InputError, match="no column z; expected"):
        inverse_file(path, None, platform)


def test_the_input_is_not_overwritten(platform, legs_csv, tmp_path):
    text = legs_csv.read_text()
    (tmp_path / "link.csv").symlink_to(legs_csv)
    for name in ("legs.csv", "link.csv"):
        with pytest.raises(GoughError, match="is the input itself"):
            solve_file(legs_csv, tmp_path / name, platform)
    assert legs_csv.read_text() == text


@pytest.mark.parametrize("source", ["legs_csv", "legs_parquet"])
def test_random_damage_is_an_error_of_ours_or_none(request, tmp_path, platform, source):
    """Flipped, cut and repeated bytes: never another exception, never a changed output."""
    path, out = request.getfixturevalue(source), tmp_path / "out.csv"
    poses = tmp_path / f"poses{path.suffix}"
    solve_file(path, poses, platform)
    whole = poses.read_bytes()
    dice, refusals = random.Random(5), []
    for _ in range(150):
        data = bytearray(whole)
        for _ in range(dice.randint(1, 4)):
            at, kind = dice.randrange(len(data)), dice.randrange(3)
            if kind == 0:
                data[at] ^= 1 << dice.randrange(8)
            elif kind == 1:
                del data[at : at + dice.randint(1, 200)]
            else:
                data[at:at] = data[at : at + dice.randint(1, 50)]
        poses.write_bytes(data)
        out.write_text("old")
        try:
            inverse_file(poses, out, platform)
        except GoughError as error:
            refusals.append(str(error))
            assert out.read_text() == "old"
    assert refusals
    assert not any("\n" in text for text in refusals)

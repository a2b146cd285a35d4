"""Histograms over many decades."""

from __future__ import annotations

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("matplotlib")

import gough
from gough.files import Reading
from gough.plot import LogHistogram, histogram_figure
from gough.plot.histograms import PER_DECADE, read_errors

POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")


def write(path, pose: gough.Pose, **more):
    values = np.concatenate([pose.position, pose.wxyz], axis=1)
    pq.write_table(pa.table(dict(zip(POSE, values.T, strict=True)) | more), path)
    return path


def count_of(histogram: LogHistogram, first: int, last: int) -> int:
    return round(histogram.shares(first, last).sum() * histogram.count)


@given(
    st.lists(
        st.floats(1e-300, 1e300) | st.floats(1e-12, 1e3) | st.sampled_from([0.0, np.nan, np.inf]),
        min_size=1,
        max_size=200,
    ),
    st.integers(1, 7),
)  # fmt: skip
def test_every_value_is_counted_once_in_its_place(values, pieces):
    array = np.array(values)
    histogram = LogHistogram()
    for piece in np.array_split(array, pieces):
        histogram.add(piece)
    finite = array[np.isfinite(array)]
    assert histogram.count == len(finite)
    assert histogram.left_out == len(array) - len(finite)
    assert histogram.zeros == (finite == 0).sum()
    assert histogram.largest == finite.max(initial=0.0)
    first, last = histogram.range
    assert count_of(histogram, first, last) == (finite > 0).sum()
    if len(finite):
        for share in (0.01, 0.5, 0.99, 1.0):
            value = histogram.quantile(share)
            assert np.mean(finite <= value * (1 + 1e-9)) >= share
            below = finite <= value * 10 ** (-1.02 / (10 * PER_DECADE))
            assert value == 0 or np.mean(below) < share


def test_a_histogram_is_kept_as_json_and_comes_back():
    values = np.concatenate([np.geomspace(1e-14, 3.0, 200), [0.0, 0.0, np.nan]])
    histogram = LogHistogram.of(values)
    again = LogHistogram.from_dict(json.loads(json.dumps(histogram.as_dict())))
    assert again.as_dict() == histogram.as_dict()
    np.testing.assert_array_equal(again.shares(-14, 1), histogram.shares(-14, 1))
    assert again.quantile(0.3) == histogram.quantile(0.3)
    empty = LogHistogram.from_dict(LogHistogram().as_dict())
    assert (empty.count, empty.range) == (0, (0, 0))


def test_negative_errors_are_refused():
    with pytest.raises(gough.GoughError, match="0 or more, found -1"):
        LogHistogram.of(np.array([1.0, -1.0]))


def test_a_figure_shows_shares_zeros_and_units():
    values = np.array([0.0, 1e-3, 2e-3, 5.0])
    figure = histogram_figure(
        {"error [mm]": {"a": LogHistogram.of(values), "b": LogHistogram.of(values[1:])}}
    )
    axes = figure.axes[0]
    assert axes.get_xlabel() == "error [mm]"
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    steps = axes.patches[0].get_data()  # pyright: ignore[reportAttributeAccessIssue]
    np.testing.assert_allclose(np.sum(steps.values), 3 / 4)
    place = int(np.searchsorted(steps.edges, 5.0)) - 1
    assert steps.values[place] == 1 / 4
    diamonds = [line for line in axes.get_lines() if line.get_marker() == "D"]
    assert [float(np.asarray(d.get_ydata())[0]) for d in diamonds] == [1 / 4]
    figure.canvas.draw()
    assert "0" in [t.get_text() for t in axes.get_xticklabels()]
    legend = axes.get_legend()
    assert legend is not None
    assert legend.get_texts()[0].get_text().startswith("a: 4 rows, half below 0.001")


def test_nothing_but_zeros_and_nothing_at_all_can_be_drawn():
    empty, zeros = LogHistogram(), LogHistogram.of(np.zeros(3))
    figure = histogram_figure({"error [m]": {"none": empty, "zeros": zeros}})
    legend = figure.axes[0].get_legend()
    assert legend is not None
    assert [t.get_text() for t in legend.get_texts()] == [
        "none: no value",
        "zeros: 3 rows, half below 0, 99 % below 0, largest 0",
    ]


# ---- files ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["reference", "reachy_mini"])
@pytest.mark.parametrize("rows", [7, 100])
def test_errors_are_distances_from_the_true_poses(tmp_path, name, rows):
    platform = gough.Platform.load(name)
    true, found = platform.sample_poses(20, seed=1), platform.sample_poses(20, seed=2)
    residual = np.geomspace(1e-9, 1, 20)
    result = read_errors(
        write(tmp_path / "a.parquet", found, residual=residual), platform,
        write(tmp_path / "b.parquet", true), reading=Reading(block_rows=rows),
    )  # fmt: skip
    shift, turn = found.distance(true)
    assert result["position"].largest == shift.max()
    np.testing.assert_allclose(result["rotation"].largest, np.degrees(turn.max()))
    assert result["residual"].largest == 1
    assert [h.count for h in result.values()] == [20, 20, 20]


def test_unusable_rows_are_left_out_unless_asked_for(tmp_path):
    platform = gough.Platform.load("reference")
    pose = platform.sample_poses(3, seed=1)
    path = write(
        tmp_path / "a.parquet", pose, residual=np.array([1e-9, 1.0, 5.0]),
        status=["converged", "not_converged", "unreachable"],
    )  # fmt: skip
    assert read_errors(path, platform)["residual"].left_out == 2
    assert read_errors(path, platform)["residual"].largest == 1e-9
    assert read_errors(path, platform, path, all_rows=True)["position"].count == 3


@pytest.mark.parametrize(("rows", "words"), [(19, "fewer rows"), (21, "more rows")])
def test_files_whose_rows_do_not_match_are_refused(tmp_path, rows, words):
    platform = gough.Platform.load("reference")
    path = write(tmp_path / "a.parquet", platform.sample_poses(20), residual=np.ones(20))
    truth = write(tmp_path / "b.parquet", platform.sample_poses(rows))
    with pytest.raises(gough.InputError, match=words):
        read_errors(path, platform, truth)


def test_a_file_without_residuals_needs_a_truth(tmp_path):
    platform = gough.Platform.load("reference")
    path = write(tmp_path / "a.parquet", platform.sample_poses(20))
    with pytest.raises(gough.InputError, match="--truth POSES"):
        read_errors(path, platform)
    assert set(read_errors(path, platform, path)) == {"position", "rotation"}

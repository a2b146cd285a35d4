"""Trajectories: every peak of any number of rows, limits, rows without an answer."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pyarrow as pa
import pyarrow.csv as pacsv
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("matplotlib")

import gough
from gough.columns import LEGS
from gough.files import Reading
from gough.files.trajectory import read_row
from gough.plot import Envelope, trajectory_figure
from gough.plot.trajectory import SIGNALS, note, read_trajectory, signals

MACHINES = ("reference", "nasa_msfc", "rubin_camera", "reachy_mini", "dietmaier")


def legs_file(folder, platform, legs, ending=".csv", **more):
    table = pa.table(more | {name: legs[:, i] for i, name in enumerate(LEGS)})
    path = folder / f"legs{ending}"
    (pacsv.write_csv if ending == ".csv" else pq.write_table)(table, str(path))
    return path


# ---- envelopes ------------------------------------------------------------------------


@given(
    rows=st.integers(1, 400),
    bins=st.integers(1, 20),
    cuts=st.lists(st.integers(0, 400), max_size=5),
    seed=st.integers(0, 2**32 - 1),
)
def test_an_envelope_is_the_lowest_and_highest_of_equal_runs_of_rows(rows, bins, cuts, seed):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(rows, 2))
    values[rng.random((rows, 2)) < 0.2] = np.nan
    answered = rng.random(rows) < 0.8
    x = np.cumsum(rng.random(rows))
    envelope = Envelope(("a", "b"), bins=bins)
    edges = sorted({0, rows, *(c for c in cuts if c < rows)})
    for start, end in pairwise(edges):
        envelope.add(x[start:end], values[start:end], answered[start:end])
    width = envelope.width
    assert width & (width - 1) == 0
    assert len(envelope.x) <= 2 * bins
    assert width == 1 or rows >= bins * width
    assert (envelope.rows, envelope.unanswered) == (rows, int((~answered).sum()))
    runs = [slice(k, k + width) for k in range(0, rows, width)]
    assert len(envelope.x) == len(runs)
    for k, run in enumerate(runs):
        np.testing.assert_array_equal(envelope.low[k], np.fmin.reduce(values[run]))
        np.testing.assert_array_equal(envelope.high[k], np.fmax.reduce(values[run]))
        assert envelope.missing[k] == (~answered[run]).sum()
        np.testing.assert_allclose(envelope.x[k], (x[run][0] + x[run][-1]) / 2)


# ---- files ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", MACHINES)
def test_a_file_of_legs_gives_the_poses_that_they_have(tmp_path, name):
    platform = gough.Platform.load(name)
    pose = platform.sample_poses(30, seed=2)
    legs = gough.leg_lengths(platform, pose)
    envelope = read_trajectory(legs_file(tmp_path, platform, legs), platform)
    expected = signals(platform, legs, pose)
    size = np.repeat([platform.size, 180.0], [9, 3])
    assert np.all(np.abs(envelope.low - expected) < 1e-9 * size)
    np.testing.assert_array_equal(envelope.x, np.arange(1, 31))
    assert envelope.unanswered == 0


@pytest.mark.parametrize("name", MACHINES)
def test_a_file_of_solved_poses_gives_the_legs_back(gough_command, tmp_path, name):
    platform = gough.Platform.load(name)
    legs = gough.leg_lengths(platform, platform.sample_poses(30, seed=2))
    poses = tmp_path / "poses.parquet"
    gough_command("solve", legs_file(tmp_path, platform, legs), "-p", name, "-o", poses)
    envelope = read_trajectory(poses, platform, reading=Reading(block_rows=7))
    shown = np.degrees(legs) if platform.legs == "rotary" else legs
    assert np.abs(envelope.high[:, :6] - shown).max() < 1e-9 * max(platform.size, 1)


def test_rows_without_an_answer_keep_their_readings_and_lose_their_pose(tmp_path):
    platform = gough.Platform.load("reference")
    legs = gough.leg_lengths(platform, platform.sample_poses(20, seed=2))
    legs[4] = np.nan
    legs[9, 2] += 900
    envelope = read_trajectory(legs_file(tmp_path, platform, legs), platform)
    assert np.flatnonzero(envelope.missing).tolist() == [4, 9]
    assert np.isnan(envelope.low[[4, 9], 6:]).all()
    np.testing.assert_allclose(envelope.low[9, :6], legs[9])
    figure = trajectory_figure(platform, envelope)
    for axes in figure.axes:
        crosses = [line for line in axes.get_lines() if line.get_marker() == "x"]
        assert np.asarray(crosses[0].get_xdata()).tolist() == [5, 10]
    assert "2 rows without a usable pose" in note(envelope)


def test_unusable_statuses_of_a_solved_file_count_as_no_answer(tmp_path):
    platform = gough.Platform.load("reference")
    pose = platform.sample_poses(4, seed=2)
    values = np.concatenate([pose.position, pose.euler], axis=1)
    columns = dict(zip(("x", "y", "z", "rx", "ry", "rz"), values.T, strict=True))
    words = ["converged", "other_mode", "near_singularity", "unreachable"]
    pq.write_table(pa.table(columns | {"status": words}), tmp_path / "a.parquet")
    envelope = read_trajectory(tmp_path / "a.parquet", platform)
    assert envelope.missing.tolist() == [0, 1, 0, 1]
    assert np.isnan(envelope.low).all(axis=1).tolist() == [False, True, False, True]


def test_time_comes_from_a_column(tmp_path):
    platform = gough.Platform.load("reference")
    legs = gough.leg_lengths(platform, platform.sample_poses(4, seed=2))
    path = legs_file(tmp_path, platform, legs, seconds=np.array([0.5, np.nan, 1.5, 3.0]))
    envelope = read_trajectory(path, platform, time="seconds")
    np.testing.assert_allclose(envelope.x, [0.5, 1.0, 1.5, 3.0])  # a gap is bridged
    assert trajectory_figure(platform, envelope, time="seconds").axes[-1].get_xlabel() == "seconds"
    for name, label in {"t": "t [s]", "time_ms": "time [ms]", "t [min]": "t [min]"}.items():
        assert trajectory_figure(platform, envelope, time=name).axes[-1].get_xlabel() == label
    rows = trajectory_figure(platform, envelope).axes[-1]
    assert rows.get_xlabel() == "row"
    assert all(float(tick).is_integer() for tick in rows.get_xticks())
    with pytest.raises(gough.InputError, match="did you mean 'seconds'"):
        read_trajectory(path, platform, time="second")


def test_one_row_of_a_file_is_a_pose(tmp_path):
    platform = gough.Platform.load("reference")
    poses = platform.sample_poses(20, seed=2)
    legs = gough.leg_lengths(platform, poses)
    legs[3] = np.nan
    path = legs_file(tmp_path, platform, legs)
    shift, turn = read_row(path, platform, 7).pose[0].distance(poses[6])
    assert max(shift / platform.size, turn) < 1e-12
    for row, words in ((4, "row 4 has no pose"), (0, "rows are 1 to 20"), (21, "no row 21")):
        with pytest.raises(gough.InputError, match=words):
            read_row(path, platform, row)


def test_files_of_neither_kind_and_of_other_platforms_are_refused(tmp_path):
    platform = gough.Platform.load("reference")
    path = tmp_path / "a.csv"
    path.write_text("a,b\n1,2\n")
    with pytest.raises(gough.InputError, match="holds neither legs nor poses"):
        read_trajectory(path, platform)
    path.write_text("leg_1,leg_2\n1,2\n")
    with pytest.raises(gough.InputError, match="no column leg_3"):
        read_trajectory(path, platform)


# ---- figures --------------------------------------------------------------------------


def envelope_of(values: np.ndarray, bins: int = 1000) -> Envelope:
    envelope = Envelope(SIGNALS, bins)
    envelope.add(np.arange(len(values), dtype=float), values, np.ones(len(values), dtype=bool))
    return envelope


@pytest.mark.parametrize("name", MACHINES)
def test_curves_are_the_signals_and_axes_have_units(name):
    platform = gough.Platform.load(name)
    pose = platform.sample_poses(15, seed=1)
    values = signals(platform, gough.leg_lengths(platform, pose), pose)
    figure = trajectory_figure(platform, envelope_of(values))
    legs, position, angles = figure.axes
    for axes, part in ((legs, values[:, :6]), (angles, values[:, 9:])):
        drawn = [np.asarray(line.get_ydata(), dtype=float) for line in axes.get_lines()]
        for k, column in enumerate(part.T):
            clean = ~np.isnan(drawn[k])
            np.testing.assert_array_equal(drawn[k][clean], column[clean])
    drawn = np.array([line.get_ydata() for line in position.get_lines()[:3]], dtype=float).T
    np.testing.assert_allclose(drawn, pose.position - platform.home.position, atol=1e-12)
    unit = platform.unit or "unit"
    assert legs.get_ylabel().endswith("[deg]" if platform.legs == "rotary" else f"[{unit}]")
    assert position.get_ylabel().endswith(f"[{unit}]")
    assert "[deg]" in angles.get_ylabel()


def test_stroke_limits_are_lines_where_they_are_near_and_words_where_they_are_far():
    platform = gough.Platform.load("nasa_msfc")
    pose = platform.sample_poses(50, seed=1)
    values = signals(platform, gough.leg_lengths(platform, pose), pose)
    legs = trajectory_figure(platform, envelope_of(values)).axes[0]
    lines = [line for line in legs.get_lines() if len(np.atleast_1d(line.get_xdata())) == 2]
    assert [float(np.asarray(line.get_ydata())[0]) for line in lines] == [106, 167]
    home = signals(platform, platform.home_legs[None], gough.Pose.identity((1,)))
    still = home + 1e-3 * np.random.default_rng(0).random((50, 12))
    legs = trajectory_figure(platform, envelope_of(still)).axes[0]
    assert [t.get_text() for t in legs.texts] == [
        "lowest reading of the stroke, 106, is outside the picture",
        "highest reading of the stroke, 167, is outside the picture",
    ]


def test_long_trajectories_are_bands_and_say_so():
    platform = gough.Platform.load("reference")
    values = np.random.default_rng(0).normal(size=(5000, 12))
    values[1234, 2] = 50.0
    envelope = envelope_of(values, bins=100)
    figure = trajectory_figure(platform, envelope)
    assert envelope.width == 32
    assert "5,000 rows: each point spans 32" in figure.texts[-1].get_text()
    band = figure.axes[0].collections[2].get_paths()[0].vertices
    assert np.asarray(band)[:, 1].max() == 50.0  # the peak is not lost


def test_angles_that_go_round_leave_a_gap():
    platform = gough.Platform.load("reference")
    values = np.zeros((4, 12))
    values[:, 11] = 170, 179, -179, -170
    angles = trajectory_figure(platform, envelope_of(values)).axes[2]
    drawn = np.asarray(angles.get_lines()[2].get_ydata(), dtype=float)
    assert np.isnan(drawn).tolist() == [False, False, True, False]

"""Files to look at: few rows of many, evenly spread, each with what is known about it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import GoughError, InputError, Platform
from gough.files import Reading, inverse_file, solve_file
from gough.view.follow import REFUSED
from gough.view.trajectory import ROWS_A_SECOND, Thin, read

EXAMPLE = Path(__file__).parents[2] / "examples" / "rubin_camera_legs.csv"
LEGS = ",".join(f"leg_{i}" for i in range(1, 7))


@pytest.fixture(scope="module")
def platform() -> Platform:
    return Platform.load("rubin_camera")


def write(path: Path, head: str, rows) -> Path:
    lines = [",".join(f"{v:.17g}" for v in row) for row in rows]
    path.write_text("\n".join([head, *lines]) + "\n")
    return path


@given(st.lists(st.integers(0, 40), max_size=8), st.integers(2, 20))
def test_rows_are_kept_evenly_over_any_stream(blocks: list[int], most: int):
    thin = Thin(most)
    total = 0
    thin.add(np.empty((0, 2)))
    for size in blocks:
        numbers = np.arange(total, total + size, dtype=float)
        thin.add(np.stack([numbers + 1, numbers], axis=-1))
        total += size
    number, values = thin.rows.T
    assert thin.total == total
    assert len(number) <= most
    assert np.array_equal(number, values + 1)  # a row keeps its number
    if total:
        step = number[1] - number[0] if len(number) > 1 else total
        assert np.array_equal(number, np.arange(1, total + 1, step))
        assert total <= most or len(number) > most / 2


def test_a_file_of_readings_is_solved(platform, tmp_path):
    trajectory = read(EXAMPLE, platform, rows=10_000)
    lines = len(EXAMPLE.read_text().splitlines()) - 1
    assert len(trajectory) == trajectory.total == lines
    assert trajectory.failures == 0
    assert trajectory.of == "leg readings"
    back = gough.leg_lengths(platform, trajectory.pose)
    np.testing.assert_allclose(back, trajectory.legs, atol=1e-12)
    assert {a.text for a in trajectory.answers} == {"Within stroke and workspace."}


def test_what_solve_and_inverse_write_can_be_looked_at(platform, tmp_path):
    poses, legs = tmp_path / "poses.parquet", tmp_path / "legs.parquet"
    solve_file(EXAMPLE, poses, platform)
    inverse_file(poses, legs, platform)
    first, second = read(poses, platform, rows=50), read(legs, platform, rows=50)
    assert (first.of, second.of) == ("poses", "leg readings")
    shift, turn = first.pose.distance(second.pose)
    assert shift.max() < 1e-12
    assert turn.max() < 1e-9
    assert first.about.startswith("poses.parquet: 1,000 rows of poses, of which every ")
    assert len(first) <= 50


def test_of_poses_and_readings_the_poses_are_shown(platform, tmp_path):
    path = tmp_path / "both.csv"
    solve_file(EXAMPLE, path, platform, reading=Reading(keep=("leg_1",)))
    assert read(path, platform, rows=10).of == "poses"


def test_a_row_without_a_pose_says_why(tmp_path):
    machine = Platform.load("reachy_mini")
    home = machine.home.position
    rows = [[*home, 0, 0, 0], [0, 0, 9, 0, 0, 0], [*home, 0, 0, 0.1]]
    path = write(tmp_path / "poses.csv", "x,y,z,rx,ry,rz", rows)
    trajectory = read(path, machine, rows=10)
    assert [a.reached for a in trajectory.answers] == [True, False, True]
    assert "cannot reach" in trajectory.answers[1].text
    assert trajectory.failures == 1
    assert trajectory.about.endswith("; 1 of the shown rows have no pose.")


def test_a_row_that_the_file_states_as_unusable_is_not_shown(platform, tmp_path):
    path = tmp_path / "poses.csv"
    rows = ["0,0,0,0,0,0,converged", "0,0,0,0,0,0,not_converged", "0,0,0,0,0,0,"]
    path.write_text("\n".join(["x,y,z,rx,ry,rz,status", *rows]))
    answers = read(path, platform, rows=10).answers
    assert [a.reached for a in answers] == [True, False, True]
    assert answers[1].text == REFUSED["not_converged"]


def test_times_play_as_fast_as_it_was(platform, tmp_path):
    rows = [[0, 0, 0, 0, 0, 0, t] for t in (5.0, 5.5, 7.0)]
    path = write(tmp_path / "poses.csv", "x,y,z,rx,ry,rz,time", rows)
    timed = read(path, platform, rows=10, time="time")
    assert timed.time.tolist() == [0, 0.5, 2.0]
    assert timed.where(2) == "row 3 of 3, 2 s"
    untimed = read(path, platform, rows=10)
    np.testing.assert_allclose(untimed.time, np.arange(3) / ROWS_A_SECOND)
    assert untimed.where(0) == "row 1 of 3"


@pytest.mark.parametrize("times", [(0.0, 2.0, 1.0), (0.0, np.nan, 1.0)])
def test_times_that_do_not_rise_are_an_error(platform, tmp_path, times):
    rows = [[0, 0, 0, 0, 0, 0, t] for t in times]
    path = write(tmp_path / "poses.csv", "x,y,z,rx,ry,rz,time", rows)
    with pytest.raises(InputError, match=r"poses.csv: row [23]: time is .*expected times that"):
        read(path, platform, rows=10, time="time")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n1,2\n", "neither legs nor poses.*found a, b"),
        ("leg_1,leg_2\n1,2\n", "no column leg_3, leg_4, leg_5, leg_6"),
        ("x,y,z\n1,2,3\n", "no whole set of rotation columns"),
        (f"{LEGS}\n1,2,3,4,5,text\n", "line 2.*leg_6"),
        ("", "is empty"),
    ],
)
def test_a_wrong_file_is_named_with_what_is_wrong(platform, tmp_path, text, message):
    path = tmp_path / "wrong.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=f"wrong.csv: .*{message}"):
        read(path, platform, rows=10)


def test_bad_rows_can_be_kept(platform, tmp_path):
    path = tmp_path / "some.csv"
    path.write_text(f"{LEGS}\n0,0,0,0,0,0\n0,0,0,0,0,text\n0,0,0,0,0,0.001\n")
    trajectory = read(path, platform, rows=10, reading=Reading(keep_bad_rows=True))
    assert [a.reached for a in trajectory.answers] == [True, False, True]


def test_an_unknown_column_of_times_is_an_error(platform):
    with pytest.raises(InputError, match="no column 't'"):
        read(EXAMPLE, platform, rows=10, time="t")


def test_another_machines_file_is_refused(platform, tmp_path):
    path = tmp_path / "poses.parquet"
    solve_file(EXAMPLE, path, platform)
    with pytest.raises(InputError, match=r"platform 'rubin_camera'.*--ignore-platform"):
        read(path, Platform.load("reference"), rows=10)
    other = Platform.load("reference")
    assert len(read(path, other, rows=10, reading=Reading(ignore_platform=True)))


def test_a_file_may_be_larger_than_what_is_shown(platform, tmp_path):
    path = tmp_path / "many.parquet"
    names = ["x", "y", "z", "qw", "qx", "qy", "qz"]
    columns = [np.zeros(300_000)] * 7
    columns[3] = np.ones(300_000)
    pq.write_table(pa.table(dict(zip(names, columns, strict=True))), path)
    trajectory = read(path, platform, rows=100)
    assert trajectory.total == 300_000
    assert 50 < len(trajectory) <= 100
    assert "of which every 4,096th is shown" in trajectory.about


def test_less_than_two_rows_are_no_trajectory(platform):
    with pytest.raises(GoughError, match="--rows 1"):
        read(EXAMPLE, platform, rows=1)

"""Files of consecutive rows: blocks of any size, events, times, likely causes."""

import numpy as np
import pyarrow.parquet as pq
import pytest

import gough
from gough.files import solve_file
from gough.files.log_format import LogFormat, time_column
from gough.files.plausible import cause, likely_fault
from gough.files.rows import Reading
from gough.status import Event


@pytest.fixture
def log(tmp_path):
    """A rising platform with a gap, a glitch and a row of 9999, and its poses."""
    platform = gough.Platform.load("reference")
    pose = gough.Pose(platform.home.position + np.linspace(0, 40, 300)[:, None] * [0.2, 0, 1.0])
    legs = gough.leg_lengths(platform, pose)
    legs[40:44] = np.nan
    legs[90, 1] += 30
    legs[91] = 9999
    path = tmp_path / "log.csv"
    rows = [f"{k / 10}," + ",".join(map(repr, row)) for k, row in enumerate(legs.tolist())]
    path.write_text("\n".join(["time [s],L1,L2,L3,L4,L5,L6", *rows]).replace("nan", "") + "\n")
    return platform, path, legs


@pytest.mark.parametrize("rows", [1, 7, 1_000])
def test_blocks_follow_each_other(log, tmp_path, rows):
    platform, path, legs = log
    out = tmp_path / "poses.parquet"
    report = solve_file(path, out, platform, follow={}, reading=Reading(block_rows=rows))
    table = pq.read_table(out)
    whole = gough.solve(platform, legs, follow=True)
    assert whole.event is not None
    assert table["event"].to_pylist() == [Event(int(e)).label for e in whole.event]
    np.testing.assert_array_equal(table["z"].to_numpy(), whole.pose.position[:, 2])
    assert report.failures == np.sum(~whole.usable) == 6
    assert report.events is not None
    assert report.events[Event.JUMPED] == report.held == 1
    assert report.time == ""


def test_times_are_noticed_and_limits_kept(log):
    platform, path, _ = log
    report = solve_file(path, None, platform)
    assert report.time == "time [s]"
    assert report.events is None
    slow = solve_file(path, None, platform, follow={"max_shift": 0.01})
    assert slow.events is not None
    assert slow.events[Event.JUMPED] > 50
    assert "line 93: all readings are 9999: no signal?" in report.unlikely[-1]
    assert time_column(["a", "stamp"], LogFormat()) == "stamp"
    assert time_column(["time", "b"], LogFormat(time="b")) == "b"
    assert time_column(["lifetime", "x"], LogFormat()) == ""


def test_rows_say_their_likely_cause():
    platform = gough.Platform.load("reference")
    home = platform.home_legs
    assert "in [mm] instead of [in]" not in cause(platform, home * 25.4)
    assert "25.4 times" in cause(platform, home * 25.4)
    assert "0.001 times" in cause(platform, home / 1000)
    assert "in [m] instead of [mm]?" in cause(platform, home / 1000)
    one = home.copy()
    one[3] = 6554
    assert "leg_4 is 6554" in cause(platform, one)
    assert cause(platform, home) == ""
    stroked = gough.Platform(
        platform.base, platform.moving, platform.home, unit="mm", stroke=(600, 720)
    )
    drawn = stroked.home_legs - 600 + np.linspace(-40, 40, 20)[:, None]
    assert "retracted end" in cause(stroked, drawn[0])
    assert "--offset=600,600" in likely_fault(stroked, drawn)
    reachy = gough.Platform.load("reachy_mini")
    assert "more than a turn" in cause(reachy, np.degrees(reachy.home_legs) + 20)

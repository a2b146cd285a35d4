"""Series of readings: as the tracker follows them, cycle by cycle."""

import dataclasses

import numpy as np
import pytest

import gough
from gough import Event, Status


def _series(name="reference", rows=600):
    """A smooth path through the workspace with gaps, a glitch, a jump and impossible rows."""
    platform = gough.Platform.load(name)
    phase = np.linspace(0, 6, rows)[:, None] * [1.0, 1.3, 0.7]
    box = platform.workspace
    assert box is not None
    shift = 0.8 * box.translation[:, 1] * np.sin(phase)
    turn = 0.8 * np.radians(box.rotation_deg[:, 1]) * np.sin(1.7 * phase + 1)
    rest = gough.Pose(np.zeros(3), platform.home.wxyz)
    pose = gough.Pose(
        platform.home.position + shift, (rest @ gough.Pose.from_euler(np.zeros(3), turn)).wxyz
    )
    legs = gough.leg_lengths(platform, pose)
    legs[50:53] = np.nan
    legs[100, 2] += 0.04 * (1 if platform.rotary else platform.size)
    legs[300:] = legs[300:][::-1].copy()
    legs[420] = 9999
    return platform, legs


@pytest.mark.parametrize("name", ["reference", "rubin_camera", "reachy_mini"])
def test_rows_are_what_a_tracker_says(name):
    platform, legs = _series(name)
    found = gough.solve(platform, legs, follow=True)
    tracker = gough.Tracker(platform)
    assert found.event is not None
    for row, reading in enumerate(legs):
        pose = tracker.update(reading)
        assert (found.event[row], found.status[row]) == (tracker.event, tracker.status)
        if tracker.event.usable:
            # two compiled functions: they may round differently in the last bits
            rounding = 1e-13 * platform.size
            np.testing.assert_allclose(found.pose.position[row], pose.position, 0, rounding)
            np.testing.assert_allclose(found.pose.wxyz[row], pose.wxyz, 0, 1e-13)
        else:
            assert np.isnan(found.pose.position[row]).all()
            assert not found.usable[row]
    assert {Event.FOUND, Event.FOLLOWED, Event.HELD, Event.JUMPED} <= {*found.event}
    assert found.event[53] == Event.FOLLOWED  # the gap is bridged
    assert found.status[420] in (Status.UNREACHABLE, Status.CONVERGED, Status.OUTSIDE_STROKE)


def test_parts_of_a_series_are_the_series():
    platform, legs = _series()
    whole = gough.Tracker(platform).follow(legs, leg_noise=0.01)
    assert whole.event is not None
    tracker = gough.Tracker(platform)
    for first, last in ((0, 1), (1, 51), (51, 52), (52, 303), (303, 303), (303, 600)):
        part = tracker.follow(legs[first:last])
        np.testing.assert_array_equal(part.event, whole.event[first:last])
        np.testing.assert_array_equal(part.pose.position, whole.pose.position[first:last])
    alone = gough.Tracker(platform)
    for reading in legs:
        alone.update(reading)
    # `update` and `follow` are compiled each on its own: the last bits may differ
    np.testing.assert_allclose(tracker.twist, alone.twist, 0, 1e-13 * platform.size)
    assert whole.covariance is not None
    frame = whole.to_frame("pyarrow")
    assert frame.column("event").to_pylist()[:2] == ["found", "followed"]
    assert np.max(whole.event[whole.usable]) <= Event.FOUND


def test_a_start_in_another_mode_is_followed_there():
    """Below the base, where the machine was said to be: usable, since followed from there."""
    platform = gough.Platform.load("reference")
    step = np.linspace(0, 20, 50)[:, None]
    pose = gough.Pose([0.0, 0.0, -600.0] - step * [0.3, 0.2, 1.0])
    legs = gough.leg_lengths(platform, pose)
    found = gough.solve(platform, legs, seed=pose[0], follow=True)
    assert found.usable.all()
    assert found.pose.distance(pose)[0].max() < 1e-9
    assert set(found.status) == {Status.OUTSIDE_WORKSPACE}
    free = dataclasses.replace(platform, workspace=None)
    assert set(gough.solve(free, legs, seed=pose[0], follow=True).status) == {Status.CONVERGED}


def test_what_does_not_go_together_is_refused():
    platform = gough.Platform.load("reference")
    legs = platform.home_legs[None]
    with pytest.raises(gough.GoughError, match="certify and ambiguous"):
        gough.solve(platform, legs, follow=True, certify=True)
    with pytest.raises(gough.GoughError, match=r"consecutive rows \(N, 6\), got \(6,\)"):
        gough.solve(platform, legs[0], follow=True)
    with pytest.raises(gough.GoughError, match="at one pose"):
        gough.solve(platform, legs, seed="polynomial", follow=True)

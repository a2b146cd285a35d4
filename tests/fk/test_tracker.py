"""The control loop: it follows, it doubts, it holds, and nothing keeps it from going on."""

import threading
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import Event, Status
from gough.kernel.constants import to_internal


@pytest.fixture
def reference():
    return gough.Platform.load("reference")


def _path(platform, cycles=400, amplitude=0.8):
    """A smooth path through the workspace, and its readings."""
    phase = np.linspace(0, 6, cycles)[:, None] * [1.0, 1.3, 0.7]
    box = platform.workspace
    shift = amplitude * box.translation[:, 1] * np.sin(phase)
    turn = amplitude * np.radians(box.rotation_deg[:, 1]) * np.sin(1.7 * phase + 1)
    home = gough.Pose(np.zeros(3), platform.home.wxyz)
    pose = gough.Pose(
        platform.home.position + shift, (home @ gough.Pose.from_euler(np.zeros(3), turn)).wxyz
    )
    return pose, gough.leg_lengths(platform, pose)


@pytest.mark.parametrize("name", gough.Platform.catalog())
def test_it_follows_every_machine(name):
    platform = gough.Platform.load(name)
    pose, legs = _path(platform)
    tracker = gough.Tracker(platform)
    for i, row in enumerate(legs):
        found = tracker.update(row)
        assert tracker.event == (Event.FOUND if i == 0 else Event.FOLLOWED)
        shift, turn = found.distance(pose[i])
        assert shift < 1e-10 * platform.size
        assert turn < 1e-10
    assert tracker.status in (Status.CONVERGED, Status.OUTSIDE_STROKE)


@pytest.mark.parametrize(
    ("bad", "status"),
    [
        ([np.nan] * 6, Status.INVALID_INPUT),
        ([650, 650, np.inf, 650, 650, 650], Status.INVALID_INPUT),
        ([-650] * 6, Status.INVALID_INPUT),
        ([0.65] * 6, Status.UNREACHABLE),
        ([655, 655, 655, 655, 655, 900], Status.UNREACHABLE),
    ],
)
def test_a_bad_reading_is_held_and_forgotten(reference, bad, status):
    pose, legs = _path(reference)
    tracker = gough.Tracker(reference)
    for row in legs[:50]:
        tracker.update(row)
    before = tracker.pose.copy()
    held = tracker.update(bad)
    assert (tracker.event, tracker.status) == (Event.HELD, status)
    np.testing.assert_array_equal(held.position, before.position)
    np.testing.assert_array_equal(held.wxyz, before.wxyz)
    found = tracker.update(legs[51])  # two cycles' motion, after one bad reading
    assert (tracker.event, tracker.status) == (Event.FOLLOWED, Status.CONVERGED)
    assert found.distance(pose[51])[0] < 1e-9


def test_a_missed_cycle_allows_for_two_and_then_no_more(reference):
    home = reference.home.position
    tracker = gough.Tracker(reference, start=reference.home, max_shift=4.0)

    def go(x):
        tracker.update(gough.leg_lengths(reference, gough.Pose(home + np.array([x, 0, 0]))))
        return tracker.event

    assert go(3.0) == Event.FOLLOWED
    tracker.update([np.nan] * 6)
    assert go(9.0) == Event.FOLLOWED  # 6 in two cycles
    assert go(15.0) == Event.JUMPED  # 6 in one
    assert go(12.0) == Event.FOLLOWED
    assert go(18.0) == Event.JUMPED


def test_a_jump_is_doubted_then_taken(reference):
    pose, legs = _path(reference)
    tracker = gough.Tracker(reference, confirm=3)
    tracker.update(legs[0])
    for _ in range(2):
        held = tracker.update(legs[200])
        assert tracker.event == Event.JUMPED
        assert held.distance(pose[0])[0] < 1e-9
    found = tracker.update(legs[200])
    assert tracker.event == Event.FOUND
    assert found.distance(pose[200])[0] < 1e-9
    tracker.update(legs[201])
    assert tracker.event == Event.FOLLOWED


def test_one_outlier_does_not_count_towards_the_next(reference):
    _, legs = _path(reference)
    tracker = gough.Tracker(reference, confirm=2)
    tracker.update(legs[0])
    for row in (legs[200], legs[100], legs[300], legs[150]):
        tracker.update(row)
        assert tracker.event == Event.JUMPED


def test_crossing_a_singularity_is_called_a_change_of_mode():
    """Fichter's platform, turned about its normal until det J changes its sign."""
    angles = np.radians([-20, 20, 100, 140, 220, 260])
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    platform = gough.Platform(2 * ring, np.roll(ring, 1, axis=0), (0, 0, 2))
    turn = np.radians(np.arange(0, 170, 1.0))
    pose = gough.Pose.from_euler([0, 0, 2], np.stack([0 * turn, 0 * turn, turn], axis=-1))
    sign = gough.assembly_sign(platform, pose)
    crossing = int(np.argmax(sign < 0))
    assert crossing > 0
    beyond, before = pose[crossing + 15], pose[crossing - 15]
    tracker = gough.Tracker(platform, start=before, max_turn=1.0, max_shift=5.0)
    tracker.update(gough.leg_lengths(platform, before))
    assert tracker.event == Event.FOLLOWED
    # the neighbour across has other legs: give the tracker a state that Newton carries over
    tracker._state[0, :7] = to_internal(tracker._constants, beyond)
    tracker.update(gough.leg_lengths(platform, beyond))
    assert tracker.event == Event.MODE_CHANGED
    assert "singularity" in tracker.event.text


def test_the_first_reading_is_found_wherever_it_is(reference):
    pose, legs = _path(reference)
    tracker = gough.Tracker(reference)
    tracker.update([np.nan] * 6)
    assert tracker.event == Event.HELD
    found = tracker.update(legs[300])
    assert tracker.event == Event.FOUND
    assert found.distance(pose[300])[0] < 1e-9
    known = gough.Tracker(reference, start=pose[300])
    known.update(legs[301])
    assert known.event == Event.FOLLOWED


@support.at_most(20)
@given(
    st.lists(
        st.one_of(
            st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=6, max_size=6),
            st.lists(st.floats(500, 850), min_size=6, max_size=6),
        ),
        max_size=8,
    )
)
def test_nothing_wedges_it(rows):
    """After any readings, `confirm` good ones bring it back to the truth."""
    platform = gough.Platform.load("reference")
    pose, legs = _path(platform)
    tracker = gough.Tracker(platform, confirm=3)
    for row in rows:
        found = tracker.update(row)
        assert np.all(np.isfinite(found.position))
    for _ in range(4):
        tracker.update(legs[7])
    assert tracker.event in (Event.FOLLOWED, Event.FOUND)
    assert tracker.pose.distance(pose[7])[0] < 1e-9


def test_a_cycle_allocates_nothing(reference):
    _, legs = _path(reference)
    rows = list(legs)
    tracker = gough.Tracker(reference)
    for row in rows[:100]:
        tracker.update(row)
    first = tracker.pose
    tracemalloc.start()
    base = tracemalloc.get_traced_memory()[0]
    tracemalloc.reset_peak()
    for row in rows[100:300]:
        tracker.update(row)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert tracker.pose is first
    assert peak - base < 4_000  # call frames and numbers: no arrays, nothing that piles up


def test_trackers_in_threads_do_not_meet(reference):
    pose, legs = _path(reference)
    worst = np.zeros(6)

    def run(k):
        tracker = gough.Tracker(reference)
        for i in range(len(legs))[:: 1 if k % 2 else -1]:
            worst[k] = max(worst[k], tracker.update(legs[i]).distance(pose[i])[0])

    threads = [threading.Thread(target=run, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert worst.max() < 1e-9


def test_a_kept_pose_stays(reference):
    _, legs = _path(reference)
    tracker = gough.Tracker(reference)
    kept = tracker.update(legs[0]).copy()
    position = kept.position.copy()
    tracker.update(legs[5])
    np.testing.assert_array_equal(kept.position, position)
    assert not np.array_equal(tracker.pose.position, position)


@pytest.mark.parametrize(
    "legs", [[1, 2, 3], 655.0, np.zeros((6, 6)), ["a"] * 6, None, "abcdef", np.zeros((1, 6))]
)
def test_what_is_no_reading_at_all_raises(reference, legs):
    tracker = gough.Tracker(reference)
    with pytest.raises(gough.GoughError, match="legs: expected six numbers"):
        tracker.update(legs)
    tracker.update(reference.home_legs)
    assert tracker.status == Status.CONVERGED


@pytest.mark.parametrize(
    ("name", "value", "wanted"),
    [
        ("max_shift", -1, "a number above 0, found -1"),
        ("max_turn", -1, "a number above 0, found -1"),
        ("period", "1", "a number above 0, found '1'"),
        ("confirm", -1, "a whole number of at least 1, found -1"),
        ("confirm", 1.5, "a whole number of at least 1, found 1.5"),
        ("start", gough.Pose(np.zeros((2, 3)), [[1.0, 0, 0, 0]] * 2), r"one Pose, found batch"),
        ("start", gough.Pose([np.nan] * 3, [1.0, 0, 0, 0]), "a pose of finite numbers"),
    ],
)
def test_settings_out_of_range_are_refused(reference, name, value, wanted):
    with pytest.raises(gough.GoughError, match=f"{name}: expected {wanted}"):
        gough.Tracker(reference, **{name: value})  # pyright: ignore[reportArgumentType]


def test_every_event_has_a_sentence():
    for event in Event:
        assert event.text.endswith(".")
        assert len(event.text) > 30


def test_the_limit_of_a_cycle_is_the_pivots_translation(reference):
    """A rotation about a far pivot moves the joints a lot and the pose's position not at all."""
    platform = replace(reference, pivot=(0.0, 0.0, 2_000.0))
    assert platform.home.position[2] == 600
    pose = gough.Pose.from_euler(platform.home.position + np.array([0, 0, 0.5]), [0.01, 0, 0])
    tracker = gough.Tracker(platform, start=platform.home, max_shift=1.0)
    tracker.update(gough.leg_lengths(platform, pose))
    assert tracker.event == Event.FOLLOWED
    further = gough.Pose.from_euler(pose.position + np.array([0, 0, 1.5]), [0.01, 0, 0])
    tracker.update(gough.leg_lengths(platform, further))
    assert tracker.event == Event.JUMPED


# ---- twist ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["reference", "rubin_camera", "reachy_mini"])
def test_twist_comes_from_two_poses_or_from_given_rates(name: str) -> None:
    platform, period = gough.Platform.load(name), 0.001
    assert platform.workspace is not None
    rate = np.concatenate([platform.workspace.translation[:, 1], [0.1, -0.2, 0.1]])
    tracker = gough.Tracker(platform, start=platform.home, period=period)
    assert np.all(np.isnan(tracker.twist))  # nothing has been followed yet
    pose, legs = platform.home, platform.home_legs
    for cycle in range(1, 6):
        pose = support.moved(platform.home, rate * cycle * period)
        legs = gough.leg_lengths(platform, pose)
        if cycle == 3:
            legs[1] = np.nan
        tracker.update(legs)
        known = cycle != 3  # and the mean over two cycles after that
        expected = rate if known else np.full(6, np.nan)
        np.testing.assert_allclose(tracker.twist, expected, rtol=1e-6, atol=1e-9)
    given = gough.leg_rates(platform, pose, rate)
    tracker.update(legs, given)
    np.testing.assert_allclose(tracker.twist, rate, rtol=1e-9)
    tracker.update(legs)
    np.testing.assert_allclose(tracker.twist, np.zeros(6), atol=1e-8)

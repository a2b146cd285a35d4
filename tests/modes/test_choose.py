"""Which of the modes is the machine's."""

from __future__ import annotations

import numpy as np
import pytest
from modes.poses import poses_of

import gough
from gough.modes.choose import ambiguous


@pytest.fixture(scope="module")
def case():
    platform = gough.Platform.load("reference")
    truth = poses_of(platform, 200)
    return truth, gough.assembly_modes(platform, gough.leg_lengths(platform, truth))


def right(modes, choice, truth) -> np.ndarray:
    best = modes.pose[choice.best]
    return best.distance(truth)[0] < 1e-6


def test_filters_leave_the_truth(case):
    truth, modes = case
    choice = gough.choose_mode(modes)
    assert np.all(choice.count == 1)
    assert not choice.ambiguous.any()
    assert right(modes, choice, truth).all()


def test_half_of_a_planar_machines_poses_are_below_its_base(case):
    _, modes = case
    choice = gough.choose_mode(modes)
    assert choice.passes["side"].mean() == 0.5


def test_previous_pose(case):
    truth, modes = case
    near = gough.Pose(truth.position + 3.0, truth.wxyz)
    choice = gough.choose_mode(modes, near=near, max_shift=6.0, max_turn=0.01)
    assert right(modes, choice, truth).all()
    assert np.all(choice.count == 1)


def test_inclinometer_and_imu(case):
    truth, modes = case
    up = truth.rotation[:, 2, :]  # R^T z: the base's vertical in platform axes
    choice = gough.choose_mode(modes, up=up, hint_error=0.02)
    assert right(modes, choice, truth).all()
    choice = gough.choose_mode(modes, orientation=truth.wxyz, hint_error=0.02)
    assert right(modes, choice, truth).all()
    assert choice.passes["orientation"].sum() < len(modes.row) / 4


def test_a_hint_without_its_error_is_refused(case):
    with pytest.raises(gough.GoughError, match="hint_error"):
        gough.choose_mode(case[1], up=[0, 0, 1])


def test_ambiguity_is_reported():
    """Without a workspace, the reference machine's home legs fit several poses above its base."""
    known = gough.Platform.load("reference")
    platform = gough.Platform(known.base, known.moving, home=known.home)
    modes = gough.assembly_modes(platform, platform.home_legs)
    choice = gough.choose_mode(modes)
    assert choice.ambiguous
    assert ambiguous(gough.assembly_modes(platform, platform.home_legs))
    modes = gough.assembly_modes(known, known.home_legs)
    assert not ambiguous(modes)
    assert ambiguous(modes, outside=True)
    assert choice.count == np.sum(choice.passed)
    limited = gough.choose_mode(modes, max_swing=np.radians(20))
    assert not limited.ambiguous


def test_stroke():
    known = gough.Platform.load("reference")
    platform = gough.Platform(known.base, known.moving, home=known.home, stroke=[600, 700])
    legs = np.array([known.home_legs, known.home_legs])
    legs[1, 3] = 710.0
    modes = gough.assembly_modes(platform, legs)
    choice = gough.choose_mode(modes)
    assert choice.passes["stroke"][modes.row == 0].all()
    assert not choice.passes["stroke"][modes.row == 1].any()


def test_motor_branch():
    platform = gough.Platform.load("reachy_mini")
    truth = poses_of(platform, 50)
    modes = gough.assembly_modes(platform, gough.leg_lengths(platform, truth))
    choice = gough.choose_mode(modes)
    assert 0.2 < choice.passes["branch"].mean() < 0.8
    assert right(modes, choice, truth).all()


def test_ranks_count_from_zero_in_each_set(case):
    _, modes = case
    choice = gough.choose_mode(modes)
    for k in range(len(modes)):
        mine = choice.rank[modes.row == k]
        assert sorted(mine) == list(range(len(mine)))

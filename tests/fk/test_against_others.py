"""Poses against solvers that nobody here wrote."""

import numpy as np
import pytest
from scipy.optimize import root

import gough
from gough import Status
from gough.kinematics import equivalent_struts


@pytest.mark.parametrize("name", gough.Platform.catalog())
def test_scipy_root_finds_the_same_poses(name):
    platform = gough.Platform.load(name)
    legs = gough.leg_lengths(platform, platform.sample_poses(10, seed=13))
    solution = gough.solve(platform, legs)
    size = np.r_[np.full(3, platform.size), np.ones(3)]
    base, lengths = equivalent_struts(platform, legs)

    def errors(x, i):
        turn = gough.Pose.from_rotation_vector(np.zeros(3), x[3:])
        wxyz = (turn @ gough.Pose(np.zeros(3), platform.home.wxyz)).wxyz
        pose = gough.Pose(platform.home.position + platform.size * x[:3], wxyz)
        found = np.linalg.norm(gough.joint_positions(platform, pose) - base[i], axis=-1)
        return (found - lengths[i]) / platform.size

    for i in range(10):
        result = root(errors, np.zeros(6), args=(i,), tol=1e-13)
        turn = gough.Pose.from_rotation_vector(np.zeros(3), result.x[3:])
        wxyz = (turn @ gough.Pose(np.zeros(3), platform.home.wxyz)).wxyz
        theirs = gough.Pose(platform.home.position + (size * result.x)[:3], wxyz)
        shift, angle = solution.pose[i].distance(theirs)
        assert shift < 1e-8 * platform.size
        assert angle < 1e-7


def test_dietmaiers_forty_poses_are_all_poses():
    """Newton from many starts finds many of the forty real poses; each is one, and distinct."""
    platform = gough.Platform.load("dietmaier")
    legs = np.array([1, 0.645275, 1.086284, 1.503439, 1.281933, 0.771071])
    rng = np.random.default_rng(3)
    start = gough.Pose(rng.uniform(-1.5, 1.5, size=(3_000, 3)), rng.normal(size=(3_000, 4)))
    solution = gough.solve(platform, np.tile(legs, (3_000, 1)), seed=start, restarts=0)
    solved = np.isin(solution.status, [0, 1, 2, 3, Status.OTHER_MODE])
    assert np.mean(solved) > 0.5
    pose = solution.pose[solved]
    found = np.linalg.norm(gough.joint_positions(platform, pose) - platform.base, axis=-1)
    assert np.abs(found - legs).max() < 1e-11
    modes: list[gough.Pose] = []
    while len(pose):
        modes.append(pose[0])
        pose = pose[np.add(*pose.distance(modes[-1])) > 1e-3]
    assert 30 <= len(modes) <= 40
    # Dietmaier's platform: the closest two of the forty are 0.3375 apart in (R, t)
    at_home = [m for m in modes if sum(m.distance(platform.home)) < 1e-6]
    assert len(at_home) == 1
    assert gough.solve(platform, legs).status == Status.CONVERGED

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from learn.networks import reference

from gough import GoughError, Pose, leg_lengths, quaternion
from gough.learn.metrics import count_newton_ends, measure, plain_newton


def off_by(pose: Pose, shift: float, degrees: float) -> Pose:
    turn = Pose.from_rotation_vector(np.zeros(3), [0, np.radians(degrees), 0])
    return Pose(pose.position + np.array([shift, 0, 0]), quaternion.product(pose.wxyz, turn.wxyz))


@settings(max_examples=30)
@given(st.floats(0, 100), st.floats(0, 170))
def test_a_known_error_is_measured(shift, degrees):
    truth = reference().sample_poses(20, seed=2)
    m = measure(reference(), off_by(truth, shift, degrees), truth)
    for value in (m.trans_mean, m.trans_median, m.trans_worst):
        assert value == pytest.approx(shift, abs=1e-9)
    for value in (m.rot_mean, m.rot_median, m.rot_worst):
        assert value == pytest.approx(degrees, abs=1e-6)
    assert m.trans_within == tuple(float(shift < t) for t in (0.5, 1, 1.5, 2, 3))


def test_the_papers_rotation_error_is_the_norm_of_the_logarithm():
    truth = reference().sample_poses(10, seed=2)
    guess = off_by(truth, 0, 7)
    by_hand = []
    for R, S in zip(guess.rotation, truth.rotation, strict=True):
        angle = np.arccos((np.trace(R @ S.T) - 1) / 2)
        log = angle / (2 * np.sin(angle)) * (R @ S.T - S @ R.T)
        by_hand.append(np.degrees(np.linalg.norm(log, "fro")))
    m = measure(reference(), guess, truth)
    assert m.rot_frobenius == pytest.approx(np.mean(by_hand))


def test_the_inverse_kinematics_error():
    truth = reference().sample_poses(10, seed=2)
    guess = off_by(truth, 3, 2)
    legs = leg_lengths(reference(), truth)
    by_hand = np.linalg.norm(leg_lengths(reference(), guess) - legs, axis=1)
    m = measure(reference(), guess, truth, legs)
    assert m.ik_mean == pytest.approx(by_hand.mean())
    assert m.ik_median == pytest.approx(np.median(by_hand))
    assert measure(reference(), guess, truth) == m


def test_different_numbers_of_poses_are_refused():
    truth = reference().sample_poses(3, seed=2)
    with pytest.raises(GoughError, match="as many poses"):
        measure(reference(), truth[:2], truth)
    with pytest.raises(GoughError, match="as many poses"):
        measure(reference(), truth[0], truth[0])


@pytest.mark.parametrize("name", ["reference", "reachy_mini", "rubin_camera", "linuxcnc_genhex"])
def test_newton_ends_at_the_true_pose_from_nearby(name):
    from machines import with_some_workspace

    from gough import Platform

    platform = with_some_workspace(Platform.load(name))
    truth = platform.sample_poses(200, seed=1)
    legs = leg_lengths(platform, truth)
    good = np.isfinite(legs).all(-1)
    truth, legs = truth[good], legs[good]
    guess = off_by(truth, 1e-3 * platform.size, 0.2)
    assert count_newton_ends(platform, guess, truth, legs).share == 1
    pose, converged = plain_newton(platform, guess, legs)
    assert converged.all()
    np.testing.assert_allclose(leg_lengths(platform, pose), legs, atol=1e-8 * platform.size)


def test_newton_counts_other_modes_and_rows_without_an_end():
    platform = reference()
    truth = platform.sample_poses(50, seed=1)
    legs = leg_lengths(platform, truth)
    mirrored = Pose(platform.home.position * [1, 1, -1])  # below the base
    below = count_newton_ends(platform, Pose(np.tile(mirrored.position, (50, 1))), truth, legs)
    assert below.true == 0
    assert below.other + below.unconverged == 50
    assert below.other > 0
    assert below.twins == 0  # none of them is in the workspace
    impossible = count_newton_ends(platform, truth, truth, legs * [1, 1, 1, 1, 1, 9])
    assert impossible.unconverged == 50

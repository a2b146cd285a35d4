"""The paper's second stage: where rows end, and that each ends by itself."""

from __future__ import annotations

from typing import Any

import inverse_study
import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from learn.networks import reference
from machines import with_some_workspace
from support import angles, random_platforms, random_twists, seeds

import gough
from gough import GoughError, Platform, Pose
from gough.kinematics import equivalent_struts
from gough.learn.kinematics import TorchPlatform, se3_exp, se3_exp_jacobian
from gough.learn.newton import BatchedSolution, batched_newton, refine
from gough.status import NewtonStatus
from gough.units import scaled


def problem(platform: Platform, count: int = 50, seed: int = 1, off: float = 1e-3):
    """True poses, their readings, and guesses that are off by that share of the size, and rad."""
    truth = with_some_workspace(platform).sample_poses(count, seed=seed)
    rng = np.random.default_rng(seed)
    turn = Pose.from_rotation_vector(np.zeros(3), off * rng.standard_normal((count, 3)))
    shift = off * platform.size * rng.standard_normal((count, 3))
    guess = Pose(truth.position + shift, (truth @ turn).wxyz)
    return truth, gough.leg_lengths(platform, truth), guess


def assert_at(platform: Platform, end: BatchedSolution, truth: Pose, tolerance: float) -> None:
    away, angle = end.pose.distance(truth)
    assert away.max(initial=0) <= tolerance * platform.size
    assert angle.max(initial=0) <= tolerance


# ---- the derivative -------------------------------------------------------------------


@given(random_platforms, seeds, angles)
def test_the_jacobian_is_that_of_the_strut_lengths(
    platform: Platform, seed: int, angle: float
) -> None:
    """dF/dxi against autograd, for every kind of leg, at no turn and at half a turn."""
    facts = TorchPlatform(platform)
    xi = torch.tensor(random_twists(np.random.default_rng(seed), (), angle))
    xi[:3] *= platform.size
    legs = torch.tensor(platform.home_legs)
    struts = facts.equivalent_struts(legs)

    def lengths(x: torch.Tensor) -> torch.Tensor:
        return facts.strut_errors(*se3_exp(x), *struts)[0]

    J = facts.strut_errors(*se3_exp(xi), *struts)[1] @ se3_exp_jacobian(xi)
    expected = torch.autograd.functional.jacobian(lengths, xi)
    torch.testing.assert_close(J, expected, rtol=0, atol=1e-12 * float(expected.abs().max()))


@given(random_platforms)
def test_equivalent_struts_are_those_of_the_core(platform: Platform) -> None:
    pose = platform.sample_poses(5)
    legs = gough.leg_lengths(platform, pose)
    starts, lengths = TorchPlatform(platform).equivalent_struts(torch.tensor(legs))
    want_starts, want_lengths = equivalent_struts(platform, legs)
    np.testing.assert_allclose(starts, want_starts, rtol=1e-14, atol=1e-14 * platform.size)
    np.testing.assert_allclose(lengths, want_lengths, rtol=1e-14)


# ---- where rows end -------------------------------------------------------------------


@pytest.mark.parametrize("name", Platform.catalog())
@pytest.mark.parametrize("scale", [False, True])
def test_poses_are_those_of_the_fast_solver(name: str, scale: bool) -> None:
    platform = Platform.load(name)
    _, legs, guess = problem(platform)
    end = batched_newton(platform, guess, legs, gamma=1e-9 * platform.size, scaled=scale)
    assert end.converged.all()
    assert_at(platform, end, gough.solve(platform, legs, seed=guess).pose, 1e-10)
    assert end.residual.max() <= 1e-12 * platform.size
    assert end.sweeps == end.iterations.max() <= 5
    assert end.step.max() < 1e-9 * platform.size


@given(seeds)
def test_the_way_to_a_pose_at_half_a_turn(seed: int) -> None:
    """The logarithm jumps there: guess and pose on its two sides, at the base and far from it."""
    rng = np.random.default_rng(seed)
    platform = reference()
    axis = rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    turn = Pose.from_rotation_vector(np.zeros(3), np.pi * axis)
    moving = turn.inverse().apply(platform.moving)  # home is upright after half a turn
    upside = Platform(platform.base, moving, Pose(platform.home.position, turn.wxyz))
    upside = upside.with_workspace(20, 5)
    truth, legs, guess = problem(upside, count=30, seed=seed)
    end = batched_newton(upside, guess, legs, gamma=1e-8)
    assert end.converged.all()
    assert_at(upside, end, truth, 1e-9)
    assert end.iterations.max() <= 6


def test_rotation_vectors_are_kept_short() -> None:
    """At a whole turn V is singular; rows that come near it are lost."""
    kept, long = inverse_study.wild_guesses(1000)
    assert kept > 0.85
    assert long < 0.6


def planted() -> tuple[Platform, Pose, np.ndarray, dict[int, NewtonStatus]]:
    """Good rows with one of every bad kind between them."""
    platform = reference()
    _, legs, guess = problem(platform, count=12)
    t, q, legs = guess.position.copy(), guess.wxyz.copy(), legs.copy()
    legs[1, 3] = np.nan
    t[3] = np.nan
    legs[5, 0] = -20.0
    # turned by 90 deg about z above a like-minded hexagon: Fichter's singularity
    t[7], q[7] = platform.home.position, Pose.from_euler(np.zeros(3), [0, 0, np.pi / 2]).wxyz
    legs[9] = np.inf
    legs[10] = 3000.0, 200, 3000, 200, 3000, 200  # no pose has these
    ends = {
        1: NewtonStatus.INVALID_INPUT, 3: NewtonStatus.INVALID_INPUT, 5: NewtonStatus.INVALID_INPUT,
        7: NewtonStatus.SINGULAR, 9: NewtonStatus.INVALID_INPUT,
    }  # fmt: skip
    return platform, Pose.trusted(t, q), legs, ends


def test_bad_rows_are_told_one_by_one_and_spoil_no_other() -> None:
    platform, guess, legs, ends = planted()
    end = batched_newton(platform, guess, legs)
    for k in range(len(legs)):
        if k == 10:
            assert end.status[k] != NewtonStatus.CONVERGED
        else:
            assert end.status[k] == ends.get(k, NewtonStatus.CONVERGED), k
    assert np.array_equal(end.singular, [k == 7 or end.status[k] == 2 for k in range(12)])
    assert sum(end.counts().values()) == 12
    good = np.flatnonzero(end.converged)
    assert list(good) == [0, 2, 4, 6, 8, 11]
    alone = batched_newton(platform, guess[good], legs[good])
    assert np.array_equal(alone.pose.position, end.pose.position[good])
    assert np.array_equal(alone.pose.wxyz, end.pose.wxyz[good])
    assert np.array_equal(alone.iterations, end.iterations[good])
    assert np.isnan(end.residual[[1, 3, 9]]).tolist() == [True, True, True]
    invalid = end.status == NewtonStatus.INVALID_INPUT
    assert np.array_equal(np.isnan(end.pose.position).all(axis=-1), invalid)
    assert np.array_equal(np.isnan(end.pose.wxyz).all(axis=-1), invalid)


def test_a_row_that_runs_away_is_stopped() -> None:
    """From very far all struts look parallel: the next step leads still farther away."""
    platform = reference()
    _, legs, guess = problem(platform, count=2)
    far = guess.position + np.array([[0, 0, 1e5 * platform.size], [0, 0, 0]])
    end = batched_newton(platform, Pose(far, guess.wxyz), legs, f_max=200, scaled=True)
    assert list(end.status) == [NewtonStatus.DIVERGED, NewtonStatus.CONVERGED]
    assert end.iterations[0] == 0
    np.testing.assert_allclose(end.pose.position[0], far[0], rtol=0, atol=1e-8)


def test_rows_stop_when_they_have_converged() -> None:
    platform = reference()
    truth, legs, guess = problem(platform, count=20)
    close = Pose(np.where(np.arange(20)[:, None] < 10, truth.position, guess.position + 5),
                 np.where(np.arange(20)[:, None] < 10, truth.wxyz, guess.wxyz))  # fmt: skip
    end = batched_newton(platform, close, legs)
    assert (end.iterations[:10] == 1).all()
    assert (end.iterations[10:] >= 3).all()
    assert end.sweeps == end.iterations.max()


def test_limits_are_kept() -> None:
    platform = reference()
    _, legs, guess = problem(platform, off=1e-2)
    short = batched_newton(platform, guess, legs, z_max=1)
    assert (short.status == NewtonStatus.NOT_CONVERGED).all()
    assert (short.iterations == 1).all()
    assert short.sweeps == 1
    none = batched_newton(platform, guess, legs, z_max=0)
    assert_at(platform, none, guess, 1e-13)
    assert none.sweeps == 0
    few = batched_newton(platform, guess, legs, f_max=5)
    assert (few.status == NewtonStatus.SINGULAR).all()
    assert_at(platform, few, guess, 1e-13)
    assert batched_newton(platform, guess, legs, f_max=5, scaled=True).sweeps <= few.sweeps


def test_f_max_of_20_is_too_few_in_a_wide_workspace_unless_lengths_are_scaled() -> None:
    platform = reference().with_workspace(100, 60)
    truth = platform.sample_poses(2000, seed=1)
    legs = gough.leg_lengths(platform, truth)
    lost = [batched_newton(platform, truth, legs, f_max=f, scaled=s).singular.sum()
            for f, s in ((20, False), (40, False), (20, True))]  # fmt: skip
    assert lost[0] > 40
    assert lost[1] == 0
    assert lost[2] <= 2


@given(st.sampled_from([1e-3, 1e3, 25.4]), st.sampled_from(["reference", "reachy_mini"]))
def test_scaled_steps_do_not_know_the_unit_and_gamma_scales_with_it(
    factor: float, name: str
) -> None:
    """In other units gamma times the factor is about the same in length, not in angle."""
    platform = with_some_workspace(Platform.load(name))
    other = scaled(platform, factor)
    truth, legs, guess = problem(platform)
    told = legs if platform.rotary else factor * legs
    elsewhere = Pose(factor * guess.position, guess.wxyz)
    one = batched_newton(platform, guess, legs, gamma=1e-9 * platform.size, scaled=True)
    two = batched_newton(other, elsewhere, told, gamma=1e-9 * other.size, scaled=True)
    assert one.converged.all()
    assert two.converged.all()
    assert np.array_equal(one.inverse_iterations, two.inverse_iterations)
    np.testing.assert_allclose(
        two.pose.position / factor, one.pose.position, rtol=0, atol=1e-11 * platform.size
    )
    truth_angle = two.pose.distance(Pose(factor * truth.position, truth.wxyz))[1]
    assert truth_angle.max() < 1e-10


def test_the_papers_units_make_the_inverse_dear_for_a_machine_in_mm() -> None:
    platform = reference()
    metres = scaled(platform, 1e-3)
    most = []
    for machine in (platform, metres):
        _, legs, guess = problem(machine)
        most.append(batched_newton(machine, guess, legs, gamma=1e-7).inverse_iterations.min())
    assert most[0] >= most[1] + 4


# ---- kinds of input -------------------------------------------------------------------


@pytest.mark.parametrize("count", [0, 1, 7])
def test_any_number_of_rows(count: int) -> None:
    platform = reference()
    truth, legs, guess = problem(platform, count=7)
    end = batched_newton(platform, guess[:count], legs[:count], device=torch.device("cpu"))
    assert len(end.pose) == len(end.status) == len(end.iterations) == count
    assert end.converged.all()
    assert_at(platform, end, truth[:count], 1e-10)
    assert end.sweeps == (0 if count == 0 else end.iterations.max())


def test_one_guess_serves_all_rows() -> None:
    platform = reference()
    truth, legs, _ = problem(platform)
    end = batched_newton(platform, platform.home, legs)
    assert end.converged.all()
    assert_at(platform, end, truth, 1e-10)


def test_single_precision() -> None:
    platform = reference()
    truth, legs, guess = problem(platform)
    end = batched_newton(platform, guess, legs, gamma=1e-2, dtype=torch.float32)
    assert end.converged.all()
    assert_at(platform, end, truth, 1e-5)
    assert end.pose.position.dtype == np.float64


def test_tensors_in_and_out() -> None:
    platform = reference()
    _, legs, guess = problem(platform)
    end = refine(
        TorchPlatform(platform), torch.tensor(guess.position), torch.tensor(guess.rotation),
        torch.tensor(legs),
    )  # fmt: skip
    same = batched_newton(platform, guess, legs)
    np.testing.assert_allclose(end.position, same.pose.position, rtol=0, atol=1e-10)
    assert not end.position.requires_grad


def test_what_is_wrong_with_the_arguments_is_said() -> None:
    platform = reference()
    _, legs, guess = problem(platform)
    with pytest.raises(GoughError, match=r"legs, guess: expected \(N, 6\) and N poses or one"):
        batched_newton(platform, guess[:3], legs)
    with pytest.raises(GoughError, match=r"legs, guess: expected \(N, 6\)"):
        batched_newton(platform, platform.home, legs[0])
    bad: dict[str, Any]
    for bad in ({"gamma": 0.0}, {"gamma": np.nan}, {"f_max": -1}, {"z_max": -1}):
        with pytest.raises(GoughError, match="gamma, f_max, z_max: expected"):
            batched_newton(platform, guess, legs, **bad)


def test_every_status_has_its_sentence() -> None:
    texts = [o.text for o in NewtonStatus]
    assert len(set(texts)) == len(NewtonStatus)
    assert all(t.endswith(".") for t in texts)


def test_the_study_of_the_papers_rule_prints_its_tables(
    capsys: pytest.CaptureFixture[str],
) -> None:
    inverse_study.sweeps("fully", inverse_study.fully, count=20)
    inverse_study.sweeps("last", inverse_study.last_allowed, count=20)
    full, last = (line.split() for line in capsys.readouterr().out.splitlines())
    assert int(full[1]) <= 4
    assert float(full[2]) < 1e-10
    assert float(last[2]) > 0.1  # the steps are small, and the poses are wrong

"""Gradients of solved poses, and forward and inverse kinematics as torch functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given
from learn.networks import reference
from learn.test_batched_newton import planted, problem
from machines import with_some_workspace
from support import random_platforms
from torch import Tensor
from torch.autograd import gradcheck, gradgradcheck

import gough
import gough.learn
from gough import GoughError, Platform, PlatformError, Pose, Status
from gough.learn.gradients import implicit_pose
from gough.learn.kinematics import TorchPlatform
from gough.learn.newton import refine
from gough.status import NewtonStatus

TOLERANCE: dict[str, Any] = {"eps": 1e-6, "atol": 1e-4, "rtol": 1e-4}


def of_one_size(platform: Platform) -> Platform:
    """In a unit that is the machine's size, so that one finite difference suits all arguments."""
    from gough.units import scaled

    return scaled(with_some_workspace(platform), 1 / platform.size)


def arguments(platform: Platform, count: int = 2) -> tuple[Pose, list[Tensor]]:
    """Poses, and their readings and the platform's joints as tensors that want gradients."""
    pose = platform.sample_poses(count, seed=1)
    values = (gough.leg_lengths(platform, pose), platform.base, platform.moving)
    return pose, [torch.tensor(v, requires_grad=True) for v in values]


# ---- gradients ------------------------------------------------------------------------


@pytest.mark.parametrize("name", Platform.catalog())
def test_gradients_of_the_solver(name: str) -> None:
    """By finite differences through gough.solve itself, for every kind of leg."""
    platform = of_one_size(Platform.load(name))
    _, inputs = arguments(platform)

    def pose(legs: Tensor, base: Tensor, moving: Tensor) -> tuple[Tensor, Tensor]:
        end = gough.learn.solve(platform, legs, base=base, moving=moving)
        return end.position, end.rotation

    assert gradcheck(pose, inputs, **TOLERANCE)


@pytest.mark.parametrize("name", ["reference", "reachy_mini", "rubin_camera"])
def test_gradients_of_the_batched_newton(name: str) -> None:
    platform = of_one_size(Platform.load(name))
    facts = TorchPlatform(platform)
    guess, inputs = arguments(platform)
    start = torch.tensor(guess.position), torch.tensor(guess.rotation)

    def pose(legs: Tensor, base: Tensor, moving: Tensor) -> tuple[Tensor, Tensor]:
        end = refine(facts.with_joints(base, moving), *start, legs, gamma=1e-10)
        return end.position, end.rotation

    assert gradcheck(pose, inputs, **TOLERANCE)


@pytest.mark.parametrize("name", ["reference", "reachy_mini", "rubin_camera"])
def test_second_derivatives(name: str) -> None:
    platform = of_one_size(Platform.load(name))
    _, inputs = arguments(platform, count=1)

    def pose(legs: Tensor, base: Tensor, moving: Tensor) -> tuple[Tensor, Tensor]:
        end = gough.learn.solve(platform, legs, base=base, moving=moving)
        return end.position, end.rotation

    assert gradgradcheck(pose, inputs, **TOLERANCE)


def test_every_number_of_a_rotary_machine_has_a_gradient() -> None:
    """Arm and rod lengths too: any tensor of a TorchPlatform."""
    platform = of_one_size(Platform.load("reachy_mini"))
    facts, (guess, (legs, _, _)) = TorchPlatform(platform), arguments(platform)
    start = torch.tensor(guess.position), torch.tensor(guess.rotation)

    def pose(arm: Tensor, rod: Tensor) -> tuple[Tensor, Tensor]:
        changed = facts.with_tensors(dict(facts.named_buffers()) | {"arm": arm, "rod": rod})
        end = refine(changed, *start, legs.detach(), gamma=1e-10)
        return end.position, end.rotation

    lengths = [facts.arm.clone().requires_grad_(), facts.rod.clone().requires_grad_()]
    assert gradcheck(pose, lengths, **TOLERANCE)


def test_gradients_with_respect_to_readings_are_the_inverse_jacobian() -> None:
    platform = reference()
    pose, (legs, _, _) = arguments(platform)
    end = gough.learn.solve(platform, legs)
    J = np.linalg.inv(gough.jacobian(platform, pose))
    for k in range(3):
        (found,) = torch.autograd.grad(end.position[:, k].sum(), legs, retain_graph=True)
        np.testing.assert_allclose(found, J[:, k], rtol=1e-8, atol=1e-10)


def test_one_machine_a_row() -> None:
    """Joints (N, 6, 3) give each row the gradients of its own machine."""
    platform = of_one_size(reference())
    facts, (truth, (legs, base, _)) = TorchPlatform(platform), arguments(platform)
    start = torch.tensor(truth.position), torch.tensor(truth.rotation)

    def gradient(base: Tensor) -> Tensor:
        end = refine(facts.with_joints(base), *start, legs.detach())
        return torch.autograd.grad(end.position.sum(), base)[0]

    many = torch.stack([base.detach()] * 2).requires_grad_()
    torch.testing.assert_close(gradient(many).sum(0), gradient(base), rtol=1e-10, atol=1e-10)


# ---- rows that fail -------------------------------------------------------------------


def solve_planted(legs: Tensor, base: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    platform, _, _, _ = planted()
    end = gough.learn.solve(platform, legs, base=base)
    return end.position, end.rotation, end.usable


def refine_planted(legs: Tensor, base: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    platform, guess, _, _ = planted()
    start = torch.tensor(guess.position), torch.tensor(guess.rotation)
    end = refine(TorchPlatform(platform).with_joints(base), *start, legs)
    return end.position, end.rotation, end.status == NewtonStatus.CONVERGED


@pytest.mark.parametrize("method", [solve_planted, refine_planted])
def test_failed_rows_have_no_gradient_and_spoil_no_other(
    method: Callable[[Tensor, Tensor], tuple[Tensor, Tensor, Tensor]],
) -> None:
    platform, _, values, _ = planted()
    legs = torch.tensor(values, requires_grad=True)
    base = torch.tensor(platform.base, requires_grad=True)
    position, rotation, good = method(legs, base)
    assert 0 < good.sum() < len(legs)
    # a loss that forgot to leave the failed rows out
    weights = torch.linspace(1, 2, len(legs))[:, None]
    (weights * position).nansum().add(rotation.nansum()).backward()
    assert legs.grad is not None
    assert base.grad is not None
    assert (legs.grad[~good] == 0).all()
    assert (legs.grad[good].abs().amax(-1) > 0).all()
    assert base.grad.isfinite().all()
    kept = legs.detach()[good].requires_grad_()
    other = torch.tensor(platform.base, requires_grad=True)
    if method is solve_planted:
        end = gough.learn.solve(platform, kept, base=other)
        ((weights[good] * end.position).sum() + end.rotation.sum()).backward()
        assert kept.grad is not None
        assert other.grad is not None
        torch.testing.assert_close(legs.grad[good], kept.grad, rtol=1e-9, atol=1e-9)
        torch.testing.assert_close(base.grad, other.grad, rtol=1e-9, atol=1e-9)


def test_a_pose_that_is_singular_to_the_last_digit_has_no_gradient() -> None:
    """Flat: all struts in one plane. Said to be solved, it still gives zeros, not infinities."""
    turn = np.radians(np.arange(6) * 60.0)
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
    platform = Platform(2 * ring, np.roll(ring, 1, axis=0), (0, 0, 1))
    flat = torch.zeros(2, 3, dtype=torch.float64)
    flat[1] = torch.tensor([0.1, 0.05, 1.1])
    rotation = torch.eye(3, dtype=torch.float64).expand(2, 3, 3)
    facts = TorchPlatform(platform)
    legs = facts.leg_lengths(flat, rotation).requires_grad_()
    solved = torch.ones(2, dtype=torch.bool)
    position, _ = implicit_pose(facts, flat, rotation, legs, solved)
    (found,) = torch.autograd.grad(position.sum(), legs)
    assert (found[0] == 0).all()
    assert found[1].isfinite().all()
    assert (found[1] != 0).any()


# ---- the public functions -------------------------------------------------------------


@given(random_platforms)
def test_leg_lengths_are_those_of_the_core(platform: Platform) -> None:
    pose = platform.sample_poses(6)
    found = gough.learn.leg_lengths(
        platform, torch.tensor(pose.position), torch.tensor(pose.rotation)
    )
    expected = gough.leg_lengths(platform, pose)
    scale = 1.0 if platform.rotary else platform.size
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * scale)


@given(random_platforms)
def test_given_joints_make_another_platform(platform: Platform) -> None:
    """Lengths at home move with the joints, for readings that count from them."""
    rng = np.random.default_rng(3)
    base, moving = (
        x + 1e-2 * platform.size * rng.standard_normal((6, 3))
        for x in (platform.base, platform.moving)
    )
    other = replace(platform, base=base, moving=moving, stroke=None)
    pose = platform.sample_poses(3)
    legs = gough.learn.leg_lengths(
        platform, torch.tensor(pose.position), torch.tensor(pose.rotation),
        base=torch.tensor(base), moving=torch.tensor(moving),
    )  # fmt: skip
    scale = 1.0 if platform.rotary else platform.size
    np.testing.assert_allclose(legs, gough.leg_lengths(other, pose), rtol=0, atol=1e-12 * scale)
    end = gough.learn.solve(
        platform, legs, base=torch.tensor(base), moving=torch.tensor(moving), seed="home"
    )
    assert end.usable.all()
    np.testing.assert_allclose(end.position, pose.position, rtol=0, atol=1e-9 * platform.size)
    np.testing.assert_allclose(end.rotation, pose.rotation, rtol=0, atol=1e-9)


def test_solve_answers_as_the_core_does_with_any_leading_axes() -> None:
    platform = reference()
    pose, (legs, _, _) = arguments(platform, count=6)
    for shape in ((), (6,), (3, 1, 2), (0,)):
        count = int(np.prod(shape))
        end = gough.learn.solve(platform, legs[:count].reshape(*shape, 6))
        assert end.position.shape == (*shape, 3)
        assert end.rotation.shape == (*shape, 3, 3)
        assert end.usable.shape == shape
        assert end.usable.all()
        flat = end.position.detach().reshape(-1, 3)
        np.testing.assert_allclose(flat, pose.position[:count], rtol=0, atol=1e-9)
    assert end.solution.counts() == {}


def test_readings_that_nothing_has_are_told() -> None:
    platform = reference()
    legs = torch.tensor(platform.home_legs).repeat(3, 1)
    legs[1], legs[2] = torch.nan, torch.tensor([9000.0, 1, 9000, 1, 9000, 1])
    end = gough.learn.solve(platform, legs)
    assert end.usable.tolist() == [True, False, False]
    assert list(end.solution.status)[:2] == [Status.CONVERGED, Status.INVALID_INPUT]


def test_single_precision_stays_single() -> None:
    platform = reference()
    _, (legs, _, _) = arguments(platform)
    single = legs.detach().float().requires_grad_()
    end = gough.learn.solve(platform, single)
    assert end.position.dtype == end.rotation.dtype == torch.float32
    end.position.sum().backward()
    (expected,) = torch.autograd.grad(gough.learn.solve(platform, legs).position.sum(), legs)
    assert single.grad is not None
    torch.testing.assert_close(single.grad.double(), expected, rtol=1e-3, atol=1e-3)


def test_a_given_pose_can_be_the_seed() -> None:
    platform = reference()
    pose, (legs, base, _) = arguments(platform)
    for changed in (None, base):
        end = gough.learn.solve(platform, legs, base=changed, seed=pose)
        np.testing.assert_allclose(end.position.detach(), pose.position, rtol=0, atol=1e-9)


def test_joints_given_leave_the_stroke_out() -> None:
    platform = reference()
    platform = replace(platform, stroke=platform.home_legs[:, None] + [0, 1e-3])
    legs = torch.tensor(platform.home_legs - 1.0)[None]
    assert gough.learn.solve(platform, legs).solution.status[0] == Status.OUTSIDE_STROKE
    end = gough.learn.solve(platform, legs, base=torch.tensor(platform.base) + 1e-6)
    assert end.solution.status[0] == Status.CONVERGED


def test_what_is_wrong_with_the_arguments_is_said() -> None:
    platform = reference()
    _, (legs, base, _) = arguments(platform)
    with pytest.raises(GoughError, match=r"legs: expected \(\.\.\., 6\), got \(2, 5\)"):
        gough.learn.solve(platform, legs[:, :5])
    with pytest.raises(GoughError, match=r"base: expected \(6, 3\), got \(5, 3\)"):
        gough.learn.solve(platform, legs, base=base[:5])
    with pytest.raises(GoughError, match="legs: expected a tensor of floating point, found int64"):
        gough.learn.solve(platform, torch.ones(2, 6, dtype=torch.int64))
    with pytest.raises(GoughError, match="legs: expected a tensor of floating point, found list"):
        gough.learn.solve(platform, [1.0] * 6)  # pyright: ignore[reportArgumentType]
    with pytest.raises(PlatformError, match="base: all six joints lie on one line"):
        gough.learn.solve(platform, legs, base=torch.ones(6, 3, dtype=torch.float64))


# ---- what it is for -------------------------------------------------------------------


def test_joints_are_found_from_positions_and_readings() -> None:
    """Calibration of a base whose joints are off by up to 1 mm, by Gauss and Newton's method."""
    platform = reference()
    true = platform.base + np.random.default_rng(0).uniform(-1, 1, (6, 3))
    pose, readings, _ = problem(replace(platform, base=true, stroke=None), count=15)
    legs, measured = torch.tensor(readings), torch.tensor(pose.position)

    def positions(base: Tensor) -> Tensor:
        return gough.learn.solve(platform, legs, base=base).position

    base = torch.tensor(platform.base)
    for _ in range(4):
        J = torch.autograd.functional.jacobian(positions, base)
        J, miss = torch.as_tensor(J).reshape(-1, 18), (measured - positions(base)).reshape(-1)
        base = base + torch.linalg.lstsq(J, miss).solution.reshape(6, 3)
    assert np.abs(base.numpy() - true).max() < 1e-8

"""SE(3) in torch against NumPy's, which has tests of its own, and against autograd."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from support import ANGLES, angles, batches, random_poses, random_twists, seeds

from gough import Pose
from gough.learn.kinematics import se3_exp, se3_exp_jacobian, se3_log, se3_shortest


@given(seeds, batches, angles)
def test_exp_and_log_are_those_of_pose(seed: int, batch: tuple[int, ...], angle: float) -> None:
    xi = random_twists(np.random.default_rng(seed), batch, angle)
    pose = Pose.exp(xi)
    position, rotation = se3_exp(torch.tensor(xi))
    np.testing.assert_allclose(position, pose.position, rtol=0, atol=1e-14)
    np.testing.assert_allclose(rotation, pose.rotation, rtol=0, atol=1e-14)
    back = se3_exp(se3_log(torch.tensor(pose.position), torch.tensor(pose.rotation)))
    np.testing.assert_allclose(back[0], pose.position, rtol=0, atol=1e-13)
    np.testing.assert_allclose(back[1], pose.rotation, rtol=0, atol=1e-14)


@given(seeds, angles)
def test_log_is_that_of_pose_below_half_a_turn(seed: int, angle: float) -> None:
    pose = random_poses(np.random.default_rng(seed), (5,), min(angle, 3.1))
    xi = se3_log(torch.tensor(pose.position), torch.tensor(pose.rotation))
    np.testing.assert_allclose(xi, pose.log(), rtol=0, atol=1e-13)


@pytest.mark.parametrize("angle", [*ANGLES, 0.9999999, 1.0000001, 4.0, 6.0])
def test_the_jacobian_is_the_derivative_of_exp(angle: float) -> None:
    """Against autograd through exp: d position, and w with dR = [w] R."""
    xi = torch.tensor(random_twists(np.random.default_rng(1), (), angle), requires_grad=True)
    d_position, d_rotation = torch.autograd.functional.jacobian(se3_exp, xi)
    rotation = se3_exp(xi)[1].detach()
    spin = torch.einsum("ijk,lj->ilk", d_rotation, rotation)  # [w] for each component of xi
    w = torch.stack([spin[2, 1], spin[0, 2], spin[1, 0]])
    J = se3_exp_jacobian(xi)
    torch.testing.assert_close(J, torch.cat([d_position, w]), rtol=0, atol=2e-13)


@given(seeds, angles)
def test_the_jacobian_is_the_derivative_by_finite_differences(seed: int, angle: float) -> None:
    rng = np.random.default_rng(seed)
    xi, d = random_twists(rng, (), angle), 1e-6
    J = se3_exp_jacobian(torch.tensor(xi)).numpy()
    for k in range(6):
        ahead, behind = (Pose.exp(xi + s * d * np.eye(6)[k]) for s in (1, -1))
        v = (ahead.position - behind.position) / (2 * d)
        w = (ahead @ behind.inverse()).rotation_vector / (2 * d)
        np.testing.assert_allclose(J[:, k], np.concatenate([v, w]), rtol=0, atol=2e-9)


def test_turns_beyond_half_a_turn_have_a_shorter_name() -> None:
    xi = torch.tensor(random_twists(np.random.default_rng(3), (50,), 1.0))
    xi[:, 3:] *= torch.linspace(0, 20, 50)[:, None]
    short = se3_shortest(xi)
    assert torch.linalg.vector_norm(short[:, 3:], dim=-1).max() <= np.pi + 1e-12
    for a, b in zip(se3_exp(short), se3_exp(xi), strict=True):
        torch.testing.assert_close(a, b, rtol=0, atol=1e-12)
    below = torch.linalg.vector_norm(xi[:, 3:], dim=-1) < np.pi
    torch.testing.assert_close(short[below], xi[below], rtol=0, atol=1e-13)

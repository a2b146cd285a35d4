"""Velocities, accelerations and forces against finite differences and MuJoCo."""

from __future__ import annotations

import mujoco_model
import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import Platform, Pose

MACHINES = Platform.catalog()
functions = st.sampled_from([gough.twist, gough.leg_rates, gough.leg_forces, gough.wrench])


def in_units(platform: Platform, unitless: np.ndarray) -> np.ndarray:
    """Twists or accelerations (..., 6) of about the machine's size in a second."""
    return unitless * np.repeat([platform.size, 1.0], 3)


def moving(platform: Platform, seed: int) -> tuple[Pose, np.ndarray, np.ndarray]:
    """A pose of the workspace, a twist and its derivative."""
    rng = np.random.default_rng(seed)
    pose = support.sample(platform, (), seed)
    twist, acceleration = in_units(platform, rng.uniform(-1, 1, (2, 6)))
    return pose, twist, acceleration


@given(support.random_platforms, support.seeds)
def test_twist_undoes_leg_rates(platform: Platform, seed: int) -> None:
    pose, twist, _ = moving(platform, seed)
    found = gough.twist(platform, pose, gough.leg_rates(platform, pose, twist))
    np.testing.assert_allclose(in_units(platform, 1 / found), in_units(platform, 1 / twist), 1e-8)


@given(support.random_platforms, support.seeds)
def test_power_is_the_same_on_both_sides(platform: Platform, seed: int) -> None:
    """Forces are dual to velocities: leg forces . leg rates = wrench . twist."""
    pose, twist, _ = moving(platform, seed)
    load = np.random.default_rng(seed).uniform(-1, 1, 6) * np.repeat([1.0, platform.size], 3)
    forces = gough.leg_forces(platform, pose, load)
    np.testing.assert_allclose(
        forces @ gough.leg_rates(platform, pose, twist), load @ twist,
        rtol=1e-9, atol=1e-9 * platform.size,
    )  # fmt: skip
    back = gough.wrench(platform, pose, forces) / np.repeat([1.0, platform.size], 3)
    np.testing.assert_allclose(back, load / np.repeat([1.0, platform.size], 3), atol=1e-10)


@given(support.random_platforms, support.seeds)
def test_rates_and_accelerations_are_the_derivatives_of_readings(
    platform: Platform, seed: int
) -> None:
    """Along a path with this twist and acceleration, by central differences of fourth order."""
    pose, twist, acceleration = moving(platform, seed)
    rates = gough.leg_rates(platform, pose, twist)
    second = gough.leg_accelerations(platform, pose, twist, acceleration)
    step = 1e-3

    def at(time: float) -> np.ndarray:
        # for exp(x) R the angular velocity is x' + (x x x') / 2 + ..., whose second term vanishes
        # to second order where x = w t + w' t^2 / 2
        return gough.leg_lengths(
            platform, support.moved(pose, twist * time + acceleration * time**2 / 2)
        )

    low2, low, here, high, high2 = (at(k * step) for k in (-2, -1, 0, 1, 2))
    scale = 1.0 if platform.legs == "rotary" else platform.size
    np.testing.assert_allclose(
        rates / scale, (low2 - 8 * low + 8 * high - high2) / (12 * step) / scale, atol=1e-8
    )
    found = (-low2 + 16 * low - 30 * here + 16 * high - high2) / (12 * step**2)
    np.testing.assert_allclose(second / scale, found / scale, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("name", MACHINES)
def test_leg_forces_hold_the_platform_in_mujoco(name: str) -> None:
    """With these forces at its tendons (or motors) a heavy platform does not accelerate."""
    platform = Platform.load(name)
    poses = support.sample(platform, (5,))
    rng = np.random.default_rng(1)
    for i in range(5):
        load = rng.uniform(-1, 1, 6) * np.repeat([1.0, platform.size], 3)
        forces = gough.leg_forces(platform, poses[i], -load)
        angles = gough.leg_lengths(platform, poses[i]) if platform.rotary else None
        rest = mujoco_model.accelerations(platform, poses[i], load, forces, angles)
        moved = mujoco_model.accelerations(platform, poses[i], load, 0 * forces, angles)
        assert np.abs(rest).max() < 1e-9 * np.abs(moved).max()


@given(functions, st.sampled_from(MACHINES))
def test_batch_axes_broadcast(function, name: str) -> None:
    platform = Platform.load(name)
    poses = support.sample(platform, (3, 1))
    vectors = in_units(platform, np.random.default_rng(0).uniform(-1, 1, (4, 6)))
    found = function(platform, poses, vectors)
    assert found.shape == (3, 4, 6)
    np.testing.assert_allclose(
        found[1, 2], function(platform, poses[1, 0], vectors[2]), rtol=1e-9, atol=1e-12
    )
    second = gough.leg_accelerations(platform, poses, vectors, vectors)
    assert second.shape == (3, 4, 6)


def test_singular_and_unreachable_poses_are_nan() -> None:
    assert np.all(np.isnan(gough.twist(support.PRISM, Pose((0, 0, 250)), np.ones(6))))
    assert np.all(np.isnan(gough.leg_forces(support.PRISM, Pose((0, 0, 250)), np.ones(6))))
    reachy = Platform.load("reachy_mini")
    far = Pose((0.0, 0.0, 9.0))
    for function in (gough.twist, gough.leg_rates, gough.leg_forces, gough.wrench):
        assert np.all(np.isnan(function(reachy, far, np.ones(6))))
    assert np.all(np.isnan(gough.leg_accelerations(reachy, far, np.ones(6), np.ones(6))))


@pytest.mark.parametrize("function", [gough.twist, gough.leg_rates, gough.leg_forces, gough.wrench])
def test_another_shape_is_an_error(function) -> None:
    platform = Platform.load("reference")
    with pytest.raises(gough.GoughError, match=r"expected \(\.\.\., 6\), got \(5,\)"):
        function(platform, platform.home, np.ones(5))

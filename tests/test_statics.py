"""Stiffness, speeds, dexterity and the range of forces: against MuJoCo, SciPy and sampling."""

from __future__ import annotations

from dataclasses import replace

import machines
import mujoco_model
import numpy as np
import pytest
import support
from hypothesis import given
from scipy.optimize import linprog

import gough
from gough import GoughError, MachineLimits, Payload, Platform, PlatformError, Pose
from gough.units import scaled

TELESCOPIC = [name for name in Platform.catalog() if Platform.load(name).rotary is None]
STATICS = (gough.stiffness, gough.softest_stiffness, gough.axis_speeds, gough.top_speeds)


@pytest.mark.parametrize("name", TELESCOPIC)
def test_stiffness_is_that_of_springs_in_mujoco(name: str) -> None:
    platform = Platform.load(name)
    pose = support.sample(platform, (), 3)
    springs = np.array([1.0, 2.0, 3.0, 1.5, 2.5, 0.5])
    matrix = gough.stiffness(platform, pose, springs)
    step = 1e-6 * np.repeat([platform.size, 1.0], 3)
    units = np.repeat([1.0, platform.size], 3)
    for k in range(6):
        ends = [support.moved(pose, sign * step * np.eye(6)[k]) for sign in (1, -1)]
        force = [mujoco_model.spring_forces(platform, pose, end, springs) for end in ends]
        column = -(force[0] - force[1]) / (2 * step[k])
        scale = np.abs(matrix[:, k] / units).max()
        np.testing.assert_allclose(column / units, matrix[:, k] / units, rtol=0, atol=1e-6 * scale)


@pytest.mark.parametrize("name", TELESCOPIC)
def test_axes_at_their_speed_move_one_leg_of_mujoco_at_its_own(name: str) -> None:
    platform = Platform.load(name)
    pose = support.sample(platform, (), 4)
    speeds = platform.size * np.array([1.0, 2.0, 3.0, 1.5, 2.5, 0.5])
    for k, speed in enumerate(gough.axis_speeds(platform, pose, speeds)):
        legs = mujoco_model.leg_velocities(platform, pose, speed * np.eye(6)[k])
        assert np.max(np.abs(legs) / speeds) == pytest.approx(1, rel=1e-9)


def fastest(A: np.ndarray, speeds: np.ndarray, part: slice, way: np.ndarray) -> float:
    """Greatest |v| or |w| with |A (v, w)| <= speeds that SciPy climbs to from a direction."""
    best = 0.0
    for _ in range(20):
        goal = np.zeros(6)
        goal[part] = -way
        found = linprog(goal, np.vstack([A, -A]), np.tile(speeds, 2), bounds=(None, None)).x[part]
        if np.linalg.norm(found) <= best * (1 + 1e-12):
            break
        best = float(np.linalg.norm(found))
        way = found / best
    return best


@pytest.mark.parametrize("name", ["reference", "reachy_mini", "rubin_camera"])
def test_no_motion_within_the_legs_speeds_is_faster_than_the_top_speeds(name: str) -> None:
    platform = Platform.load(name)
    pose = support.sample(platform, (), 1)
    speeds = np.array([1.0, 2.0, 3.0, 1.5, 2.5, 0.5])
    units = np.repeat([platform.size, 1.0], 3)
    A = gough.jacobian(platform, pose) * units
    rng = np.random.default_rng(0)
    for k, top in enumerate(gough.top_speeds(platform, pose, speeds)):
        part = slice(3 * k, 3 * k + 3)
        climbs = [fastest(A, speeds, part, way) for way in support.unit_vectors(rng, 15)]
        assert max(climbs) * units[3 * k] == pytest.approx(top, rel=1e-7)


@given(support.random_platforms, support.seeds)
def test_the_softest_direction_gives_way_most(platform: Platform, seed: int) -> None:
    pose = platform.sample_poses(1, seed)[0]
    rng = np.random.default_rng(seed)
    springs = rng.uniform(0.5, 2, 6)
    matrix = gough.stiffness(platform, pose, springs)
    softest = gough.softest_stiffness(platform, pose, springs)
    units = np.repeat([1.0, 1 / platform.size], 3)
    forces = np.concatenate([support.unit_vectors(rng, 50), np.zeros((50, 3))], axis=-1)
    moved = np.linalg.solve(matrix * units * units[:, None], (forces * units).T).T * units
    shift = np.linalg.norm(moved[:, :3], axis=-1)
    assert np.all(shift <= (1 + 1e-6) / softest)
    compliance = np.linalg.inv(matrix * units * units[:, None])[:3, :3]
    assert softest == pytest.approx(1 / np.linalg.eigvalsh(compliance)[-1], rel=1e-6)


@given(support.random_platforms, support.seeds)
def test_units_and_sensors_change_no_statics(platform: Platform, seed: int) -> None:
    pose = platform.sample_poses(3, seed)
    other = scaled(replace(platform, gain=1.0, offset=0.0, stroke=None), 1000.0)
    same = Pose(1000 * pose.position, pose.wxyz)
    along = 1.0 if platform.legs == "rotary" else 1000.0
    np.testing.assert_allclose(
        gough.axis_speeds(other, same, along), gough.axis_speeds(platform, pose, 1.0)
        * np.repeat([1000.0, 1.0], 3), rtol=1e-9,
    )  # fmt: skip
    for function in (gough.dexterity, gough.singularity_distance):
        np.testing.assert_allclose(function(other, same), function(platform, pose), rtol=1e-9)


@pytest.mark.parametrize("name", ["rubin_camera", "reachy_mini", "nasa_msfc"])
def test_no_pose_of_the_workspace_has_forces_beyond_the_range(name: str) -> None:
    platform = Platform.load(name)
    load = Payload(10.0, platform.size * np.array([0.1, 0.2, 0.3]))
    found = gough.force_range(platform, load)
    forces = gough.payload_forces(platform, platform.sample_poses(20_000, seed=5), load)
    slack = 1e-9 * np.abs(found.force).max()
    assert np.all(forces >= found.force[:, 0] - slack)
    assert np.all(forces <= found.force[:, 1] + slack)
    there = gough.payload_forces(platform, found.pose, load)
    for end in range(2):
        np.testing.assert_allclose(np.diagonal(there[:, end]), found.force[:, end], rtol=1e-9)
    assert platform.in_workspace(found.pose).all()


def test_singular_and_unreachable_poses_are_told_apart() -> None:
    prism, up = support.PRISM, Pose((0, 0, 250.0))
    assert gough.softest_stiffness(prism, up, 1.0) == 0
    assert np.all(np.isinf(gough.top_speeds(prism, up, 1.0)))
    assert gough.dexterity(prism, up) < 1e-15
    reachy = Platform.load("reachy_mini")
    far = Pose((0.0, 0.0, 9.0))
    for function in STATICS:
        assert np.all(np.isnan(function(reachy, far, 1.0)))
    assert np.isnan(gough.dexterity(reachy, far))


@pytest.mark.parametrize("batch", support.BATCHES)
def test_batch_axes_stay(batch: tuple[int, ...]) -> None:
    platform = Platform.load("reachy_mini")
    pose = support.sample(platform, batch)
    shapes = [np.shape(function(platform, pose, 1.0)) for function in STATICS]
    assert shapes == [(*batch, 6, 6), batch, (*batch, 6), (*batch, 2)]
    assert np.shape(gough.dexterity(platform, pose)) == batch


def test_speeds_are_those_of_the_file_unless_given() -> None:
    bare = Platform.load("reference")
    platform = replace(bare, limits=MachineLimits(leg_speed=100))
    np.testing.assert_array_equal(
        gough.axis_speeds(platform, bare.home), gough.axis_speeds(bare, bare.home, 100.0)
    )
    with pytest.raises(GoughError, match=r"leg_speed: the platform states none in \[limits\]"):
        gough.axis_speeds(bare, bare.home)
    with pytest.raises(GoughError, match="leg_speed: expected one number above 0, or six"):
        gough.top_speeds(bare, bare.home, [1, 2])
    with pytest.raises(GoughError, match="leg_stiffness: expected one number above 0"):
        gough.stiffness(bare, bare.home, 0)
    with pytest.raises(PlatformError, match=r"workspace: .* no range of forces"):
        gough.force_range(machines.limited(replace(bare, workspace=None)))

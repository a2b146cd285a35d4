"""Readings, Jacobian and conditioning, against finite differences, MuJoCo and their invariances."""

from __future__ import annotations

from dataclasses import replace

import machines
import mujoco_model
import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import approx_fprime
from support import BATCHES, TELESCOPIC_LIKE, Floats, reading_scale, unitless

import gough
from gough import GoughError, Platform, Pose, jacobian, leg_lengths, singularity_distance
from gough.kinematics import equivalent_struts, normalised_jacobian, strut_vectors

CATALOG = Platform.catalog()
REFERENCE = Platform.load("reference")
REACHY = Platform.load("reachy_mini")
NOWHERE = Pose(np.full(3, np.nan), np.full(4, np.nan))


# ---- known cases ----------------------------------------------------------------------


def test_simulink_model_of_the_rubin_hexapod() -> None:
    """lsst-ts/ts_mthexapod, tests/test_simple_hexapod.py: expected struts to five decimals."""
    platform = Platform.load("rubin_simulink")
    pose = Pose.from_euler((-0.0603, 0.1045, -0.0109), (-0.0355, -0.0205, -0.0004))
    expected = (0.15205, 0.07204, -0.04667, 0.13381, 0.02959, -0.07292)
    assert np.round(leg_lengths(platform, pose), 5).tolist() == list(expected)


def test_home_readings_of_the_sources() -> None:
    assert np.all(np.abs(REFERENCE.home_legs - 655.543) < 1e-3)
    assert np.all(np.abs(Platform.load("linuxcnc_genhex").home_legs - 29.7466) < 3e-4)
    assert np.all(np.abs(Platform.load("matlab_stewart").home_legs - 3.15380068) < 1e-8)
    assert np.all(Platform.load("rubin_camera").home_legs == 0)


def test_all_forty_poses_of_dietmaier_have_the_same_legs() -> None:
    """Home is one of the forty: its legs are those of the paper, to the paper's six digits."""
    legs = (1, 0.645275, 1.086284, 1.503439, 1.281933, 0.771071)
    np.testing.assert_allclose(Platform.load("dietmaier").home_legs, legs, atol=1e-6)


def test_straight_up() -> None:
    """A prism whose legs are vertical: readings are the height, and no twist changes them."""
    platform, pose = support.PRISM, Pose((0, 0, 250))
    np.testing.assert_allclose(leg_lengths(platform, pose), [250] * 6)
    np.testing.assert_allclose(jacobian(platform, pose)[:, :3], [[0, 0, 1]] * 6)
    assert singularity_distance(platform, pose) < 1e-15


# ---- batch axes, NaN ------------------------------------------------------------------


@pytest.mark.parametrize("name", CATALOG)
@pytest.mark.parametrize("batch", BATCHES)
def test_rows_of_a_batch_are_solved_alone(name: str, batch: tuple[int, ...]) -> None:
    platform = Platform.load(name)
    poses = support.sample(platform, batch)
    results = {
        (6,): leg_lengths(platform, poses),
        (6, 6): jacobian(platform, poses),
        (): singularity_distance(platform, poses),
        (6, 3): gough.joint_positions(platform, poses),
    }
    for trailing, many in results.items():
        assert np.shape(many) == (*batch, *trailing)
    assert np.shape(gough.assembly_sign(platform, poses)) == batch
    assert gough.pose_covariance(platform, poses, 1e-3).shape == (*batch, 6, 6)
    for i in np.ndindex(batch):
        one = poses[i] if batch else poses
        np.testing.assert_allclose(results[6,][i], leg_lengths(platform, one), rtol=1e-14,
                                   atol=1e-15)  # fmt: skip
        np.testing.assert_allclose(results[6, 6][i], jacobian(platform, one), rtol=1e-10,
                                   atol=1e-13)  # fmt: skip


@pytest.mark.parametrize("name", CATALOG)
def test_nan_goes_in_and_comes_out_and_leaves_its_neighbours_alone(name: str) -> None:
    platform = Platform.load(name)
    good = platform.home
    poses = Pose(
        np.stack([good.position, NOWHERE.position, good.position]),
        np.stack([good.wxyz, NOWHERE.wxyz, good.wxyz]),
    )
    for result in (
        leg_lengths(platform, poses),
        jacobian(platform, poses),
        singularity_distance(platform, poses),
        gough.assembly_sign(platform, poses),
        gough.pose_covariance(platform, poses, 1e-3),
    ):
        rows = np.reshape(result, (3, -1))
        assert np.all(np.isnan(rows[1]))
        assert np.all(np.isfinite(rows[[0, 2]]))
        np.testing.assert_array_equal(rows[0], rows[2])


# ---- Jacobian -------------------------------------------------------------------------


@pytest.mark.parametrize("name", CATALOG)
def test_jacobian_is_the_derivative_for_catalog_machines(name: str) -> None:
    platform = Platform.load(name)
    _check_derivative(platform, support.sample(platform, (25,)))


@given(support.random_platforms)
def test_jacobian_is_the_derivative_for_any_platform(platform: Platform) -> None:
    _check_derivative(platform, support.sample(platform, (5,)))


def _check_derivative(platform: Platform, pose: Pose) -> None:
    """Central differences, fourth order, along each coordinate of the twist."""
    J = unitless(platform, jacobian(platform, pose))
    step = 3e-4
    for column in range(6):
        twist = np.zeros(6)
        twist[column] = step * (platform.size if column < 3 else 1.0)
        at = {k: leg_lengths(platform, support.moved(pose, k * twist)) for k in (-2, -1, 1, 2)}
        slope = (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * step * reading_scale(platform))
        scale = max(1.0, float(np.abs(J).max()))
        np.testing.assert_allclose(J[..., column], slope, rtol=0, atol=1e-9 * scale)


def test_the_derivative_check_agrees_with_scipy() -> None:
    """A second, independent finite difference, at one pose."""
    pose = support.sample(REFERENCE, ())

    def legs(twist: Floats) -> Floats:
        return leg_lengths(REFERENCE, support.moved(pose, twist))

    found = np.asarray(approx_fprime(np.zeros(6), legs, 1e-7))
    np.testing.assert_allclose(jacobian(REFERENCE, pose), found, rtol=1e-4, atol=1e-3)


# ---- MuJoCo ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", TELESCOPIC_LIKE)
def test_struts_are_mujocos_tendons(name: str) -> None:
    platform = Platform.load(name)
    poses = support.sample(platform, (20,))
    zero = platform.home_lengths if platform.legs == "length_change" else 0.0
    for i in range(20):
        lengths, rows = mujoco_model.measure(platform, poses[i])
        readings = leg_lengths(platform, poses[i])
        np.testing.assert_allclose(readings, lengths - zero, rtol=0, atol=4e-15 * platform.size)
        ours = unitless(platform, jacobian(platform, poses[i]))
        np.testing.assert_allclose(ours, unitless(platform, rows), rtol=0, atol=1e-14)


@given(st.integers(0, 10**6), st.sampled_from(["telescopic", "length_change"]))
def test_struts_of_any_platform_are_mujocos_tendons(seed: int, legs: str) -> None:
    platform = machines.random_platform(seed, legs)
    pose = support.sample(platform, (), seed)
    lengths, rows = mujoco_model.measure(platform, pose)
    np.testing.assert_allclose(
        np.linalg.norm(strut_vectors(platform, pose), axis=-1), lengths, rtol=1e-14
    )
    ours = unitless(platform, jacobian(platform, pose))
    np.testing.assert_allclose(ours, unitless(platform, rows), rtol=0, atol=1e-13)


def test_motor_angles_make_mujocos_rods_the_right_length() -> None:
    """Hinges at our angles: rods have their length, and its implicit derivative is our Jacobian."""
    arms = REACHY.rotary
    assert arms is not None
    poses = support.sample(REACHY, (20,))
    for i in range(20):
        angles = leg_lengths(REACHY, poses[i])
        rods, rows = mujoco_model.measure(REACHY, poses[i], angles)
        np.testing.assert_allclose(rods, arms.rod_length, rtol=1e-13)
        slope = -np.linalg.solve(rows[:, :6], rows[:, 6:])  # rod(q, x) = const: dq/dx
        np.testing.assert_allclose(jacobian(REACHY, poses[i]), slope, rtol=1e-6, atol=1e-6)


# ---- rotary legs ----------------------------------------------------------------------


@given(support.seeds)
def test_an_arms_tip_is_one_rod_from_the_joint(seed: int) -> None:
    platform = machines.random_platform(seed, "rotary", seed % 2 == 1)
    assert platform.rotary is not None
    poses = support.sample(platform, (10,), seed)
    readings = leg_lengths(platform, poses)
    assert np.all(np.abs(readings * platform.gain) <= np.pi)
    tips, rods = equivalent_struts(platform, readings)
    assert np.all(rods == platform.rotary.rod_length)
    np.testing.assert_allclose(
        np.linalg.norm(gough.joint_positions(platform, poses) - tips, axis=-1), rods, rtol=1e-13
    )
    radius = np.linalg.norm(tips - platform.base, axis=-1)
    arms = np.broadcast_to(platform.rotary.arm_length, radius.shape)
    np.testing.assert_allclose(radius, arms, rtol=1e-14)


@given(support.seeds)
def test_the_other_branch_is_the_other_angle_that_reaches(seed: int) -> None:
    """Both angles reach; they lie to the two sides of the joint's direction in the arm's plane."""
    platform = machines.random_platform(seed, "rotary")
    arms = platform.rotary
    assert arms is not None
    pose = support.sample(platform, (), seed)
    mirrored = replace(platform, rotary=replace(arms, branch=-arms.branch), stroke=None)
    ours, other = leg_lengths(platform, pose), leg_lengths(mirrored, pose)
    assert np.all(np.abs(np.sin((ours - other) / 2)) > 1e-6)
    tips, rods = equivalent_struts(mirrored, other)
    joints = gough.joint_positions(platform, pose)
    np.testing.assert_allclose(np.linalg.norm(joints - tips, axis=-1), rods, rtol=1e-13)
    toward = strut_vectors(platform, pose)
    direction = np.arctan2(np.sum(toward * arms.axis_y, -1), np.sum(toward * arms.axis_x, -1))
    assert np.all(np.sign(np.sin(ours - direction)) == arms.branch)
    np.testing.assert_allclose(np.sin(ours - direction), -np.sin(other - direction), atol=1e-12)


def test_out_of_a_motors_reach_is_nan_and_says_nothing() -> None:
    far = Pose((0, 0, 1))
    assert np.all(np.isnan(leg_lengths(REACHY, far)))
    assert np.all(np.isnan(jacobian(REACHY, far)))
    assert np.isnan(singularity_distance(REACHY, far))
    assert np.isnan(gough.assembly_sign(REACHY, far))


def test_the_rate_grows_without_bound_where_arm_and_rod_align() -> None:
    """At full stretch the angle says nothing to first order: the rate is about 1 / sqrt(gap)."""
    low, high = REACHY.home.position[2], REACHY.home.position[2] + 0.1
    for _ in range(60):
        middle = (low + high) / 2
        reached = np.all(np.isfinite(leg_lengths(REACHY, Pose((0, 0, middle)))))
        low, high = (middle, high) if reached else (low, middle)
    gaps = np.array([1e-4, 1e-6, 1e-8]) * REACHY.size
    poses = Pose(np.stack([0 * gaps, 0 * gaps, low - gaps], axis=-1))
    rates = np.abs(jacobian(REACHY, poses)).max(axis=(-2, -1))
    np.testing.assert_allclose(rates[1:] / rates[:-1], 10, rtol=0.05)


# ---- equivalent struts ----------------------------------------------------------------


@given(support.random_platforms, st.sampled_from(BATCHES))
def test_equivalent_struts_have_the_machines_geometry(
    platform: Platform, batch: tuple[int, ...]
) -> None:
    poses = support.sample(platform, batch)
    starts, lengths = equivalent_struts(platform, leg_lengths(platform, poses))
    assert starts.shape == (*batch, 6, 3)
    assert lengths.shape == (*batch, 6)
    spans = np.linalg.norm(gough.joint_positions(platform, poses) - starts, axis=-1)
    np.testing.assert_allclose(spans, lengths, rtol=1e-13)


# ---- distance to singularity, assembly sign -------------------------------------------


def test_an_architecturally_singular_platform_is_singular_everywhere() -> None:
    """Similar regular hexagons, joined vertex to vertex (Ma and Angeles 1991)."""
    turn = np.radians(np.arange(0, 360, 60))
    hexagon = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
    platform = Platform(hexagon, 0.5 * hexagon, home=(0, 0, 1)).with_workspace(0.2, 25)
    assert np.all(singularity_distance(platform, support.sample(platform, (200,))) < 1e-15)


@pytest.mark.parametrize("quarter", [1, -1])
def test_a_turn_of_a_quarter_is_singular_for_a_symmetric_platform(quarter: int) -> None:
    """Fichter's singularity: with base and platform parallel, +-90 deg about the vertical from the
    untwisted pose. The reference platform's home is untwisted."""

    def turn(degrees: float) -> Pose:
        return Pose.from_euler((0, 0, 600), np.radians((0, 0, quarter * degrees)))

    assert singularity_distance(REFERENCE, turn(90)) < 1e-5  # joints are rounded to 0.001 mm
    assert gough.assembly_sign(REFERENCE, turn(89)) == 1
    assert gough.assembly_sign(REFERENCE, turn(91)) == -1
    assert gough.assembly_sign(REFERENCE, REFERENCE.home) == 1


def test_a_flat_platform_is_singular() -> None:
    platform = replace(REFERENCE, home=Pose((0, 0, 600)))
    assert singularity_distance(platform, Pose((5, 3, 0))) < 1e-15


@given(support.random_platforms, support.seeds)
def test_the_distance_is_that_to_the_nearest_singular_matrix(platform: Platform, seed: int) -> None:
    """Eckart and Young: a change of that size makes it singular, and no smaller one does."""
    pose = support.sample(platform, (), seed)
    M, distance = normalised_jacobian(platform, pose), singularity_distance(platform, pose)
    u, s, vh = np.linalg.svd(M)
    nearest = M - s[-1] * np.outer(u[:, -1], vh[-1])
    assert np.linalg.norm(nearest - M, 2) == pytest.approx(distance, rel=1e-12)
    assert np.linalg.cond(nearest) > 1e13
    rng = np.random.default_rng(seed)
    for _ in range(20):
        change = rng.standard_normal((6, 6))
        change *= 0.999 * distance / np.linalg.norm(change, 2)
        assert np.linalg.svd(M + change, compute_uv=False)[-1] > 0.9e-3 * distance


@given(support.random_platforms, support.seeds)
def test_joints_move_by_no_more_than_leg_error_over_distance(platform: Platform, seed: int) -> None:
    """What the docstring promises a user, for a small error of the struts."""
    platform = replace(platform, legs="telescopic", rotary=None, stroke=None, offset=0, gain=1)
    pose = support.sample(platform, (), seed)
    rng = np.random.default_rng(seed)
    error = rng.standard_normal(6)
    error *= 1e-6 * platform.size / np.linalg.norm(error)
    twist = np.linalg.solve(jacobian(platform, pose), error)
    before = gough.joint_positions(platform, pose)
    after = gough.joint_positions(platform, support.moved(pose, twist))
    shift = np.sqrt(np.mean(np.sum((after - before) ** 2, axis=-1)))
    limit = np.linalg.norm(error) / singularity_distance(platform, pose)
    assert shift <= 1.0001 * limit


@pytest.mark.parametrize("name", CATALOG)
def test_workspaces_of_the_catalog_hold_no_singularity(name: str) -> None:
    platform = Platform.load(name)
    poses = support.sample(platform, (2000,))
    assert np.all(gough.assembly_sign(platform, poses) == 1)
    assert np.all(singularity_distance(platform, poses) > 1e-3)


# ---- covariance -----------------------------------------------------------------------


@pytest.mark.parametrize("name", ["reference", "rubin_camera", "reachy_mini"])
def test_covariance_is_what_noisy_legs_do(name: str) -> None:
    """20,000 noisy readings, each taken back to a pose by Newton's method."""
    platform = Platform.load(name)
    rng = np.random.default_rng(1)
    pose = support.sample(platform, (), seed=3)
    sigma = 1e-5 * reading_scale(platform) * np.array([1, 2, 1, 0.5, 1, 3])
    noise = sigma * rng.standard_normal((20_000, 6))
    wanted = leg_lengths(platform, pose) + noise
    poses = Pose(np.broadcast_to(pose.position, (20_000, 3)), pose.wxyz)
    for _ in range(3):
        gap = wanted - leg_lengths(platform, poses)
        step = np.linalg.solve(jacobian(platform, poses), gap[..., None])[..., 0]
        poses = support.moved(poses, step)
    assert np.max(np.abs(wanted - leg_lengths(platform, poses))) < 1e-12 * reading_scale(platform)
    turn = Pose(np.zeros(3), poses.wxyz) @ Pose(np.zeros(3), pose.wxyz).inverse()
    errors = np.concatenate([poses.position - pose.position, turn.rotation_vector], axis=-1)
    found, expected = np.cov(errors.T), gough.pose_covariance(platform, pose, sigma)
    spread = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(found / np.outer(spread, spread),
                               expected / np.outer(spread, spread), atol=0.04)  # fmt: skip


@given(support.random_platforms, support.seeds)
def test_ways_of_telling_the_noise_agree(platform: Platform, seed: int) -> None:
    pose = support.sample(platform, (3,), seed)
    one = gough.pose_covariance(platform, pose, 0.1)
    np.testing.assert_array_equal(gough.pose_covariance(platform, pose, [0.1] * 6), one)
    np.testing.assert_allclose(gough.pose_covariance(platform, pose, 0.01 * np.eye(6)), one)
    np.testing.assert_allclose(one, np.swapaxes(one, -1, -2), rtol=1e-9)
    assert np.all(np.linalg.eigvalsh(one / one[..., :1, :1]) > -1e-12)


def test_covariance_of_a_singular_pose_is_nan() -> None:
    assert np.all(np.isnan(gough.pose_covariance(support.PRISM, Pose((0, 0, 250)), 1.0)))


@pytest.mark.parametrize(
    ("noise", "message"),
    [
        (-1.0, r"leg_noise: expected standard deviations of 0 or more, found -1\.0"),
        (np.nan, "leg_noise: expected standard deviations of 0 or more, found nan"),
        ([1.0] * 5, r"leg_noise: expected a number, \(6,\) or \(6, 6\), got \(5,\)"),
        (np.full((6, 6), np.inf), "leg_noise: expected a covariance: finite, symmetric, no negat"),
        (-np.eye(6), "leg_noise: expected a covariance: finite, symmetric, no negative eigenvalue"),
        (np.triu(np.ones((6, 6))), "leg_noise: expected a covariance: finite, symmetric"),
        ("loud", "leg_noise: expected a number, found 'loud'"),
    ],
)
def test_wrong_noise_is_named(noise, message: str) -> None:
    with pytest.raises(GoughError, match=f"^{message}"):
        gough.pose_covariance(REFERENCE, REFERENCE.home, noise)


def test_wrong_readings_are_named() -> None:
    with pytest.raises(GoughError, match=r"^legs: expected \(..., 6\), got \(2, 5\)$"):
        equivalent_struts(REFERENCE, np.zeros((2, 5)))

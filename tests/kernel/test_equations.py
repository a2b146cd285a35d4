"""The compiled mathematics against NumPy's and against itself in its two uses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough.kernel import layout, linear
from gough.kernel.constants import from_internal, kernel_constants, solving_order, to_internal
from gough.kernel.elimination import eliminate
from gough.kernel.equations import newton_step
from gough.kernel.jit import jit
from gough.kernel.pose_io import put_reading
from gough.kinematics import equivalent_struts

CATALOG = gough.Platform.catalog()


@jit()
def _eliminate(A, b):
    rows = [(A[i, 0], A[i, 1], A[i, 2], A[i, 3], A[i, 4], A[i, 5], b[i]) for i in range(6)]
    return eliminate(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5])


@jit()
def _newton_step(constants, buffer):
    newton_step(constants, buffer, layout.FIRST, layout.SINGLE)


@jit()
def _put_reading(constants, legs, buffer):
    return put_reading(constants, legs, layout.FIRST, buffer, layout.FIRST, layout.SINGLE)


@jit()
def _pivoted_solve(J, r, system, step):
    return linear.pivoted_solve(J, r, system, step)


@jit()
def _damped_solve(J, r, damping, system, step):
    return linear.damped_solve(J, r, damping, system, step)


@jit()
def _smallest_singular_value(J, system):
    return linear.smallest_singular_value(J, system)


def _matrices(seed, count=20):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, 6, 6)) + 4 * np.eye(6), rng.normal(size=(count, 6))


@given(st.integers(0, 2**32 - 1))
def test_elimination_agrees_with_lapack(seed):
    for A, b in zip(*_matrices(seed, 5), strict=True):
        *x, determinant = _eliminate(A, b)
        np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(determinant, np.linalg.det(A), rtol=1e-8)


@given(st.integers(0, 2**32 - 1))
def test_pivoted_solve_agrees_with_lapack(seed):
    rng = np.random.default_rng(seed)
    A, b, x = rng.normal(size=(6, 6)), rng.normal(size=6), np.empty(6)
    determinant = _pivoted_solve(A, b, np.empty((6, 6)), x)
    np.testing.assert_allclose(A @ x, b, atol=1e-9 * (1 + np.abs(x).max()))
    np.testing.assert_allclose(determinant, np.linalg.det(A), rtol=1e-9)


def test_pivoted_solve_says_zero_of_a_singular_matrix():
    A = np.ones((6, 6))
    assert _pivoted_solve(A, np.ones(6), np.empty((6, 6)), np.empty(6)) == 0.0


@given(st.integers(0, 2**32 - 1), st.floats(1e-9, 1e3))
def test_damped_step_minimises_the_damped_error(seed, damping):
    rng = np.random.default_rng(seed)
    J, r, step = rng.normal(size=(6, 6)), rng.normal(size=6), np.empty(6)
    steepest = _damped_solve(J, r, damping, np.empty((6, 6)), step)
    left = (J.T @ J + damping * np.eye(6)) @ step
    np.testing.assert_allclose(left, J.T @ r, atol=1e-9 * (1 + np.abs(step).max()))
    np.testing.assert_allclose(steepest, np.abs(J.T @ r).max(), rtol=1e-12)


@given(st.integers(0, 2**32 - 1), st.floats(-6, 0))
def test_smallest_singular_value_agrees_with_lapack(seed, exponent):
    rng = np.random.default_rng(seed)
    U, _, V = np.linalg.svd(rng.normal(size=(6, 6)))
    values = np.array([2.0, 1.5, 1.0, 1.0, 0.7, 0.5 * 10**exponent])
    found = _smallest_singular_value(U @ np.diag(values) @ V, np.empty((6, 6)))
    assert found == pytest.approx(values[-1], rel=1e-3, abs=5e-8)


@pytest.mark.parametrize("name", CATALOG)
def test_newton_step_is_newtons(name):
    """The step solves J step = legs - legs(pose) of the public Jacobian, to second order."""
    platform = gough.Platform.load(name)
    constants = kernel_constants(platform)
    near = platform.sample_poses(1, seed=4)[0]
    twist = 1e-4 * np.array([0.3, -0.5, 0.4, 0.2, 0.6, -0.4])
    true = gough.Pose(near.position + platform.size * twist[:3],
                      (gough.Pose.from_rotation_vector(np.zeros(3), twist[3:])
                       @ gough.Pose(np.zeros(3), near.wxyz)).wxyz)  # fmt: skip
    buffer = _state(constants, platform, gough.leg_lengths(platform, true), near)
    _newton_step(constants, buffer)
    expected = to_internal(constants, true)
    np.testing.assert_allclose(buffer[:7], expected, atol=2e-6)
    assert (
        np.abs(buffer[:7] - expected).max()
        < 0.02 * np.abs(to_internal(constants, near) - expected).max()
    )


def test_a_settled_pose_stays_where_it_is():
    platform = gough.Platform.load("reference")
    constants = kernel_constants(platform)
    pose = platform.sample_poses(1, seed=4)[0]
    buffer = _state(constants, platform, platform.home_legs, pose)
    buffer[layout.STEP] = 0.0
    before = buffer[:7].copy()
    _newton_step(constants, buffer)
    np.testing.assert_array_equal(buffer[:7], before)


def _state(constants, platform, legs, pose):
    """A buffer of stride 1 with the struts of a reading and a pose."""
    buffer = np.zeros(layout.COMPONENTS)
    buffer[layout.STEP] = np.inf
    assert _put_reading(constants, np.ascontiguousarray(legs)[None], buffer)
    buffer[:7] = to_internal(constants, pose)
    return buffer


def test_the_order_of_legs_is_a_permutation():
    for name in CATALOG:
        order = solving_order(gough.Platform.load(name))
        assert sorted(order) == list(range(6))


@pytest.mark.parametrize("name", CATALOG)
def test_internal_poses_and_back(name):
    platform = gough.Platform.load(name)
    constants = kernel_constants(platform)
    pose = platform.sample_poses(20, seed=1)
    back = from_internal(constants, to_internal(constants, pose))
    np.testing.assert_allclose(back.position, pose.position, atol=1e-14 * platform.size)
    np.testing.assert_array_equal(back.wxyz, pose.wxyz)


@pytest.mark.parametrize("name", ["reference", "rubin_camera", "reachy_mini"])
def test_struts_of_readings_are_those_of_the_plain_statement(name):
    platform = gough.Platform.load(name)
    constants = kernel_constants(platform)
    legs = gough.leg_lengths(platform, platform.sample_poses(1, seed=3)[0])
    buffer = _state(constants, platform, legs, platform.home)
    order = solving_order(platform)
    base, lengths = equivalent_struts(platform, legs)
    found = buffer[layout.BASE :][:18].reshape(6, 3) * platform.size + platform.base.mean(axis=0)
    np.testing.assert_allclose(found, base[order], atol=1e-14 * platform.size)
    np.testing.assert_allclose(
        buffer[layout.LENGTH :][:6] * platform.size, lengths[order], rtol=1e-14
    )

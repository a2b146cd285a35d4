"""The certificate against ball arithmetic, and against what it must refuse."""

from __future__ import annotations

from typing import Any

import balls
import numpy as np
import pytest
from machines import ALL
from modes.poses import poses_of

import gough
from gough import quaternion
from gough.certificate import TURNS, _bounds
from gough.kernel import bounds, lanes
from gough.kinematics import equivalent_struts, joint_radius


@pytest.mark.parametrize("name", ALL)
def test_whole_workspace_is_certified(name):
    platform = gough.Platform.load(name)
    pose = poses_of(platform, 3000)
    proof = gough.certify(platform, gough.leg_lengths(platform, pose), pose)
    assert proof.certified.all()
    assert np.all(proof.error < 1e-3 * proof.radius)
    assert np.all(proof.error < 1e-9 * platform.size)


@pytest.mark.parametrize("name", ALL)
def test_bounds_hold_in_ball_arithmetic(name):
    """With 70 digits: the true solution is within `error`, and `radius` is not too large."""
    platform = gough.Platform.load(name)
    pose = poses_of(platform, 12)
    legs = gough.leg_lengths(platform, pose)
    proof = gough.certify(platform, legs, pose)
    base, lengths = equivalent_struts(platform, legs)
    pivot = platform.pivot_point
    exact = [[balls.acb(v) for v in row] for row in platform.moving - pivot]
    for k in range(len(pose)):
        e, t = pose.wxyz[k], pose.position[k]
        squares = [balls.acb(v) ** 2 for v in lengths[k]]
        problem = base[k] - pivot, platform.moving - pivot, squares
        solved, unrefined = balls.prove(*problem, e, t), balls.prove(*problem, e, t, steps=0)
        assert solved is not None
        assert unrefined is not None
        gaps = balls.relative(exact, balls.numbers(e), balls.numbers(t), solved.e, solved.t)
        assert all(gap < float(proof.error[k]) for gap in gaps)
        assert proof.radius[k] <= unrefined.radius
        assert proof.radius[k] > 0.999 * solved.radius


def test_rounding_is_accounted_for_far_from_the_origin():
    """A machine 1e5 sizes away: struts lose five digits, and the error must say so."""
    near = gough.Platform.load("reference")
    far = np.array([1e8, -7e7, 3e7]) / 3
    platform = gough.Platform(near.base + far, near.moving, home=near.home.position + far)
    pose = near.sample_poses(20, 6)
    pose = gough.Pose(pose.position + far, pose.wxyz)
    legs = gough.leg_lengths(near, near.sample_poses(20, 6))
    proof = gough.certify(platform, legs, pose)
    assert proof.certified.all()
    exact = [[balls.acb(v) for v in row] for row in platform.moving]
    for k in range(20):
        squares = [balls.acb(v) ** 2 for v in legs[k]]
        solved = balls.prove(
            platform.base, platform.moving, squares, pose.wxyz[k], pose.position[k]
        )
        assert solved is not None
        e, t = balls.numbers(pose.wxyz[k]), balls.numbers(pose.position[k])
        gaps = balls.relative(exact, e, t, solved.e, solved.t)
        assert all(gap < float(proof.error[k]) for gap in gaps)


def test_interval_newton_agrees():
    """The Jacobian over the whole box, entry by entry in intervals: a different bound."""
    platform = gough.Platform.load("reference")
    pose = platform.sample_poses(4, 5)
    legs = gough.leg_lengths(platform, pose)
    proof = gough.certify(platform, legs, pose)
    for k in range(4):
        # a cube inside half the ball of radius `radius`: intervals overestimate
        edge = proof.radius[k] / np.sqrt(3) / 2
        assert contracts(platform, legs[k], pose[k], edge)
        assert not contracts(platform, legs[k], pose[k], 1e3 * edge)


def contracts(platform, legs, pose, edge) -> bool:
    """Whether |1 - Y DF(x)| < 1 for all x with coordinates up to `edge`, DF in intervals."""
    arb, mat = balls.arb, balls.flint.arb_mat
    moving = [[balls.acb(v) for v in row] for row in platform.moving]
    base = [[balls.acb(v) for v in row] for row in platform.base]
    e, t = ([balls.acb(v) for v in part] for part in (pose.wxyz, pose.position))
    squares = [balls.acb(v) ** 2 for v in legs]
    _, a, d, m, size = balls.equations(base, moving, squares, e, t)
    box = [arb(0, edge) for _ in range(7)]  # 2 g0, 2 c, 2 L r
    g0, c, r = box[0] / 2, [v / 2 for v in box[1:4]], [v / (2 * size) for v in box[4:]]
    rows: list[list] = [[0.0] * 7 for _ in range(7)]
    rows[0] = [arb(1), *r, *[v / size for v in c]]  # of 2 (g0 + r.c)
    for i in range(6):
        di, mi = [v.real for v in d[i]], [v.real for v in m[i]]
        q = [(x + y) / 2 for x, y in zip(di, mi, strict=True)]
        b = [(y - x) / 2 for x, y in zip(di, mi, strict=True)]
        level = sum(v * v for v in mi) - squares[i].real
        rd = sum(x * y for x, y in zip(r, di, strict=True))
        rq, rb = (sum(x * y for x, y in zip(r, v, strict=True)) for v in (q, b))
        by_g0 = 4 * g0 - 2 * rd
        rm, mc, qd = balls._cross(r, mi), balls._cross(mi, c), balls._cross(q, di)
        by_c = [2 * di[k] + 4 * c[k] + 2 * rm[k] for k in range(3)]
        by_r = [
            2 * qd[k] - 2 * g0 * di[k] + 2 * mc[k] + r[k] * level - 2 * (q[k] * rb + b[k] * rq)
            for k in range(3)
        ]
        rows[i + 1] = [by_g0 / 2, *[v / 2 for v in by_c], *[v / (2 * size) for v in by_r]]
    inverse = np.zeros((7, 7))
    inverse[0, 0] = 1.0
    middle = np.array([[float(a[i, j].real) for j in range(6)] for i in range(6)])
    inverse[1:, 1:] = np.linalg.inv(middle)
    product = mat([[arb(v) for v in row] for row in inverse.tolist()]) * mat(rows)
    worst = 0.0
    for i in range(7):
        entries = (abs(product[i, j] - (1 if i == j else 0)).upper() for j in range(7))
        worst = max(worst, sum(float(v) for v in entries))
    return worst < 1


def test_small_pivots_are_noticed():
    """Where the inverse fails for want of pivoting, nothing false is claimed."""
    platform = gough.Platform.load("reference")
    pose = platform.sample_poses(60, 8)
    axis = quaternion.to_matrix(TURNS[0])[0]  # the first pivot is the first strut's part along it
    strut = gough.joint_positions(platform, pose)[:, 0] - platform.base[0]
    along = strut @ axis * (1 - np.logspace(-16, -1, 60))
    pose = gough.Pose(pose.position - along[:, None] * axis, pose.wxyz)
    legs = gough.leg_lengths(platform, pose)
    alone = _bounds(platform, TURNS[0], platform.base[None], legs, pose)
    proof = gough.certify(platform, legs, pose)
    assert np.sum(alone[0] == 0) > np.sum(~proof.certified)
    for k in range(60):
        best = balls.prove(platform.base, platform.moving, legs[k] ** 2, pose.wxyz[k],
                           pose.position[k], steps=0)  # fmt: skip
        limit = 0.0 if best is None else best.radius
        assert alone[0][k] <= limit
        assert proof.radius[k] <= limit
        assert proof.certified[k] == (best is not None)


def test_modes_lie_outside_each_others_radius():
    platform = gough.Platform.load("reference")
    modes = gough.assembly_modes(platform, gough.leg_lengths(platform, poses_of(platform, 50)))
    length = joint_radius(platform)
    for one in modes:
        for k in range(len(one)):
            shift, turn = one.pose[k].distance(one.pose)
            measure = np.maximum(shift / np.cos(turn / 2), 2 * length * np.tan(turn / 2))
            measure[k] = np.inf
            assert np.all(measure > one.certificate.radius[k])


@pytest.mark.parametrize("off", [1e-3, 1e-6])
def test_error_covers_a_pose_that_is_off(off):
    platform = gough.Platform.load("reference")
    pose = platform.sample_poses(200, 2)
    legs = gough.leg_lengths(platform, pose)
    wrong = gough.Pose(pose.position + off, pose.wxyz)
    proof = gough.certify(platform, legs, wrong)
    assert proof.certified.all()
    assert np.all(proof.error >= off)
    assert np.all(proof.error <= 1e3 * off)


def test_wrong_poses_are_refused():
    platform = gough.Platform.load("reference")
    pose = platform.sample_poses(200, 2)
    legs = gough.leg_lengths(platform, pose)
    for wrong in (
        gough.Pose(pose.position + 50.0, pose.wxyz),
        gough.Pose(np.full((200, 3), np.nan), pose.wxyz),
        platform.home,
    ):
        proof = gough.certify(platform, legs, wrong)
        assert not proof.certified.any()
        assert np.all(proof.radius == 0)
        assert np.all(np.isinf(proof.error))


def test_singular_pose_is_refused():
    """Turned by 90 deg about its axis, a symmetric hexapod is singular (Fichter 1986)."""
    platform = gough.Platform.load("reference")
    half = np.sqrt(0.5)
    pose = gough.Pose(platform.home.position, [half, 0, 0, half])
    assert not gough.certify(platform, gough.leg_lengths(platform, pose), pose).certified


@pytest.mark.parametrize("unit", [1e-6, 1e3])
def test_radius_scales_with_the_unit(unit):
    platform = gough.Platform.load("reference")
    pose = platform.sample_poses(100, 2)
    legs = gough.leg_lengths(platform, pose)
    home = gough.Pose(platform.home.position * unit, platform.home.wxyz)
    scaled = gough.Platform(platform.base * unit, platform.moving * unit, home=home)
    proof = gough.certify(platform, legs, pose)
    other = gough.certify(scaled, legs * unit, gough.Pose(pose.position * unit, pose.wxyz))
    assert proof.certified.all()
    assert other.certified.all()
    assert np.allclose(other.radius, proof.radius * unit, rtol=1e-8)


def test_bounds_are_calculated_in_the_order_they_are_derived_in():
    """No flag lets the compiler reorder sums: its bounds on rounding assume the written order."""
    rows: Any = bounds.bound_rows
    assert not rows.targetoptions["fastmath"]
    assert set(lanes._FLAGS) == {"contract", "nsz"}


@pytest.mark.parametrize("name", ["reference", "reachy_mini"])
def test_compiled_bounds_are_those_in_numpy(name):
    """The same functions on NumPy arrays: they agree but for rounding."""
    platform = gough.Platform.load(name)
    pose = poses_of(platform, 5)
    base, lengths = equivalent_struts(platform, gough.leg_lengths(platform, pose))
    radius, error = _bounds(platform, TURNS[0], base, lengths, pose)
    matrix = quaternion.to_matrix(TURNS[0])
    moving = platform.moving - platform.pivot_point
    centre, size = moving.mean(axis=0), joint_radius(platform)
    shared = np.concatenate([TURNS[0], matrix.ravel(), (moving - centre).ravel(), centre, [size]])
    rotated = (base - platform.pivot_point) @ matrix.T
    z = list(np.concatenate([pose.wxyz, pose.position, rotated.reshape(-1, 18), lengths], axis=1).T)
    z += [np.zeros(len(pose))] * (bounds.SLOTS - len(z))
    bounds.bound(z, shared)
    assert np.allclose(radius, z[bounds.RADIUS], rtol=1e-9)
    assert np.allclose(error, z[bounds.ERROR], rtol=1e-9)


def test_shapes_follow_the_batch():
    platform = gough.Platform.load("reference")
    assert gough.certify(platform, platform.home_legs, platform.home).radius.shape == ()
    pose = gough.Pose(platform.sample_poses(6).position.reshape(2, 3, 3))
    legs = gough.leg_lengths(platform, pose)
    assert gough.certify(platform, legs, pose).radius.shape == (2, 3)

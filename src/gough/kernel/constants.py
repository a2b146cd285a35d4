"""A platform in the form that the compiled code takes: one flat array of numbers without unit."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gough import limit_rules, quaternion
from gough.checks import Array
from gough.home_mode import sure_workspace
from gough.kernel import layout
from gough.kinematics import (
    SINGULAR,
    equivalent_struts,
    home_sign,
    joint_positions,
    joint_radius,
    normalised_jacobian,
)
from gough.platform import Platform
from gough.platform_checks import refuse_screws
from gough.pose import Pose


@lru_cache(maxsize=256)
def kernel_constants(platform: Platform, singular: float = SINGULAR) -> Array:
    """Return the platform's constants, (layout.CONSTANTS,).

    Args:
        singular: distance to singularity below which poses are to be looked at closely.
    """
    refuse_screws(platform)
    size = platform.size
    c = np.zeros(layout.CONSTANTS)
    order = solving_order(platform)
    centre = platform.moving.mean(axis=0)
    base_centre = platform.base.mean(axis=0)

    def put(at: int, values) -> None:
        flat = np.ravel(values)
        c[at : at + flat.size] = flat

    put(layout.JOINTS, (platform.moving - centre)[order] / size)
    put(layout.RADIUS, joint_radius(platform) / size)
    put(layout.ORDER, order)
    put(layout.FIXED, (platform.base - base_centre)[order] / size)
    put(layout.SIZE, size)
    put(layout.PER_SIZE, 1 / size)
    put(layout.PIVOT, (platform.pivot_point - centre) / size)
    put(layout.ORIGIN, base_centre - platform.pivot_point)
    put(layout.HOME_READINGS, platform.home_legs)
    put(layout.STROKE, limit_rules.stroke_limits(platform))
    if platform.rotary is not None:
        arms = platform.rotary
        put(layout.ROTARY, 1.0)
        put(layout.ROD, arms.rod_length[order] / size)
        put(layout.ARM_X, (arms.arm_length[:, None] / size * arms.axis_x)[order])
        put(layout.ARM_Y, (arms.arm_length[:, None] / size * arms.axis_y)[order])
        put(layout.BRANCH, arms.branch[order])
    put(layout.GAIN, platform.gain[order])
    put(layout.ZERO, platform.true_at_zero[order])
    put(layout.HOME_POSITION, (platform.home.position - c[layout.ORIGIN :][:3]) / size)
    put(layout.HOME_QUATERNION, platform.home.wxyz)
    _put_workspace(put, platform)
    put(layout.HOME_POSE, to_internal(c, platform.home))
    # sigma_min >= |det| ((n - 1) / |J|_F^2)^((n - 1) / 2) with n = 6 (Yu and Gu 1997), and
    # |J|_F^2 <= 12: six unit vectors, and moments whose squares sum to at most six.
    put(layout.REGULAR_DETERMINANT, singular / (5 / 12) ** 2.5)
    at_home = normalised_jacobian(platform, platform.home)[order]
    put(layout.HOME_SIGN, np.sign(np.linalg.det(at_home)) * abs(home_sign(platform)))
    c.flags.writeable = False
    return c


def _put_workspace(put, platform: Platform) -> None:
    """Store the box of the workspace, widened by the slack of `limit_rules`.

    A platform that states none gets the box in which poses are surely in home's mode, so that only
    poses beyond it have to be looked at one by one.
    """
    slack = limit_rules.SLACK
    workspace = platform.workspace or sure_workspace(platform)
    put(layout.STATED, float(platform.workspace is not None))
    if workspace is None:
        put(layout.BOX_LOW, np.full(3, -np.inf))
        put(layout.BOX_HIGH, np.full(3, np.inf))
        put(layout.BOX_X, np.tile([1.0, 0.0, -2.0], (3, 1)))
        return
    low, high = workspace.translation.T / platform.size
    put(layout.BOX_LOW, low - slack)
    put(layout.BOX_HIGH, high + slack)
    low, high = np.radians(workspace.rotation_deg.T)
    middle, half = (low + high) / 2, (high - low) / 2 + slack
    # a cosine cannot tell angles below 1e-8 apart; -2 admits every angle
    limit = np.where(half >= np.pi, -2.0, np.cos(np.minimum(half, np.pi)) - 4e-16)
    put(layout.BOX_X, np.stack([np.cos(middle), np.sin(middle), limit], axis=-1))


def solving_order(platform: Platform) -> np.ndarray:
    """Return the order (6,) of legs in which elimination at home needs no pivoting.

    Partial pivoting at home picks it; over a workspace on home's side of the singularities
    the pivots stay away from zero, or the row is caught by its residual.
    """
    base, _ = equivalent_struts(platform, platform.home_legs)
    joints = joint_positions(platform, platform.home)
    struts, arms = joints - base, joints - joints.mean(axis=0)
    rows = np.concatenate([struts, np.cross(arms, struts)], axis=-1) / platform.size
    order = np.arange(6)
    for column in range(5):
        best = column + int(np.argmax(np.abs(rows[column:, column])))
        rows[[column, best]], order[[column, best]] = rows[[best, column]], order[[best, column]]
        if rows[column, column] != 0:
            factors = rows[column + 1 :, column : column + 1] / rows[column, column]
            rows[column + 1 :] -= factors * rows[column]
    return order


def to_internal(c: Array, pose: Pose) -> Array:
    """Poses (...) as internal position and quaternion (..., 7), given the constants."""
    lever = quaternion.to_matrix(pose.wxyz) @ c[layout.PIVOT : layout.PIVOT + 3]
    position = (pose.position - c[layout.ORIGIN : layout.ORIGIN + 3]) / c[layout.SIZE] - lever
    return np.concatenate([position, pose.wxyz], axis=-1)


def from_internal(c: Array, internal: Array) -> Pose:
    """Poses (...) of internal positions and unit quaternions (..., 7); inverts `to_internal`."""
    wxyz = internal[..., 3:]
    lever = quaternion.to_matrix(wxyz) @ c[layout.PIVOT : layout.PIVOT + 3]
    position = c[layout.SIZE] * (internal[..., :3] + lever) + c[layout.ORIGIN : layout.ORIGIN + 3]
    return Pose.trusted(position, wxyz)

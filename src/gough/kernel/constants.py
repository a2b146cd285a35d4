"""A platform as the compiled code wants it: one flat array of numbers without unit."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gough import quaternion
from gough.checks import Array
from gough.kernel import layout
from gough.kinematics import equivalent_struts, joint_positions, joint_radius, normalised_jacobian
from gough.platform import Platform
from gough.pose import Pose

SINGULAR = 1e-3  # distance to singularity below which a pose is called close to one
SLACK = 1e-9  # of the platform's size, and [rad]: keeps poses on the box's faces inside


@lru_cache(maxsize=256)
def constants(platform: Platform, singular: float = SINGULAR) -> Array:
    """The platform's constants, (layout.CONSTANTS,).

    Args:
        singular: distance to singularity below which poses are to be looked at closely.
    """
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
    put(layout.REST, platform.home_legs)
    put(layout.GAIN, platform.gain[order])
    put(layout.ZERO, platform.true_at_zero[order])
    stroke = platform.stroke if platform.stroke is not None else np.tile([-np.inf, np.inf], (6, 1))
    put(layout.STROKE, stroke)
    if platform.rotary is not None:
        arms = platform.rotary
        c[layout.ROTARY] = 1.0
        put(layout.ROD, arms.rod_length[order] / size)
        put(layout.ARM_X, (arms.arm_length[:, None] / size * arms.axis_x)[order])
        put(layout.ARM_Y, (arms.arm_length[:, None] / size * arms.axis_y)[order])
    _put_workspace(put, platform)
    put(layout.START, to_internal(c, platform.home))
    # sigma_min >= |det| ((n - 1) / |J|_F^2)^((n - 1) / 2) with n = 6 (Yu and Gu 1997), and
    # |J|_F^2 <= 12: six unit vectors, and moments whose squares sum to at most six.
    put(layout.ENOUGH, singular / (5 / 12) ** 2.5)
    put(
        layout.REFERENCE,
        np.sign(np.linalg.det(normalised_jacobian(platform, platform.home)[order])),
    )
    c.flags.writeable = False
    return c


def _put_workspace(put, platform: Platform) -> None:
    home = platform.home
    put(layout.CENTRE, (home.position - _origin(platform)) / platform.size)
    put(layout.HOME, home.wxyz)
    if platform.workspace is None:
        put(layout.SHIFT_LOW, np.full(3, -np.inf))
        put(layout.SHIFT_HIGH, np.full(3, np.inf))
        put(layout.TURN, np.tile([1.0, 0.0, -2.0], (3, 1)))
        return
    low, high = platform.workspace.translation.T / platform.size
    put(layout.SHIFT_LOW, low - SLACK)
    put(layout.SHIFT_HIGH, high + SLACK)
    low, high = np.radians(platform.workspace.rotation_deg.T)
    middle, half = (low + high) / 2, (high - low) / 2
    # a cosine cannot tell angles below 1e-8 apart; -2 admits every angle
    limit = np.where(half + SLACK >= np.pi, -2.0, np.cos(np.minimum(half + SLACK, np.pi)) - 4e-16)
    put(layout.TURN, np.stack([np.cos(middle), np.sin(middle), limit], axis=-1))


def _origin(platform: Platform) -> Array:
    """Centre of the base joints minus pivot: position 0 of the internal frame, (3,)."""
    return platform.base.mean(axis=0) - platform.pivot_point


def solving_order(platform: Platform) -> np.ndarray:
    """The order of legs in which elimination at home needs no pivoting, (6,) of int.

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

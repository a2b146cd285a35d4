"""Forward kinematics of legs whose screws turn with them, on the machine without this turning.

What turning adds to the lengths is smooth and small, and depends on the pose. Newton's method on
the exact equations finds the pose, and so what is added there; without it, the readings are those
of a machine whose legs do not turn, with the same pose.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from gough import quaternion
from gough.checks import Array
from gough.kinematics import jacobian, leg_lengths, screw_lengths
from gough.platform import Platform
from gough.pose import Pose

STEPS = 8  # of Newton's method, which starts within what the turning of screws can move
ROWS = 65_536  # that are worked on at a time


@lru_cache(maxsize=64)
def without_turning(platform: Platform) -> Platform:
    """The machine whose legs have the same lengths without turning, and no stroke of readings."""
    return replace(
        platform, screw=None, stroke=None, limits=None, legs="telescopic",
        offset=platform.true_at_zero,
    )  # fmt: skip


def readings_without_turning(platform: Platform, legs: Array, near: Pose) -> Array:
    """What the machine without turning reads at the poses of readings (N, 6).

    Args:
        near: (N,) poses near these, or of NaN, in place of which home serves.
    """
    parts = [np.empty((0, 6))]
    for first in range(0, len(legs), ROWS):
        rows = slice(first, first + ROWS)
        position, wxyz = near.position[rows].copy(), near.wxyz[rows].copy()
        unknown = ~(np.isfinite(position).all(axis=-1) & np.isfinite(wxyz).all(axis=-1))
        position[unknown], wxyz[unknown] = platform.home.position, platform.home.wxyz
        pose = _refined(platform, legs[rows], Pose.trusted(position, wxyz))
        parts.append(legs[rows] - screw_lengths(platform, pose) / platform.gain)
    return np.concatenate(parts)


def _refined(platform: Platform, legs: Array, pose: Pose) -> Pose:
    """Poses (N,) with readings (N, 6), by Newton's method; those it cannot step stay."""
    for _ in range(STEPS):
        error, J = legs - leg_lengths(platform, pose), jacobian(platform, pose)
        regular = np.isfinite(error).all(axis=-1) & (np.linalg.det(J) != 0)
        J[~regular], error[~regular] = np.eye(6), 0.0
        step = np.asarray(np.linalg.solve(J, error[..., None])[..., 0], float)
        far = np.linalg.norm(step[:, :3], axis=-1) / platform.size + np.linalg.norm(
            step[:, 3:], axis=-1
        )
        step[~(far < 1)] = 0.0  # no correction of screws moves a pose so far
        turn = quaternion.from_rotation_vector(step[:, 3:])
        pose = Pose(pose.position + step[:, :3], quaternion.product(turn, pose.wxyz))
        if np.max(far, initial=0.0) < 1e-15:
            break
    return pose

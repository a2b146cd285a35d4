"""Poses as they stand in files, and what is known about each before it has legs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.files.names import EULER_DEG, QUATERNION
from gough.files.report import Outcome
from gough.platform import Platform
from gough.pose import Pose

PLACED = (
    Outcome("ok", "The legs have this pose.", True),
    Outcome("outside_stroke", "A reading is outside the stroke limits: out of reach.", True),
    Outcome("outside_workspace", "The pose is outside the stated workspace.", True),
    Outcome("unreachable", "A motor's arm and rod cannot reach the pose.", False),
    Outcome("invalid_input", "The row is not a pose: correct it.", False),
)
OK, OUTSIDE_STROKE, OUTSIDE_WORKSPACE, UNREACHABLE, INVALID = range(5)
UNIT_LENGTH = 1e-3  # a quaternion whose length is farther from 1 is taken for a mistake


def poses_from_columns(values: Array, names: Sequence[str]) -> tuple[Pose, Callable[[int], str]]:
    """Poses, NaN where a row is none, and a function that says what is wrong with row i.

    Args:
        values: (N, 6) or (N, 7): position, then a quaternion or Euler angles.
        names: the columns' names, which say what the values mean.
    """
    rotation = tuple(names[3:])
    valid = np.all(np.isfinite(values), axis=-1)
    if rotation == QUATERNION:
        with np.errstate(over="ignore", invalid="ignore"):
            length = np.linalg.norm(values[:, 3:], axis=-1)
        valid &= np.abs(length - 1) <= UNIT_LENGTH

    def reason(i: int) -> str:
        for name, value in zip(names, values[i], strict=True):
            if not np.isfinite(value):
                found = "empty or not a number" if np.isnan(value) else value
                return f"{name} is {found}, expected a finite number"
        length = np.linalg.norm(values[i, 3:])
        return f"the quaternion's length is {length:.6g}, expected 1"

    clean = np.where(valid[:, None], values, np.nan)
    position, turn = clean[:, :3], clean[:, 3:]
    if rotation == QUATERNION:
        return Pose(position, turn), reason
    return Pose.from_euler(position, np.radians(turn) if rotation == EULER_DEG else turn), reason


def placed(platform: Platform, pose: Pose, readings: Array) -> NDArray[np.uint8]:
    """What is known about each row of an inverse solution."""
    status = np.full(len(readings), OK, np.uint8)
    status[~platform.in_workspace(pose)] = OUTSIDE_WORKSPACE
    if platform.stroke is not None:
        low, high = platform.stroke.T
        slack = 1e-12 * np.maximum(np.abs(low), np.abs(high))  # limits written with their digits
        status[np.any((readings < low - slack) | (readings > high + slack), axis=-1)] = (
            OUTSIDE_STROKE
        )
    status[~np.all(np.isfinite(readings), axis=-1)] = UNREACHABLE
    status[np.isnan(pose.position[:, 0])] = INVALID
    return status

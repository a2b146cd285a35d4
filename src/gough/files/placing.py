"""What is known about poses of a file before the solver has seen them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
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

"""What is known about poses of a file before the solver has seen them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.platform import Platform
from gough.pose import Pose
from gough.status import InverseStatus

PLACED = tuple(InverseStatus)
OK, OUTSIDE_STROKE, OUTSIDE_WORKSPACE, UNREACHABLE, INVALID = map(int, InverseStatus)


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

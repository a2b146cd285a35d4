"""The limits of a machine: one rule for the stroke, one for the workspace.

Everything that compares readings with the stroke or poses with the workspace uses these
functions; `kernel.pose_io.in_stroke` and `kernel.equations.assess` repeat them in compiled code.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.pose import Pose

if TYPE_CHECKING:
    from gough.platform import Platform

# Limits count as met up to this share of the platform's size, or this angle [rad]: poses on the
# faces of the box and readings at the end of the stroke are inside in spite of rounding.
SLACK = 1e-9


def stroke_limits(platform: Platform) -> Array:
    """Return lowest and highest reading of each leg (6, 2), widened by the slack.

    Infinite where the platform states no stroke.
    """
    if platform.stroke is None:
        return np.tile([-np.inf, np.inf], (6, 1))
    unit = 1.0 if platform.rotary is not None else platform.size
    slack = SLACK * unit / np.abs(platform.gain)  # a reading is the ideal one divided by its gain
    return platform.stroke + slack[:, None] * np.array([-1.0, 1.0])


def legs_in_stroke(platform: Platform, legs: Array) -> NDArray[np.bool_]:
    """Return which readings (..., 6) are within their stroke, leg by leg; False for NaN.

    Args:
        legs: readings (..., 6) [platform unit], or [rad] for rotary legs.
    """
    low, high = stroke_limits(platform).T
    return (legs >= low) & (legs <= high)


def in_stroke(platform: Platform, legs: Array) -> NDArray[np.bool_]:
    """Return which sets (...) of readings (..., 6) have all six legs within their stroke.

    Example:
        >>> platform = gough.Platform.load("rubin_camera")
        >>> in_stroke(platform, platform.home_legs)
        np.True_
    """
    return np.all(legs_in_stroke(platform, legs), axis=-1)


def in_workspace(platform: Platform, pose: Pose) -> NDArray[np.bool_]:
    """Return which poses (...) are in the stated workspace; True where none is stated."""
    if platform.workspace is None:
        return np.ones(pose.batch, dtype=bool)
    return platform.workspace.contains(platform.home, pose, SLACK * platform.size, SLACK)

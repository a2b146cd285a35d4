"""The points and lines that a hexapod is drawn from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import GoughError
from gough.kinematics import equivalent_struts, joint_positions, leg_lengths
from gough.platform import Platform
from gough.pose import Pose


@dataclass(frozen=True, eq=False)
class Skeleton:
    """One pose of a hexapod as points in base coordinates [platform unit].

    Attributes:
        base: (6, 3) base joints; for rotary legs the centres of the motor arms.
        tips: (6, 3) where struts start: base joints, or the tips of the motor arms (NaN where
            a motor cannot reach).
        plate: (6, 3) platform joints.
        readings: (6,) of the legs, as `gough.leg_lengths` gives them.
        share: (6,) how much of its stroke each leg uses: 0 at the lowest reading, 1 at the
            highest; NaN where the platform states no stroke.
    """

    base: Array
    tips: Array
    plate: Array
    readings: Array
    share: Array

    @property
    def outside(self) -> NDArray[np.bool_]:
        """(6,) legs that are outside their stroke."""
        slack = 1e-9  # a leg at its very end is not outside for rounding
        return (self.share < -slack) | (self.share > 1 + slack)

    @property
    def unreachable(self) -> NDArray[np.bool_]:
        """(6,) rotary legs whose arm and rod are too short."""
        return ~np.isfinite(self.readings)

    @property
    def points(self) -> Array:
        """(M, 3) all points that are somewhere."""
        points = np.concatenate([self.base, self.tips, self.plate])
        return points[np.isfinite(points[:, 0])]


def skeleton(platform: Platform, pose: Pose) -> Skeleton:
    """What to draw of one pose.

    Raises:
        GoughError: a batch, or a pose without numbers.
    """
    if pose.batch:
        raise GoughError(f"pose: expected one pose, found batch axes {pose.batch}; pass pose[i]")
    if not np.all(np.isfinite([*pose.position, *pose.wxyz])):
        raise GoughError("pose: has no numbers: nothing was found that could be drawn")
    readings = leg_lengths(platform, pose)
    tips, _ = equivalent_struts(platform, readings)
    share = np.full(6, np.nan)
    if platform.stroke is not None:
        low, high = platform.stroke.T
        share = (readings - low) / (high - low)
    return Skeleton(platform.base, tips, joint_positions(platform, pose), readings, share)


def outline_order(points: Array) -> NDArray[np.intp]:
    """The order (6,) in which joints (6, 3) lie around their centre: a polygon that
    does not cross itself, whatever the order of the legs.
    """
    offsets = points - points.mean(axis=0)
    first, second = np.linalg.svd(offsets)[2][:2]
    return np.argsort(np.arctan2(offsets @ second, offsets @ first), kind="stable")

"""Points of a hexapod as it is drawn, shared by the figures and the viewer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import GoughError
from gough.kinematics import equivalent_struts, joint_positions, leg_lengths
from gough.limit_rules import legs_in_stroke
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
        share: (6,) position in the stroke, as `stroke_share` gives it.
        outside: (6,) legs outside their stroke.
    """

    base: Array
    tips: Array
    plate: Array
    readings: Array
    share: Array
    outside: NDArray[np.bool_]

    @property
    def unreachable(self) -> NDArray[np.bool_]:
        """(6,) rotary legs whose arm and rod are too short."""
        return ~np.isfinite(self.readings)

    @property
    def points(self) -> Array:
        """(M, 3) all points that are finite."""
        points = np.concatenate([self.base, self.tips, self.plate])
        return points[np.isfinite(points[:, 0])]


def skeleton(platform: Platform, pose: Pose, readings: Array | None = None) -> Skeleton:
    """Points of one pose.

    Args:
        readings: (6,) the readings at the pose, where they are known. The pose alone does not
            give the motor angles of a mode with the arms on their other branch.

    Raises:
        GoughError: a batch of poses, or a pose of NaN.
    """
    if pose.batch:
        raise GoughError(f"pose: expected one pose, found batch axes {pose.batch}; pass pose[i]")
    if not np.all(np.isfinite([*pose.position, *pose.wxyz])):
        raise GoughError("pose: holds NaN, because no pose was found: nothing to draw")
    if readings is None:
        readings = leg_lengths(platform, pose)
    tips = platform.base
    if platform.rotary is not None:
        tips, _ = equivalent_struts(platform, readings)
    return Skeleton(
        platform.base, tips, joint_positions(platform, pose), readings,
        stroke_share(platform, readings), outside_stroke(platform, readings),
    )  # fmt: skip


def stroke_share(platform: Platform, readings: Array) -> Array:
    """Position of readings (..., 6) in their stroke: 0 lowest, 1 highest; NaN without a stroke."""
    if platform.stroke is None:
        return np.full(np.shape(readings), np.nan)
    low, high = platform.stroke.T
    return (readings - low) / (high - low)


def outside_stroke(platform: Platform, readings: Array) -> NDArray[np.bool_]:
    """True for readings (..., 6) beyond their limits; the limits themselves are allowed."""
    return np.isfinite(readings) & ~legs_in_stroke(platform, readings)


def outline_order(points: Array) -> NDArray[np.intp]:
    """Order (6,) of joints (6, 3) around their centre.

    Joined in this order they make a polygon that does not cross itself, whatever the order of
    the legs. It runs counterclockwise seen from above.
    """
    offsets = points - points.mean(axis=0)
    first, second = np.linalg.svd(offsets)[2][:2]
    if np.cross(first, second)[2] < 0:
        second = -second
    return np.argsort(np.arctan2(offsets @ second, offsets @ first), kind="stable")

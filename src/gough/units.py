"""Units of length and angle, and a platform with its lengths in another unit."""

from __future__ import annotations

import math
from dataclasses import replace

from gough.errors import GoughError
from gough.platform import Platform
from gough.pose import Pose

LENGTHS = {
    "m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "micron": 1e-6,
    "in": 0.0254, "inch": 0.0254, "inches": 0.0254, '"': 0.0254, "ft": 0.3048,
}  # fmt: skip  # [m]
ANGLES = dict.fromkeys(("deg", "degree", "degrees", "°"), math.pi / 180) | {"rad": 1.0}  # [rad]


def in_unit(platform: Platform, unit: str) -> Platform:
    """Return the same machine with its lengths in another unit of `LENGTHS`.

    Raises:
        GoughError: the platform's unit is not one of `LENGTHS`.

    Example:
        >>> in_unit(gough.Platform.load("reference"), "m")
        Platform('reference', telescopic legs, size 1.028 [m])
    """
    if platform.unit not in LENGTHS:
        raise GoughError(
            f"unit: cannot convert {platform.unit!r} to {unit}; the platform file must say one of "
            f"{', '.join(LENGTHS)}"
        )
    return scaled(platform, LENGTHS[platform.unit] / LENGTHS[unit], unit)


def scaled(platform: Platform, factor: float, unit: str = "") -> Platform:
    """Return the platform with every length multiplied by `factor`, and the unit's new name."""
    arms, box, stroke = platform.rotary, platform.workspace, platform.stroke
    if arms is not None:
        lengths = factor * arms.arm_length, factor * arms.rod_length
        arms = replace(arms, arm_length=lengths[0], rod_length=lengths[1])
    screw = platform.screw
    if screw is not None:
        screw = replace(screw, lead=factor * screw.lead)
    along = 1.0 if arms is not None else factor  # of readings
    return replace(
        platform,
        base=factor * platform.base,
        moving=factor * platform.moving,
        home=Pose(factor * platform.home.position, platform.home.wxyz),
        pivot=None if platform.pivot is None else factor * platform.pivot,
        unit=unit,
        stroke=None if stroke is None else along * stroke,
        offset=along * platform.offset,
        workspace=None if box is None else replace(box, translation=factor * box.translation),
        rotary=arms,
        screw=screw,
        frames=platform.frames and platform.frames.scaled(factor),
        limits=platform.limits and platform.limits.scaled(factor, rotary=arms is not None),
    )

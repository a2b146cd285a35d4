"""Screws of legs that turn with their two universal joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gough.checks import Array, one_or_six, platform_field
from gough.errors import PlatformError


@dataclass(frozen=True, eq=False, init=False)
class Screws:
    """Screw drives whose rod turns in its nut as the leg is turned by its two universal joints.

    The sensor, which counts turns of the motor, then reads the distance of the joints plus
    lead / 2 pi times the turn of the platform joint about the leg, seen from the base joint; see
    `gough.struts.screw_turns`.

    Attributes:
        lead: (6,) change of length for one turn, positive for right-hand threads, or one number
            for all [platform unit].
        base_axis: (6, 3) the axes of the universal joints that are fixed in the base.
        moving_axis: (6, 3) those fixed in the platform, in platform coordinates. A turn counts
            from where the two axes, seen along the leg, coincide; to reverse one reverses the sign.

    Raises:
        PlatformError: naming the field, what was found and what was expected.
    """

    lead: Array
    base_axis: Array
    moving_axis: Array

    def __init__(self, lead: ArrayLike, base_axis: ArrayLike, moving_axis: ArrayLike) -> None:
        object.__setattr__(self, "lead", one_or_six("screw.lead", lead))
        for name, value in (("base_axis", base_axis), ("moving_axis", moving_axis)):
            axes = platform_field(f"screw.{name}", value, (6, 3))
            lengths = np.linalg.norm(axes, axis=-1)
            if np.any(lengths == 0):
                leg = int(np.argmin(lengths))
                raise PlatformError(f"screw.{name}[{leg}]: expected a direction, found three zeros")
            object.__setattr__(self, name, axes)

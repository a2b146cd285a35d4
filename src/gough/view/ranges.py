"""How far sliders go, in steps of a round number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gough.platform import Platform
from gough.view.model import pose_numbers

STEPS = 5000  # a slider has at least so many
BEYOND_STROKE = 0.25  # of the stroke, so that its end can be crossed
BEYOND_WORKSPACE = 2.0  # times the workspace
LEG_REACH = 0.3  # of a leg's length, where no stroke is stated
MOTOR_REACH = 120.0  # [deg]
SHIFT, TURN = 0.25, 45.0  # of the size, and [deg], where no workspace is stated
LEAST_SHIFT, LEAST_TURN = 0.005, 1.0  # sliders reach so far from home, whatever is stated


@dataclass
class Range:
    """One slider's ends and decimals; grows where a value lies beyond."""

    low: float
    high: float

    @property
    def decimals(self) -> int:
        """Digits after the point, which make for 5000 to 50,000 steps."""
        return max(0, -int(np.floor(np.log10((self.high - self.low) / STEPS))))

    def reach(self, value: float) -> bool:
        """Grow so that `value` is inside; whether that was needed."""
        inside = self.low <= value <= self.high
        if not inside:
            spare = 0.1 * (self.high - self.low)
            self.low = round(min(self.low, value - spare), self.decimals)
            self.high = round(max(self.high, value + spare), self.decimals)
        return not inside


def leg_factor(platform: Platform) -> float:
    """What readings are multiplied by for people: motor angles are told in degrees."""
    return 180 / np.pi if platform.legs == "rotary" else 1.0


def leg_ranges(platform: Platform) -> list[Range]:
    """Sliders of the six legs: the stroke and a little more."""
    home = leg_factor(platform) * platform.home_legs
    if platform.stroke is not None:
        low, high = leg_factor(platform) * platform.stroke.T
        spare = BEYOND_STROKE * (high - low)
        return _ranges(low - spare, high + spare)
    if platform.legs == "rotary":
        return _ranges(home - MOTOR_REACH, home + MOTOR_REACH)
    reach = LEG_REACH * platform.home_lengths
    return _ranges(home - reach, home + reach)


def pose_ranges(platform: Platform) -> list[Range]:
    """Sliders of x, y, z [platform unit] and rx, ry, rz [deg]: the workspace and more."""
    home = pose_numbers(platform.home)
    box = np.array([[-1.0, 1.0]] * 6) * np.repeat([SHIFT * platform.size, TURN], 3)[:, None]
    if platform.workspace is not None:
        box = np.concatenate([platform.workspace.translation, platform.workspace.rotation_deg])
        box = BEYOND_WORKSPACE * box
    least = np.repeat([LEAST_SHIFT * platform.size, LEAST_TURN], 3)
    low, high = np.minimum(box[:, 0], -least), np.maximum(box[:, 1], least)
    return _ranges(home + low, home + high)


def _ranges(low, high) -> list[Range]:
    ranges = [Range(float(a), float(b)) for a, b in zip(low, high, strict=True)]
    for one in ranges:
        decimals = one.decimals
        one.low, one.high = round(one.low, decimals), round(one.high, decimals)
    return ranges

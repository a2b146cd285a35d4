"""Sliders of the panel, and the ranges that a machine gives them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser

from gough.frames import FramePose
from gough.platform import Platform
from gough.pose import pose_values
from gough.text import decimals
from gough.view.beyond import leg_factor

STEPS = 5000  # least number of steps of a slider
BEYOND_STROKE = 0.25  # of the stroke, so that its end can be crossed
BEYOND_WORKSPACE = 2.0  # range of a slider / workspace
LEG_REACH = 0.3  # of a leg's length, without a stroke
MOTOR_REACH = 120.0  # [deg]
TRANSLATION, ROTATION = 0.25, 45.0  # of the size, and [deg], without a workspace
LEAST_TRANSLATION, LEAST_ROTATION = 0.005, 1.0  # the same, whatever is stated


@dataclass
class Range:
    """Ends of one slider, and the stated limits between them; grows to hold a value."""

    low: float
    high: float
    limits: tuple[float, float] | None = None

    @property
    def decimals(self) -> int:
        """Digits after the point, for 5000 to 50,000 steps."""
        return decimals((self.high - self.low) / STEPS, 1)

    def reach(self, value: float) -> bool:
        """Grow to hold `value`; True if that was needed."""
        inside = self.low <= value <= self.high
        if not inside:
            spare = 0.1 * (self.high - self.low)
            self.low = round(min(self.low, value - spare), self.decimals)
            self.high = round(max(self.high, value + spare), self.decimals)
        return not inside


class Slider:
    """One number that can be dragged or typed, with marks at its limits.

    Values from the library are shown rounded. Only what a person sets is posted, so that a
    number which nobody touched keeps all its digits.
    """

    def __init__(
        self, gui: viser.GuiApi, label: str, ends: Range, request: Callable[[float], None]
    ) -> None:
        self._first, self._ends = (ends.low, ends.high), ends
        middle = round((ends.low + ends.high) / 2, ends.decimals)
        limits = (ends.low, ends.high) if ends.limits is None else ends.limits
        self.handle = gui.add_slider(
            label, ends.low, ends.high, 10.0**-ends.decimals, float(middle),
            marks=tuple((value, f"{value:.5g}") for value in limits),
        )  # fmt: skip
        self.handle.precision = ends.decimals

        @self.handle.on_update
        async def _(event: viser.GuiEvent) -> None:
            if event.client_id is not None:  # else `show` has set it
                request(self.handle.value)

    def show(self, value: float) -> None:
        """Set the number, and widen the slider if need be."""
        if self._ends.reach(float(value)):
            self.handle.min, self.handle.max = self._ends.low, self._ends.high
        rounded = round(float(value), self._ends.decimals)
        # a person may have set a value half a step away, which rounding must not change
        if abs(rounded - self.handle.value) > 1e-9 * (self._ends.high - self._ends.low):
            self.handle.value = rounded

    def reset(self) -> None:
        """Set the ends that the slider had at first."""
        if (self._ends.low, self._ends.high) != self._first:
            self._ends.low, self._ends.high = self._first
            self.handle.min, self.handle.max = self._first


def leg_ranges(platform: Platform) -> list[Range]:
    """Ranges of the six leg sliders: the stroke and a little more."""
    home = leg_factor(platform) * platform.home_legs
    if platform.stroke is not None:
        low, high = leg_factor(platform) * platform.stroke.T
        spare = BEYOND_STROKE * (high - low)
        return _ranges(low - spare, high + spare, leg_factor(platform) * platform.stroke)
    if platform.legs == "rotary":
        return _ranges(home - MOTOR_REACH, home + MOTOR_REACH)
    reach = LEG_REACH * platform.home_lengths
    return _ranges(home - reach, home + reach)


def pose_ranges(platform: Platform, view: FramePose | None = None) -> list[Range]:
    """Ranges of x, y, z [platform unit] and rx, ry, rz [deg]: the workspace and more.

    Args:
        view: the frame whose pose they are; its sliders have no limits, since the workspace is a
            box of the platform's poses.
    """
    home = pose_values(platform.home if view is None else view.of(platform.home), "deg")
    reach = np.repeat([TRANSLATION * platform.size, ROTATION], 3)
    box, limits = np.stack([-reach, reach], axis=1), None
    if platform.workspace is not None:
        stated = np.concatenate([platform.workspace.translation, platform.workspace.rotation_deg])
        box = BEYOND_WORKSPACE * stated
        limits = home[:, None] + stated if view is None else None
    least = np.repeat([LEAST_TRANSLATION * platform.size, LEAST_ROTATION], 3)
    low, high = np.minimum(box[:, 0], -least), np.maximum(box[:, 1], least)
    return _ranges(home + low, home + high, limits)


def _ranges(low, high, limits=None) -> list[Range]:
    ranges = [Range(float(a), float(b)) for a, b in zip(low, high, strict=True)]
    for i, one in enumerate(ranges):
        decimals = one.decimals
        one.low, one.high = round(one.low, decimals), round(one.high, decimals)
        if limits is not None:
            one.limits = float(limits[i][0]), float(limits[i][1])
    return ranges

"""The numbers of a machine that a calibration changes, and how sure the drawing is of each.

Row i of the values (6, K) belongs to leg i; its columns are

    base x, y, z and platform x, y, z      the two joints [platform unit]
    offset                                 strut length [platform unit], or motor angle [rad], at
                                           the reading that the drawing's home pose has
    arm length, rod length, tilt x, tilt y rotary legs: lengths, and the rotation vector of the
                                           arm's plane about its own drawn axes [rad]
    gain                                   where fitted: true travel for one unit of reading

Offsets count from the reading at home, not from zero: that keeps them apart from the gains, which
would otherwise act at the end of a lever as long as the leg. A length change is a length here, so
that moving a joint does not move the zero of the sensor.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from gough import quaternion
from gough.calibration.arrays import Array
from gough.errors import PlatformError
from gough.platform import Platform
from gough.platform_checks import refuse_screws
from gough.pose import Pose

JOINTS = ("base x", "base y", "base z", "platform x", "platform y", "platform z")
ROTARY = ("arm length", "rod length", "tilt x", "tilt y")
BASE, MOVING, OFFSET = slice(0, 3), slice(3, 6), 6
ARM, ROD, TILT = 7, 8, slice(9, 11)
GAIN_TOLERANCE = 1e-3  # standard deviation of a gain before any measurement


class Parameters:
    """Layout, drawn values and tolerances of the 6 x K numbers of a machine.

    Attributes:
        drawing: the machine as it was drawn.
        names: (K,) names of the columns.
        drawn: (6, K) values of the drawing.
        tolerance: (6, K) their standard deviations.
        rest: (6,) readings at home, which offsets count from.
    """

    def __init__(self, drawing: Platform, tolerance: float, gains: bool = False) -> None:
        """Lay out the parameters of `drawing`.

        Args:
            tolerance: standard deviation of joints, lengths and zeros [platform unit]; angles of
                rotary legs have it at the end of the arm.
            gains: fit a gain of each leg, too.
        """
        self.drawing, self.gains = drawing, gains
        self.rotary = drawing.rotary is not None
        self.names = (*JOINTS, "offset", *ROTARY * self.rotary, *("gain",) * gains)
        self.rest = drawing.home_legs
        refuse_screws(drawing)
        self.drawn = self.values(drawing)
        self.tolerance = np.full(self.drawn.shape, float(tolerance))
        if drawing.rotary is not None:
            angle = tolerance / drawing.rotary.arm_length
            self.tolerance[:, OFFSET] = angle
            self.tolerance[:, TILT] = angle[:, None]
        if gains:
            self.tolerance[:, -1] = GAIN_TOLERANCE

    @cached_property
    def count(self) -> int:
        """K, the number of parameters of a leg."""
        return len(self.names)

    @cached_property
    def unit_names(self) -> tuple[str, ...]:
        """(K,) unit of each column."""
        unit = self.drawing.unit
        angles = {"tilt x", "tilt y"} | ({"offset"} if self.rotary else set())
        return tuple("rad" if n in angles else "" if n == "gain" else unit for n in self.names)

    def gain(self, values: Array) -> Array:
        """Gains (6,) of the values."""
        return values[:, -1] if self.gains else self.drawing.gain

    def values(self, platform: Platform) -> Array:
        """Values (6, K) of a machine that differs from the drawing in these numbers alone."""
        joints = [platform.base, platform.moving]
        zero = platform.true_at_zero + platform.gain * self.rest
        columns = [*joints, zero[:, None]]
        if platform.rotary is not None:
            arms = platform.rotary
            columns += [arms.arm_length[:, None], arms.rod_length[:, None], self._tilts(platform)]
        return np.concatenate([*columns, *([platform.gain[:, None]] * self.gains)], axis=1)

    def _tilts(self, platform: Platform) -> Array:
        """Rotation vectors (6, 2) from the drawn arm planes to those of `platform`."""
        drawn, arms = self.drawing.rotary, platform.rotary
        assert drawn is not None
        assert arms is not None
        normal = np.cross(arms.axis_x, arms.axis_y)
        x, y = (np.sum(normal * axis, axis=1) for axis in (drawn.axis_x, drawn.axis_y))
        sine = np.hypot(x, y)
        angle = np.arctan2(sine, np.sum(normal * np.cross(drawn.axis_x, drawn.axis_y), axis=1))
        share = np.where(sine > 0, angle / np.where(sine > 0, sine, 1), 1.0)
        return np.stack([-y * share, x * share], axis=1)

    def axes(self, values: Array) -> tuple[Array, Array]:
        """Directions of the motor arms at 0 and at 90 deg, each (6, 3)."""
        arms = self.drawing.rotary
        assert arms is not None
        tilt = values[:, TILT]
        vector = tilt[:, :1] * arms.axis_x + tilt[:, 1:] * arms.axis_y
        turn = quaternion.to_matrix(quaternion.from_rotation_vector(vector))
        rotate = lambda axis: np.einsum("lij,lj->li", turn, axis)  # noqa: E731
        return rotate(arms.axis_x), rotate(arms.axis_y)

    def platform(self, values: Array) -> Platform:
        """The drawing with other values (6, K).

        Home stays where it was drawn unless the readings there are out of stroke now; then it is
        moved to the pose that has the drawn home readings.

        Raises:
            PlatformError: values that make no machine.
        """
        base, moving, zero = values[:, BASE], values[:, MOVING], values[:, OFFSET]
        gain = self.gain(values)
        arms = self.drawing.rotary
        if arms is not None:
            x, y = self.axes(values)
            arms = replace(
                arms, arm_length=values[:, ARM], rod_length=values[:, ROD], axis_x=x, axis_y=y
            )
        made = replace(
            self.drawing, base=base, moving=moving, gain=gain, offset=np.zeros(6), rotary=arms,
            stroke=None,
        )  # fmt: skip
        made = _with_zero(made, zero - gain * self.rest)
        try:
            return replace(made, stroke=self.drawing.stroke)
        except PlatformError:
            made = _with_zero(replace(made, home=_home(made, self.rest)), zero - gain * self.rest)
            return replace(made, stroke=self.drawing.stroke)


def _with_zero(platform: Platform, zero: Array) -> Platform:
    """The machine whose struts have the lengths, or motors the angles, `zero` at reading 0."""
    return replace(platform, offset=platform.offset + zero - platform.true_at_zero)


def _home(platform: Platform, readings: Array) -> Pose:
    """The pose that has the readings (6,)."""
    from gough.fk.solve import solve

    found = solve(platform, readings, seed=platform.home)
    return found.pose if found.usable else platform.home

"""Motor arms of a rotary (6-RSS) hexapod."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gough.checks import Array, frozen, one_or_six, platform_field
from gough.errors import PlatformError

RIGHT_ANGLE = 1e-6  # how far axes may be from unit length and from right angles
EXACT = 4e-15  # within which they are left as they are


@dataclass(frozen=True, eq=False, init=False)
class RotaryArms:
    """Motor arms of a 6-RSS hexapod. Base joint i is the tip of arm i,

        tip_i(q_i) = base_i + arm_length_i (cos q_i axis_x_i + sin q_i axis_y_i),

    and a rod of fixed length joins it to platform joint i.

    Attributes:
        arm_length: (6,) from each motor's axis to its arm's tip, or one for all [platform unit].
        rod_length: (6,) between the two ball joints of each rod, or one for all [platform unit].
        axis_x: (6, 3) unit vectors, where the arm points at angle 0.
        axis_y: (6, 3) unit vectors, where it points at angle +90 deg. Axes that a file states in a
            few digits are made exact, axis_y perpendicular to axis_x.
        branch: (6,) of +1 or -1: which of the two motor angles that reach a pose is meant,
            q = atan2(y, x) + branch * acos(...), with x, y along axis_x, axis_y.

    Raises:
        PlatformError: naming the field, what was found and what was expected.
    """

    arm_length: Array
    rod_length: Array
    axis_x: Array
    axis_y: Array
    branch: Array

    def __init__(
        self,
        arm_length: ArrayLike,
        rod_length: ArrayLike,
        axis_x: ArrayLike,
        axis_y: ArrayLike,
        branch: ArrayLike,
    ) -> None:
        for name, given in (("arm_length", arm_length), ("rod_length", rod_length)):
            value = one_or_six(f"rotary.{name}", given)
            if value.min() <= 0:
                found = value.min()
                raise PlatformError(f"rotary.{name}: expected a length above 0, found {found}")
            object.__setattr__(self, name, value)
        for name, given, shape in (
            ("axis_x", axis_x, (6, 3)), ("axis_y", axis_y, (6, 3)), ("branch", branch, (6,))
        ):  # fmt: skip
            object.__setattr__(self, name, platform_field(f"rotary.{name}", given, shape))
        self._check_axes()
        x, y = _orthonormal(self.axis_x, self.axis_y)
        object.__setattr__(self, "axis_x", frozen(x))
        object.__setattr__(self, "axis_y", frozen(y))

    def _check_axes(self) -> None:
        if any(abs(sign) != 1 for sign in self.branch):
            found = self.branch.tolist()
            raise PlatformError(f"rotary.branch: expected six of 1 or -1, found {found}")
        for i in range(6):
            x, y = self.axis_x[i], self.axis_y[i]
            if max(abs(x @ x - 1), abs(y @ y - 1), abs(x @ y)) > RIGHT_ANGLE:
                raise PlatformError(
                    f"rotary.axis_x[{i}], axis_y[{i}]: expected two unit vectors at right "
                    f"angles, found {x.tolist()} and {y.tolist()}"
                )


def _orthonormal(x: Array, y: Array) -> tuple[Array, Array]:
    """Axes (6, 3) of unit length and at right angles to rounding; those that are stay unchanged."""
    off = [np.sum(x * x, axis=-1) - 1, np.sum(y * y, axis=-1) - 1, np.sum(x * y, axis=-1)]
    inexact = np.abs(off).max(axis=0)[:, None] > EXACT
    unit = x / np.linalg.norm(x, axis=-1, keepdims=True)
    upright = y - np.sum(unit * y, axis=-1, keepdims=True) * unit
    upright /= np.linalg.norm(upright, axis=-1, keepdims=True)
    return np.where(inexact, unit, x), np.where(inexact, upright, y)

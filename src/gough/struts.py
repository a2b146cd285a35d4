"""Struts of a hexapod as arrays: the physics of the three kinds of leg, stated once.

Every kind of leg is a telescopic strut seen differently. With pose (t, R), pivot c, base
joint b_i and platform joint p_i the strut is

    d_i = R (p_i - c) + c + t - b_i,        length |d_i|

(Merlet, Parallel Robots, 2nd ed., sec. 5.1). A telescopic leg reads |d_i|, a leg that reads a
length change |d_i| minus its value at home; a rotary leg has a rod of fixed length whose lower
end the motor arm moves. `gough.kinematics` offers these functions for a `Platform`.
"""

from __future__ import annotations

import numpy as np

from gough.checks import Array
from gough.rotary import RotaryArms


def levers(moving: Array, pivot: Array, rotation: Array) -> Array:
    """Levers R (p_i - c) from the pivot to the platform joints, in base directions (..., 6, 3)."""
    return (moving - pivot) @ np.swapaxes(rotation, -1, -2)


def joints(moving: Array, pivot: Array, position: Array, rotation: Array) -> Array:
    """Platform joints in base coordinates, (..., 6, 3)."""
    return levers(moving, pivot, rotation) + (pivot + position)[..., None, :]


def readings(struts: Array, zero: Array, arms: RotaryArms | None) -> Array:
    """Readings (..., 6) of legs whose strut vectors are `struts` (..., 6, 3).

    Args:
        struts: from base joint to platform joint; for rotary legs from the arm's centre.
        zero: (6,) length at which a leg reads 0: zeros, or the lengths at home.
        arms: the motor arms of rotary legs, whose readings are angles [rad].
    """
    if arms is not None:
        return motor_angles(struts, arms)
    return np.linalg.norm(struts, axis=-1) - zero


def equivalent(
    base: Array, zero: Array, arms: RotaryArms | None, legs: Array
) -> tuple[Array, Array]:
    """Telescopic struts that readings stand for: inverse of `readings`.

    Args:
        base: (6, 3) base joints, or centres of the arms.
        zero: (6,) as in `readings`.
        legs: readings (..., 6).

    Returns:
        Lower ends (..., 6, 3) and lengths (..., 6) of the struts.
    """
    if arms is not None:
        tips = base + arms.arm_length * arm_directions(arms, legs)[0]
        return tips, np.full(legs.shape, arms.rod_length)
    return np.broadcast_to(base, (*legs.shape, 3)), legs + zero


def arm_directions(arms: RotaryArms, angles: Array) -> tuple[Array, Array]:
    """Unit vectors along the motor arms at `angles` [rad], and their derivatives (..., 6, 3)."""
    x, y = arms.axis_x, arms.axis_y
    cos, sin = np.cos(angles)[..., None], np.sin(angles)[..., None]
    return cos * x + sin * y, cos * y - sin * x


def motor_angles(struts: Array, arms: RotaryArms) -> Array:
    """Angles whose arm tips are one rod length from the platform joints, (..., 6) [rad].

    With (x, y) the joint in the arm's plane, h = |(x, y)|, D its distance from the centre:
    |joint - tip|^2 = rod^2 becomes 2 a h cos(q - atan2(y, x)) = D^2 + a^2 - rod^2. NaN where
    arm and rod cannot reach the joint.

    Args:
        struts: (..., 6, 3) from the arms' centres to the platform joints.
    """
    x, y = np.sum(struts * arms.axis_x, axis=-1), np.sum(struts * arms.axis_y, axis=-1)
    reach = 2 * arms.arm_length * np.hypot(x, y)
    wanted = np.sum(struts**2, axis=-1) + arms.arm_length**2 - arms.rod_length**2
    with np.errstate(invalid="ignore", divide="ignore"):
        angle = np.arctan2(y, x) + arms.branch * np.arccos(wanted / reach)
    return np.arctan2(np.sin(angle), np.cos(angle))


def rods_and_rates(struts: Array, arms: RotaryArms | None) -> tuple[Array, Array]:
    """Struts or rods (..., 6, 3), and the divisors (..., 6) that give d reading / d twist.

    A telescopic reading changes by d . dP / |d|. A rotary one keeps |P - tip(q)|, so
    d . (dP - tip'(q) dq) = 0 and dq = d . dP / (d . tip'(q)).
    """
    if arms is None:
        return struts, np.linalg.norm(struts, axis=-1)
    arm, slope = arm_directions(arms, motor_angles(struts, arms))
    rods = struts - arms.arm_length * arm
    return rods, arms.arm_length * np.sum(rods * slope, axis=-1)

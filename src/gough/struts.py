"""Struts of a hexapod as arrays: the physics of the three kinds of leg, stated once.

Every kind of leg is a telescopic strut seen differently. With pose (t, R), pivot c, base
joint b_i and platform joint p_i the strut is

    d_i = R (p_i - c) + c + t - b_i,        length |d_i|

(Merlet, Parallel Robots, 2nd ed., sec. 5.1). A telescopic leg moves |d_i|; so does a leg that
reads a length change, which counts from the length at home h_i; a rotary leg has a rod of fixed
length whose lower end the motor arm moves, at the angle q_i. What the sensor reads is

    |d_i|  or  q_i  =  gain_i reading_i + zero_i,        zero_i = offset_i (+ h_i, length changes)

(for legs whose screws turn with them, |d_i| plus what `screw_lengths` gives)
with the platform's fields `gain` (1 unless stated) and `offset` (0 unless stated). So the offset
is what the leg's ideal reading is where its sensor reads 0, and the gain is by how much that
changes for one unit of the sensor. `gough.kinematics` offers these functions for a `Platform`.
"""

from __future__ import annotations

import numpy as np

from gough.checks import Array
from gough.rotary import RotaryArms
from gough.screws import Screws


def levers(moving: Array, pivot: Array, rotation: Array) -> Array:
    """Levers R (p_i - c) from the pivot to the platform joints, in base directions (..., 6, 3)."""
    return (moving - pivot) @ np.swapaxes(rotation, -1, -2)


def joints(moving: Array, pivot: Array, position: Array, rotation: Array) -> Array:
    """Platform joints in base coordinates, (..., 6, 3)."""
    return levers(moving, pivot, rotation) + (pivot + position)[..., None, :]


def readings(
    struts: Array, zero: Array, gain: Array, arms: RotaryArms | None, turned: Array | float = 0.0
) -> Array:
    """Readings (..., 6) of legs whose strut vectors are `struts` (..., 6, 3).

    Args:
        struts: from base joint to platform joint; for rotary legs from the arm's centre.
        zero: (6,) length [platform unit] or motor angle [rad] at which a leg reads 0.
        gain: (6,) by how much length or angle change for one unit of reading.
        arms: the motor arms of rotary legs; motor angles minus `zero` are within half a turn.
        turned: (..., 6) what screws that turn with their legs add to the lengths.
    """
    if arms is not None:
        angle = motor_angles(struts, arms) - zero
        return np.arctan2(np.sin(angle), np.cos(angle)) / gain
    return (np.linalg.norm(struts, axis=-1) + turned - zero) / gain


def equivalent(
    base: Array, zero: Array, gain: Array, arms: RotaryArms | None, legs: Array
) -> tuple[Array, Array]:
    """Telescopic struts that readings stand for: inverse of `readings`.

    Args:
        base: (6, 3) base joints, or centres of the arms.
        zero, gain: (6,) as in `readings`.
        legs: readings (..., 6).

    Returns:
        Lower ends (..., 6, 3) and lengths (..., 6) of the struts.
    """
    true = gain * legs + zero
    if arms is not None:
        tips = base + arms.arm_length[:, None] * arm_directions(arms, true)[0]
        return tips, np.broadcast_to(arms.rod_length, legs.shape)
    return np.broadcast_to(base, (*legs.shape, 3)), true


def arm_directions(arms: RotaryArms, angles: Array) -> tuple[Array, Array]:
    """Unit vectors along the motor arms at `angles` [rad], and their derivatives (..., 6, 3)."""
    x, y = arms.axis_x, arms.axis_y
    cos, sin = np.cos(angles)[..., None], np.sin(angles)[..., None]
    return cos * x + sin * y, cos * y - sin * x


def motor_angles(struts: Array, arms: RotaryArms) -> Array:
    """Angles whose arm tips are one rod length from the platform joints, (..., 6) [rad].

    They count from `axis_x` and are within three half turns of it.

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
        return np.arctan2(y, x) + arms.branch * np.arccos(wanted / reach)


def rods_and_rates(struts: Array, gain: Array, arms: RotaryArms | None) -> tuple[Array, Array]:
    """Struts or rods (..., 6, 3), and the divisors (..., 6) that give d reading / d twist.

    A telescopic reading changes by d . dP / |d|. A rotary one keeps |P - tip(q)|, so
    d . (dP - tip'(q) dq) = 0 and dq = d . dP / (d . tip'(q)). Either is divided by the gain.
    """
    if arms is None:
        return struts, gain * np.linalg.norm(struts, axis=-1)
    arm, slope = arm_directions(arms, motor_angles(struts, arms))
    rods = struts - arms.arm_length[:, None] * arm
    return rods, gain * arms.arm_length * np.sum(rods * slope, axis=-1)


# ---- screws that turn with their legs -------------------------------------------------


def screw_turns(struts: Array, base_axis: Array, moving_axis: Array, side: Array) -> Array:
    """Turn of each platform joint about its leg, seen from the base joint, (..., 6) [rad].

    A universal joint lets no turn about the leg through, so the leg's lower half is turned by the
    component of the base joint's axis u across the leg n, its upper half by that of the platform
    joint's axis w:

        turn = atan2(n . (u x w), side (u . w - (u . n) (w . n)))

    It is LinuxCNC's correction of strut lengths (genhexkins, A. Kyrychenko), arc sine of the same
    sine, up to 90 deg, and goes on beyond. Screws add lead / 2 pi times the turn to a length.

    Args:
        struts: (..., 6, 3) from base joint to platform joint.
        base_axis, moving_axis: u and w, (..., 6, 3), in base coordinates.
        side: (6,) of +1 or -1, the sign of the cosine at home, where a turn so is within 90 deg.
    """
    n = struts / np.linalg.norm(struts, axis=-1, keepdims=True)
    sine = _dot(n, np.cross(base_axis, moving_axis))
    return np.arctan2(sine, side * _across(n, base_axis, moving_axis))


def screw_sides(struts: Array, base_axis: Array, moving_axis: Array) -> Array:
    """Signs (6,) of the turns' cosines, for `screw_turns`; arguments as there, at home."""
    n = struts / np.linalg.norm(struts, axis=-1, keepdims=True)
    return np.where(_across(n, base_axis, moving_axis) < 0, -1.0, 1.0)


def screw_turn_rates(
    struts: Array, levers: Array, base_axis: Array, moving_axis: Array, side: Array
) -> Array:
    """Derivative of `screw_turns` with respect to the twist (v, w), (..., 6, 6).

    The angle of an axis a about n, seen from a frame that n carries along without turning it
    about itself, changes by n . (a' x (da - (a . n) dn)) / |a'|^2, a' = a - (a . n) n. Here
    du = 0, dw = omega x w, dn = (1 - n n') (v + omega x r) / |d|, with which the turn changes by

        n . omega - (w . n) w' . omega / |w'|^2 + A . (v + omega x r),
        A = ((u . n) n x u' / |u'|^2 - (w . n) n x w' / |w'|^2) / |d|.

    Args:
        levers: r, (..., 6, 3).
        struts, base_axis, moving_axis, side: as in `screw_turns`.
    """
    length = np.linalg.norm(struts, axis=-1, keepdims=True)
    n = struts / length
    parts = []
    for axis in (base_axis, moving_axis):
        along = _dot(axis, n)[..., None]
        across = axis - along * n
        parts.append(along * across / _dot(across, across)[..., None])
    A = np.cross(n, parts[0] - parts[1]) / length
    rows = np.concatenate([A, n - parts[1] + np.cross(levers, A)], axis=-1)
    return side[:, None] * rows


def screw_lengths(screws: Screws | None, side: Array, struts: Array, rotation: Array
                  ) -> Array | float:  # fmt: skip
    """Lengths (..., 6) that screws add to those of the struts; 0.0 without screws."""
    if screws is None:
        return 0.0
    axes = screws.moving_axis @ np.swapaxes(rotation, -1, -2)
    return screws.lead / (2 * np.pi) * screw_turns(struts, screws.base_axis, axes, side)


def _across(n: Array, a: Array, b: Array) -> Array:
    """Product (...) of the components of two vectors across unit vectors n."""
    return _dot(a, b) - _dot(a, n) * _dot(b, n)


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)

"""Velocities, accelerations and forces: what the Jacobian carries between legs and platform.

With J = d readings / d twist (see `gough.jacobian`) and the twist (v, w) of a pose -- velocity of
its position, angular velocity, both in base coordinates --

    leg rates = J (v, w),        wrench = J' leg forces,

the second since both sides have the same power (Merlet, Parallel Robots, 2nd ed., sec. 5.1, 8.1).
A wrench is a force and a moment about the pose's position, both in base coordinates. With
frame="tool in work" poses, twists and wrenches are those of that frame: about the tool's origin, in
coordinates of work (see `gough.frames`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gough import struts
from gough.checks import Array, as_batch
from gough.kinematics import jacobian, platform_pose, singularity_distance, strut_vectors
from gough.platform import Platform
from gough.platform_checks import refuse_screws
from gough.pose import Pose

ROUNDING = 1e-15  # distance to a singularity that rounding alone leaves at one


def leg_rates(platform: Platform, pose: Pose, twist: ArrayLike, frame: str | None = None) -> Array:
    """Rates of the readings, (..., 6), while the platform moves with a twist.

    Args:
        pose: batch axes (...).
        twist: (..., 6) velocity of the pose's position [platform unit / s] and angular velocity
            [rad / s], both in base coordinates.
        frame: whose poses and twists these are, such as "tool in work"; as in `gough.jacobian`.

    Returns:
        [platform unit / s], or [rad / s] for rotary legs; NaN where a motor cannot reach the pose.

    Raises:
        GoughError: a twist of another shape, or an unknown frame.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.leg_rates(platform, platform.home, [0, 0, 10, 0, 0, 0]).round(3)
        array([9.153, 9.153, 9.153, 9.153, 9.153, 9.153])
    """
    return _times(jacobian(platform, pose, frame), as_batch("twist", twist, (6,)))


def twist(platform: Platform, pose: Pose, leg_rates: ArrayLike, frame: str | None = None) -> Array:
    """Twist of the platform, (..., 6), from the rates of its readings: inverse of `leg_rates`.

    Args:
        pose: batch axes (...).
        leg_rates: (..., 6) [platform unit / s], or [rad / s] for rotary legs.
        frame: whose poses and twists these are, such as "tool in work"; as in `gough.jacobian`.

    Returns:
        Velocity of the pose's position [platform unit / s] and angular velocity [rad / s], both in
        base coordinates. NaN at a singular pose, and where a motor cannot reach.

    Raises:
        GoughError: rates of another shape, or an unknown frame.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.twist(platform, platform.home, [10.0] * 6).round(3)[:3] + 0.0
        array([ 0.   ,  0.   , 10.926])
    """
    own, J = platform_pose(platform, pose, frame), jacobian(platform, pose, frame)
    return _solved(platform, own, J, as_batch("leg_rates", leg_rates, (6,)))


def leg_accelerations(
    platform: Platform,
    pose: Pose,
    twist: ArrayLike,
    acceleration: ArrayLike,
    frame: str | None = None,
) -> Array:
    """Second derivatives of the readings, (..., 6).

    The joint P_i moves with u_i = v + w x r_i and u_i' = v' + w' x r_i + w x (w x r_i), r_i its
    lever; deriving the strut's equation twice gives the readings'.

    Args:
        pose: batch axes (...).
        twist: (..., 6), as in `leg_rates`.
        acceleration: (..., 6) derivative of the twist by time: acceleration of the pose's position
            [platform unit / s^2] and angular acceleration [rad / s^2], in base coordinates.
        frame: whose poses and twists these are, such as "tool in work"; as in `gough.jacobian`.

    Returns:
        [platform unit / s^2], or [rad / s^2] for rotary legs; NaN where a motor cannot reach.

    Raises:
        GoughError: a twist or an acceleration of another shape, or an unknown frame.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> still, upward = [0.0] * 6, [0, 0, 10, 0, 0, 0]
        >>> gough.leg_accelerations(platform, platform.home, still, upward).round(3)
        array([9.153, 9.153, 9.153, 9.153, 9.153, 9.153])
    """
    refuse_screws(platform)
    motion = as_batch("twist", twist, (6,))[..., None, :]
    change = as_batch("acceleration", acceleration, (6,))[..., None, :]
    own = platform_pose(platform, pose, frame)
    lever = struts.levers(platform.moving, platform.pivot_point, own.rotation)
    if frame is not None:  # all in base coordinates, the levers from the frame's origin
        view = platform.frame(frame)
        motion, change = view.in_base(motion), view.in_base(change)
        lever = lever - view.lever(own)[..., None, :]
    swept = np.cross(motion[..., 3:], lever)
    velocity = motion[..., :3] + swept
    second = change[..., :3] + np.cross(change[..., 3:], lever) + np.cross(motion[..., 3:], swept)
    vectors, arms = strut_vectors(platform, own), platform.rotary
    rods, divisors = struts.rods_and_rates(vectors, np.ones(6), arms)
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = _dot(rods, velocity) / divisors
        if arms is None:  # l l' = d . u, so l l'' = |u|^2 - l'^2 + d . u'
            found = (_dot(velocity, velocity) - rates**2 + _dot(rods, second)) / divisors
            return found / platform.gain
        # d . (u - tip' q') = 0, so d . tip' q'' = |u - tip' q'|^2 + d . (u' - tip'' q'^2)
        arm, slope = struts.arm_directions(arms, struts.motor_angles(vectors, arms))
        length = arms.arm_length[:, None]
        sliding = velocity - length * slope * rates[..., None]
        inward = length * arm * rates[..., None] ** 2
        return (_dot(sliding, sliding) + _dot(rods, second + inward)) / divisors / platform.gain


def wrench(
    platform: Platform, pose: Pose, leg_forces: ArrayLike, frame: str | None = None
) -> Array:
    """Wrench that the legs exert on the platform, (..., 6).

    Args:
        pose: batch axes (...).
        leg_forces: (..., 6) pushing forces of the actuators, positive where they work to raise the
            reading; torques [force x platform unit] of the motors for rotary legs.
        frame: whose poses and twists these are, such as "tool in work"; as in `gough.jacobian`.

    Returns:
        Force, and moment about the pose's position [force x platform unit], both in base
        coordinates. NaN where a motor cannot reach.

    Raises:
        GoughError: forces of another shape, or an unknown frame.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.wrench(platform, platform.home, [100.0] * 6).round(1)[2]
        np.float64(549.2)
    """
    forces = as_batch("leg_forces", leg_forces, (6,))
    return _times(np.swapaxes(jacobian(platform, pose, frame), -1, -2), forces)


def leg_forces(
    platform: Platform, pose: Pose, wrench: ArrayLike, frame: str | None = None
) -> Array:
    """Actuator forces that exert a wrench on the platform, (..., 6): inverse of `wrench`.

    To hold a load, pass the wrench that balances it: a weight m g at the pose's position is held
    by (0, 0, m g, 0, 0, 0).

    Args:
        pose: batch axes (...).
        wrench: (..., 6) force, and moment about the pose's position [force x platform unit], both
            in base coordinates.
        frame: whose poses and twists these are, such as "tool in work"; as in `gough.jacobian`.

    Returns:
        Pushing forces, or torques [force x platform unit] for rotary legs. NaN at a singular pose,
        where no forces hold every load, and where a motor cannot reach.

    Raises:
        GoughError: a wrench of another shape, or an unknown frame.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.leg_forces(platform, platform.home, [0, 0, 600, 0, 0, 0]).round(1)
        array([109.3, 109.3, 109.3, 109.3, 109.3, 109.3])
    """
    load = as_batch("wrench", wrench, (6,))
    own, J = platform_pose(platform, pose, frame), jacobian(platform, pose, frame)
    return _solved(platform, own, np.swapaxes(J, -1, -2), load)


def _times(matrices: Array, vectors: Array) -> Array:
    with np.errstate(invalid="ignore"):  # infinite rows, where arm and rod align
        return (matrices @ vectors[..., None])[..., 0]


def _solved(platform: Platform, pose: Pose, matrices: Array, right: Array) -> Array:
    """Solutions (..., 6) of systems with J or J'; NaN where J is singular or not finite."""
    known = np.all(np.isfinite(matrices), axis=(-2, -1))
    known &= singularity_distance(platform, pose) > ROUNDING
    regular = np.where(known[..., None, None], matrices, np.eye(6))
    shape = np.broadcast_shapes(known.shape, right.shape[:-1])
    found = np.linalg.solve(regular, np.broadcast_to(right, (*shape, 6))[..., None])[..., 0]
    return np.where(known[..., None], found, np.nan)


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)

"""Angles at joints, gaps between legs and forces of legs: what `MachineLimits` bounds.

Each stands here once, as arrays; `kernel.margins` repeats it compiled and is tested against it,
and `check_home` uses it when a platform is made. docs/machine_limits.md has the derivations.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gough import struts
from gough.checks import Array
from gough.errors import PlatformError
from gough.machine_limits import MachineLimits, Payload
from gough.platform_checks import COINCIDENT, refuse_screws
from gough.pose import Pose

if TYPE_CHECKING:
    from gough.platform import Platform

PAIRS = tuple(combinations(range(6), 2))  # of legs, in the order of all arrays (..., 15)


def joint_angles(platform: Platform, pose: Pose) -> tuple[Array, Array]:
    """Angles of the legs from the axes of their joints, (..., 6) [rad] each.

    The axes are those of `platform.limits`, or else the leg directions at home: of the base joint
    fixed in the base (of a rotary leg: in the arm), of the platform joint fixed in the platform.

    Args:
        pose: batch axes (...).

    Returns:
        Angles at the base joints and at the platform joints; NaN where a motor cannot reach.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> lifted = gough.Pose(platform.home.position + [0, 0, 50])
        >>> gough.joint_angles(platform, lifted)[0].round(4)
        array([0.0287, 0.0287, 0.0287, 0.0287, 0.0287, 0.0287])
    """
    _, rods, frames = leg_bodies(platform, pose)
    base_axes, moving_axes = joint_axes(platform)
    lower = np.einsum("ia,...iax->...ix", base_axes, frames)
    upper = moving_axes @ np.swapaxes(pose.rotation, -1, -2)
    return _angles(lower, rods), _angles(upper, -rods)


def leg_gaps(platform: Platform, pose: Pose) -> Array:
    """Distances between the axes of every two legs, (..., 15) [platform unit].

    The order of the pairs is `gough.limit_geometry.PAIRS`: legs 1 and 2, 1 and 3, ..., 5 and 6.
    The legs are line segments from joint to joint; a rotary leg is its arm and its rod, and the
    gap is the least of the four. Their surfaces are nearer by both `leg_radius`.

    Args:
        pose: batch axes (...).

    Returns:
        NaN where a motor cannot reach; 0 for legs that share a joint.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.leg_gaps(platform, platform.home).min().round(3)
        np.float64(102.606)
    """
    start, rods, _ = leg_bodies(platform, pose)
    bodies = [(start, rods)]
    if platform.rotary is not None:
        bodies.append((platform.base, start - platform.base))
    first, second = np.array(PAIRS).T
    distances = [
        segment_distance(p[..., first, :], u[..., first, :], q[..., second, :], v[..., second, :])
        for p, u in bodies
        for q, v in bodies
    ]
    return np.minimum.reduce(distances)


def payload_forces(platform: Platform, pose: Pose, payload: Payload | None = None) -> Array:
    """Forces of the legs that hold a payload still, (..., 6), positive where they push.

    The legs exert the wrench (-m g, -(R (s - c)) x m g) about the pose's position, s the payload's
    centre and c the pivot. Weight of the legs and friction are left out.

    Args:
        pose: batch axes (...).
        payload: what the platform carries; the one of `platform.limits` unless given.

    Returns:
        [N] if the mass is in kg, whatever the unit of length; torques of motors [N x platform
        unit] for rotary legs. NaN at a singular pose and where a motor cannot reach.

    Raises:
        PlatformError: no payload is given and the platform states none.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> load = gough.Payload(mass=30, centre=(0, 0, 80))
        >>> gough.payload_forces(platform, platform.home, load).round(2)
        array([53.57, 53.57, 53.57, 53.57, 53.57, 53.57])
    """
    if payload is None:
        payload = platform.limits and platform.limits.payload
    if payload is None:
        raise PlatformError(
            "limits.payload: the platform states none; pass payload=gough.Payload(mass, centre)"
        )
    refuse_screws(platform)
    vectors = _strut_vectors(platform, pose)
    rods, rates = struts.rods_and_rates(vectors, np.ones(6), platform.rotary)
    arms = struts.levers(platform.moving, platform.pivot_point, pose.rotation)
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = np.concatenate([rods, np.cross(arms, rods)], axis=-1) / rates[..., None]
    weight = payload.mass * payload.gravity
    lever = (payload.centre - platform.pivot_point) @ np.swapaxes(pose.rotation, -1, -2)
    wrench = np.concatenate(np.broadcast_arrays(-weight, -np.cross(lever, weight)), axis=-1)
    units = np.repeat([1.0, platform.size], 3)  # both sides without unit of length
    matrices = np.swapaxes(rows, -1, -2) / units[:, None]
    regular = np.all(np.isfinite(matrices), axis=(-2, -1))
    regular &= np.linalg.det(np.where(regular[..., None, None], matrices, 0.0)) != 0
    solvable = np.where(regular[..., None, None], matrices, np.eye(6))
    found = np.linalg.solve(solvable, (wrench / units)[..., None])[..., 0]
    return np.where(regular[..., None], found, np.nan)


# ---- parts ----------------------------------------------------------------------------


def leg_bodies(platform: Platform, pose: Pose) -> tuple[Array, Array, Array]:
    """Lower joints (..., 6, 3), vectors from them to the platform joints, frames of the sockets.

    The frame of a lower socket (..., 6, 3, 3) has its directions in its rows: those of the base,
    or of the motor arm that carries it: along the arm, along the tip's motion, along the axis.
    """
    vectors = _strut_vectors(platform, pose)
    arms = platform.rotary
    if arms is None:
        return np.broadcast_to(platform.base, vectors.shape), vectors, np.tile(np.eye(3), (6, 1, 1))
    along, ahead = struts.arm_directions(arms, struts.motor_angles(vectors, arms))
    reach = arms.arm_length[:, None] * along
    frames = np.stack([along, ahead, np.cross(along, ahead)], axis=-2)
    return platform.base + reach, vectors - reach, frames


def joint_axes(platform: Platform) -> tuple[Array, Array]:
    """Unit vectors (6, 3) of the joints' axes: in base (or arm) and in platform coordinates.

    Both point along the leg, away from their joint.
    """
    limits = platform.limits or MachineLimits()
    _, rods, frames = leg_bodies(platform, platform.home)
    base = np.einsum("ix,iax->ia", _axes_or(limits.base_joint_axis, rods), frames)
    return base, _axes_or(limits.moving_joint_axis, -rods @ platform.home.rotation)


def segment_distance(p: Array, u: Array, q: Array, v: Array) -> Array:
    """Distance (...) between the segments p + s u and q + t v, 0 <= s, t <= 1, (..., 3) each.

    The nearest points of two lines, moved into the segments one after the other; no division by
    the sine of their angle decides the result where they are parallel (Ericson, Real-Time
    Collision Detection, sec. 5.1.9).
    """
    between = p - q
    a, e, b = _dot(u, u), _dot(v, v), _dot(u, v)
    c, f = _dot(u, between), _dot(v, between)
    square = a * e - b * b
    s = np.clip((b * f - c * e) / np.where(square > 0, square, np.inf), 0, 1)
    t = np.clip((b * s + f) / np.where(e > 0, e, 1), 0, 1)
    s = np.clip((b * t - c) / np.where(a > 0, a, 1), 0, 1)
    return np.linalg.norm(between + s[..., None] * u - t[..., None] * v, axis=-1)


def shared_joints(platform: Platform) -> NDArray[np.bool_]:
    """Pairs of legs (15,) that have a joint in common, as booleans: their gap is always 0."""
    first, second = np.array(PAIRS).T
    gaps = [np.linalg.norm(p[first] - p[second], axis=-1) for p in (platform.base, platform.moving)]
    return np.min(gaps, axis=0) <= COINCIDENT * platform.size


def _strut_vectors(platform: Platform, pose: Pose) -> Array:
    joints = struts.joints(platform.moving, platform.pivot_point, pose.position, pose.rotation)
    return joints - platform.base


def _axes_or(given: Array | None, directions: Array) -> Array:
    """Unit vectors (6, 3) along the axes given, on the directions' side, or along these."""
    axes = directions if given is None else given * np.sign(_dot(given, directions))[:, None]
    return axes / np.linalg.norm(axes, axis=-1, keepdims=True)


def _angles(a: Array, b: Array) -> Array:
    """Angles (...) [rad] between vectors (..., 3), to full accuracy at 0 and at half a turn."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), _dot(a, b))


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)


# ---- home -----------------------------------------------------------------------------


def check_home(platform: Platform) -> None:
    """Raise PlatformError for the first limit that the home pose itself breaks."""
    limits = platform.limits
    if limits is None:
        return
    home = platform.home
    for name, angles in zip(("base", "moving"), joint_angles(platform, home), strict=True):
        cone, found = getattr(limits, f"{name}_joint_cone"), np.degrees(angles)
        if cone is not None and np.any(found > cone):
            leg = int(np.argmax(found - cone))
            raise PlatformError(
                f"limits.{name}_joint_cone[{leg}]: forbids the home pose: there leg {leg + 1} is "
                f"{found[leg]:.6g} deg from its joint's axis, allowed are {cone[leg]:.6g}; change "
                f"home, {name}_joint_axis or the cone"
            )
    if limits.leg_radius is not None:
        _check_gaps(platform, limits)
    if limits.leg_force is not None:
        forces = payload_forces(platform, home)
        low, high = limits.leg_force.T
        if not np.all((forces >= low) & (forces <= high)):
            leg = int(np.argmin((forces >= low) & (forces <= high)))
            raise PlatformError(
                f"limits.leg_force[{leg}]: forbids the home pose: there leg {leg + 1} pushes with "
                f"{forces[leg]:.6g} under the payload, allowed are {low[leg]:.6g} to "
                f"{high[leg]:.6g}; change the payload or the forces"
            )


def least_gaps(limits: MachineLimits) -> Array:
    """Least distances (15,) of the axes of two legs that their radii and the clearance allow."""
    assert limits.leg_radius is not None
    first, second = np.array(PAIRS).T
    return limits.leg_radius[first] + limits.leg_radius[second] + limits.clearance


def _check_gaps(platform: Platform, limits: MachineLimits) -> None:
    gaps, least = leg_gaps(platform, platform.home), least_gaps(limits)
    apart = ~shared_joints(platform)
    if np.any(apart & (gaps < least)):
        pair = int(np.argmin(np.where(apart, gaps - least, np.inf)))
        a, b = PAIRS[pair]
        raise PlatformError(
            f"limits.leg_radius: forbids the home pose: there the axes of legs {a + 1} and {b + 1} "
            f"are {gaps[pair]:.6g} apart, and their radii with the clearance need "
            f"{least[pair]:.6g}; change leg_radius or clearance"
        )

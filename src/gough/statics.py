"""Stiffness, speeds, dexterity, and the forces of a payload over the whole workspace.

With A = d legs / d twist, legs being lengths or motor angles (so A is `gough.jacobian` without the
sensors' gains), the platform has

    stiffness A' diag(k) A,        speeds |A (v, w)| <= leg speeds,

the first for legs that are springs and carry no load (Gosselin, Stiffness mapping for parallel
manipulators, IEEE Trans. Robotics and Automation 6 (1990), eq. 9), the second a polytope of twists
(Merlet, Parallel Robots, 2nd ed., sec. 5.3). `gough.payload_forces` has the forces of one pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough.checks import Array, as_batch
from gough.errors import GoughError, PlatformError
from gough.kinematics import jacobian, normalised_jacobian
from gough.limit_geometry import payload_forces
from gough.machine_limits import Payload
from gough.platform import Platform
from gough.pose import Pose

ROUNDING = 1e-15  # smallest singular value / largest that rounding alone leaves at a singularity
SAMPLES = 4096  # poses of the workspace from which the search for forces starts, corners first
HALVINGS = 40  # of the search's steps, the first of which is half the box


def stiffness(
    platform: Platform, pose: Pose, leg_stiffness: ArrayLike, frame: str | None = None
) -> Array:
    """Stiffness of the platform from that of its legs, (..., 6, 6).

    It maps a small displacement (translation of the pose's position, rotation vector, both in base
    coordinates) to the wrench that holds it. Joints and plates are rigid, and the legs carry no
    load, whose effect is small where legs are stiff.

    Args:
        pose: batch axes (...).
        leg_stiffness: force per change of length of every leg (a number) or of each (6,) [force /
            platform unit]; of rotary legs torque per motor angle [force x platform unit / rad].
        frame: whose poses and axes, such as "tool in work", as in `gough.jacobian`.

    Returns:
        Blocks [force / platform unit], [force / rad], [force] and [force x platform unit / rad].
        NaN where a motor cannot reach.

    Raises:
        GoughError: stiffness of another shape, or not above 0.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.stiffness(platform, platform.home, 1000.0)[2, 2].round(1)
        np.float64(5026.3)
    """
    springs = _per_leg("leg_stiffness", leg_stiffness)
    A = _leg_jacobian(platform, pose, frame)
    with np.errstate(invalid="ignore"):  # infinite rows, where arm and rod align
        return np.swapaxes(A, -1, -2) @ (springs[:, None] * A)


def softest_stiffness(
    platform: Platform, pose: Pose, leg_stiffness: ArrayLike, frame: str | None = None
) -> Array:
    """Stiffness (...) against forces in the direction in which the platform gives way most.

    A force F at the pose's position, in any direction, moves it by at most F / this, rotation
    included. It is one over the largest eigenvalue of the compliance's translational block.

    Args:
        pose: batch axes (...).
        leg_stiffness: as in `stiffness`.
        frame: whose poses and axes, such as "tool in work", as in `gough.jacobian`.

    Returns:
        [force / platform unit]; 0 at a singular pose, NaN where a motor cannot reach.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.softest_stiffness(platform, platform.home, 1000.0).round(1)
        np.float64(130.7)
    """
    springs = _per_leg("leg_stiffness", leg_stiffness)
    units = np.repeat([1.0, 1 / platform.size], 3)
    A = _leg_jacobian(platform, pose, frame) * units  # all columns in the unit of the first
    inverse, regular, known = _inverse(A)
    moved = inverse[..., :3, :] / np.sqrt(springs)
    largest = np.linalg.svd(moved, compute_uv=False)[..., 0]
    return np.where(known, np.where(regular, 1 / largest**2, 0.0), np.nan)[()]


def axis_speeds(
    platform: Platform,
    pose: Pose,
    leg_speed: ArrayLike | None = None,
    frame: str | None = None,
) -> Array:
    """Largest speed of each axis on its own that the speeds of the legs allow, (..., 6).

    The accelerations of the axes from rest follow from those of the legs in the same way.

    Args:
        pose: batch axes (...).
        leg_speed: largest speed of every leg (a number) or of each (6,) [platform unit / s], of
            motors [rad / s]; that of `platform.limits` unless given.
        frame: whose poses and axes, such as "tool in work", as in `gough.jacobian`.

    Returns:
        Along x, y, z [platform unit / s] and about x, y, z [rad / s] of the base; infinite where
        an axis moves no leg, NaN where a motor cannot reach.

    Raises:
        GoughError: speeds of another shape or not above 0, or none given and none stated.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.axis_speeds(platform, platform.home, 100.0).round(3)
        array([251.195, 266.262, 109.257,   0.74 ,   0.775,   3.194])
    """
    speeds = _leg_speeds(platform, leg_speed)
    with np.errstate(divide="ignore"):
        return np.min(speeds[:, None] / np.abs(_leg_jacobian(platform, pose, frame)), axis=-2)


def top_speeds(
    platform: Platform,
    pose: Pose,
    leg_speed: ArrayLike | None = None,
    frame: str | None = None,
) -> Array:
    """Highest speeds that the platform can take with the legs within their speeds, (..., 2).

    The twists that the legs allow are a polytope, and the speed of the position, as the angular
    speed, is greatest at one of its 64 corners, where every leg runs at full speed.

    Args:
        pose: batch axes (...).
        leg_speed: as in `axis_speeds`.
        frame: whose poses and axes, such as "tool in work", as in `gough.jacobian`.

    Returns:
        Speed of the pose's position in any motion [platform unit / s], angular speed in any motion
        [rad / s]. Infinite at a singular pose, NaN where a motor cannot reach.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.top_speeds(platform, platform.home, 100.0).round(2)
        array([630.24,   3.19])
    """
    corners = np.array(list(product([-1.0, 1.0], repeat=6))) * _leg_speeds(platform, leg_speed)
    inverse, regular, known = _inverse(_leg_jacobian(platform, pose, frame))
    twists = np.einsum("...ij,cj->...ci", inverse, corners)
    parts = twists.reshape(*twists.shape[:-1], 2, 3)
    found = np.max(np.linalg.norm(parts, axis=-1), axis=-2)
    return np.where(known[..., None], np.where(regular[..., None], found, np.inf), np.nan)


def dexterity(platform: Platform, pose: Pose) -> Array:
    """Smallest over largest singular value of the unit-free Jacobian, (...), from 0 to 1.

    One over its condition number: 0 at a singular pose, 1 where leg errors of one size cause
    errors of one size in all directions (Gosselin and Angeles 1991). The matrix is that of
    `gough.singularity_distance`, so neither units nor frames change it.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.dexterity(platform, platform.home).round(4)
        np.float64(0.1504)
    """
    matrices = normalised_jacobian(platform, pose)
    known = np.all(np.isfinite(matrices), axis=(-2, -1))
    values = np.linalg.svd(np.where(known[..., None, None], matrices, 0.0), compute_uv=False)
    with np.errstate(invalid="ignore"):
        return np.where(known, values[..., -1] / values[..., 0], np.nan)[()]


@dataclass(frozen=True, eq=False)
class ForceRange:
    """Lowest and highest force of each leg over the workspace, and where they occur.

    Attributes:
        force: (6, 2) [N] if the mass is in kg, or torques [N x platform unit].
        pose: batch (6, 2), the poses with these forces.
    """

    force: Array
    pose: Pose


def force_range(platform: Platform, payload: Payload | None = None, *, seed: int = 0) -> ForceRange:
    """Find the lowest and the highest force of each leg that holds a payload in the workspace.

    The 64 corners of the box and poses drawn from it are tried; from the best of each leg a pattern
    search along the box's axes goes on until its steps are below 1e-12 of the box. It finds the
    range, but proves nothing; near a singularity forces grow without bound.

    Args:
        payload: what the platform carries; the one of `platform.limits` unless given.
        seed: of the random poses.

    Raises:
        PlatformError: the platform states no workspace, or no payload.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference").with_workspace(50, 10)
        >>> gough.force_range(platform, gough.Payload(30, (0, 0, 80))).force[0].round(1)
        array([-100.2,  185.8])
    """
    space = platform.workspace
    if space is None:
        raise PlatformError(
            f"workspace: platform {platform.name!r} states none, so there is no range of forces; "
            "add a [workspace] table or call with_workspace(translation, rotation_deg)"
        )

    def forces(shares: Array) -> Array:
        """Forces (..., 6) at shares (..., 6) of the box."""
        return payload_forces(platform, space.at(platform.home, shares), payload)

    starts = np.random.default_rng(seed).uniform(size=(SAMPLES, 6))
    starts[:64] = list(product([0.0, 1.0], repeat=6))
    signs = np.array([-1.0, 1.0])
    tried = _or_lowest(forces(starts)[..., None] * signs)  # (SAMPLES, 6, 2)
    best, at = np.max(tried, axis=0), starts[np.argmax(tried, axis=0)]
    step = 0.5
    for _ in range(HALVINGS):
        best, at = _improved(forces, signs, best, at, step)
        step /= 2
    return ForceRange(best * signs + 0.0, space.at(platform.home, at))


def _improved(forces, signs: Array, best: Array, at: Array, step: float) -> tuple[Array, Array]:
    """Better places (6, 2, 6) among the neighbours at this step, as long as there are any."""
    moves = step * np.concatenate([np.eye(6), -np.eye(6)])
    while True:
        near = np.clip(at[..., None, :] + moves, 0, 1)  # (6, 2, 12, 6)
        own = np.moveaxis(np.diagonal(forces(near), axis1=0, axis2=3), -1, 0)  # (6, 2, 12)
        found = _or_lowest(own * signs[:, None])
        pick = np.argmax(found, axis=-1)
        value = np.take_along_axis(found, pick[..., None], axis=-1)[..., 0]
        better = value > best + 1e-15 * np.abs(best)
        if not np.any(better):
            return best, at
        moved = np.take_along_axis(near, pick[..., None, None], axis=-2)[..., 0, :]
        best, at = np.where(better, value, best), np.where(better[..., None], moved, at)


def _or_lowest(values: Array) -> Array:
    """Values, -inf where there is none, so that no search ends there."""
    return np.where(np.isnan(values), -np.inf, values)


def _leg_jacobian(platform: Platform, pose: Pose, frame: str | None) -> Array:
    """Derivatives (..., 6, 6) of lengths or motor angles, whatever the sensors make of them."""
    return jacobian(platform, pose, frame) * platform.gain[:, None]


def _inverse(matrices: Array) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Inverses (..., 6, 6), which of them are regular, and which matrices are finite."""
    known = np.all(np.isfinite(matrices), axis=(-2, -1))
    values = np.linalg.svd(np.where(known[..., None, None], matrices, 0.0), compute_uv=False)
    regular = values[..., -1] > ROUNDING * values[..., 0]
    inverse = np.linalg.inv(np.where(regular[..., None, None], matrices, np.eye(6)))
    return inverse, regular, known


def _per_leg(name: str, value: ArrayLike) -> Array:
    """Six numbers above 0, from one or six."""
    array = as_batch(name, value, ())
    if array.shape not in ((), (6,)) or not np.all(array > 0):
        raise GoughError(f"{name}: expected one number above 0, or six, found {value!r}")
    return np.broadcast_to(array, 6)


def _leg_speeds(platform: Platform, leg_speed: ArrayLike | None) -> Array:
    if leg_speed is None:
        leg_speed = platform.limits and platform.limits.leg_speed
    if leg_speed is None:
        raise GoughError("leg_speed: the platform states none in [limits]; pass leg_speed=...")
    return _per_leg("leg_speed", leg_speed)

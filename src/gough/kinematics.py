"""Leg readings of a pose, their derivative, and how far the pose is from a singularity.

The struts d_i stand in `gough.struts`. A strut's length changes with the twist (v, w) of the pose
-- v the velocity of the pivot, w the angular velocity, both in base coordinates -- as

    d|d_i| = n_i . v + (R (p_i - c) x n_i) . w,        n_i = d_i / |d_i|

(Merlet, Parallel Robots, 2nd ed., sec. 5.1). A rotary leg has a fixed |d_i| and moves b_i.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough import struts
from gough.checks import Array, as_batch
from gough.errors import GoughError
from gough.platform import Platform
from gough.platform_checks import refuse_screws
from gough.pose import Pose, as_pose
from gough.tables import Table, as_readings

SINGULAR = 1e-3  # distance to singularity below which a pose is called close to one


def joint_positions(platform: Platform, pose: Pose) -> Array:
    """Platform joints in base coordinates (..., 6, 3) [platform unit]."""
    return struts.joints(platform.moving, platform.pivot_point, pose.position, pose.rotation)


def strut_vectors(platform: Platform, pose: Pose) -> Array:
    """Vectors from base joint to platform joint, (..., 6, 3) [platform unit].

    For rotary legs the base joint is the arm's centre here, not its tip.
    """
    return joint_positions(platform, pose) - platform.base


def leg_lengths(platform: Platform, pose: Pose | Table, frame: str | None = None) -> Array:
    """Inverse kinematics: readings of the six legs, (..., 6).

    Args:
        pose: batch axes (...), or a table of N poses (see `Pose.from_frame`).
        frame: whose poses these are, such as "tool in work" (see `Platform.frame`); those of the
            platform unless given.

    Returns:
        Lengths [platform unit], lengths minus those at home [platform unit], or motor angles
        [rad], by the platform's kind of leg, as sensors with its `gain` and `offset` read them.
        NaN where a motor's arm and rod cannot reach, and where a row of a table holds no pose.

    Raises:
        GoughError: neither poses nor a table, a table with other columns, or an unknown frame.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("rubin_simulink")
        >>> gough.leg_lengths(platform, platform.home).shape
        (6,)
    """
    with np.errstate(over="ignore", invalid="ignore"):  # poses out of reach, and far beyond it
        own = platform_pose(platform, as_pose(pose), frame)
        vectors, zero, gain = strut_vectors(platform, own), platform.true_at_zero, platform.gain
        turned = screw_lengths(platform, own)
        return struts.readings(vectors, zero, gain, platform.rotary, turned)


def screw_lengths(platform: Platform, pose: Pose) -> Array | float:
    """What screws that turn with their legs add to the lengths, (..., 6) [platform unit].

    0.0 for a platform without such screws; see `gough.struts.screw_turns`.
    """
    vectors, side = strut_vectors(platform, pose), platform.screw_side
    return struts.screw_lengths(platform.screw, side, vectors, pose.rotation)


def platform_pose(platform: Platform, pose: Pose, frame: str | None) -> Pose:
    """Poses (...) of the platform, from those of a frame such as "tool in work" if one is named.

    Raises:
        GoughError: an unknown frame.
    """
    return pose if frame is None else platform.frame(frame).platform_pose(pose)


def equivalent_struts(platform: Platform, legs: ArrayLike | Table) -> tuple[Array, Array]:
    """Telescopic struts that readings stand for: their lower ends and lengths.

    Args:
        legs: readings (..., 6).

    Raises:
        PlatformError: the screws of the legs turn with them, so that readings alone give no length.

    Returns:
        Base joints (..., 6, 3) and strut lengths (..., 6) [platform unit].
    """
    refuse_screws(platform)
    zero, gain = platform.true_at_zero, platform.gain
    return struts.equivalent(platform.base, zero, gain, platform.rotary, as_readings(legs))


def jacobian(platform: Platform, pose: Pose, frame: str | None = None) -> Array:
    """Jacobian d readings / d twist, (..., 6, 6).

    The twist is (velocity of the pose's position, angular velocity), both in base
    coordinates. Units: 1 and [platform unit / rad], or [rad / platform unit] and 1 for rotary
    legs, whose rows are NaN where the motor cannot reach and infinite where arm and rod align.

    Source: Merlet, Parallel Robots, 2nd ed., sec. 5.1.

    Args:
        pose: batch axes (...).
        frame: whose poses and twists these are, such as "tool in work" (see `Platform.frame`):
            the velocity is then that of the moving frame's origin, in coordinates of the frame at
            rest. Those of the platform unless given.

    Raises:
        GoughError: an unknown frame.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.jacobian(platform, platform.sample_poses(5)).shape
        (5, 6, 6)
    """
    own = platform_pose(platform, pose, frame)
    rods, rates = struts.rods_and_rates(
        strut_vectors(platform, own), platform.gain, platform.rotary
    )
    levers = _levers(platform, own)
    turn = np.eye(3)
    if frame is not None:
        view = platform.frame(frame)
        turn = view.before.rotation  # of all vectors to coordinates of the frame at rest
        levers = (levers - view.lever(own)[..., None, :]) @ turn.T
        rods = rods @ turn.T
    rows = np.concatenate([rods, np.cross(levers, rods)], axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rows /= rates[..., None]
    screw = platform.screw
    if screw is not None:
        axes = screw.moving_axis @ np.swapaxes(own.rotation, -1, -2) @ turn.T
        base_axes, side = screw.base_axis @ turn.T, platform.screw_side
        turns = struts.screw_turn_rates(rods, levers, base_axes, axes, side)
        rows += (screw.lead / (2 * np.pi * platform.gain))[:, None] * turns
    return rows


def singularity_distance(platform: Platform, pose: Pose) -> Array:
    """Distance to the nearest singularity, (...), a number without unit: 0 is singular.

    The smallest singular value of the 6x6 matrix with rows (n_i, m_i), n_i the unit vector
    along strut i and m_i = r_i x n_i / L its moment about the centre of the platform joints;
    L is their root mean square distance from that centre. By Eckart and Young it is the
    distance, in the spectral norm, to the nearest singular matrix; neither the unit of length
    nor the choice of frames, pivot or tool point changes it. A leg error e moves the joints by
    up to about e / value.
    """
    rows, known = _finite_rows(normalised_jacobian(platform, pose))
    smallest = np.linalg.svd(rows, compute_uv=False)[..., -1]
    return np.where(known, smallest, np.nan)[()]


def assembly_sign(platform: Platform, pose: Pose) -> Array:
    """Sign of det(Jacobian) times that at home, (...): -1 means a singularity lies between.

    NaN where the pose is, or where a motor cannot reach it; 0 everywhere if home is singular.
    """
    rows, known = _finite_rows(normalised_jacobian(platform, pose))
    return np.where(known, np.linalg.slogdet(rows)[0] * home_sign(platform), np.nan)[()]


@lru_cache(maxsize=256)
def home_sign(platform: Platform) -> float:
    """Sign of det(Jacobian) at home, 0.0 where home is singular.

    It counts as singular where its `singularity_distance` is below SINGULAR: then the determinant
    is zero, or changes its sign so near that it cannot tell assembly modes apart.
    """
    rows, _ = _finite_rows(normalised_jacobian(platform, platform.home))
    distance = np.linalg.svd(rows, compute_uv=False)[-1]
    return float(np.linalg.slogdet(rows)[0]) if distance >= SINGULAR else 0.0


def normalised_jacobian(platform: Platform, pose: Pose) -> Array:
    """Jacobian with rows (n_i, m_i), without units, (..., 6, 6); see `singularity_distance`."""
    rods, _ = struts.rods_and_rates(strut_vectors(platform, pose), platform.gain, platform.rotary)
    directions = rods / np.linalg.norm(rods, axis=-1, keepdims=True)
    levers = _levers(platform, pose)
    levers = levers - levers.mean(axis=-2, keepdims=True)
    return np.concatenate([directions, np.cross(levers, directions) / joint_radius(platform)], -1)


def _finite_rows(matrices: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Matrices (..., 6, 6), zero where one held NaN, and a mask (...) of those without NaN."""
    known = np.all(np.isfinite(matrices), axis=(-2, -1))
    return np.where(known[..., None, None], matrices, 0.0), known


def joint_radius(platform: Platform) -> float:
    """Root mean square distance of the platform joints from their centre [platform unit]."""
    offsets = platform.moving - platform.moving.mean(axis=0)
    return float(np.sqrt(np.mean(np.sum(offsets**2, axis=-1))))


def pose_covariance(
    platform: Platform, pose: Pose, leg_noise: ArrayLike, frame: str | None = None
) -> Array:
    """Covariance of the pose that noise of the leg readings causes, (..., 6, 6).

    To first order, C_pose = J^-1 C_legs J^-T, in the twist coordinates of `jacobian`:
    position [platform unit], then rotation vector in base coordinates [rad].

    Args:
        leg_noise: standard deviation of every reading (a number) or of each (6,), or the
            covariance (6, 6) of the readings.
        frame: whose poses these are, and whose covariance is returned; as in `jacobian`.

    Returns:
        (..., 6, 6); NaN where the pose is singular.

    Raises:
        GoughError: noise of another shape, negative or not finite, or an unknown frame.
    """
    covariance = _leg_covariance(leg_noise)
    J = jacobian(platform, pose, frame)
    rows, known = _finite_rows(J)
    regular = (known & (np.linalg.det(rows) != 0))[..., None, None]
    inverse = np.linalg.inv(np.where(regular, J, np.eye(6)))
    return np.where(regular, inverse @ covariance @ np.swapaxes(inverse, -1, -2), np.nan)


def _leg_covariance(leg_noise: ArrayLike) -> Array:
    """Covariance (6, 6) of the readings from any of the ways to state their noise."""
    noise = as_batch("leg_noise", leg_noise, ())
    if noise.shape not in ((), (6,), (6, 6)):
        raise GoughError(f"leg_noise: expected a number, (6,) or (6, 6), got {noise.shape}")
    if noise.ndim < 2:
        if not np.all((noise >= 0) & (noise < np.inf)):
            raise GoughError(f"leg_noise: expected standard deviations of 0 or more, found {noise}")
        return np.diag(np.broadcast_to(noise, 6) ** 2)
    slack = 1e-9 * np.max(np.abs(noise))
    if (
        not np.all(np.isfinite(noise))
        or np.any(np.abs(noise - noise.T) > slack)
        or np.linalg.eigvalsh(noise)[0] < -slack
    ):
        raise GoughError(
            "leg_noise: expected a covariance: finite, symmetric, no negative eigenvalue; "
            f"found {noise.tolist()}"
        )
    return noise


def _levers(platform: Platform, pose: Pose) -> Array:
    """Levers from the pivot to the platform joints, in base directions (..., 6, 3)."""
    return struts.levers(platform.moving, platform.pivot_point, pose.rotation)

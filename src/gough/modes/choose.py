"""The mode a machine is in: filters that its pose must pass, and a ranking."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough import quaternion
from gough.checks import Array, as_batch
from gough.errors import GoughError
from gough.kinematics import home_sign, joint_positions, leg_lengths
from gough.limit_rules import in_stroke
from gough.modes.result import AssemblyModes
from gough.platform import Platform
from gough.pose import Pose

LIMITS = ("stroke", "workspace")
BRANCH_SLACK = 1e-6  # [rad] readings of a pose that agree with the given ones


@dataclass(frozen=True, eq=False)
class Choice:
    """Assembly modes filtered and ranked.

    Attributes:
        passes: for each filter that applied, the poses (M,) that pass it.
        rank: (M,) 0 for the best pose of its set of readings, then 1, 2, ...: poses that pass
            more filters first, then those nearer to `near`, or to home.
        count: (...) how many poses of each set pass every filter.
    """

    passes: dict[str, NDArray[np.bool_]]
    rank: NDArray[np.int64]
    count: NDArray[np.int64]

    @property
    def passed(self) -> NDArray[np.bool_]:
        """(M,) poses that pass every filter."""
        everything = [np.ones(len(self.rank), dtype=bool), *self.passes.values()]
        return np.logical_and.reduce(everything)

    @property
    def ambiguous(self) -> NDArray[np.bool_]:
        """(...) more than one pose passes every filter, so readings alone cannot decide."""
        return self.count > 1

    @property
    def best(self) -> NDArray[np.int64]:
        """Indices of the poses of rank 0, one for each set of readings that has a pose."""
        return np.flatnonzero(self.rank == 0)


def choose_mode(
    modes: AssemblyModes,
    *,
    near: Pose | None = None,
    max_shift: float = np.inf,
    max_turn: float = np.inf,
    up: ArrayLike | None = None,
    orientation: ArrayLike | None = None,
    hint_error: float = 0.0,
    max_swing: float = np.inf,
) -> Choice:
    """Filter and rank assembly modes by what a machine can do and what sensors measure.

    Always applied: "side" (the platform joints' centre lies on home's side of the base plate;
    mirror images do not), "sign" (the sign of det J is home's, so no singularity had to be
    crossed; left out where home itself is singular), "stroke" and "workspace" where the platform
    states them, "branch" for rotary legs (the motors reach the pose on their own branch at these
    angles).

    Args:
        near: the last known pose (of `modes.frame`, as `up` and `orientation`), () or one for each
            set of readings (...): "near" passes poses
            within max_shift [platform unit] and max_turn [rad] of it, and the ranking goes by
            distance to it.
        up: (3,) or (..., 3), the vertical of the base as an inclinometer on the platform measures
            it, in platform coordinates: "up" passes poses for which R times it is within
            hint_error of the base's z axis.
        orientation: (4,) or (..., 4) quaternion wxyz of an IMU: "orientation" passes poses that
            are rotated by at most hint_error from it.
        hint_error: largest error of `up` and `orientation` [rad].
        max_swing: "swing" passes poses whose struts are rotated by at most this [rad] from
            their direction at home, at base and at platform joints.

    Raises:
        GoughError: a hint without its error, or hints that are neither one nor one for each set.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> modes = gough.assembly_modes(platform, platform.home_legs)
        >>> choice = gough.choose_mode(modes)
        >>> choice.count, modes.pose[choice.best].position[0].round(6)
        (array(1), array([  0.,   0., 600.]))
    """
    if (up is not None or orientation is not None) and not hint_error > 0:
        raise GoughError("hint_error: expected the sensor's error in rad, above 0, beside a hint")
    platform, pose = modes.platform, modes.platform_pose
    passes = {"side": same_side(platform, pose)}
    if home_sign(platform):
        passes["sign"] = modes.sign > 0
    if platform.stroke is not None:
        passes["stroke"] = in_stroke(platform, modes.readings)
    if platform.workspace is not None:
        passes["workspace"] = platform.in_workspace(pose)
    if platform.rotary is not None:
        passes["branch"] = _on_branch(platform, pose, modes.readings)
    if max_swing < np.inf:
        passes["swing"] = swing(platform, pose) <= max_swing
    if near is None:
        translation, rotation = pose.distance(platform.home)
    else:
        translation, rotation = modes.pose.distance(_for_poses("near", near, modes))
    if near is not None:
        passes["near"] = (translation <= max_shift) & (rotation <= max_turn)
    if up is not None:
        vertical = _per_pose("up", as_batch("up", up, (3,)), modes)
        vertical = vertical / np.linalg.norm(vertical, axis=-1, keepdims=True)
        x, y, z = (modes.pose.rotation @ vertical[..., None])[..., 0].T
        passes["up"] = np.arctan2(np.hypot(x, y), z) <= hint_error
    if orientation is not None:
        hint = Pose(np.zeros(3), as_batch("orientation", orientation, (4,)))
        hint = _for_poses("orientation", hint, modes)
        passes["orientation"] = modes.pose.distance(hint)[1] <= hint_error
    return _ranked(modes, passes, translation / platform.size + rotation)


def ambiguous(modes: AssemblyModes, outside: ArrayLike = False) -> NDArray[np.bool_]:
    """True (...) where more than one pose could be the machine's.

    Those are the poses that pass the filters of `choose_mode`, but for the stroke, which all poses
    of the same readings keep or break alike.

    Args:
        outside: (...) True where the pose that is believed to be the machine's is outside the
            workspace, so that another one may be, too.
    """
    passes = choose_mode(modes).passes
    fits = np.logical_and.reduce([p for name, p in passes.items() if name not in LIMITS])
    batch = modes.legs.shape[:-1]
    anywhere = np.broadcast_to(outside, batch).ravel()[modes.row]
    fits &= anywhere | passes.get("workspace", True)
    return (np.bincount(modes.row[fits], minlength=math.prod(batch)) > 1).reshape(batch)


def same_side(platform: Platform, pose: Pose) -> NDArray[np.bool_]:
    """True where the platform joints' centre is on home's side of the base joints' plane."""
    centre = platform.base.mean(axis=0)
    normal = np.linalg.svd(platform.base - centre)[2][2]
    height = (joint_positions(platform, pose).mean(axis=-2) - centre) @ normal
    home = (joint_positions(platform, platform.home).mean(axis=-2) - centre) @ normal
    return height * home > 0


def swing(platform: Platform, pose: Pose) -> Array:
    """Largest angle of a strut from its direction at home, in base or platform axes, (M,) [rad].

    Ball and universal joints at both ends limit it.
    """
    base = platform.base
    if platform.rotary is not None:
        raise GoughError("max_swing: for rotary legs the directions of the rods depend on the arms")
    home = joint_positions(platform, platform.home) - base
    now = joint_positions(platform, pose) - base
    home, now = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (home, now))
    carried = home @ quaternion.to_matrix(platform.home.wxyz)  # in platform axes
    seen = now @ pose.rotation
    angles = [_angle(now, home), _angle(seen, carried)]
    return np.maximum(*angles).max(axis=-1)


def _angle(a: Array, b: Array) -> Array:
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))


def _on_branch(platform: Platform, pose: Pose, readings: Array) -> NDArray[np.bool_]:
    """True where the motors' own branch of the inverse kinematics gives the readings back."""
    gap = platform.gain * (leg_lengths(platform, pose) - readings)
    wrapped = np.abs(np.arctan2(np.sin(gap), np.cos(gap)))
    return np.all(wrapped < BRANCH_SLACK, axis=-1)


def _per_pose(name: str, values: Array, modes: AssemblyModes) -> Array:
    """A hint (k,) or (..., k) repeated for each of the M poses, (M, k)."""
    size = values.shape[-1:]
    try:
        values = np.broadcast_to(values, (*modes.legs.shape[:-1], *size))
    except ValueError:
        raise GoughError(
            f"{name}: expected one, or one for each set of readings {modes.legs.shape[:-1]}; "
            f"found {values.shape[:-1]}"
        ) from None
    return values.reshape(-1, *size)[modes.row]


def _for_poses(name: str, pose: Pose, modes: AssemblyModes) -> Pose:
    """A pose, or one for each set of readings, repeated for each of the M poses."""
    parts = (_per_pose(name, part, modes) for part in (pose.position, pose.wxyz))
    return Pose.trusted(*parts)


def _ranked(modes: AssemblyModes, passes: dict, distance: Array) -> Choice:
    row = modes.row
    failed = sum((~p for p in passes.values()), np.zeros(len(row), dtype=np.int64))
    order = np.lexsort((distance, failed, row))
    rank = np.empty(len(row), dtype=np.int64)
    first = np.searchsorted(row, row)  # rows are in order
    rank[order] = np.arange(len(row)) - first[order]
    batch = modes.legs.shape[:-1]
    count = np.bincount(row[failed == 0], minlength=math.prod(batch)).reshape(batch)
    return Choice(passes, rank, count)

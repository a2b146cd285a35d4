"""Distances of a pose from every limit of its machine, and how far each axis can still move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import GoughError, suggestion
from gough.kernel.limit_constants import KINDS, LABELS, NAMES, NO_PART, STATED, limit_constants
from gough.kernel.margins import SLOTS, margin_rows
from gough.kernel.reach import reach_rows
from gough.kernel.threads import in_parts
from gough.kinematics import platform_pose
from gough.platform import Platform
from gough.pose import Pose, as_pose
from gough.tables import Table

STEPS = 1000  # in which `reach` crosses the workspace's box along one of its axes
TEXTS = np.array([*LABELS, ""])  # of parts; the last is that of no part
AXES = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class Limits:
    """Margins of poses to the limits of their machine, each that of its worst leg, pair or axis.

    Attributes:
        names: the K limits that the machine has, out of "stroke", "arm", "base joint", "platform
            joint", "clearance", "leg force", "workspace" and "singularity".
        margin: (..., K) how far the pose is inside each limit, negative beyond it; see `limits`
            for the units.
        share: (..., K) the same as a share that can be compared between limits: 0 at the limit,
            negative beyond it, 1 in the middle of a range, on a joint's axis, or as at home.
        part: (..., K) uint8, which leg, pair or axis is meant: an index of
            `gough.margins.TEXTS`.
        broken: (...) uint8, bit i for a limit of leg i, bits 6 and 7 for workspace, singularity.
    """

    names: tuple[str, ...]
    margin: Array
    share: Array
    part: NDArray[np.uint8]
    broken: NDArray[np.uint8]

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Poses (...) within all limits, up to the slack of `gough.limit_rules`."""
        return (self.broken == 0) & ~np.isnan(self.tightest)

    @property
    def legs(self) -> NDArray[np.bool_]:
        """Legs (..., 6) that break one of their limits."""
        return (self.broken[..., None] >> np.arange(6, dtype=np.uint8)) % 2 == 1

    @property
    def tightest(self) -> Array:
        """Share (...) of the limit that is nearest; NaN where there is no pose."""
        least = np.fmin.reduce(self.share, axis=-1, initial=np.inf)  # passes over single NaN
        no_pose = np.all(np.isnan(self.share), axis=-1) & (len(self.names) > 0)
        return np.where(no_pose, np.nan, least)[()]

    @property
    def tightest_part(self) -> NDArray[np.uint8]:
        """Index (...) in `gough.margins.TEXTS` of the limit that is nearest."""
        nearest = self.share == np.expand_dims(self.tightest, -1)
        part = np.min(np.where(nearest, self.part, NO_PART), axis=-1, initial=NO_PART)
        return np.where(part == NO_PART, len(LABELS), part).astype(np.uint8)

    @property
    def limit(self) -> Any:
        """Name (...) of the limit that is nearest, such as "legs 2 and 3: clearance"."""
        texts = TEXTS[self.tightest_part]
        return texts if texts.ndim else str(texts)

    def of(self, name: str) -> Array:
        """Return the margins (...) of the limit with this name.

        Raises:
            GoughError: the machine has no such limit; the text lists those it has.
        """
        if name not in self.names:
            near = suggestion(name, self.names)
            raise GoughError(f"no limit {name!r}{near} this machine has {', '.join(self.names)}")
        return self.margin[..., self.names.index(name)]

    def __getitem__(self, index: Any) -> Limits:
        if not self.broken.ndim:
            raise IndexError("the limits of a single pose have no rows")
        rows = (*index, ...) if isinstance(index, tuple) else (index, ...)
        return Limits(
            self.names, self.margin[(*rows, slice(None))], self.share[(*rows, slice(None))],
            self.part[(*rows, slice(None))], self.broken[index],
        )  # fmt: skip

    def __repr__(self) -> str:
        if self.broken.ndim:
            return f"Limits(batch {self.broken.shape}; {np.sum(self.ok):,} within all)"
        return f"Limits({self.limit}, {float(self.tightest):.3g} left)"


def limits(
    platform: Platform,
    pose: Pose | Table,
    *,
    workers: int | None = None,
    frame: str | None = None,
) -> Limits:
    """Calculate how far poses are from every limit of their machine.

    Their margins, and where their share is 1:

    - stroke: the reading's distance from the nearer end [platform unit], [rad]; in the middle
    - arm: by how much the rod is clear of being too short or too long for its arm [platform
      unit]; at one arm length
    - base joint, platform joint: cone minus angle from the joint's axis [rad]; on the axis
    - clearance: gap of two legs minus radii and `clearance` [platform unit]; as at home
    - leg force: its distance from the nearer end of `leg_force`; in the middle
    - workspace: distance from the nearest face of the box [platform unit], [rad]; in the middle
    - singularity: determinant of the unit-free Jacobian, with home's sign; as at home

    A machine has the limits that its file states, `arm` if it has motor arms, and `singularity`
    unless home is singular.

    Args:
        pose: batch axes (...), or a table of N poses (see `Pose.from_frame`).
        workers: threads; as many as there are cores unless given.
        frame: whose poses these are, such as "tool in work" (see `Platform.frame`); those of the
            platform unless given.

    Returns:
        NaN throughout for poses of NaN. Where a motor cannot reach, only `arm` and `workspace`
        have a margin.

    Raises:
        GoughError: neither poses nor a table, a table with other columns, or an unknown frame.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("rubin_camera")
        >>> lifted = gough.Pose(platform.home.position + [0, 0, 0.008], platform.home.wxyz)
        >>> found = gough.limits(platform, lifted)
        >>> found
        Limits(z: workspace, 0.389 left)
        >>> found.of("stroke").round(4)
        np.float64(0.0076)
    """
    poses = platform_pose(platform, as_pose(pose), frame)
    constants = limit_constants(platform)
    kinds = np.flatnonzero(constants[STATED : STATED + KINDS])
    position, wxyz = flat_rows(poses)
    out = new_rows(len(position), len(kinds))

    def part_rows(first: int, last: int) -> int:
        return margin_rows(constants, kinds, position, wxyz, first, last, new_work(), out)

    in_parts(part_rows, len(position), workers)
    margin, share, part, broken = out
    shape = (*poses.batch, len(kinds))
    return Limits(
        tuple(NAMES[kind] for kind in kinds), margin.reshape(shape), share.reshape(shape),
        part.reshape(shape), broken.reshape(poses.batch),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Reach:
    """Distances that poses can still move along and about the axes of the base.

    Attributes:
        distance: (..., 6, 2) along x, y, z [platform unit] and about x, y, z [rad], first towards
            lower then towards higher values; 0 where the pose itself breaks a limit, NaN where
            there is no pose.
        part: (..., 6, 2) uint8, the limit that ends it: an index of `gough.margins.TEXTS`.
    """

    distance: Array
    part: NDArray[np.uint8]

    @property
    def limit(self) -> Any:
        """Names (..., 6, 2) of the limits, such as "leg 3: stroke"; "" where none was met."""
        return part_text(self.part)

    def __repr__(self) -> str:
        if self.distance.ndim > 2:
            return f"Reach(batch {self.distance.shape[:-2]})"
        rows = zip(AXES, self.distance, self.limit, strict=True)
        lines = [
            f"  {axis} -{low:.4g} ({first or 'no limit'}) +{high:.4g} ({second or 'no limit'})"
            for axis, (low, high), (first, second) in rows
        ]
        return "\n".join(["Reach(", *lines, ")"])


def reach(
    platform: Platform,
    pose: Pose | Table,
    *,
    workers: int | None = None,
    frame: str | None = None,
) -> Reach:
    """Calculate how far each axis of a pose can still move, both ways, and which limit ends it.

    One axis moves at a time: the position along x, y or z of the base, or the rotation about one
    of these directions through the pose's position. With a frame such as "tool in work" it is the
    tool that moves, along and about the axes of the work piece. The limits are those of `limits`;
    the workspace stays the box of the platform's poses.

    Poses are tried in steps of a thousandth of the workspace's box along the axis (for rotations
    of its widest angle; without a workspace, of the platform's size and of half a turn), up to
    the width of the box (the size, half a turn); the first step that breaks a limit is bisected.
    So every distance returned is that of a pose within all limits, and so are all steps on the
    way; what could be missed is a limit that is broken for less than one step in between.

    Args:
        pose: batch axes (...), or a table of N poses (see `Pose.from_frame`).
        workers: threads; as many as there are cores unless given.
        frame: whose poses and axes, such as "tool in work" (see `Platform.frame`); those of the
            platform in the base unless given.

    Raises:
        GoughError: neither poses nor a table, a table with other columns, or an unknown frame.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("rubin_camera")
        >>> found = gough.reach(platform, platform.home)
        >>> found.distance[2].round(4), found.limit[2].tolist()
        (array([0.0131, 0.0131]), ['z: workspace', 'z: workspace'])
    """
    poses = platform_pose(platform, as_pose(pose), frame)
    constants = limit_constants(platform)
    position, wxyz = flat_rows(poses)
    axes, point = np.eye(3), np.zeros(3)
    if frame is not None:
        view = platform.frame(frame)
        axes, point = view.before.rotation.copy(), view.after.position - view.pivot
    count = len(position)
    out = np.empty((count, 6, 2)), np.empty((count, 6, 2), np.uint8)
    spans = _spans(platform, axes)

    def part(first: int, last: int) -> int:
        return reach_rows(
            constants, position, wxyz, first, last, spans, axes, point, new_work(), out
        )

    in_parts(part, count, workers, chunk=4, serial=1)
    return Reach(out[0].reshape(*poses.batch, 6, 2), out[1].reshape(*poses.batch, 6, 2))


def part_text(part: NDArray[np.uint8]) -> Any:
    """Names of parts (...), "" for none."""
    return TEXTS[np.where(part == NO_PART, len(LABELS), part)]


def flat_rows(pose: Pose) -> tuple[Array, Array]:
    """Positions (N, 3) and quaternions (N, 4) of poses, of one type for compiled code."""
    return (
        np.require(pose.position.reshape(-1, 3), requirements=["C", "W"]),
        np.require(pose.wxyz.reshape(-1, 4), requirements=["C", "W"]),
    )


def new_rows(count: int, kinds: int) -> tuple[Array, Array, NDArray[np.uint8], NDArray[np.uint8]]:
    """Arrays for the results of `margin_rows`."""
    margin, share = np.empty((count, kinds)), np.empty((count, kinds))
    return margin, share, np.empty((count, kinds), np.uint8), np.empty(count, np.uint8)


def new_work() -> tuple[Array, ...]:
    """Arrays that `margin_rows` works in."""
    return np.zeros(SLOTS), np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(6), np.zeros(6)


def _spans(platform: Platform, axes: Array) -> Array:
    """Step and longest way (6, 2) of each axis that `reach` tries [platform unit], [rad].

    Args:
        axes: (3, 3) directions of the axes in base coordinates, one a row.
    """
    width = np.repeat([platform.size, np.pi], 3)
    longest = width.copy()
    if platform.workspace is not None:
        space = platform.workspace
        width[:3] = longest[:3] = np.abs(axes) @ np.ptp(space.translation, axis=1)
        angles = np.radians(np.ptp(space.rotation_deg, axis=1))
        width[3:] = max(np.max(angles), 1e-3)
        longest[3:] = min(np.sum(angles), np.pi)  # no two rotations of the box are farther apart
    return np.stack([np.maximum(width, 1e-9) / STEPS, longest], axis=-1)

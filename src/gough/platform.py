"""A hexapod as data: twelve joints, a home pose, the kind of leg, limits and a unit."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough import limit_geometry, limit_rules, platform_checks, struts
from gough.checks import Array, frozen, one_or_six, platform_field
from gough.errors import PlatformError
from gough.frames import FramePose, Frames, frame_pose, one_pose
from gough.machine_limits import MachineLimits
from gough.platform_checks import LegKind
from gough.pose import Pose
from gough.rotary import RotaryArms
from gough.screws import Screws
from gough.text import page, vector
from gough.workspace import Workspace


@dataclass(frozen=True, eq=False, init=False)
class Platform:
    """Gough-Stewart platform: leg i runs from base joint i to platform joint i.

    Where a pose (t, R) puts the platform joint p:  R (p - c) + c + t, with pivot c (zero
    unless given): the rotation is about the pivot, and t is how far the pivot has moved.

    Attributes:
        base: (6, 3) base joints in base coordinates [platform unit]; for rotary legs the
            centres of the motors' arms.
        moving: (6, 3) platform joints in platform coordinates [platform unit].
        home: the pose at rest; a position (3,) stands for no rotation.
        unit: name of the length unit; a label, nothing is ever converted by it.
        name: what the platform is called in messages.
        legs: "telescopic" (readings are leg lengths), "length_change" (readings are lengths
            minus those at home) or "rotary" (readings are motor angles [rad]).
        stroke: (6, 2) lowest and highest reading of each leg, or one pair for all.
        offset: (6,) what the ideal reading of each leg is where its sensor reads 0
            [platform unit], or [rad] for rotary legs; one number for all; zero unless given.
        gain: (6,) by how much the ideal reading changes for one unit of the sensor's; one number
            for all; 1 unless given. See `gough.struts` for both; `gough.calibrate` finds them.
        pivot: (3,) point of the platform, in its own coordinates, that poses rotate about.
        workspace: the poses the machine is meant for.
        rotary: the motor arms, for rotary legs only.
        screw: the screws of legs that turn with their joints, which changes their readings.
        frames: named frames, such as a tool on the platform and a work piece beside the base.
        limits: what joints, legs and motors allow; see `gough.limits`.

    Raises:
        PlatformError: naming the field, what was found and what was expected.

    Example:
        >>> import numpy as np, gough
        >>> turn = np.radians([-15, 15, 105, 135, 225, 255])
        >>> base = 500 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
        >>> moving = np.roll(base * 0.6 @ np.diag([-1.0, -1.0, 1.0]), 3, axis=0)
        >>> platform = gough.Platform(base, moving, home=(0, 0, 600), unit="mm")
        >>> platform
        Platform('unnamed', telescopic legs, size 1000 [mm])
    """

    base: Array
    moving: Array
    home: Pose
    unit: str
    name: str
    legs: LegKind
    stroke: Array | None
    pivot: Array | None
    workspace: Workspace | None
    rotary: RotaryArms | None
    screw: Screws | None
    offset: Array
    gain: Array
    frames: Frames | None
    limits: MachineLimits | None

    def __init__(
        self,
        base: ArrayLike,
        moving: ArrayLike,
        home: Pose | ArrayLike = (0.0, 0.0, 0.0),
        *,
        unit: str = "",
        name: str = "unnamed",
        legs: LegKind = "telescopic",
        stroke: ArrayLike | None = None,
        pivot: ArrayLike | None = None,
        workspace: Workspace | None = None,
        rotary: RotaryArms | None = None,
        screw: Screws | None = None,
        offset: ArrayLike = 0.0,
        gain: ArrayLike = 1.0,
        frames: Frames | None = None,
        limits: MachineLimits | None = None,
    ) -> None:
        platform_checks.check_text(unit=unit, name=name)
        platform_checks.check_parts(legs, workspace, rotary, screw, frames, limits)
        fields = {
            "base": platform_checks.joints("base", base),
            "moving": platform_checks.joints("moving", moving),
            "home": one_pose("home", home),
            "unit": unit,
            "name": name,
            "legs": legs,
            "pivot": None if pivot is None else platform_field("pivot", pivot, (3,)),
            "workspace": workspace,
            "rotary": rotary,
            "screw": screw,
            "offset": one_or_six("offset", offset),
            "gain": platform_checks.nonzero("gain", one_or_six("gain", gain)),
            "frames": frames,
            "limits": limits,
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)
        at_home = self._moving_at_home()
        platform_checks.check_near_origin(
            self.size, base=self.base, moving=self.moving, pivot=self.pivot_point,
            home=self.home.position,
        )  # fmt: skip
        platform_checks.check_joints(self.base, self.moving, at_home, self.size, rotary is None)
        ends = platform_checks.stroke_limits(stroke, legs, self.home_legs)
        object.__setattr__(self, "stroke", ends)
        limit_geometry.check_home(self)

    # ---- files ------------------------------------------------------------------------

    @staticmethod
    def load(name_or_path: str | Path) -> Platform:
        """Load a catalog machine by name, or a platform from the path of a .toml file.

        Raises:
            PlatformError: no such name or file, or a field that is missing or wrong.
        """
        from gough.platform_file import load

        return load(name_or_path)

    @staticmethod
    def catalog() -> list[str]:
        """Names of the machines that come with the package."""
        from gough.platform_file import catalog_names

        return catalog_names()

    def to_toml(self) -> str:
        """Return this platform as TOML text, from which `load` makes an equal platform."""
        from gough.platform_file import to_toml

        return to_toml(self)

    def save(self, path: str | Path) -> None:
        """Write `to_toml()` to a file, which appears whole or not at all."""
        from gough.platform_file import save

        save(self, path)

    # ---- derived ----------------------------------------------------------------------

    @cached_property
    def pivot_point(self) -> Array:
        """The pivot, zero where none is given, (3,)."""
        return frozen(np.zeros(3)) if self.pivot is None else self.pivot

    @cached_property
    def home_lengths(self) -> Array:
        """Distance between the two joints of each leg at home, (6,) [platform unit]."""
        return frozen(np.linalg.norm(self._home_struts(), axis=-1))

    @cached_property
    def true_at_zero(self) -> Array:
        """Strut length [platform unit] or motor angle [rad] of a leg that reads 0, (6,)."""
        if self.legs != "length_change":
            return self.offset
        return frozen(self.home_lengths + self._turned_at_home() + self.offset)

    @cached_property
    def home_legs(self) -> Array:
        """Readings at home (6,); zeros for length changes without offset."""
        zero, gain = self.true_at_zero, self.gain
        turned = self._turned_at_home()
        return frozen(struts.readings(self._home_struts(), zero, gain, self.rotary, turned))

    @cached_property
    def screw_side(self) -> Array:
        """Signs (6,) by which the turns of the legs' screws at home are within 90 deg."""
        if self.screw is None:
            return frozen(np.ones(6))
        axes = self.screw.moving_axis @ self.home.rotation.T
        return frozen(struts.screw_sides(self._home_struts(), self.screw.base_axis, axes))

    @cached_property
    def size(self) -> float:
        """The largest distance between two joints at home, which tolerances are relative to."""
        points = np.vstack([self.base, self._moving_at_home()])
        return float(max(np.linalg.norm(a - b) for a, b in combinations(points, 2)))

    @cached_property
    def digest(self) -> str:
        """SHA-256 over all that affects kinematics, seeds and statuses (not name and limits)."""
        facts = self.to_dict()
        facts.pop("name")
        facts.pop("limits", None)
        return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()

    def to_dict(self) -> dict:
        """Return the tables of the TOML file as plain lists, numbers and text."""
        out: dict = {"name": self.name, "unit": self.unit, "legs": self.legs}
        out |= {"base": self.base.tolist(), "moving": self.moving.tolist()}
        for key in ("pivot", "stroke"):
            if getattr(self, key) is not None:
                out[key] = getattr(self, key).tolist()
        for key, usual in (("offset", 0.0), ("gain", 1.0)):
            if np.any(getattr(self, key) != usual):
                out[key] = getattr(self, key).tolist()
        out["home"] = _pose_dict(self.home)
        for key in ("workspace", "rotary", "screw"):
            part = getattr(self, key)
            if part is not None:
                out[key] = {k: _plain(k, v) for k, v in vars(part).items()}
        if self.frames is not None:
            out["frames"] = {name: _pose_dict(pose) for name, pose in self.frames.poses.items()}
        if self.limits is not None:
            out["limits"] = self.limits.to_dict()
        return out

    def with_workspace(self, translation: ArrayLike, rotation_deg: ArrayLike) -> Platform:
        """Copy with another workspace; arguments as `Workspace.about_home`."""
        return replace(self, workspace=Workspace.about_home(translation, rotation_deg))

    def with_origin_at(self, point: ArrayLike) -> Platform:
        """Copy whose poses give the position of `point` (3,) of the platform [platform unit].

        The point may be a tool tip, a mirror's vertex or a camera. Positions are that point's, in
        base coordinates, and rotations are about it. A stated workspace becomes the box of the
        point's positions that holds all poses of it, and some more (`Workspace.seen_at`); frames
        (`with_frames`) keep the workspace as it is.
        """
        p = platform_field("point", point, (3,))
        if self.pivot is not None:
            raise PlatformError("pivot: a platform has a pivot or a moved origin, not both")
        if self.frames is not None:
            raise PlatformError("frames: state the point as a frame, such as tool_in_platform")
        home = Pose(self.home.apply(p), self.home.wxyz)
        limits = self.limits and self.limits.with_origin_at(p)
        space = self.workspace and self.workspace.seen_at(self.home, p)
        return replace(self, moving=self.moving - p, home=home, limits=limits, workspace=space)

    # ---- frames -----------------------------------------------------------------------

    def with_frames(self, poses: Mapping[str, Pose | ArrayLike]) -> Platform:
        """Copy with further named frames; see `gough.Frames`.

        Args:
            poses: the pose of frame A in frame B by the name "A_in_B"; a position (3,) stands for
                no rotation. A name that is there already is replaced.

        Raises:
            PlatformError: a name of another form, or frames that do not hang together.
        """
        known = {} if self.frames is None else self.frames.poses
        return replace(self, frames=Frames({**known, **poses}))

    def frame(self, name: str) -> FramePose:
        """Poses of a frame that moves with the platform in one that rests with the base.

        Args:
            name: such as "tool in work". Without frames of your own, tool is the platform, and
                world and work are the base.

        Raises:
            GoughError: no such frames, or two that the legs do not move against each other.

        Example:
            >>> machine = gough.Platform.load("reference").with_frames(
            ...     {"tool_in_platform": [0, 0, 120], "work_in_world": [0, 0, 600]}
            ... )
            >>> machine.frame("tool in work").of(machine.home).position - machine.home.position
            array([   0.,    0., -480.])
        """
        return frame_pose(self.frames or Frames({}), self.pivot_point, name)

    # ---- workspace --------------------------------------------------------------------

    def sample_poses(self, count: int, seed: int = 0) -> Pose:
        """Draw poses evenly from the workspace's box, batch (count,), from a fixed seed.

        Raises:
            PlatformError: the platform states no workspace.
        """
        return self._workspace().sample(self.home, count, seed)

    def _workspace(self) -> Workspace:
        if self.workspace is None:
            raise PlatformError(
                f"workspace: platform {self.name!r} states none; add a [workspace] table or call "
                "with_workspace(translation, rotation_deg)"
            )
        return self.workspace

    def in_workspace(self, pose: Pose) -> NDArray[np.bool_]:
        """Return which poses (...) are in the workspace; True where none is stated.

        The box is widened by 1e-9 of the platform's size, so that poses on its faces count
        as inside in spite of rounding (see `gough.limit_rules`).
        """
        return limit_rules.in_workspace(self, pose)

    def _moving_at_home(self) -> Array:
        home = self.home
        return struts.joints(self.moving, self.pivot_point, home.position, home.rotation)

    def _home_struts(self) -> Array:
        return self._moving_at_home() - self.base

    def _turned_at_home(self) -> Array | float:
        """Lengths (6,) that the screws add at home."""
        rotation = self.home.rotation
        return struts.screw_lengths(self.screw, self.screw_side, self._home_struts(), rotation)

    # ---- identity ---------------------------------------------------------------------

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Platform):
            return NotImplemented
        return self is other or (self.digest == other.digest and self._label() == other._label())

    def _label(self) -> tuple[str, dict | None]:
        """Facts that are not in the digest: the name, and the limits as plain lists."""
        return self.name, self.limits and self.limits.to_dict()

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        unit = self.unit or "unit not named"
        return f"Platform({self.name!r}, {self.legs} legs, size {self.size:.4g} [{unit}])"

    def _repr_html_(self) -> str:
        unit = self.unit or "unit not named"
        reading = "rad" if self.legs == "rotary" else unit
        heads = ["leg", f"base joint [{unit}]", f"platform joint [{unit}]", f"home [{reading}]"]
        columns = [map(vector, self.base), map(vector, self.moving), map(vector, self.home_legs)]
        stroke = [] if self.stroke is None else [f"stroke [{reading}]"]
        limits = [] if self.stroke is None else [[vector(pair, " to ") for pair in self.stroke]]
        rows = zip("123456", *columns, *limits, strict=True)
        return page(repr(self), heads + stroke, rows, self._notes())

    def _notes(self) -> list[str]:
        """Home, pivot and workspace, a sentence each."""
        unit = self.unit or "unit not named"
        angles = vector(np.degrees(self.home.euler))
        notes = [f"home: {vector(self.home.position)} [{unit}], rotated by {angles} [deg]"]
        if self.pivot is not None:
            notes.append(f"pivot: {vector(self.pivot)} [{unit}]")
        if self.workspace is not None:
            axes = ("x", "y", "z", "rx", "ry", "rz")
            sides = [*self.workspace.translation, *self.workspace.rotation_deg]
            ranges = zip(axes, sides, [unit] * 3 + ["deg"] * 3, strict=True)
            listed = "; ".join(f"{axis} {vector(side, ' to ')} [{u}]" for axis, side, u in ranges)
            notes.append(f"workspace from home: {listed}")
        return notes


def _pose_dict(pose: Pose) -> dict[str, list]:
    return {"position": pose.position.tolist(), "wxyz": pose.wxyz.tolist()}


def _plain(key: str, value: Array) -> list | float:
    """An array as lists; a length that six legs share as one number."""
    if key in ("arm_length", "rod_length", "lead") and np.all(value == value[0]):
        return float(value[0])
    return value.tolist()


def as_platform(platform: Platform | str | Path) -> Platform:
    """Return a platform as it is, or load the one of a catalog name or of a .toml file's path.

    Raises:
        PlatformError: something else, or no such platform.
    """
    if isinstance(platform, (str, Path)):
        return Platform.load(platform)
    if not isinstance(platform, Platform):
        raise PlatformError(
            "platform: expected a Platform, a name in the catalog or the path of a .toml file, "
            f"found {type(platform).__name__}"
        )
    return platform

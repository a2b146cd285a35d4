"""Frames: the pose of one named frame in another, from the pose of the platform.

The pose of frame A in frame B maps coordinates in A to coordinates in B. Frames that move hang on
the platform, frames at rest hang on the base, and the legs are between the two:

    T(moving frame in frame at rest) = A H B,
    A = T(base in frame at rest),  B = T(moving frame in platform),
    H = T(platform in base):  p -> R (p - c) + c + t,

with the pose (t, R) and pivot c of `Platform`. So a pivot only changes how H is written, and
`Platform.with_origin_at(p)` has the poses of a frame in base whose B is the translation by p.

Let r be the vector from the pivot to the moving frame's origin, in base coordinates, and W the
rotation of A. A twist (v, w) of the platform's pose then is the twist (W (v + w x r), W w) of the
frame's, by which velocities and covariances are carried over (Lynch and Park, Modern Robotics,
2017, sec. 3.3, with the velocity of each frame's own origin).
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gough.checks import Array, platform_field
from gough.errors import GoughError, PlatformError, suggestion
from gough.pose import Pose

USUAL = (("base", "world"), ("tool", "platform"), ("work", "world"))  # equal where not stated
NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*(_(?!in_)[A-Za-z0-9]+)*")
KEY = re.compile(rf"({NAME.pattern})_in_({NAME.pattern})")


@dataclass(frozen=True, eq=False, init=False)
class Frames:
    """Named frames of a machine beside its base and its platform.

    Attributes:
        poses: the pose of frame A in frame B by the name "A_in_B". base_in_world,
            tool_in_platform and work_in_world are the identity unless stated.
        moving: poses in the platform of the frames that move with it, by name.
        at_rest: poses in the base of the frames that rest with it, by name.

    Raises:
        PlatformError: a name of another form, or frames that do not hang together.

    Example:
        >>> import gough
        >>> frames = gough.Frames({"tool_in_platform": gough.Pose([0, 0, 0.12])})
        >>> list(frames.moving), list(frames.at_rest)
        (['platform', 'tool'], ['base', 'world', 'work'])
    """

    poses: dict[str, Pose]
    moving: dict[str, Pose]
    at_rest: dict[str, Pose]

    def __init__(self, poses: Mapping[str, Pose | ArrayLike]) -> None:
        stated = {key: one_pose(f"frames.{key}", pose) for key, pose in poses.items()}
        edges = [(*_names(key), pose) for key, pose in stated.items()]
        placed = {a for a, _, _ in edges}
        usual = [name for name in USUAL if name[0] not in placed]
        edges = [(a, b, Pose.identity()) for a, b in usual] + edges
        moving, at_rest = _tree("platform", edges), _tree("base", edges)
        for a, b, _ in edges:
            if a not in moving and a not in at_rest:
                raise PlatformError(
                    f"frames.{a}_in_{b}: {b} hangs on neither base nor platform; frames are "
                    f"{', '.join([*at_rest, *moving])}"
                )
            if a in moving and a in at_rest:
                raise PlatformError(
                    f"frames.{a}_in_{b}: {a} hangs on both base and platform, which only the legs "
                    "may join"
                )
        for field, value in (("poses", stated), ("moving", moving), ("at_rest", at_rest)):
            object.__setattr__(self, field, value)

    def scaled(self, factor: float) -> Frames:
        """Return the same frames with lengths in a unit of which `factor` are one of now."""
        return Frames({k: Pose(factor * p.position, p.wxyz) for k, p in self.poses.items()})


@dataclass(frozen=True, eq=False)
class FramePose:
    """Poses of a frame that moves with the platform in a frame at rest; see `Platform.frame`.

    Attributes:
        pivot: (3,) of the platform [platform unit].
        before: pose of the base in the frame at rest.
        after: pose of the moving frame in the platform.
        name: such as "tool in work".
    """

    pivot: Array
    before: Pose
    after: Pose
    name: str

    @property
    def digest(self) -> str:
        """SHA-256 of where the two frames are."""
        ends = [part.tolist() for p in (self.before, self.after) for part in (p.position, p.wxyz)]
        return hashlib.sha256(json.dumps(ends).encode()).hexdigest()

    def of(self, pose: Pose) -> Pose:
        """Poses (...) of the frame, from those of the platform."""
        return self.before @ about_origin(pose, self.pivot) @ self.after

    def platform_pose(self, pose: Pose) -> Pose:
        """Poses (...) of the platform, from those of the frame: inverse of `of`."""
        return about_origin(self.before.inverse() @ pose @ self.after.inverse(), -self.pivot)

    def lever(self, pose: Pose) -> Array:
        """Vectors (..., 3) from the pivot to the moving frame's origin, in base coordinates.

        Args:
            pose: poses (...) of the platform.
        """
        return pose.rotation @ (self.after.position - self.pivot)

    def in_base(self, vectors: Array) -> Array:
        """Pairs of vectors (..., 6) in base coordinates, from those of the frame at rest."""
        pairs = vectors.reshape(*vectors.shape[:-1], 2, 3) @ self.before.rotation
        return pairs.reshape(vectors.shape)

    def twist_matrix(self, pose: Pose) -> Array:
        """Matrices (..., 6, 6) from twists of the platform's poses to twists of the frame's.

        Twists are (velocity of the pose's position, angular velocity), the platform's in base
        coordinates, the frame's in coordinates of the frame at rest. A covariance C of the
        platform's pose is M C M' for the frame's.

        Args:
            pose: poses (...) of the platform.
        """
        lever = self.lever(pose)
        rotation = self.before.rotation
        out = np.zeros((*pose.batch, 6, 6))
        out[..., :3, :3] = out[..., 3:, 3:] = rotation
        out[..., :3, 3:] = rotation @ -np.cross(lever[..., None, :], np.eye(3)).swapaxes(-1, -2)
        return out


def about_origin(pose: Pose, pivot: Array) -> Pose:
    """Poses (...) of the same motions as about `pivot` (3,), written about the origin: t + c - R c.

    With -pivot it is the inverse.
    """
    return Pose.trusted(pose.position + pivot - pose.rotation @ pivot, pose.wxyz)


def frame_pose(frames: Frames, pivot: Array, name: str) -> FramePose:
    """Poses of the frame that a name such as "tool in work" states; see `Platform.frame`.

    Raises:
        GoughError: no such frames, or two that the legs do not move against each other.
    """
    moving, _, at_rest = name.partition(" in ")
    for frame, known, kind in (
        (moving, frames.moving, "move with the platform"),
        (at_rest, frames.at_rest, "rest with the base"),
    ):
        if frame not in known:
            raise GoughError(
                f"frame: expected a name such as 'tool in work', found {name!r}"
                f"{suggestion(frame, known)} frames that {kind} are {', '.join(known)}"
            )
    before, after = frames.at_rest[at_rest].inverse(), frames.moving[moving]
    return FramePose(pivot, before, after, name)


def one_pose(name: str, value: Pose | ArrayLike) -> Pose:
    """Return a pose, or a position (3,) without rotation, as one pose of read-only arrays.

    Args:
        name: the field of the platform, for the message.

    Raises:
        PlatformError: several poses, or numbers that are none of a pose.
    """
    pose = value if isinstance(value, Pose) else Pose(platform_field(name, value, (3,)))
    if pose.batch:
        raise PlatformError(f"{name}: expected one pose, found batch axes {pose.batch}")
    return Pose(
        platform_field(f"{name}.position", pose.position, (3,)),
        platform_field(f"{name}.wxyz", pose.wxyz, (4,)),
    )


def _names(key: str) -> tuple[str, str]:
    found = KEY.fullmatch(key)
    if not found:
        raise PlatformError(
            f"frames.{key}: expected a name such as tool_in_platform: a frame, _in_, and the "
            "frame that its pose is given in"
        )
    return found[1], found[3]


def _tree(root: str, edges: list[tuple[str, str, Pose]]) -> dict[str, Pose]:
    """Poses in `root` of all frames that hang together with it."""
    found, left = {root: Pose.identity()}, list(edges)
    while True:
        rest = []
        for a, b, pose in left:
            if a in found and b in found:
                raise PlatformError(f"frames.{a}_in_{b}: follows from the other frames already")
            if b in found:
                found[a] = found[b] @ pose
            elif a in found:
                found[b] = found[a] @ pose.inverse()
            else:
                rest.append((a, b, pose))
        if len(rest) == len(left):
            return found
        left = rest

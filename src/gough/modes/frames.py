"""Normalised leg equations: one scale and one pair of frames for all hexapods, and complex poses.

Lengths are divided by the root mean square distance of the joints from their centres, base
and platform joints are counted from those centres, and both frames are rotated by fixed
rotations in no special position, so that the symmetric poses of symmetric machines meet no
zero pivots. With joint = R (p - c) + c + t for pivot c, the pose (t, R) becomes

    R' = U R V^T,      t' = U (R (m - c) + c + t - o) / scale

where m and o are the centres of platform and base joints.

A normalised pose is seven numbers, position t and quaternion e, real or complex. Dots are without
conjugation: R(e) = Q(e) / (e.e) has R R^T = 1, and R is real where e is, up to a factor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gough import quaternion
from gough.checks import LARGEST, Array
from gough.kernel.paths import Complex
from gough.platform import Platform
from gough.pose import Pose

# Two rotations in no special position: any others would do.
_U = np.array([0.52, 0.37, -0.61, 0.47])
_V = np.array([-0.41, 0.66, 0.35, 0.52])
_U, _V = _U / np.linalg.norm(_U), _V / np.linalg.norm(_V)
_RU, _RV = quaternion.to_matrix(_U), quaternion.to_matrix(_V)
# a row (w, x, y, z) of the platform's times this matrix is the product U wxyz conj(V)
_TURN = quaternion.product(quaternion.product(_U, np.eye(4)), quaternion.conjugate(_V))
FLAT = 1e-12  # joints within this share of their spread from a plane lie in it


@dataclass(frozen=True, eq=False)
class Frames:
    """Change from the coordinates of a platform to normalised ones and back.

    Attributes:
        scale: one normalised unit of length [platform unit].
        base_centre, moving_centre: (3,) origins [platform unit].
        pivot: (3,) the platform's pivot [platform unit].
        moving: (6, 3) normalised platform joints.
        mirror: matrices (3, 3) and (4, 4) if base and platform joints are planar, with unit
            normals n and m: (t, e) and its mirror image (t - 2 (n.t) n, n e m), a quaternion
            product, have the same legs, and are rows times these matrices.
    """

    scale: float
    base_centre: Array
    moving_centre: Array
    pivot: Array
    moving: Array
    mirror: tuple[Array, Array] | None

    @classmethod
    def of(cls, platform: Platform) -> Frames:
        """Frames of a platform, from the joints alone."""
        base, moving = platform.base, platform.moving
        base_centre, moving_centre = base.mean(axis=0), moving.mean(axis=0)
        offsets = np.vstack([base - base_centre, moving - moving_centre])
        scale = float(np.sqrt(np.mean(np.sum(offsets**2, axis=1))))
        n, m = _normal(base), _normal(moving)
        mirror = None
        if platform.rotary is None and n is not None and m is not None:
            n, m = np.append(0.0, _RU @ n), np.append(0.0, _RV @ m)
            flip = quaternion.product(quaternion.product(n, np.eye(4)), m)
            mirror = np.eye(3) - 2 * np.outer(n[1:], n[1:]), flip
        rotated = (moving - moving_centre) @ _RV.T / scale
        return cls(scale, base_centre, moving_centre, platform.pivot_point, rotated, mirror)

    def base(self, base: Array) -> Array:
        """Normalised base joints (..., 6, 3)."""
        return (base - self.base_centre) @ _RU.T / self.scale

    def squares(self, lengths: Array) -> Array:
        """Normalised squared lengths (..., 6)."""
        return (lengths / self.scale) ** 2

    def denormalise(self, poses: Array) -> Pose:
        """The platform's poses that normalised real ones (..., 7) stand for."""
        wxyz = poses[..., 3:] @ _TURN.T
        wxyz = wxyz / np.linalg.norm(wxyz, axis=-1, keepdims=True)
        arm = quaternion.to_matrix(wxyz) @ (self.moving_centre - self.pivot)
        there = self.scale * poses[..., :3] @ _RU + self.base_centre
        return Pose(there - arm - self.pivot, np.where(wxyz[..., :1] < 0, -wxyz, wxyz))

    def normalise(self, pose: Pose) -> Array:
        """Normalised poses (..., 7) of the platform's."""
        arm = pose.rotation @ (self.moving_centre - self.pivot)
        there = pose.position + self.pivot + arm - self.base_centre
        return np.concatenate([there @ _RU.T / self.scale, pose.wxyz @ _TURN], axis=-1)

    def reflect(self, poses: NDArray) -> NDArray:
        """Mirror images of normalised poses (..., 7), real or complex, of a planar platform."""
        assert self.mirror is not None
        reflection, flip = self.mirror
        return np.concatenate([poses[..., :3] @ reflection, poses[..., 3:] @ flip], axis=-1)


def _normal(joints: Array) -> Array | None:
    """Unit normal of the plane that holds all joints (6, 3), or None."""
    _, spread, axes = np.linalg.svd(joints - joints.mean(axis=0))
    return axes[2] if spread[2] <= FLAT * spread[0] else None


@dataclass(frozen=True, eq=False)
class Problem:
    """Normalised leg equations of N sets of readings of one machine.

    Attributes:
        moving: (6, 3) platform joints.
        base: (N, 6, 3) lower ends of the struts, or (1, 6, 3) if the same for all sets.
        squares: (N, 6) squared strut lengths.
    """

    moving: Array
    base: Array
    squares: Array

    @classmethod
    def of(cls, frames: Frames, base: Array, lengths: Array) -> Problem:
        """Equations of struts, (N, 6, 3) or (1, 6, 3) and (N, 6) [platform unit].

        Squares of lengths that are not above 0 are NaN.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            squares = np.where(lengths > 0, frames.squares(lengths), np.nan)
        return cls(frames.moving, frames.base(base), squares)

    @property
    def valid(self) -> NDArray[np.bool_]:
        """(N,) sets whose lengths are numbers above 0 that can be calculated with."""
        return np.all((self.squares > 0) & (self.squares < LARGEST), axis=1)

    def __getitem__(self, sets: NDArray[np.int64]) -> Problem:
        base = self.base if len(self.base) == 1 else self.base[sets]
        return Problem(self.moving, np.ascontiguousarray(base), self.squares[sets])


# ---- complex poses --------------------------------------------------------------------


def rotation(poses: NDArray) -> NDArray:
    """Rotation matrices (..., 3, 3) of poses (..., 7) whose quaternions have any length."""
    e = poses[..., 3:]
    return quaternion.to_matrix(e / np.sqrt(np.sum(e * e, axis=-1, keepdims=True)))


def inverse(poses: Complex) -> Complex:
    """Poses (..., 7) that undo these: base and platform change roles."""
    back = np.concatenate([poses[..., :3], quaternion.conjugate(poses[..., 3:])], axis=-1)
    back[..., :3] = -np.einsum("...ij,...j->...i", rotation(back), poses[..., :3])
    return back


def squared_lengths(poses: Complex, base: Complex, moving: Complex) -> Complex:
    """l^2 of the six struts, (..., 6)."""
    joints = np.einsum("...ij,kj->...ki", rotation(poses), moving) + poses[..., None, :3]
    return np.sum((joints - base) ** 2, axis=-1)


def distances(a: NDArray, b: NDArray) -> Array:
    """Distances (A, B) of poses a (A, 7) and b (B, 7): largest difference in R and t.

    Relative to the size of a's numbers where those are above 1.
    """
    ka, kb = (np.concatenate([rotation(p).reshape(len(p), 9), p[:, :3]], axis=1) for p in (a, b))
    scale = np.maximum(1.0, np.abs(ka).max(axis=1, initial=0.0))[:, None]
    return np.abs(ka[:, None] - kb[None]).max(axis=2, initial=0.0) / scale


def distinct(poses: NDArray, apart: float) -> NDArray[np.int64]:
    """Indices of poses of which no earlier kept one is within `apart`."""
    gaps = distances(poses, poses)
    kept: list[int] = []
    for i in range(len(poses)):
        if not any(gaps[i, k] < apart for k in kept):
            kept.append(i)
    return np.array(kept, dtype=np.int64)

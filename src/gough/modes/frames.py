"""One scale and one pair of frames for all hexapods: what the tracker calculates in.

Lengths are divided by the root mean square distance of the joints from their centres, base
and platform joints are counted from those centres, and both frames are turned by fixed
rotations in no special position, so that the symmetric poses of symmetric machines meet no
zero pivots. With joint = R (p - c) + c + t for pivot c, the pose (t, R) becomes

    R' = U R V^T,      t' = U (R (m - c) + c + t - o) / scale

where m and o are the centres of platform and base joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gough import quaternion
from gough.checks import Array
from gough.modes.study import product
from gough.platform import Platform
from gough.pose import Pose

# Two rotations in no special position: any others would do.
_U = np.array([0.52, 0.37, -0.61, 0.47])
_V = np.array([-0.41, 0.66, 0.35, 0.52])
_U, _V = _U / np.linalg.norm(_U), _V / np.linalg.norm(_V)
_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
FLAT = 1e-12  # joints within this share of their spread from a plane lie in it


@dataclass(frozen=True, eq=False)
class Frames:
    """The change from a platform's coordinates to the tracker's and back.

    Attributes:
        scale: one normalised unit of length [platform unit].
        base_centre, moving_centre: (3,) origins [platform unit].
        pivot: (3,) the platform's pivot [platform unit].
        moving: (6, 3) normalised platform joints.
        mirror: two unit quaternions (n, m) if base and platform joints are planar: (t, e) and
            its mirror image (t - 2 (n.t) n, n e m), a quaternion product, have the same legs.
    """

    scale: float
    base_centre: Array
    moving_centre: Array
    pivot: Array
    moving: Array
    mirror: tuple[Array, Array] | None

    @classmethod
    def of(cls, platform: Platform) -> Frames:
        base, moving = platform.base, platform.moving
        base_centre, moving_centre = base.mean(axis=0), moving.mean(axis=0)
        offsets = np.vstack([base - base_centre, moving - moving_centre])
        scale = float(np.sqrt(np.mean(np.sum(offsets**2, axis=1))))
        planes = [_normal(joints) for joints in (base, moving)]
        mirror = None
        if platform.rotary is None and planes[0] is not None and planes[1] is not None:
            turned = quaternion.to_matrix(_U) @ planes[0], quaternion.to_matrix(_V) @ planes[1]
            mirror = np.append(0.0, turned[0]), np.append(0.0, turned[1])
        turned_moving = (moving - moving_centre) @ quaternion.to_matrix(_V).T / scale
        return cls(scale, base_centre, moving_centre, platform.pivot_point, turned_moving, mirror)

    def base(self, base: Array) -> Array:
        """Normalised base joints (..., 6, 3)."""
        return (base - self.base_centre) @ quaternion.to_matrix(_U).T / self.scale

    def squares(self, lengths: Array) -> Array:
        """Normalised squared lengths (..., 6)."""
        return (lengths / self.scale) ** 2

    def pose(self, e: Array, t: Array) -> Pose:
        """The platform's poses of normalised real ones (..., 4), (..., 3)."""
        wxyz = product(product(_U * _CONJUGATE, e), _V)
        wxyz = wxyz / np.linalg.norm(wxyz, axis=-1, keepdims=True)
        arm = quaternion.to_matrix(wxyz) @ (self.moving_centre - self.pivot)
        there = self.scale * t @ quaternion.to_matrix(_U) + self.base_centre
        return Pose(there - arm - self.pivot, np.where(wxyz[..., :1] < 0, -wxyz, wxyz))

    def normal(self, pose: Pose) -> tuple[Array, Array]:
        """Normalised quaternions (..., 4) and positions (..., 3) of the platform's poses."""
        e = product(product(np.broadcast_to(_U, pose.wxyz.shape), pose.wxyz), _V * _CONJUGATE)
        arm = pose.rotation @ (self.moving_centre - self.pivot)
        there = pose.position + self.pivot + arm - self.base_centre
        return e, there @ quaternion.to_matrix(_U).T / self.scale

    def reflect(self, e: NDArray, t: NDArray) -> tuple[NDArray, NDArray]:
        """The mirror images of normalised poses of a planar platform."""
        assert self.mirror is not None
        n, m = self.mirror
        shape = e.shape
        flipped = product(product(np.broadcast_to(n, shape), e), np.broadcast_to(m, shape))
        return flipped, t - 2 * (t @ n[1:])[..., None] * n[1:]


def _normal(joints: Array) -> Array | None:
    """Unit normal of the plane that holds all joints (6, 3), or None."""
    _, spread, axes = np.linalg.svd(joints - joints.mean(axis=0))
    return axes[2] if spread[2] <= FLAT * spread[0] else None

"""What is drawn, as numbers: meshes, and where the parts of a leg are. Knows no browser."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.kinematics import equivalent_struts, joint_positions
from gough.platform import Platform
from gough.pose import Pose

BARREL = 0.55  # length of a telescopic leg's outer tube, as a share of the leg at home
INSIDE = 0.8  # or of the leg as it is, if that is less
LABEL_GAP = 0.09  # labels are at least so far apart, and from their joints [drawn]


class Mesh(NamedTuple):
    """Corners (V, 3) and triangles (F, 3)."""

    vertices: Array
    faces: NDArray[np.int64]


@dataclass(frozen=True)
class Frame:
    """From a machine's own coordinates to drawn ones, in which its size is 1.

    Cameras, line widths and handles then need no care for units or far-off origins.
    """

    centre: Array
    size: float

    @classmethod
    def of(cls, platform: Platform) -> Frame:
        """The frame whose origin is the centre of the base joints."""
        return cls(platform.base.mean(axis=0), platform.size)

    def drawn(self, points: Array) -> Array:
        """Base coordinates (..., 3) [platform unit] as drawn."""
        return (points - self.centre) / self.size

    def told(self, points: Array) -> Array:
        """Drawn points (..., 3) in base coordinates [platform unit]."""
        return points * self.size + self.centre


class Limbs(NamedTuple):
    """The thick and the thin part of each leg, both from start to end, (6, 3) each.

    Telescopic: an outer tube on the base, and the rod that comes out of it. Rotary: motor arm,
    and the rod between its tip and the platform.
    """

    thick_start: Array
    thick_end: Array
    thin_start: Array
    thin_end: Array


def limbs(platform: Platform, pose: Pose, legs: Array) -> Limbs:
    """Where the parts of the legs are in base coordinates, to scale.

    Args:
        legs: the readings (6,) at the pose. They say where motor arms stand, which the pose
            alone does not for a mode on the motors' other branch.
    """
    joints = joint_positions(platform, pose)
    tips, _ = equivalent_struts(platform, legs)
    if platform.rotary is not None:
        return Limbs(platform.base, tips, tips, joints)
    struts = joints - tips
    length = np.linalg.norm(struts, axis=-1)
    with np.errstate(divide="ignore"):
        share = np.minimum(BARREL * platform.home_lengths / length, INSIDE)
    return Limbs(tips, tips + share[:, None] * struts, tips, joints)


def rods_between(starts: Array, ends: Array, radius: float) -> tuple[Array, Array, Array]:
    """Positions (N, 3), quaternions (N, 4) and scales (N, 3) that put unit cylinders there."""
    along = ends - starts
    length = np.linalg.norm(along, axis=-1)
    with np.errstate(invalid="ignore"):
        x, y, z = np.where(length[:, None] > 0, along / length[:, None], [0.0, 0.0, 1.0]).T
    # the half-way quaternion from +z; straight down it is undefined, and a turn about x serves
    wxyz = np.stack([1 + z, -y, x, np.zeros_like(z)], axis=-1)
    wxyz[1 + z < 1e-12] = [0, 1, 0, 0]
    wxyz /= np.linalg.norm(wxyz, axis=-1, keepdims=True)
    scales = np.stack([np.full_like(length, radius)] * 2 + [length], axis=-1)
    return starts, wxyz, scales


def cylinder(sides: int = 20) -> Mesh:
    """Radius 1 about the z axis, from z = 0 to 1; caps have corners of their own, for shading."""
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(sides)], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    vertices = np.concatenate([ring, ring + up, ring, ring + up, [0 * up, up]])
    i = np.arange(sides)
    j = (i + 1) % sides
    floor, roof = np.full(sides, 4 * sides), np.full(sides, 4 * sides + 1)
    parts = [
        (i, j, sides + j), (i, sides + j, sides + i),
        (floor, 2 * sides + j, 2 * sides + i), (roof, 3 * sides + i, 3 * sides + j),
    ]  # fmt: skip
    return Mesh(vertices, np.concatenate([np.stack(p, axis=-1) for p in parts]))


def sphere(rings: int = 10, sides: int = 16) -> Mesh:
    """Radius 1 about the origin."""
    tilt = np.linspace(0, np.pi, rings + 1)[:, None]
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    shape = np.broadcast_shapes(tilt.shape, turn.shape)
    x, y, z = np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)
    vertices = np.stack([np.broadcast_to(v, shape) for v in (x, y, z)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    a, b = i * sides + j, i * sides + (j + 1) % sides
    below = np.stack([a, a + sides, b + sides], axis=-1), np.stack([a, b + sides, b], axis=-1)
    return Mesh(vertices, np.concatenate([part.reshape(-1, 3) for part in below]))


def plate(joints: Array, thickness: float, margin: float = 1.1) -> Mesh:
    """A slab whose upper side holds six joints (6, 3), a little wider than they are.

    The joints are taken in the order in which they stand around their centre, and need not lie
    in a plane; the plate then is a tent over them.
    """
    centre = joints.mean(axis=0)
    right, _, normal = np.linalg.svd(joints - centre)[2]
    normal = -normal if normal[2] < 0 else normal
    up = np.cross(normal, right)
    order = np.argsort(np.arctan2((joints - centre) @ up, (joints - centre) @ right))
    rim = centre + margin * (joints[order] - centre)
    down = -thickness * normal
    top = np.concatenate([rim, [centre]])
    edge = np.concatenate([rim, rim + down])
    i = np.arange(6)
    j = (i + 1) % 6
    hub = np.full(6, 6)
    parts = [
        (hub, i, j), (7 + hub, 7 + j, 7 + i),
        (20 + i, 20 + j, 14 + j), (20 + i, 14 + j, 14 + i),
    ]  # fmt: skip
    faces = np.concatenate([np.stack(p, axis=-1) for p in parts])
    return Mesh(np.concatenate([top, top + down, edge]), faces)


def label_places(joints: Array) -> Array:
    """Where labels of drawn joints (6, 3) stand: outside of them, and apart from each other."""
    centre = joints.mean(axis=0)
    outward = joints - centre
    outward[:, 2] = 0.0
    reach = np.linalg.norm(outward, axis=-1, keepdims=True)
    places = joints + LABEL_GAP * outward / np.where(reach > 0, reach, 1.0)
    for _ in range(50):
        apart = places[:, None] - places[None]
        distance = np.linalg.norm(apart, axis=-1) + 10 * np.eye(6)
        if distance.min() >= LABEL_GAP:
            break
        push = np.clip(LABEL_GAP - distance, 0, None)[..., None] / 2
        # joints at one point have no direction apart: take that of their legs' numbers
        spread = np.subtract.outer(np.arange(6.0), np.arange(6.0))[..., None] * [1.0, 0.5, 0.0]
        where = np.where(distance[..., None] > 1e-9, apart, spread)
        length = np.linalg.norm(where, axis=-1, keepdims=True)
        places = places + (push * where / np.where(length > 0, length, 1.0)).sum(axis=1)
    return places


def round_number(value: float) -> float:
    """The largest of 1, 2, 5, 10, 20, ... (and 0.5, 0.2, ...) that is not above a number."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(m * power for m in (1, 2, 5) if m * power <= value * (1 + 1e-9)))

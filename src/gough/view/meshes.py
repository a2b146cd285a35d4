"""Meshes, parts of a leg and colours, as numbers: independent of the browser."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.platform import Platform
from gough.pose import Pose
from gough.skeleton import outline_order, outside_stroke, skeleton, stroke_share

# Colours that all kinds of colour vision tell apart (Okabe and Ito).
BLUE, GREEN, YELLOW, VERMILION = "#0072B2", "#009E73", "#F0E442", "#D55E00"
ORANGE, GREY = "#E69F00", "#7A8590"
BASE, PLATE = "#A7B0B8", "#5B6B7B"
RAMP = (BLUE, GREEN, YELLOW)  # lowest, middle and highest reading of a stroke
OUT = "#D1001C"  # outside the stroke: red, and darker than any colour of the ramp
SAME, OTHER = BLUE, VERMILION  # det J with home's sign, or with the other; as `gough plot modes`

THICK, THIN = 0.014, 0.0075  # radii of a leg's two parts / size, where none is stated
ROD = 0.9  # radius of the thin part / stated radius, which is that of both
TUBE = 0.55  # length of a telescopic leg's outer tube / length of the leg at home
LONGEST_TUBE = 0.8  # the same / present length of the leg
LABEL_GAP = 0.09  # smallest distance between labels, and from their joints / size


class Mesh(NamedTuple):
    """Corners (V, 3) and triangles (F, 3)."""

    vertices: Array
    faces: NDArray[np.int64]


@dataclass(frozen=True)
class Frame:
    """Map between base coordinates and drawn coordinates, in which the machine's size is 1.

    Cameras, line widths and handles then need no care for units or far-off origins.
    """

    centre: Array
    size: float

    @classmethod
    def of(cls, platform: Platform) -> Frame:
        """Frame whose origin is the centre of the base joints."""
        return cls(platform.base.mean(axis=0), platform.size)

    def drawn(self, points: Array) -> Array:
        """Drawn coordinates of points (..., 3) in base coordinates [platform unit]."""
        return (points - self.centre) / self.size

    def from_drawn(self, points: Array) -> Array:
        """Base coordinates [platform unit] of drawn points (..., 3)."""
        return points * self.size + self.centre


class Limbs(NamedTuple):
    """The thick and the thin part of each leg, both from start to end, (6, 3) each.

    Telescopic: an outer tube on the base, and the rod that slides in it. Rotary: motor arm, and
    the rod between its tip and the platform.
    """

    thick_start: Array
    thick_end: Array
    thin_start: Array
    thin_end: Array


def leg_radii(platform: Platform) -> tuple[Array, Array]:
    """Radii (6,) of the thick and of the thin parts as drawn: as stated, if they are."""
    stated = None if platform.limits is None else platform.limits.leg_radius
    if stated is None:
        return np.full(6, THICK), np.full(6, THIN)
    return stated / platform.size, ROD * stated / platform.size


def limbs(platform: Platform, pose: Pose, legs: Array) -> Limbs:
    """Parts of the legs at a pose with readings (6,), in base coordinates [platform unit]."""
    points = skeleton(platform, pose, legs)
    if platform.rotary is not None:
        return Limbs(points.base, points.tips, points.tips, points.plate)
    struts = points.plate - points.tips
    length = np.linalg.norm(struts, axis=-1)
    with np.errstate(divide="ignore"):
        share = np.minimum(TUBE * platform.home_lengths / length, LONGEST_TUBE)
    return Limbs(points.tips, points.tips + share[:, None] * struts, points.tips, points.plate)


def rgb(color: str) -> tuple[int, int, int]:
    """Red, green and blue, 0 to 255, of "#rrggbb"."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def leg_colors(platform: Platform, legs: Array) -> NDArray[np.uint8]:
    """Colours (6, 3) of legs by their position in the stroke; grey where none is stated."""
    if platform.stroke is None:
        return np.tile(np.array(rgb(GREY), np.uint8), (6, 1))
    share = np.clip(stroke_share(platform, legs), 0, 1)
    stops = np.array([rgb(color) for color in RAMP], float)
    where = np.linspace(0, 1, len(RAMP))
    colors = np.stack([np.interp(share, where, channel) for channel in stops.T], axis=-1)
    colors[outside_stroke(platform, legs)] = rgb(OUT)
    return np.round(colors).astype(np.uint8)


def rods_between(starts: Array, ends: Array, radius: float | Array) -> tuple[Array, Array, Array]:
    """Positions (N, 3), quaternions (N, 4) and scales (N, 3) of unit cylinders as rods (N, 3).

    Args:
        radius: one, or of each rod (N,).
    """
    along = ends - starts
    length = np.linalg.norm(along, axis=-1)
    with np.errstate(invalid="ignore"):
        x, y, z = np.where(length[:, None] > 0, along / length[:, None], [0.0, 0.0, 1.0]).T
    # the shortest rotation from +z; straight down, where it is undefined, half a turn about x
    wxyz = np.stack([1 + z, -y, x, np.zeros_like(z)], axis=-1)
    wxyz[1 + z < 1e-12] = [0, 1, 0, 0]
    wxyz /= np.linalg.norm(wxyz, axis=-1, keepdims=True)
    scales = np.stack([np.full_like(length, radius)] * 2 + [length], axis=-1)
    return starts, wxyz, scales


def cylinder(sides: int = 20) -> Mesh:
    """Cylinder of radius 1 about the z axis, z = 0 to 1; caps share no corners, for shading."""
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
    """Sphere of radius 1 about the origin."""
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
    """Slab under six joints (6, 3), `margin` times as wide; a tent if they lie in no plane."""
    centre = joints.mean(axis=0)
    normal = np.linalg.svd(joints - centre)[2][2]
    normal = -normal if normal[2] < 0 else normal
    rim = joints[outline_order(joints)]
    if np.sum(np.cross(rim - centre, np.roll(rim, -1, axis=0) - centre) @ normal) < 0:
        rim = rim[::-1]  # counterclockwise from above, so that faces look outward
    rim = centre + margin * (rim - centre)
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
    """Places (6, 3) for labels of drawn joints (6, 3): outside them, and apart from each other."""
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
        # joints at one point: separate their labels in the order of the legs
        spread = np.subtract.outer(np.arange(6.0), np.arange(6.0))[..., None] * [1.0, 0.5, 0.0]
        where = np.where(distance[..., None] > 1e-9, apart, spread)
        length = np.linalg.norm(where, axis=-1, keepdims=True)
        places = places + (push * where / np.where(length > 0, length, 1.0)).sum(axis=1)
    return places


def round_number(value: float) -> float:
    """Largest of ..., 0.2, 0.5, 1, 2, 5, 10, ... that does not exceed a positive value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(m * power for m in (1, 2, 5) if m * power <= value * (1 + 1e-9)))

"""Random hexapods to train the universal network on, and poses of each.

All lengths are in units of the machine's size, the largest distance between two joints at home,
and all points count from the centre of the platform joints there. No machine is a copy of one of
the catalog: every one has joints displaced at random.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from gough.learn.kinematics import euler_to_matrix

SINGULAR = 0.02  # homes nearer to a singularity than this are not machines that anybody builds
SMALLEST, LARGEST = (0.02, 5.0), (0.15, 60.0)  # half-widths of boxes: share of size, [deg]


@dataclass(frozen=True, eq=False)
class Machines:
    """Hexapods at home: ends of the struts (M, 6, 3), and the inverse Jacobian (M, 6, 6)."""

    base: Tensor
    joints: Tensor
    inverse: Tensor

    def __len__(self) -> int:
        return len(self.base)

    def __getitem__(self, index) -> Machines:
        return Machines(*(getattr(self, f.name)[index] for f in fields(self)))

    @classmethod
    def at_home(cls, base: Tensor, joints: Tensor) -> Machines:
        """Make machines from points in any frame and unit, (M, 6, 3)."""
        points = torch.cat([base, joints], dim=1)
        size = torch.cdist(points, points).flatten(1).amax(1)[:, None, None]
        centre = joints.mean(1, keepdim=True)
        base, joints = (base - centre) / size, (joints - centre) / size
        return cls(base, joints, torch.linalg.inv(jacobian(joints - base, joints)))

    def distance(self) -> Tensor:
        """Distance of home to the nearest singularity (M,): see `gough.singularity_distance`."""
        return _smallest(self.joints - self.base, self.joints)


@dataclass(frozen=True, eq=False)
class Poses:
    """Displacements from home: translation (M, N, 3) of the centre, rotation (M, N, 3, 3).

    `change` (M, 6, N) are strut lengths minus those at home; `regular` (M, N) is whether det J has
    home's sign there; `gain` (M, N) is the Frobenius norm of the inverse Jacobian there.
    """

    translation: Tensor
    rotation: Tensor
    change: Tensor
    regular: Tensor
    gain: Tensor


def jacobian(struts: Tensor, levers: Tensor) -> Tensor:
    """Rows (n_i, r_i x n_i), (..., 6, 6): see `gough.jacobian`."""
    n = struts / torch.linalg.vector_norm(struts, dim=-1, keepdim=True)
    return torch.cat([n, torch.linalg.cross(levers, n)], dim=-1)


def _smallest(struts: Tensor, levers: Tensor) -> Tensor:
    rows = jacobian(struts, levers)
    radius = levers.square().sum(-1).mean(-1).sqrt()[..., None, None]
    scaled = torch.cat([rows[..., :3], rows[..., 3:] / radius], dim=-1)
    return torch.linalg.svdvals(scaled)[..., -1]


class Draw:
    """Random machines and poses, each batch from its own number."""

    def __init__(self, seed: int) -> None:
        self._generator = torch.Generator().manual_seed(seed)

    def uniform(self, low: float, high: float, *shape: int) -> Tensor:
        numbers = torch.rand(*shape, generator=self._generator, dtype=torch.float64)
        return low + (high - low) * numbers

    def where(self, share: float, count: int) -> Tensor:
        """True for about this share of `count` machines, shaped (M, 1, 1)."""
        return self.uniform(0, 1, count, 1, 1) < share

    def machines(self, count: int, odd: float = 0.15) -> Machines:
        """Hexapods of all usual kinds; a share `odd` has its joints anywhere in a box."""
        drawn = 2 * count
        usual, strange = self._usual(drawn), self._odd(drawn)
        pick = self.where(odd, drawn)
        base, joints = (torch.where(pick, b, a) for a, b in zip(usual, strange, strict=True))
        # homes at a singularity have no inverse: keep them out of it
        joints = joints + 1e-9 * self.uniform(-1, 1, drawn, 6, 3)
        made = Machines.at_home(base, joints)
        good = torch.nonzero(made.distance() > SINGULAR)[:, 0]
        length = torch.linalg.vector_norm(made.joints - made.base, dim=-1).amin(-1)
        good = good[length[good] > 0.05]
        return made[good[:count]]

    def _usual(self, count: int) -> tuple[Tensor, Tensor]:
        """Three pairs of joints above and below, on rings or nearly so, anywhere about rest."""
        one = (count, 1, 1)
        radius, height = self.uniform(0.2, 1.2, *one), self.uniform(0.3, 2.0, *one)
        low, high = self._gap(count), self._gap(count)
        crossed = torch.where(self.where(0.1, count), -1.0, 1.0)
        base = self._ring(low, 0.0, 1.0)
        joints = self._ring(math.pi / 3 - high, 0.0, crossed) * radius
        rough = self.uniform(0, 0.1, *one) * (~self.where(0.2, count))
        base = base + rough * self.uniform(-1, 1, count, 6, 3)
        joints = joints + rough * radius * self.uniform(-1, 1, count, 6, 3)
        uneven = self.uniform(0, 0.25, *one) * self.where(0.2, count)
        up = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
        base = base + uneven * self.uniform(-1, 1, count, 6, 1) * up
        joints = joints + uneven * radius * self.uniform(-1, 1, count, 6, 1) * up
        away = self.where(0.5, count)
        angles = self.uniform(-1, 1, count, 3) * math.radians(30)
        turn = torch.where(away, euler_to_matrix(angles), torch.eye(3, dtype=torch.float64))
        aside = self.uniform(-0.3, 0.3, count, 1, 3) * away
        joints = joints @ turn.mT + aside + height * up
        return self._cranked(base, joints, count), joints

    def _gap(self, count: int) -> Tensor:
        """Half the angle between the two joints of a pair, (M, 1, 1): 0 in a tenth of them."""
        return self.uniform(0, math.pi / 6, count, 1, 1) * (~self.where(0.1, count))

    def _ring(self, gap: Tensor, middle: float, side: Tensor | float) -> Tensor:
        """Pairs of joints on the unit circle, (M, 6, 3)."""
        sign = torch.tensor([-1.0, 1.0] * 3, dtype=torch.float64)[:, None]
        centre = (
            torch.arange(3, dtype=torch.float64).repeat_interleave(2)[:, None] * 2 * math.pi / 3
        )
        angle = centre + middle + side * gap * sign
        return torch.cat([angle.cos(), angle.sin(), 0 * angle], dim=-1)

    def _cranked(self, base: Tensor, joints: Tensor, count: int) -> Tensor:
        """Base joints moved as motor arms move them when a rotary machine leaves home."""
        some = self.where(0.2, count)
        axis = torch.nn.functional.normalize(
            self.uniform(-0.5, 0.5, count, 6, 3) + torch.tensor([0.0, 0, 1], dtype=torch.float64),
            dim=-1,
        )
        return (
            base
            + some * self.uniform(0, 0.5, count, 1, 1) * self.uniform(-1, 1, count, 6, 1) * axis
        )

    def _odd(self, count: int) -> tuple[Tensor, Tensor]:
        """Joints anywhere in two boxes, which may overlap."""
        shape = self.uniform(0.1, 1, 2, count, 1, 3)
        base = shape[0] * self.uniform(-1, 1, count, 6, 3)
        joints = shape[1] * self.uniform(0.3, 1, count, 1, 1) * self.uniform(-1, 1, count, 6, 3)
        return base, joints + self.uniform(-1.5, 1.5, count, 1, 3)

    def poses(
        self, machines: Machines, count: int, box: tuple[float, float] | None = None
    ) -> Poses:
        """Poses of each machine from a box of its own size, or from the given one [deg]."""
        many = len(machines)
        share = self.uniform(0, 1, many, 1, 1)
        length, angle = (
            (low + (high - low) * share) for low, high in zip(SMALLEST, LARGEST, strict=True)
        )
        if box is not None:
            length, angle = (torch.full_like(share, value) for value in box)
        translation = length * self.uniform(-1, 1, many, count, 3)
        angles = torch.deg2rad(angle * self.uniform(-1, 1, many, count, 3))
        rotation = euler_to_matrix(angles)
        levers = machines.joints[:, None] @ rotation.mT
        struts = levers + translation[..., None, :] - machines.base[:, None]
        home = torch.linalg.vector_norm(machines.joints - machines.base, dim=-1)
        change = torch.linalg.vector_norm(struts, dim=-1) - home[:, None]
        rows = jacobian(struts, levers)
        ratio = torch.linalg.det(rows @ machines.inverse[:, None])
        inverse, _ = torch.linalg.inv_ex(rows)
        gain = torch.linalg.matrix_norm(inverse)
        regular = (ratio > 0) & gain.isfinite()
        return Poses(translation, rotation, change.mT, regular, gain)

"""A hexapod as a graph: 12 hinges, 18 edges, and the matrix of their lengths.

Nodes 0-5 are the base joints, nodes 6-11 the platform joints, in the platform file's order.
The edges are the six legs and, on each plate, the ring that joins every hinge to its two
neighbours; the longer links within a plate follow from these and are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.platform import Platform

NODES = 12


@dataclass(frozen=True, eq=False)
class HexapodGraph:
    """The graph of one platform.

    Attributes:
        legs: (6, 2) nodes of each leg's edge, base joint first.
        rings: (12, 2) nodes of the edges within the plates, lower number first.
        constant: (12, 12) symmetric distances of the rings, zero elsewhere [platform unit].
    """

    legs: NDArray[np.int64]
    rings: NDArray[np.int64]
    constant: Array

    @classmethod
    def of(cls, platform: Platform) -> HexapodGraph:
        """The graph of any platform."""
        legs = np.array([[i, i + 6] for i in range(6)])
        rings, constant = [], np.zeros((NODES, NODES))
        for offset, points in ((0, platform.base), (6, platform.moving)):
            for a, b in _ring(points):
                rings.append((a + offset, b + offset))
                constant[a + offset, b + offset] = np.linalg.norm(points[a] - points[b])
        return cls(legs, np.array(sorted(rings)), constant + constant.T)

    @cached_property
    def adjacency(self) -> NDArray[np.bool_]:
        """(12, 12), True where an edge is."""
        out = np.zeros((NODES, NODES), dtype=bool)
        for a, b in (*self.legs, *self.rings):
            out[a, b] = out[b, a] = True
        return out

    def matrix(self, leg_lengths: Array) -> Array:
        """E (..., 12, 12) for the lengths (..., 6) of the legs' edges [platform unit]."""
        out = np.broadcast_to(self.constant, (*leg_lengths.shape[:-1], NODES, NODES)).copy()
        out[..., self.legs[:, 0], self.legs[:, 1]] = leg_lengths
        out[..., self.legs[:, 1], self.legs[:, 0]] = leg_lengths
        return out


def edge_lengths(platform: Platform, legs: Array) -> Array:
    """Lengths (..., 6) of the legs' edges for readings (..., 6) [platform unit].

    The distance between the joints; for rotary legs, which do not measure it, that at home
    plus the way that the arm's tip has gone, which tells the readings apart just as well.
    """
    if platform.rotary is not None:
        travel = platform.gain * (legs - platform.home_legs)
        return platform.home_lengths + platform.rotary.arm_length * travel
    return platform.gain * legs + platform.true_at_zero


def _ring(points: Array) -> list[tuple[int, int]]:
    """Edges (lower, higher) that join six joints (6, 3) in the order of their angles.

    The angles are about the joints' centre, in the plane that fits them best; joints at the
    same place keep the order of their numbers.
    """
    offsets = points - points.mean(axis=0)
    x, y = np.linalg.svd(offsets, full_matrices=False)[2][:2]
    angles = np.round(np.arctan2(offsets @ y, offsets @ x), 9)
    order = np.argsort(angles, kind="stable")
    pairs = zip(order, np.roll(order, -1), strict=True)
    return [(int(min(a, b)), int(max(a, b))) for a, b in pairs]

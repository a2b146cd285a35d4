"""Networks whose input is the graph's distance matrix."""

from __future__ import annotations

import torch
from torch import Tensor

from gough.learn.graph import NODES, HexapodGraph, edge_lengths
from gough.learn.models.base import PoseNetwork, Scaling
from gough.platform import Platform


class GraphNetwork(PoseNetwork):
    """Adds the graph: distances are divided by the largest that occurs in the workspace."""

    edge_offset: Tensor
    edge_gain: Tensor
    ring_matrix: Tensor

    def __init__(self, platform: Platform, scaling: Scaling) -> None:
        super().__init__(platform, scaling)
        self.graph = HexapodGraph.of(platform)
        # the legs' edges are affine in the normalised readings
        at_zero = edge_lengths(platform, scaling.leg_mean)
        at_one = edge_lengths(platform, scaling.leg_mean + scaling.leg_std)
        widest = edge_lengths(platform, scaling.leg_range.T).max()
        largest = max(float(widest), float(self.graph.constant.max()))
        facts = {"edge_offset": at_zero / largest, "edge_gain": (at_one - at_zero) / largest}
        facts |= {"ring_matrix": self.graph.constant / largest}
        for name, value in facts.items():
            self.register_buffer(name, torch.tensor(value, dtype=torch.float64), persistent=False)

    def edges(self, x: Tensor) -> Tensor:
        """Scaled lengths (N, 6) of the legs' edges for normalised readings (N, 6)."""
        return x * self.edge_gain.to(x.dtype) + self.edge_offset.to(x.dtype)

    def matrix(self, edges: Tensor) -> Tensor:
        """Scaled E (N, 12, 12) for scaled lengths (N, 6) of the legs' edges."""
        lower = torch.nn.functional.pad(torch.diag_embed(edges), (6, 0, 0, 6))  # (N, 12, 12)
        return self.ring_matrix.to(edges.dtype) + lower + lower.mT


assert NODES == 12

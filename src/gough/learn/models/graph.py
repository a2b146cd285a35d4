"""Networks on the distance matrix: their base, and the paper's baselines GCN and GraphMLP."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from gough.learn.data import NODES, HexapodGraph, edge_lengths
from gough.learn.models.base import PoseNetwork, Scaling
from gough.learn.models.layers import Dense
from gough.platform import Platform


class GraphNetwork(PoseNetwork):
    """Base of networks on the graph's distance matrix.

    Distances are divided by the largest that occurs in the workspace.
    """

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
        values = {"edge_offset": at_zero / largest, "edge_gain": (at_one - at_zero) / largest}
        values |= {"ring_matrix": self.graph.constant / largest}
        for name, value in values.items():
            self.register_buffer(name, torch.tensor(value, dtype=torch.float64), persistent=False)

    def edges(self, x: Tensor) -> Tensor:
        """Scaled lengths (N, 6) of the legs' edges for normalised readings (N, 6)."""
        return x * self.edge_gain.to(x.dtype) + self.edge_offset.to(x.dtype)

    def matrix(self, edges: Tensor) -> Tensor:
        """Scaled E (N, 12, 12) for scaled lengths (N, 6) of the legs' edges."""
        lower = nn.functional.pad(torch.diag_embed(edges), (6, 0, 0, 6))  # (N, 12, 12)
        return self.ring_matrix.to(edges.dtype) + lower + lower.mT


class NodeNetwork(GraphNetwork):
    """Base of networks with one feature vector per node, whose mean over the nodes is read out.

    Every node starts with its row of the distance matrix and its number. In the matrix the legs'
    entries are standardised and the rings' scaled: as plain lengths, whose differences are small,
    the legs are learned far more slowly.
    """

    spread: Tensor

    def __init__(self, platform: Platform, scaling: Scaling, width: int) -> None:
        super().__init__(platform, scaling)
        self.register_buffer("spread", normalised_adjacency(self.graph.adjacency), persistent=False)
        self.first = nn.Linear(2 * NODES, width)

    def nodes(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """First features (N, 12, width) of the nodes, and the averaging matrix (12, 12)."""
        matrix = self.matrix(x)
        one_hot = torch.eye(NODES, dtype=matrix.dtype, device=matrix.device)
        h = self.first(torch.cat([matrix, one_hot.expand_as(matrix)], dim=-1))
        return h, self.spread.to(h.dtype)


def normalised_adjacency(adjacency: np.ndarray) -> Tensor:
    """D^-1/2 (A + I) D^-1/2, (12, 12) float64 (Kipf and Welling, 2017)."""
    a = torch.as_tensor(adjacency, dtype=torch.float64) + torch.eye(NODES, dtype=torch.float64)
    scale = a.sum(0).rsqrt()
    return scale[:, None] * a * scale


class GCN(NodeNetwork):
    """The paper's third baseline: graph convolutions.

    A layer averages over the neighbours by `normalised_adjacency`, then applies a residual dense
    layer.
    """

    kind = "gcn"

    def __init__(self, platform: Platform, scaling: Scaling, *, width: int = 112,
                 layers: int = 9, head: int = 1) -> None:  # fmt: skip
        super().__init__(platform, scaling, width)
        self.layers = nn.ModuleList(Dense(width, width) for _ in range(layers))
        self.head = nn.Sequential(*(Dense(width, width) for _ in range(head)), nn.LayerNorm(width))
        self.last = nn.Linear(width, self.outputs)
        self.start_near_home(self.last)

    def network(self, x: Tensor) -> Tensor:
        h, spread = self.nodes(x)
        for layer in self.layers:
            h = layer(spread @ h)
        return self.last(self.head(h.mean(1)))


class GraphMLP(NodeNetwork):
    """The paper's largest baseline: mixing over nodes and channels, with the graph.

    Each block mixes over the nodes, by an MLP beside a graph convolution, and then over the
    channels (Li et al., GraphMLP, 2022).
    """

    kind = "graphmlp"

    def __init__(self, platform: Platform, scaling: Scaling, *, width: int = 144,
                 blocks: int = 3, hidden: int = 328) -> None:  # fmt: skip
        super().__init__(platform, scaling, width)
        self.blocks = nn.ModuleList(_Block(width, hidden) for _ in range(blocks))
        self.norm = nn.LayerNorm(width)
        self.last = nn.Linear(width, self.outputs)
        self.start_near_home(self.last)

    def network(self, x: Tensor) -> Tensor:
        h, spread = self.nodes(x)
        for block in self.blocks:
            h = block(h, spread)
        return self.last(self.norm(h.mean(1)))


class _Block(nn.Module):
    def __init__(self, width: int, hidden: int) -> None:
        super().__init__()
        self.norm_nodes, self.norm_channels = nn.LayerNorm(width), nn.LayerNorm(width)
        self.nodes = _two_layers(NODES, 2 * NODES)
        self.graph = nn.Linear(width, width)
        self.channels = _two_layers(width, hidden)

    def forward(self, h: Tensor, spread: Tensor) -> Tensor:
        x = self.norm_nodes(h)
        h = h + self.nodes(x.mT).mT + self.graph(spread @ x)
        return h + self.channels(self.norm_channels(h))


def _two_layers(width: int, hidden: int) -> nn.Sequential:
    return nn.Sequential(nn.Linear(width, hidden), nn.GELU(), nn.Linear(hidden, width))

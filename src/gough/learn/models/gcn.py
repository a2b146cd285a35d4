"""GCN, the paper's third baseline: graph convolutions on the distance matrix."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from gough.learn.graph import NODES
from gough.learn.models.base import Scaling
from gough.learn.models.graph_base import GraphNetwork
from gough.learn.models.layers import Dense
from gough.platform import Platform


class GCN(GraphNetwork):
    """Every node starts with its row of the distance matrix and its number.

    In the matrix the legs' entries are standardised and the rings' scaled: as plain lengths,
    whose differences are small, the legs are learned far more slowly.

    A layer averages over the neighbours, D^-1/2 (A + I) D^-1/2 (Kipf and Welling, 2017), then
    applies a residual dense layer. The nodes' mean is read out.
    """

    kind = "gcn"
    spread: Tensor

    def __init__(self, platform: Platform, scaling: Scaling, *, width: int = 112,
                 layers: int = 9, head: int = 1) -> None:  # fmt: skip
        super().__init__(platform, scaling)
        self.register_buffer("spread", normalised_adjacency(self.graph.adjacency), persistent=False)
        self.first = nn.Linear(2 * NODES, width)
        self.layers = nn.ModuleList(Dense(width, width) for _ in range(layers))
        self.head = nn.Sequential(*(Dense(width, width) for _ in range(head)), nn.LayerNorm(width))
        self.last = nn.Linear(width, self.outputs)
        self.start_near_home(self.last)

    def network(self, x: Tensor) -> Tensor:
        h = self.first(node_features(self.matrix(x)))  # (N, 12, width)
        spread = self.spread.to(h.dtype)
        for layer in self.layers:
            h = layer(spread @ h)
        return self.last(self.head(h.mean(1)))


def normalised_adjacency(adjacency: np.ndarray) -> Tensor:
    """D^-1/2 (A + I) D^-1/2, (12, 12) float64."""
    a = torch.as_tensor(adjacency, dtype=torch.float64) + torch.eye(NODES, dtype=torch.float64)
    scale = a.sum(0).rsqrt()
    return scale[:, None] * a * scale


def node_features(matrix: Tensor) -> Tensor:
    """Rows of E and the nodes' numbers, one-hot, (N, 12, 24)."""
    one_hot = torch.eye(NODES, dtype=matrix.dtype, device=matrix.device)
    return torch.cat([matrix, one_hot.expand_as(matrix)], dim=-1)

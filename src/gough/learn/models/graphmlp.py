"""GraphMLP, the paper's largest baseline: mixing over nodes and channels, with the graph.

Follows Li et al., GraphMLP (2022): each block mixes over the nodes, by an MLP beside a graph
convolution, and then over the channels.
"""

from __future__ import annotations

from torch import Tensor, nn

from gough.learn.graph import NODES
from gough.learn.models.base import Scaling
from gough.learn.models.gcn import node_features, normalised_adjacency
from gough.learn.models.graph_base import GraphNetwork
from gough.platform import Platform


class GraphMLP(GraphNetwork):
    """Blocks of width `width`; the nodes' mean is read out."""

    kind = "graphmlp"
    spread: Tensor

    def __init__(self, platform: Platform, scaling: Scaling, *, width: int = 144,
                 blocks: int = 3, hidden: int = 328) -> None:  # fmt: skip
        super().__init__(platform, scaling)
        self.register_buffer("spread", normalised_adjacency(self.graph.adjacency), persistent=False)
        self.first = nn.Linear(2 * NODES, width)
        self.blocks = nn.ModuleList(_Block(width, hidden) for _ in range(blocks))
        self.norm = nn.LayerNorm(width)
        self.last = nn.Linear(width, self.outputs)
        self.start_near_home(self.last)

    def network(self, x: Tensor) -> Tensor:
        h = self.first(node_features(self.matrix(x)))  # (N, 12, width)
        for block in self.blocks:
            h = block(h, self.spread.to(h.dtype))
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

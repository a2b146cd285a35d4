"""DisGNet (Zhu et al., 2024): a 2-FWL network on the hexapod's distance matrix.

Every ordered pair of nodes (u, v) has a feature of width H. With d the nodes' order and e the
distance matrix, and the numbers of the paper's equations,

    h_uv  = f1(emb d_u) * f2(emb d_v) * g12(rbf e_uv) * g21(rbf e_vu)      initialisation (7)
    h'_uv = h_uv + W sum_j P(h_uj) * Q(h_jv) / 12                          2-FWL (8 to 10)
    z     = sum_uv h'_uv / 12                                              readout (11)

then dense layers, and a linear map to twelve numbers; * is element by element. The sum makes
the message cheap, exactly:

    sum_uv sum_j P(h_uj) * Q(h_jv) = sum_j p_j * q_j,   p_j = sum_u P(h_uj),  q_j = sum_v Q(h_jv)

and of the 144 pairs only the 12 that hold a leg depend on the sample: p_j and q_j are a
constant of the batch plus one term, that of the leg at node j. The structured evaluation
computes only these. Since p_j * q_j depends on one leg, z is a sum of functions of single legs, and
the interaction of legs must be learned by the dense layers of the head. This is a property of the
linear map W, one reading of the paper; `gough.learn.models.disgnet` is another.
"""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor, nn

from gough.learn.data import NODES
from gough.learn.models.base import Scaling
from gough.learn.models.graph import GraphNetwork
from gough.learn.models.layers import Dense, RadialBasis, Standardise, dense_stack
from gough.learn.models.series import BEYOND, analysis, chebyshev, nodes_of
from gough.platform import Platform


class LinearDisGNet(GraphNetwork):
    """DisGNet, linear after the 2-FWL product, with two evaluations of the same weights.

    Args:
        width: H.
        initial: dense layers in each map of the initialisation block.
        head: dense layers before the last linear map.
        embedding: width of the nodes' embedding.
        bumps: radial basis functions.
        table: terms of the series that training uses for each leg; 0: none, exact.
        form: "structured" (fast) or "dense" (plain 12 x 12, for any distance matrix).
    """

    kind = "disgnet-linear"
    range_middle: Tensor
    range_half: Tensor

    def __init__(self, platform: Platform, scaling: Scaling, *, width: int = 96, initial: int = 3,
                 head: int = 2, embedding: int = 8, bumps: int = 32, table: int = 64,
                 form: Literal["structured", "dense"] = "structured") -> None:  # fmt: skip
        super().__init__(platform, scaling)
        self.form, self.table = form, table
        spread = scaling.leg_std[:, None]
        low, high = ((scaling.leg_range - scaling.leg_mean[:, None]) / spread).T
        self.register_buffer("range_middle", torch.tensor((low + high) / 2), persistent=False)
        self.register_buffer(
            "range_half", torch.tensor(BEYOND * (high - low) / 2), persistent=False
        )
        self.embed = nn.Embedding(NODES, embedding)
        self.basis = RadialBasis(bumps)
        self.node_first = dense_stack(embedding, width, initial)
        self.node_second = dense_stack(embedding, width, initial)
        self.edge_there = dense_stack(bumps, width, initial)
        self.edge_back = dense_stack(bumps, width, initial)
        self.left = Dense(width, width)
        self.right = Dense(width, width)
        self.mix = nn.Linear(width, width, bias=False)
        self.readout = Standardise(width)
        self.head = nn.Sequential(*(Dense(width, width) for _ in range(head)), nn.LayerNorm(width))
        self.last = nn.Linear(width, self.outputs)
        self.start_near_home(self.last)
        with torch.no_grad():  # most of the sum is constant; standardise the rest for the head
            constant, single, product = self._by_leg(self.edges(torch.randn(512, 6)))
            self.readout.start(self._pool(constant, single.sum(1), product.sum(1)))

    def network(self, x: Tensor) -> Tensor:
        edges = self.edges(x)
        if self.form == "dense":
            return self.dense(self.matrix(edges), torch.arange(NODES, device=x.device))
        if self.training and self.table:
            return self.tabulated(x)
        return self.structured(edges)

    def dense(self, matrix: Tensor, order: Tensor) -> Tensor:
        """Raw numbers (N, 12) for scaled distance matrices (N, 12, 12) of any graph.

        Args:
            order: (12,) the node of the platform that each row and column stands for.
        """
        h = self._nodes(order) * self._pair(matrix, matrix.mT)  # (N, 12, 12, H)
        message = torch.einsum("nujh,njvh->nuvh", self.left(h), self.right(h)) / NODES
        return self._finish((h + self.mix(message)).sum((-3, -2)) / NODES)

    def structured(self, edges: Tensor) -> Tensor:
        """Raw numbers (N, 12) for scaled lengths (N, 6) of the legs' edges."""
        constant, single, product = self._by_leg(edges)
        return self._finish(self._pool(constant, single.sum(1), product.sum(1)))

    def tabulated(self, x: Tensor) -> Tensor:
        """Raw numbers (N, 12) for normalised readings (N, 6), to about 1e-6, at less cost.

        z is a sum of functions of single legs. They are evaluated at a few nodes of each leg's
        range and converted to Chebyshev series, which are evaluated at the samples.
        """
        middle, half = self.range_middle.to(x), self.range_half.to(x)
        constant, single, product = self._by_leg(
            self.edges(middle + half * nodes_of(self.table).to(x)[:, None])
        )
        values = single + self.mix(product / NODES)  # (K, 6, H)
        series = torch.einsum("km,mih->ikh", analysis(self.table).to(x), values).flatten(
            0, 1
        )  # (6 K, H)
        terms = chebyshev(self.table, (x - middle) / half)
        return self._finish(self._pool(constant, terms.flatten(1) @ series, None))

    def _by_leg(self, edges: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Parts of z: a constant (H,), and for lengths (N, 6) two terms (N, 6, H)."""
        nodes = self._nodes(torch.arange(NODES, device=edges.device))  # (12, 12, H)
        rings = self.ring_matrix.to(edges)
        fixed = self._no_leg(edges)
        constant = nodes * self._pair(rings, rings)
        p = (self.left(constant) * fixed).sum(0)  # (12, H), by column
        q = (self.right(constant) * fixed).sum(1)  # (12, H), by row
        base, top = self.graph.legs.T.tolist()
        pair = self._pair(edges, edges)  # (N, 6, H)
        up, down = nodes[base, top] * pair, nodes[top, base] * pair
        product = (p[base] + self.left(down)) * (q[base] + self.right(up))
        product = product + (p[top] + self.left(up)) * (q[top] + self.right(down))
        return (constant * fixed).sum((0, 1)), up + down, product

    def _pool(self, constant: Tensor, single: Tensor, product: Tensor | None) -> Tensor:
        """z (N, H)."""
        message = 0.0 if product is None else self.mix(product / NODES)
        return (constant + single + message) / NODES

    def _nodes(self, order: Tensor) -> Tensor:
        """f1(emb d_u) * f2(emb d_v), (12, 12, H)."""
        e = self.embed(order)
        return self.node_first(e)[:, None] * self.node_second(e)[None]

    def _pair(self, there: Tensor, back: Tensor) -> Tensor:
        """Features (..., H) of distances (...), g12 and g21 multiplied."""
        return self.edge_there(self.basis(there)) * self.edge_back(self.basis(back))

    def _no_leg(self, like: Tensor) -> Tensor:
        """(12, 12, 1): 0 for pairs that hold a leg, 1 elsewhere."""
        out = torch.ones(NODES, NODES, 1, dtype=like.dtype, device=like.device)
        base, top = self.graph.legs.T.tolist()
        out[base, top] = out[top, base] = 0
        return out

    def _finish(self, pooled: Tensor) -> Tensor:
        return self.last(self.head(self.readout(pooled)))

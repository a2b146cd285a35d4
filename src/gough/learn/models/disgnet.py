"""DisGNet (Zhu et al., 2024) with a nonlinear 2-FWL step, as its sources publish it.

Every ordered pair of nodes (u, v) has a feature of width H. With d the nodes' order and e the
distance matrix, * element by element, and the numbers of the paper's equations,

    h_uv  = f1(emb d_u) * f2(emb d_v) * g(rbf e_uv)                  initialisation (7)
    m_uv  = norm( S(h_uv) * sum_j P(h_uj) * Q(h_jv) )                2-FWL product (9, 10)
    h'_uv = m_uv + B silu(A m_uv + a)                                message f_mp (8)
    z     = sum_uv h'_uv / 12                                        readout (11)

then dense layers and a linear map to twelve numbers (11), of which nine become the nearest rotation
(12). f1, f2, g are stacks of dense layers, P, Q, S one each. docs/disgnet.md compares this with the
paper line by line.

One 2-FWL step makes h'_uv a function of at most two leg lengths: the only legs in row u and column
v are those at the nodes u and v. So z is a sum of 15 functions of two legs and 6 of one. The sum
over j holds P of u's leg times a constant, a constant times Q of v's leg, and constants, so that
m_uv is a function of u's leg plus one of v's, unless both are the same leg (`gough.learn.models.
two_legs` computes both). The network has three evaluations of the same weights:

- dense: the statement above, 12 x 12 x 12, for any distance matrix;
- structured: the sum over j written out, with the terms that hold no leg computed once;
- tables: each of the 21 functions at K x K (or K) nodes, then as a Chebyshev series
  (`gough.learn.models.series`). A addresses rows and columns apart and B the sum, so no matrix is
  multiplied at the K x K points, and the cost of a step hardly depends on the batch. A table
  represents the network only if the network is smooth in the legs: legs have wide Gaussians over
  their own range, and every batch has other nodes, so that no training relies on what lies between.
"""

from __future__ import annotations

import copy
from typing import Literal

import torch
from torch import Tensor, nn

from gough.learn.data import NODES
from gough.learn.models.base import Scaling
from gough.learn.models.graph import GraphNetwork
from gough.learn.models.layers import Dense, RadialBasis, Standardise, dense_stack
from gough.learn.models.series import (
    BEYOND,
    analysis,
    chebyshev,
    nodes_of,
    products_of_two,
    series_of_two,
)
from gough.learn.models.two_legs import LEG_PAIRS, Product, of_pairs
from gough.platform import Platform

WIDTH = 1.6  # deviation of the Gaussians of legs, relative to half the legs' range
FILE_NODES = 12  # nodes of each leg of the series that a network's file holds
NORM_NODES = 16  # nodes of each leg that the norm is computed from
SMALLEST = 1e-3  # numbers that vary less, relative to their mean size, are not magnified to 1


class DisGNet(GraphNetwork):
    """DisGNet, nonlinear after the 2-FWL product.

    Args:
        platform: the machine.
        scaling: its scales.
        width: H.
        initial: dense layers in each map of the initialisation; the paper's M.
        head: dense layers before the last linear map; the paper's M of the head.
        embedding: width of the nodes' embedding.
        bumps: radial basis functions.
        own: 1: the product is multiplied by the pair's own features S; 0: it is not.
        table: K, nodes per leg of the tables that training uses; 0: none, exact.
        form: "structured" or "dense".
    """

    kind = "disgnet"
    range_middle: Tensor
    range_half: Tensor
    leg_middle: Tensor
    leg_half: Tensor
    gain: Tensor
    bias: Tensor

    def __init__(self, platform: Platform, scaling: Scaling, *, width: int = 96, initial: int = 3,
                 head: int = 2, embedding: int = 8, bumps: int = 32, own: int = 1, table: int = 8,
                 form: Literal["structured", "dense"] = "structured") -> None:  # fmt: skip
        super().__init__(platform, scaling)
        self.form, self.table, self.with_own = form, table, own
        spread = scaling.leg_std[:, None]
        low, high = ((scaling.leg_range - scaling.leg_mean[:, None]) / spread).T
        middle, half = torch.tensor((low + high) / 2), torch.tensor(BEYOND * (high - low) / 2)
        ends = torch.stack([self.edges(middle - half), self.edges(middle + half)])
        values = {
            "range_middle": middle, "range_half": half, "leg_middle": (ends.max() + ends.min()) / 2,
            "leg_half": (ends.max() - ends.min()) / 2,
        }  # fmt: skip
        for name, value in values.items():
            self.register_buffer(name, value, persistent=False)
        self.embed = nn.Embedding(NODES, embedding)
        self.basis = RadialBasis(bumps)
        self.bumps = bumps
        self.node_first = dense_stack(embedding, width, initial)
        self.node_second = dense_stack(embedding, width, initial)
        self.edge = dense_stack(bumps, width, initial)
        self.left, self.right, self.own = (
            Dense(width, width, residual=False) for _ in range(3)
        )  # P, Q, S
        self.first = nn.Linear(width, width)  # A, a
        self.second = nn.Linear(width, width, bias=False)  # B
        self.readout = Standardise(width)
        self.head = nn.Sequential(*(Dense(width, width) for _ in range(head)), nn.LayerNorm(width))
        self.last = nn.Linear(width, self.outputs)
        self.start_near_home(self.last)
        # constants of the norm that random readings and the first weights give
        self.register_buffer("gain", torch.ones(NODES, NODES, width))
        self.register_buffer("bias", torch.zeros(NODES, NODES, width))
        with torch.no_grad():
            self._start_norm(torch.randn(512, 6))

    def network(self, x: Tensor) -> Tensor:
        if self.form == "dense":
            order = torch.arange(NODES, device=x.device)
            return self.dense(self.matrix(self.edges(x)), order)
        if self.training and self.table:
            shift = float(x[0, 0].detach().double() * 1000 % 1)  # other nodes in each batch
            return self.finish(self.tabulated(x, shift))
        return self.finish(self.structured(self.edges(x)))

    # ---- the statement ----------------------------------------------------------------

    def dense(self, matrix: Tensor, order: Tensor) -> Tensor:
        """Raw numbers (N, 12) for scaled distance matrices (N, 12, 12) of any graph.

        Args:
            matrix: distances.
            order: (12,) the node of the platform that each row and column stands for.
        """
        legs = self.leg_mask(matrix)[order][:, order]
        bumps = torch.where(legs, self.leg_bumps(matrix), self.basis(matrix))
        h = self.nodes()[order][:, order] * self.edge(bumps)  # (N, 12, 12, H)
        product = torch.einsum("nujh,njvh->nuvh", self.left(h), self.right(h))
        gain, bias = (b[order][:, order].to(h.dtype) for b in (self.gain, self.bias))
        m = self.own_of(h) * product * gain + bias
        mean, scale = self.norm_of(matrix)
        m = (m - mean) * scale
        updated = m + self.second(nn.functional.silu(self.first(m)))
        return self.finish(updated.sum((1, 2)) / NODES)

    def nodes(self) -> Tensor:
        """f1(emb d_u) * f2(emb d_v), (12, 12, H)."""
        return self.node_first(self.embed.weight)[:, None] * self.node_second(self.embed.weight)

    def own_of(self, h: Tensor) -> Tensor:
        """S(h), or ones."""
        return self.own(h) if self.with_own else torch.ones_like(h)

    def leg_bumps(self, edges: Tensor) -> Tensor:
        """Gaussian features (..., bumps) of lengths of legs' edges, over the legs' own range.

        They are wider than the range, so that short series represent them.
        """
        y = (edges - self.leg_middle.to(edges)) / self.leg_half.to(edges)  # -1..1
        centres = torch.linspace(-1, 1, self.bumps, dtype=edges.dtype, device=edges.device)
        return torch.exp(-(((y[..., None] - centres) / WIDTH) ** 2) / 2)

    def leg_mask(self, like: Tensor) -> Tensor:
        """Pairs (12, 12, 1) of nodes that a leg joins."""
        out = torch.zeros(NODES, NODES, 1, dtype=torch.bool, device=like.device)
        base, top = self.graph.legs.T.tolist()
        out[base, top] = out[top, base] = True
        return out

    def finish(self, pooled: Tensor) -> Tensor:
        """Raw numbers (N, 12) for z (N, H)."""
        return self.last(self.head(self.readout(pooled)))

    # ---- by pairs of legs -------------------------------------------------------------

    def structured(self, edges: Tensor) -> Tensor:
        """z (N, H) for scaled lengths (N, 6) of the legs' edges."""
        m = Product(self, edges, *self.norm_of(edges)).all()
        hidden = nn.functional.silu(self.first(m)).sum(1)
        return (m.sum(1) + self.second(hidden)) / NODES

    def norm_of(self, like: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and 1 / deviation (H,) of m over all pairs (u, v) and the legs' range."""
        product, to_series = self._at_nodes(NORM_NODES, 0.5, like)
        return product.norm(to_series)

    def _at_nodes(self, count: int, shift: float, like: Tensor) -> tuple[Product, Tensor]:
        """The product at `count` nodes of each leg's range, and the matrix to series."""
        middle, half = self.range_middle.to(like), self.range_half.to(like)
        at = nodes_of(count, shift).to(like)
        return Product(self, self.edges(middle + half * at[:, None])), analysis(count, shift).to(
            like
        )

    def tabulated(self, x: Tensor, shift: float = 0.5) -> Tensor:
        """z (N, H) for normalised readings (N, 6), by series through nodes that `shift` moves."""
        return self.of_series(x, *self.series(self.table, shift, x))

    def series(self, count: int, shift: float, like: Tensor) -> tuple[Tensor, Tensor]:
        """Series of the functions whose sum is z, through `count` nodes of each leg.

        Returns:
            Of one leg (K 6, 2 H): the sums of m, and of silu; of two (T 15, H): the sums of silu.
        """
        product, to_series = self._at_nodes(count, shift, like)
        product.normalise(*product.norm(to_series))
        rows, columns, one = product.rows(), product.columns(), product.one()
        A, a = self.first.weight.T, self.first.bias
        first, second = of_pairs(rows.flatten(1, 2) @ A + a, columns.flatten(1, 2) @ A)
        two = sum_of_silu(first, second)  # (K, K, 15, H)
        silu = nn.functional.silu(one @ A + a)
        sums = rows.sum(2) + columns.sum(1) + one.unflatten(1, (2, 12)).sum(1)  # (K, 12, H)
        single = torch.cat([sums, silu.unflatten(1, (2, 12)).sum(1)], dim=-1)
        single = single.unflatten(1, (2, 6)).sum(1)  # (K, 6, 2H)
        single = (to_series @ single.flatten(1)).view_as(single)
        return single.flatten(0, 1), series_of_two(to_series, two).flatten(0, 1)

    def of_series(self, x: Tensor, single: Tensor, pairs: Tensor) -> Tensor:
        """z (N, H) for normalised readings (N, 6), from these series."""
        y = (x - self.range_middle.to(x)) / self.range_half.to(x)
        phi = chebyshev(len(single) // 6, y).mT  # (N, K, 6)
        i, j = torch.tensor(LEG_PAIRS, device=x.device).T
        products = products_of_two(phi[:, :, i], phi[:, :, j])  # (N, T, 15)
        linear, hidden = (phi.flatten(1) @ single).chunk(2, dim=-1)
        return (linear + self.second(hidden + products.flatten(1) @ pairs)) / NODES

    def for_export(self) -> nn.Module:
        return SeriesNetwork(self, FILE_NODES)

    def _start_norm(self, x: Tensor) -> None:
        """Choose constants so that random readings give every number deviation 1."""
        m = Product(self, self.edges(x)).all().unflatten(1, (NODES, NODES))
        mean, deviation = m.mean(0), m.std(0)
        # numbers that hardly vary are centred, not magnified
        scale = torch.maximum(deviation, SMALLEST * m.abs().mean())
        self.gain.copy_(1 / scale)
        self.bias.copy_(-mean / scale)
        self.readout.start(self.structured(self.edges(x)))


def sum_of_silu(first: Tensor, second: Tensor) -> Tensor:
    """sum_t silu(first_atp + second_btp), (K, K, P, H), for (K, T, P, H) each."""
    total = torch.zeros((), dtype=first.dtype, device=first.device)
    for a, b in zip(first.unbind(1), second.unbind(1), strict=True):
        total = total + nn.functional.silu(a[:, None] + b)
    return total


class SeriesNetwork(nn.Module):
    """A trained DisGNet as the series of its 21 functions and its head: what its file evaluates.

    Args:
        net: the network.
        count: K; the series are computed in float64.
    """

    single: Tensor
    pairs: Tensor

    def __init__(self, net: DisGNet, count: int) -> None:
        super().__init__()
        self.net = net
        exact = copy.deepcopy(net)
        exact.cast(torch.float64)
        with torch.no_grad():
            single, pairs = exact.series(count, 0.5, exact.range_middle)
        self.register_buffer("single", single.to(net.dtype))
        self.register_buffer("pairs", pairs.to(net.dtype))

    def raw(self, legs: Tensor) -> Tensor:
        """Raw numbers (N, 12), float64, for readings (N, 6), float64."""
        z = self.net.of_series(self.net.normalised(legs), self.single, self.pairs)
        return self.net.finish(z).double()

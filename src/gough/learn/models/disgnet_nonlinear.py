"""DisGNet (Zhu et al., 2024) with a nonlinear 2-FWL step, as its sources publish it.

Every ordered pair of nodes (u, v) has a feature of width H. With d the nodes' order and e the
distance matrix, and * element by element,

    h_uv  = f1(emb d_u) * f2(emb d_v) * g(rbf e_uv)                            initialisation
    m_uv  = norm_uv( S(h_uv) * sum_j P(h_uj) * Q(h_jv) )                       2-FWL product
    h'_uv = F(m_uv)                                                            update
    z     = sum_uv h'_uv / 12                                                  readout

then dense layers, and a linear map to twelve numbers. f1, f2, g are stacks of dense layers, P, Q, S
one each, F residual layers. The paper writes h <- f_mp(h, {{ ... }}) and refers to Li et al.
(k-DisGNNs) and Maron et al. for f_mp; the code of both applies a nonlinear map at every pair before
pairs are summed, Li et al.'s to the product of the pair's own features with the sum. `disgnet` of
this package is linear there.

One 2-FWL step makes h'_uv a function of at most two leg lengths: the only legs in row u and column
v are those at the nodes u and v. So z is a sum of 15 functions of two legs and 6 of one, and the
network has three evaluations of the same weights:

- dense: the statement above, 12 x 12 x 12, for any distance matrix;
- structured: the sum over j written out, with the terms that hold no leg computed once;
- tables: each of the 21 functions at K x K (or K) Chebyshev nodes, then as a bivariate series. The
  cost hardly depends on the batch. A table represents the network only if its features are smooth
  in the leg's length, so legs have wide Gaussians over their own range.
"""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor, nn

from gough.learn.data import NODES
from gough.learn.models.base import Scaling
from gough.learn.models.disgnet import BEYOND, chebyshev
from gough.learn.models.graph import GraphNetwork
from gough.learn.models.layers import Dense, RadialBasis, Standardise, dense_stack
from gough.platform import Platform

LEG_PAIRS = [(i, j) for i in range(6) for j in range(i + 1, 6)]
# tuples (u, v): those of two legs i < j with u on leg i, and those of one leg
TWO = [(u, v) for i, j in LEG_PAIRS for u in (i, i + 6) for v in (j, j + 6)]
ONE = [(u, v) for i in range(6) for u in (i, i + 6) for v in (i, i + 6)]


class NonlinearDisGNet(GraphNetwork):
    """DisGNet with a nonlinear map after the 2-FWL product.

    Args:
        platform: the machine.
        scaling: its scales.
        width: H.
        initial: dense layers in each map of the initialisation.
        update: residual layers of F.
        head: dense layers before the last linear map.
        embedding: width of the nodes' embedding.
        bumps: radial basis functions.
        table: K, nodes per leg of the tables that training uses; 0: none, exact.
        form: "structured" or "dense".
    """

    kind = "disgnet-nonlinear"
    range_middle: Tensor
    range_half: Tensor
    leg_middle: Tensor
    leg_half: Tensor
    gain: Tensor
    bias: Tensor

    def __init__(self, platform: Platform, scaling: Scaling, *, width: int = 96, initial: int = 3,
                 update: int = 2, head: int = 2, embedding: int = 8, bumps: int = 32,
                 table: int = 16, form: Literal["structured", "dense"] = "structured"
                 ) -> None:  # fmt: skip
        super().__init__(platform, scaling)
        self.form, self.table = form, table
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
        self.left, self.right, self.own = (Dense(width, width) for _ in range(3))
        self.update = nn.Sequential(*(Dense(width, width, norm=False) for _ in range(update)))
        self.readout = Standardise(width)
        self.head = nn.Sequential(
            *(Dense(width, width, norm=False) for _ in range(head)), nn.LayerNorm(width)
        )
        self.last = nn.Linear(width, self.outputs)
        self.start_near_home(self.last)
        # the constants of norm_uv, and the readout's, from random readings and first weights
        self.register_buffer("gain", torch.ones(NODES, NODES, width))
        self.register_buffer("bias", torch.zeros(NODES, NODES, width))
        with torch.no_grad():
            self._start_norm(torch.randn(512, 6))

    def network(self, x: Tensor) -> Tensor:
        if self.form == "dense":
            order = torch.arange(NODES, device=x.device)
            return self.dense(self.matrix(self.edges(x)), order)
        if self.training and self.table:
            return self._finish(self._tabulated(x))
        return self._finish(self._structured(self.edges(x)))

    # ---- the statement ----------------------------------------------------------------

    def dense(self, matrix: Tensor, order: Tensor) -> Tensor:
        """Raw numbers (N, 12) for scaled distance matrices (N, 12, 12) of any graph.

        Args:
            matrix: distances.
            order: (12,) the node of the platform that each row and column stands for.
        """
        legs = self._leg_mask(matrix)[order][:, order]
        bumps = torch.where(legs, self._leg_bumps(matrix), self.basis(matrix))
        h = self._nodes()[order][:, order] * self.edge(bumps)  # (N, 12, 12, H)
        product = torch.einsum("nujh,njvh->nuvh", self.left(h), self.right(h))
        gain, bias = (b[order][:, order].to(h.dtype) for b in (self.gain, self.bias))
        updated = self.update(self.own(h) * product * gain + bias)
        return self._finish(updated.sum((1, 2)) / NODES)

    def _nodes(self) -> Tensor:
        """f1(emb d_u) * f2(emb d_v), (12, 12, H)."""
        return self.node_first(self.embed.weight)[:, None] * self.node_second(self.embed.weight)

    def _leg_bumps(self, edges: Tensor) -> Tensor:
        """Gaussian features (..., bumps) of lengths of legs' edges, over the legs' own range.

        They are half the range wide, so that short series represent them.
        """
        y = (edges - self.leg_middle.to(edges)) / self.leg_half.to(edges)  # -1..1
        centres = torch.linspace(-1, 1, self.bumps, dtype=edges.dtype, device=edges.device)
        return torch.exp(-2 * (y[..., None] - centres) ** 2)

    def _leg_mask(self, like: Tensor) -> Tensor:
        """Pairs (12, 12, 1) of nodes that a leg joins."""
        out = torch.zeros(NODES, NODES, 1, dtype=torch.bool, device=like.device)
        base, top = self.graph.legs.T.tolist()
        out[base, top] = out[top, base] = True
        return out

    def _finish(self, pooled: Tensor) -> Tensor:
        return self.last(self.head(self.readout(pooled)))

    # ---- by pairs of legs -------------------------------------------------------------

    def _structured(self, edges: Tensor) -> Tensor:
        """z (N, H) for scaled lengths (N, 6) of the legs' edges."""
        terms = _Terms(self, edges)
        u, v = _columns(TWO, edges)
        two = self._updated(terms.two(u, v, terms.p[:, u], terms.q[:, v]), u, v)
        two = two + self._updated(terms.two(v, u, terms.p[:, v], terms.q[:, u]), v, u)
        return (two.sum(1) + self._of_one(terms).sum((1, 2))) / NODES

    def _tabulated(self, x: Tensor) -> Tensor:
        """z (N, H) for normalised readings (N, 6), by series."""
        K, pairs = self.table, len(LEG_PAIRS)
        at, analysis = chebyshev(K, x)
        middle, half = self.range_middle.to(x), self.range_half.to(x)
        terms = _Terms(self, self.edges(middle + half * at[:, None]))  # at K nodes of each leg
        u, v = _columns(TWO, x)  # first axis of a grid: the leg of u, second: that of v
        two = self._updated(terms.two(u, v, terms.p[:, None, u], terms.q[None, :, v]), u, v)
        two = two + self._updated(terms.two(v, u, terms.p[None, :, v], terms.q[:, None, u]), v, u)
        values = two.unflatten(2, (pairs, 4)).sum(3)  # (K, K, 15, H)
        pair_series = torch.einsum("ka,lb,abph->pklh", analysis, analysis, values).flatten(0, 2)
        leg_series = torch.einsum("ka,aih->ikh", analysis, self._of_one(terms).sum(2))
        angle = ((x - middle) / half).clamp(-1, 1).acos()
        phi = torch.cos(angle[..., None] * torch.arange(K, device=x.device))  # (N, 6, K)
        i, j = _columns(LEG_PAIRS, x)
        products = (phi[:, i, :, None] * phi[:, j, None, :]).flatten(1)  # (N, 15 K K)
        return (products @ pair_series + phi.flatten(1) @ leg_series.flatten(0, 1)) / NODES

    def _of_one(self, terms: _Terms) -> Tensor:
        """Updated features of the four tuples of each leg, (N, 6, 4, H)."""
        u, v = _columns(ONE, terms.p)
        return self._updated(terms.one(u, v), u, v).unflatten(1, (6, 4))

    def _updated(self, product: Tensor, u: Tensor, v: Tensor) -> Tensor:
        """h'_uv (..., T, H) for products (..., T, H) of tuples u, v (T,)."""
        return self.update(product * self.gain[u, v].to(product) + self.bias[u, v].to(product))

    def _start_norm(self, x: Tensor) -> None:
        """Choose norm_uv and the readout's constants so that random readings have deviation 1."""
        terms = _Terms(self, self.edges(x))
        for tuples, of in ((TWO, None), ([(v, u) for u, v in TWO], None), (ONE, terms.one)):
            u, v = _columns(tuples, x)
            t = of(u, v) if of else terms.two(u, v, terms.p[:, u], terms.q[:, v])
            mean, deviation = t.mean(0), t.std(0)
            # numbers that hardly vary are centred, not magnified
            scale = torch.maximum(deviation, 1e-3 * t.abs().mean())
            self.gain[u, v], self.bias[u, v] = 1 / scale, -mean / scale
        self.readout.start(self._structured(self.edges(x)))


class _Terms:
    """Constant and leg-dependent terms of the 2-FWL product for lengths (N, 6) of legs' edges.

    sum_j P(h_uj) Q(h_jv) is C_uv, the sum over j where neither pair is a leg, plus P(h_uj) Q(h_jv)
    for j the other end of u's leg and of v's leg, which is the same j if u = v.

    Attributes:
        p, q, s: (N, 12, H) P and S of the pair (u, other end of u's leg), Q of (other end, v).
    """

    def __init__(self, net: NonlinearDisGNet, edges: Tensor) -> None:
        nodes, legs = net._nodes(), net._leg_mask(edges)
        fixed = nodes * net.edge(net.basis(net.ring_matrix.to(edges)))
        P, Q, S = (layer(fixed).masked_fill(legs, 0) for layer in (net.left, net.right, net.own))
        self.sum = torch.einsum("ujh,jvh->uvh", P, Q)
        self.P, self.Q, self.S = P, Q, S
        self.other = torch.arange(NODES, device=edges.device).roll(6)
        base, top = net.graph.legs.T.tolist()
        features = net.edge(net._leg_bumps(edges))  # (N, 6, H)
        up, down = nodes[base, top] * features, nodes[top, base] * features
        self.p = torch.cat([net.left(up), net.left(down)], dim=1)
        self.q = torch.cat([net.right(down), net.right(up)], dim=1)
        self.s = torch.cat([net.own(up), net.own(down)], dim=1)

    def two(self, u: Tensor, v: Tensor, p: Tensor, q: Tensor) -> Tensor:
        """Products (..., T, H) of tuples of two legs, for p of row u and q of column v."""
        product = self.sum[u, v] + p * self.Q[self.other[u], v] + self.P[u, self.other[v]] * q
        return self.S[u, v] * product

    def one(self, u: Tensor, v: Tensor) -> Tensor:
        """Products (N, T, H) of tuples of one leg: u = v, or the leg's own pair."""
        p, q, same = self.p[:, u], self.q[:, v], (u == v)[:, None]
        product = self.sum[u, v] + p * self.Q[self.other[u], v] + self.P[u, self.other[v]] * q
        product = product + torch.where(same, p * q, 0)
        return torch.where(same, self.S[u, v], self.s[:, u]) * product


def _columns(pairs: list[tuple[int, int]], like: Tensor) -> Tensor:
    """First and second numbers of pairs, (2, T)."""
    return torch.tensor(pairs, device=like.device).T

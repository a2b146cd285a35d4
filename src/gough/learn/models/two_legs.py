"""The 2-FWL product of DisGNet, split by legs.

sum_j P(h_uj) Q(h_jv) is C_uv, the sum over j where neither pair is a leg, plus P(h_uj) Q(h_jv) for
j the other end of u's leg and of v's leg, which is the same j if u = v. So for u and v on
different legs

    m_uv = constant_uv + of_u_uv * p_u + of_v_uv * q_v

where p_u = P(h_uj) depends on u's leg and q_v = Q(h_jv) on v's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor

from gough.learn.data import NODES

if TYPE_CHECKING:
    from gough.learn.models.disgnet import DisGNet

Norm = tuple[Tensor, Tensor]
LEG_PAIRS = [(i, j) for i in range(6) for j in range(i + 1, 6)]
# (u, v) with u on the first of two legs and v on the second, by side of u, side of v, pair of legs
FORTH = [(u * 6 + i, v * 6 + j) for u in (0, 1) for v in (0, 1) for i, j in LEG_PAIRS]


class Product:
    """m_uv for lengths (N, 6) of the legs' edges.

    Attributes:
        p, q, s: (N, 12, H) P and S of the pair (u, other end of u's leg), Q of (other end, v).
        constant, of_u, of_v: (12, 12, H), zero for u and v on one leg.
    """

    def __init__(self, net: DisGNet, edges: Tensor, *norm: Tensor) -> None:
        nodes, legs = net.nodes(), net.leg_mask(edges)
        fixed = nodes * net.edge(net.basis(net.ring_matrix.to(edges)))
        P, Q, S = (f(fixed).masked_fill(legs, 0) for f in (net.left, net.right, net.own_of))
        base, top = net.graph.legs.T.tolist()
        features = net.edge(net.leg_bumps(edges))  # (N, 6, H)
        up, down = nodes[base, top] * features, nodes[top, base] * features
        self.p = net.left(torch.cat([up, down], dim=1))
        self.q = net.right(torch.cat([down, up], dim=1))
        C = torch.einsum("ujh,jvh->uvh", P, Q)
        gain, bias = net.gain.to(edges), net.bias.to(edges)
        Q_other, P_other = Q.roll(6, 0), P.roll(6, 1)  # the other end: six nodes on
        self.own = net.own_of(torch.cat([up, down], dim=1)) * across(gain)
        self.constant, self.of_u, self.of_v = (
            C * (S * gain) + bias,
            Q_other * (S * gain),
            P_other * (S * gain),
        )
        # u = v, and the leg's own pair
        self.same = diagonal(S * gain) * (diagonal(C) + self.p * self.q) + diagonal(bias)
        own = across(C) + self.p * across(Q_other) + across(P_other) * self.q.roll(6, 1)
        self.cross = self.own * own + across(bias)
        two = torch.ones(NODES, NODES, dtype=edges.dtype, device=edges.device)
        leg = torch.arange(NODES, device=edges.device) % 6
        self.mask = (two * (leg[:, None] != leg))[..., None]
        self.constant, self.of_u, self.of_v = (
            t * self.mask for t in (self.constant, self.of_u, self.of_v)
        )
        if norm:
            self.normalise(*norm)

    def norm(self, to_series: Tensor) -> Norm:
        """Mean and 1 / deviation (H,) of m over all pairs and the legs' range.

        By the series of p, q and m: with the weight 1 / sqrt(1 - y^2), the mean of a series is its
        first coefficient and its variance half the sum of the others' squares.
        """
        (p, vp), (q, vq), (o, vo) = (
            _moments(to_series, t) for t in (self.p, self.q, torch.cat([self.same, self.cross], 1))
        )
        mean = self.constant + self.of_u * p[:, None] + self.of_v * q
        variance = self.of_u.square() * vp[:, None] + self.of_v.square() * vq
        middle = (mean.sum((0, 1)) + o.sum(0)) / NODES**2
        away = ((mean - middle).square() * self.mask + variance).sum((0, 1))
        away = away + ((o - middle).square() + vo).sum(0)
        return middle, (away / NODES**2 + 1e-12).rsqrt()

    def normalise(self, mean: Tensor, scale: Tensor) -> None:
        """Replace m by (m - mean) * scale."""
        self.constant = (self.constant - mean * self.mask) * scale
        self.of_u, self.of_v = self.of_u * scale, self.of_v * scale
        self.same, self.cross = (self.same - mean) * scale, (self.cross - mean) * scale

    def rows(self) -> Tensor:
        """The part of m_uv that u's leg and constants make, (N, 12, 12, H)."""
        return self.constant + self.of_u * self.p[:, :, None]

    def columns(self) -> Tensor:
        """The part of m_uv that v's leg makes, (N, 12, 12, H)."""
        return self.of_v * self.q[:, None]

    def one(self) -> Tensor:
        """m_uv (N, 24, H) for u = v, then for (u, other end of u's leg)."""
        return torch.cat([self.same, self.cross], dim=1)

    def all(self) -> Tensor:
        """m_uv (N, 144, H)."""
        m = self.rows() + self.columns()
        u = torch.arange(NODES, device=m.device)
        m = m.flatten(1, 2).index_copy(1, u * 13, self.same)
        return m.index_copy(1, u * 12 + (u + 6) % 12, self.cross)


def of_pairs(rows: Tensor, columns: Tensor) -> tuple[Tensor, Tensor]:
    """Parts (K, 8, 15, H) on the first and on the second leg of each pair of legs.

    Args:
        rows: parts (K, 144, H) of the pairs (u, v) that depend on u's leg.
        columns: parts that depend on v's.
    """
    u, v = torch.tensor(FORTH, device=rows.device).T
    forth, back = u * NODES + v, v * NODES + u + NODES**2
    both = torch.cat([rows, columns], dim=1)
    first = both.index_select(1, torch.cat([forth, back]))
    second = both.index_select(1, torch.cat([forth + NODES**2, back - NODES**2]))
    return first.unflatten(1, (8, 15)), second.unflatten(1, (8, 15))


def diagonal(t: Tensor) -> Tensor:
    """t_uu (12, H)."""
    return t.diagonal().mT


def across(t: Tensor) -> Tensor:
    """t_uv (12, H) for v the other end of u's leg."""
    return t.roll(-6, 1).diagonal().mT


def _moments(to_series: Tensor, values: Tensor) -> tuple[Tensor, Tensor]:
    """Mean and variance (T, H) of functions with values (K, T, H) at the nodes."""
    series = (to_series @ values.flatten(1)).view_as(values)
    return series[0], series[1:].square().sum(0) / 2

"""Chebyshev series of functions of one leg and of two, through values at a few nodes."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

BEYOND = 1.15  # range of the series, relative to the sampled range of readings


def nodes_of(count: int, shift: float = 0.5) -> Tensor:
    """Nodes (K,) in -1..1, float64: cos((k + shift) pi / K); 0.5 gives Chebyshev's."""
    return torch.from_numpy(np.cos(_angles(count, shift)))


def analysis(count: int, shift: float = 0.5) -> Tensor:
    """Matrix (K, K), float64, from values at these nodes to the series through them."""
    return torch.from_numpy(np.linalg.inv(np.cos(_angles(count, shift)[:, None] * range(count))))


def chebyshev(count: int, y: Tensor) -> Tensor:
    """Chebyshev polynomials T_0 to T_K-1 (..., K) of y, which is held to -1..1."""
    k = torch.arange(count, dtype=y.dtype, device=y.device)
    return torch.cos(y.clamp(-1, 1).acos()[..., None] * k)


def series_of_two(to_series: Tensor, values: Tensor) -> Tensor:
    """Series (T, P, H) of P functions of two legs, from values (K, K, P, H) at pairs of nodes.

    The T = K (K + 1) / 2 terms T_k T_l of total degree k + l < K stay, by k and then l.
    """
    K = len(to_series)
    first = (to_series @ values.flatten(1)).view_as(values)
    both = (to_series @ first.flatten(2)).view_as(values)
    return torch.cat([both[k, : K - k] for k in range(K)])


def products_of_two(first: Tensor, second: Tensor) -> Tensor:
    """Products T_k T_l (N, T, P) of polynomials (N, K, P) of the first and the second leg."""
    K = first.shape[1]
    return torch.cat([first[:, k, None] * second[:, : K - k] for k in range(K)], dim=1)


def _angles(count: int, shift: float) -> np.ndarray:
    return (np.arange(count) + shift) * np.pi / count

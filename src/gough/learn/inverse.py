"""Inverses of many small matrices by matrix products alone, as the DisGNet paper takes them.

From Z_0 = J^T / (|J|_1 |J|_inf) the iteration

    Z <- Z (13 I - JZ (15 I - JZ (7 I - JZ))) / 4

of Razavi et al. (2014) turns the error E = I - JZ into (3 E^3 + E^4) / 4: it cubes. J Z_0 is
symmetric with eigenvalues s^2 / (|J|_1 |J|_inf) in [0, 1], s the singular values of J, so that E
shrinks from the first step on if and only if J is regular. See docs/gpu_newton.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Inverses:
    """Approximate inverses Z of matrices J.

    Attributes:
        Z: (N, n, n).
        error: (N,) `|I - JZ|` in the Frobenius norm; NaN for a matrix that holds one.
        iterations: (N,) int64.
    """

    Z: Tensor
    error: Tensor
    iterations: Tensor


def first_inverse(J: Tensor) -> Tensor:
    """Z_0 (..., n, n) of matrices J (..., n, n)."""
    size = torch.linalg.matrix_norm(J, 1) * torch.linalg.matrix_norm(J, torch.inf)
    return J.mT / size[..., None, None]


def next_inverse(Z: Tensor, JZ: Tensor) -> Tensor:
    """Z_(f+1) of Z_f and J Z_f, each (..., n, n)."""
    eye = torch.eye(JZ.shape[-1], dtype=JZ.dtype, device=JZ.device)
    return Z @ (13 * eye - JZ @ (15 * eye - JZ @ (7 * eye - JZ))) / 4


def approximate_inverse(J: Tensor, f_max: int = 20) -> Inverses:
    """Iterate each of the matrices J (N, n, n) until its error is below sqrt(eps) of the dtype.

    Each stops by itself, after at most f_max iterations, whatever the others do: the answer for a
    matrix does not depend on its company.
    """
    enough = torch.finfo(J.dtype).eps ** 0.5
    eye = torch.eye(J.shape[-1], dtype=J.dtype, device=J.device)
    Z, error = torch.empty_like(J), J.new_empty(len(J))
    iterations = torch.zeros(len(J), dtype=torch.int64, device=J.device)
    left = torch.arange(len(J), device=J.device)
    z = first_inverse(J)
    for f in range(f_max + 1):
        JZ = J @ z
        now = torch.linalg.matrix_norm(eye - JZ)
        open_ = (now > enough) & (f < f_max)  # not so where it is NaN
        done = ~open_
        if done.any():
            rows = left[done]
            Z[rows], error[rows], iterations[rows] = z[done], now[done], f
            if not open_.any():
                break
            J, z, JZ, left = J[open_], z[open_], JZ[open_], left[open_]
        z = next_inverse(z, JZ)
    return Inverses(Z, error, iterations)

"""The rotation nearest to a 3x3 matrix: what 9D-SVD orthogonalisation computes."""

from __future__ import annotations

import torch
from torch import Tensor


def nearest_rotation(matrix: Tensor) -> Tensor:
    """U diag(1, 1, det(U V^T)) V^T of matrices M = U S V^T, (..., 3, 3).

    Source: Levinson et al., An Analysis of SVD for Deep Rotation Estimation (2020).
    """
    return _NearestRotation.apply(matrix)  # pyright: ignore[reportReturnType]


class _NearestRotation(torch.autograd.Function):
    """With the closed-form gradient, which needs no division by differences of squares."""

    @staticmethod
    def forward(ctx, matrix: Tensor) -> Tensor:
        u, s, vt = torch.linalg.svd(matrix)
        sign = torch.sign(torch.linalg.det(u) * torch.linalg.det(vt))
        u = torch.cat([u[..., :2], u[..., 2:] * sign[..., None, None]], dim=-1)
        s = torch.cat([s[..., :2], s[..., 2:] * sign[..., None]], dim=-1)
        ctx.save_for_backward(u, s, vt)
        return u @ vt

    @staticmethod
    def backward(ctx, grad: Tensor) -> Tensor:  # pyright: ignore[reportIncompatibleMethodOverride]
        """dR = U [(U^T dM V - V^T dM^T U) / (s_i + s_j)] V^T, transposed."""
        u, s, vt = ctx.saved_tensors
        inner = u.mT @ grad @ vt.mT
        sums = s[..., :, None] + s[..., None, :]
        sums = torch.where(sums.abs() < 1e-12, torch.full_like(sums, 1e-12), sums)
        return u @ ((inner - inner.mT) / sums) @ vt

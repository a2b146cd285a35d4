"""The exponential of SE(3) in torch, its inverse and its derivative, with any leading axes.

xi = (rho [unit], w [rad]) stands for the pose with R = exp(w) and t = V(w) rho, where

    V = I + a [w] + b [w]^2,    a = (1 - cos q) / q^2,    b = (q - sin q) / q^3,    q = |w|

is the left Jacobian of SO(3) (Sola, Deray, Atchuthan, A micro Lie theory (2018), eq. 145, 172).
`Pose.exp` and `Pose.log` are the same in NumPy.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from gough.learn.kinematics import quaternion_to_matrix

# Factors of (-q^2)^k in sin q / q, a, b, a' / q, b' / q: for q < 1 ten terms reach rounding.
_SERIES = [
    [
        1 / math.factorial(2 * k + 1),
        1 / math.factorial(2 * k + 2),
        1 / math.factorial(2 * k + 3),
        -(2 * k + 2) / math.factorial(2 * k + 4),
        -(2 * k + 2) / math.factorial(2 * k + 5),
    ]
    for k in range(10)
]


def exp(xi: Tensor) -> tuple[Tensor, Tensor]:
    """Positions (..., 3) [unit] and rotations (..., 3, 3) of xi (..., 6)."""
    rho, w = xi[..., :3], xi[..., 3:]
    _, a, b, _, _ = _coefficients(w)
    once = torch.linalg.cross(w, rho)
    return rho + a * once + b * torch.linalg.cross(w, once), rotation_exp(w)


def log(position: Tensor, rotation: Tensor) -> Tensor:
    """xi (..., 6) with |w| <= pi of positions (..., 3) and rotations (..., 3, 3)."""
    wxyz = matrix_to_quaternion(rotation)
    sine = torch.linalg.vector_norm(wxyz[..., 1:], dim=-1, keepdim=True)
    angle = 2 * torch.atan2(sine, wxyz[..., :1])
    small = sine < 1e-8  # there angle / sine is 2 to rounding
    w = wxyz[..., 1:] * torch.where(small, 2.0, angle / torch.where(small, 1.0, sine))
    return _with_position(position, w)


def shortest(xi: Tensor) -> Tensor:
    """xi (..., 6) of the same poses with |w| <= pi."""
    position, _ = exp(xi)
    w = xi[..., 3:]
    angle = torch.linalg.vector_norm(w, dim=-1, keepdim=True)
    turns = torch.round(angle / (2 * torch.pi))
    return _with_position(position, w * (1 - 2 * torch.pi * turns / angle.clamp(min=1e-30)))


def exp_jacobian(xi: Tensor) -> Tensor:
    """d twist / d xi, (..., 6, 6), the twist as in `gough.jacobian`.

    [[V, D], [0, V]] with D = d(V rho) / d w. This is the left Jacobian of SE(3) but for its first
    rows: those of the left Jacobian give the velocity of the point at the base's origin.
    """
    rho, w = xi[..., :3], xi[..., 3:]
    _, a, b, slope_a, slope_b = _coefficients(w)
    W, P = hat(w), hat(rho)
    once = torch.linalg.cross(w, rho)
    twice = torch.linalg.cross(w, once)
    a, b = a[..., None], b[..., None]
    V = torch.eye(3, dtype=xi.dtype, device=xi.device) + a * W + b * (W @ W)
    D = (slope_a * once + slope_b * twice)[..., None] * w[..., None, :]
    D = D - a * P - b * (hat(once) + W @ P)
    low = torch.cat([torch.zeros_like(V), V], dim=-1)
    return torch.cat([torch.cat([V, D], dim=-1), low], dim=-2)


def rotation_exp(w: Tensor) -> Tensor:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) [rad]."""
    half = torch.linalg.vector_norm(w, dim=-1, keepdim=True) / 2
    wxyz = torch.cat([half.cos(), w / 2 * torch.sinc(half / torch.pi)], dim=-1)
    return quaternion_to_matrix(wxyz)


def matrix_to_quaternion(rotation: Tensor) -> Tensor:
    """Unit quaternions (..., 4), w >= 0, of rotation matrices: see `gough.pose.matrix_to_wxyz`."""
    m = rotation
    diagonal = m.diagonal(dim1=-2, dim2=-1)
    trace = diagonal.sum(-1, keepdim=True)
    squares = torch.cat([1 + trace, 1 + 2 * diagonal - trace], dim=-1)  # 4 w^2, 4 x^2, ...
    a, b, c = m[..., 2, 1], m[..., 0, 2], m[..., 1, 0]
    d, e, f = m[..., 1, 2], m[..., 2, 0], m[..., 0, 1]
    s0, s1, s2, s3 = squares.unbind(-1)
    rows = [s0, a - d, b - e, c - f, a - d, s1, c + f, b + e,
            b - e, c + f, s2, a + d, c - f, b + e, a + d, s3]  # fmt: skip
    candidates = torch.stack(rows, dim=-1).unflatten(-1, (4, 4))
    best = squares.argmax(dim=-1)[..., None, None].expand(*squares.shape[:-1], 1, 4)
    wxyz = candidates.gather(-2, best)[..., 0, :]
    wxyz = wxyz / torch.linalg.vector_norm(wxyz, dim=-1, keepdim=True)
    return torch.where(wxyz[..., :1] < 0, -wxyz, wxyz)


def hat(v: Tensor) -> Tensor:
    """Matrices (..., 3, 3) of the cross product by v (..., 3)."""
    x, y, z = v.unbind(-1)
    o = torch.zeros_like(x)
    return torch.stack([o, -z, y, z, o, -x, -y, x, o], dim=-1).unflatten(-1, (3, 3))


def _with_position(position: Tensor, w: Tensor) -> Tensor:
    """xi = (V^-1 t, w).

    V^-1 = I - [w] / 2 + c [w]^2, c = (1 - (q/2) cot(q/2)) / q^2 = -a' / (2 a q).
    """
    _, a, _, slope_a, _ = _coefficients(w)
    once = torch.linalg.cross(w, position)
    rho = position - once / 2 - slope_a / (2 * a) * torch.linalg.cross(w, once)
    return torch.cat([rho, w], dim=-1)


def _coefficients(w: Tensor) -> tuple[Tensor, ...]:
    """sin q / q, a, b, a' / q, b' / q, each (..., 1); none loses digits at small q."""
    square = (w * w).sum(-1)
    small = square < 1
    table = torch.tensor(_SERIES, dtype=w.dtype, device=w.device)
    x = torch.where(small, square, 0)[..., None]
    series = torch.zeros_like(x)
    for row in reversed(table):
        series = row - x * series
    square = torch.where(small, 1, square)
    q = square.sqrt()
    sinc = q.sin() / q
    a, b = 2 * (q / 2).sin() ** 2 / square, (1 - sinc) / square
    closed = torch.stack([sinc, a, b, (sinc - 2 * a) / square, (a - 3 * b) / square], dim=-1)
    return torch.where(small[..., None], series, closed).split(1, dim=-1)

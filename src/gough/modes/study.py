"""Complex poses as quaternions and positions: the little algebra that homotopies need.

Quaternions e (..., 4) and positions t (..., 3) are complex128 here, and dots are without
conjugation: R(e) = Q(e) / (e.e) has R R^T = 1, and R is real where e is, up to a factor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]


def product(a: NDArray, b: NDArray) -> NDArray:
    """Hamilton product of quaternions (..., 4)."""
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    scalar = aw * bw - np.sum(av * bv, axis=-1, keepdims=True)
    return np.concatenate([scalar, aw * bv + bw * av + np.cross(av, bv)], axis=-1)


def rotation(e: Complex) -> Complex:
    """Complex rotation matrices (..., 3, 3)."""
    w, x, y, z = np.moveaxis(e, -1, 0)
    n = w * w + x * x + y * y + z * z
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2) / n[..., None, None]


def inverse(e: Complex, t: Complex) -> tuple[Complex, Complex]:
    """The poses that undo these: base and platform change roles."""
    conjugate = e * np.array([1.0, -1.0, -1.0, -1.0])
    return conjugate, -np.einsum("...ij,...j->...i", rotation(conjugate), t)


def squared_lengths(e: Complex, t: Complex, base: Complex, moving: Complex) -> Complex:
    """l^2 of the six struts, (..., 6)."""
    d = np.einsum("...ij,kj->...ki", rotation(e), moving) + t[..., None, :] - base
    return np.sum(d * d, axis=-1)


def distances(a: tuple[Complex, Complex], b: tuple[Complex, Complex]) -> NDArray[np.float64]:
    """How far poses a (A,) and b (B,) are apart, (A, B): largest difference in R and t.

    Relative to the size of a's numbers where those are above 1.
    """
    ka, kb = (np.concatenate([rotation(e).reshape(len(e), 9), t], axis=1) for e, t in (a, b))
    scale = np.maximum(1.0, np.abs(ka).max(axis=1, initial=0.0))[:, None]
    return np.abs(ka[:, None] - kb[None]).max(axis=2, initial=0.0) / scale


def distinct(e: Complex, t: Complex, apart: float) -> NDArray[np.int64]:
    """Indices of poses of which no earlier kept one is within `apart`."""
    gaps = distances((e, t), (e, t))
    kept: list[int] = []
    for i in range(len(e)):
        if not any(gaps[i, k] < apart for k in kept):
            kept.append(i)
    return np.array(kept, dtype=np.int64)

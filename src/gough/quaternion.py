"""Rotations as unit quaternions (w, x, y, z): every formula once, for any leading batch axes.

`product`, `to_matrix` and `conjugate` hold for complex numbers too (no conjugation of complex
parts is taken), which the homotopy of `gough.modes` relies on. Compiled code, PyTorch and ball
arithmetic repeat `product` and `to_matrix`; their tests compare them with these.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import GoughError

SERIES_ANGLE = 0.3  # [rad] below it, series whose first dropped term is under 1e-15


def conjugate(wxyz: NDArray) -> NDArray:
    """Quaternions (..., 4) of the inverse rotations."""
    return wxyz * np.array([1.0, -1.0, -1.0, -1.0])


def product(a: NDArray, b: NDArray) -> NDArray:
    """Hamilton product of quaternions (..., 4): the rotation b, then a."""
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    scalar = aw * bw - np.sum(av * bv, axis=-1, keepdims=True)
    return np.concatenate([scalar, aw * bv + bw * av + np.cross(av, bv)], axis=-1)


def to_matrix(wxyz: NDArray) -> NDArray:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    w, x, y, z = np.moveaxis(wxyz, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def from_matrix(rotation: Array) -> Array:
    """Unit quaternions (..., 4), w >= 0, of rotation matrices (..., 3, 3).

    The largest of the four squared components is the divisor, so no case loses digits
    (Shepperd 1978).
    """
    m = rotation
    trace = np.trace(m, axis1=-2, axis2=-1)
    diagonal = np.diagonal(m, axis1=-2, axis2=-1)
    # four times the squares of w, x, y, z
    squares = np.concatenate([(1 + trace)[..., None], 1 + 2 * diagonal - trace[..., None]], -1)
    a, b, c = m[..., 2, 1], m[..., 0, 2], m[..., 1, 0]
    d, e, f = m[..., 1, 2], m[..., 2, 0], m[..., 0, 1]
    s0, s1, s2, s3 = np.moveaxis(squares, -1, 0)
    candidates = np.stack(
        [
            np.stack([s0, a - d, b - e, c - f], axis=-1),
            np.stack([a - d, s1, c + f, b + e], axis=-1),
            np.stack([b - e, c + f, s2, a + d], axis=-1),
            np.stack([c - f, b + e, a + d, s3], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(squares, axis=-1)[..., None, None]
    q = np.take_along_axis(candidates, best, axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., :1] < 0, -q, q)


def from_rotation_vector(vector: Array) -> Array:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) [rad]."""
    half = np.linalg.norm(vector, axis=-1, keepdims=True) / 2
    # np.sinc(x) is sin(pi x) / (pi x) and is exact at zero
    return np.concatenate([np.cos(half), vector / 2 * np.sinc(half / np.pi)], axis=-1)


def to_rotation_vector(wxyz: Array) -> Array:
    """Rotation vectors (..., 3) [rad] of unit quaternions (..., 4), angle in [0, pi]."""
    q = np.where(wxyz[..., :1] < 0, -wxyz, wxyz)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    small = sine < 1e-8  # there angle / sine is 2 to rounding
    return q[..., 1:] * np.where(small, 2.0, angle / np.where(small, 1.0, sine))


def from_euler(angles: Array) -> Array:
    """Unit quaternions (..., 4) of Euler angles (..., 3) [rad], R = Rx(a) Ry(b) Rz(c)."""
    ca, cb, cc = np.moveaxis(np.cos(angles / 2), -1, 0)
    sa, sb, sc = np.moveaxis(np.sin(angles / 2), -1, 0)
    w = ca * cb * cc - sa * sb * sc
    x = sa * cb * cc + ca * sb * sc
    y = ca * sb * cc - sa * cb * sc
    z = ca * cb * sc + sa * sb * cc
    return np.stack([w, x, y, z], axis=-1)


def from_axes(angles: Array, order: str) -> Array:
    """Unit quaternions (..., 4) of angles (..., 3) [rad] about three axes, one after the other.

    Args:
        order: three axes, "XYZ" or "ZYX" about those of the rotated frame (R = Rx Ry Rz for
            "XYZ"), or "xyz" about those at rest (R = Rz Ry Rx for "xyz").

    Raises:
        GoughError: another order, or the same axis twice in a row.
    """
    axes = order.lower() if isinstance(order, str) else ""
    known = len(axes) == 3 and set(axes) <= set("xyz") and order in (axes, axes.upper())
    if not known or axes[0] == axes[1] or axes[1] == axes[2]:
        raise GoughError(
            f"order: expected three axes such as 'XYZ' (about axes that turn along) or 'xyz' "
            f"(about axes at rest), found {order!r}"
        )
    first, second, third = (
        from_rotation_vector(angles[..., i : i + 1] * np.eye(3)["xyz".index(axis)])
        for i, axis in enumerate(axes)
    )
    if order == axes:
        first, third = third, first
    return product(product(first, second), third)


def to_euler(wxyz: Array) -> Array:
    """Euler angles (..., 3) [rad] with R = Rx(a) Ry(b) Rz(c), b in [-pi/2, pi/2].

    From half the sum and half the difference of a and c, so that the angles describe the
    rotation to rounding at b = +-pi/2 too, where only one of the two is determined
    (Bernardes and Viollet 2022).
    """
    w, x, y, z = np.moveaxis(wxyz, -1, 0)
    plus, minus = np.arctan2(x + z, w + y), np.arctan2(x - z, w - y)
    b = 2 * np.arctan2(np.hypot(w + y, x + z), np.hypot(w - y, x - z)) - np.pi / 2
    a, c = (
        angle - 2 * np.pi * np.round(angle / (2 * np.pi)) for angle in (plus + minus, plus - minus)
    )
    return np.stack([a, b, c], axis=-1)


def angle_between(a: Array, b: Array) -> Array:
    """Angle (...) [rad] of the rotation from one unit quaternion (..., 4) to the other."""
    turn = product(conjugate(a), b)
    return 2 * np.arctan2(np.linalg.norm(turn[..., 1:], axis=-1), np.abs(turn[..., 0]))


def left_jacobian_terms(angle: Array) -> tuple[Array, Array]:
    """(1 - cos) / angle^2 and (angle - sin) / angle^3, neither losing digits near zero."""
    small = angle < SERIES_ANGLE
    t, t2 = np.where(small, 1.0, angle), angle * angle
    series = 1 / 6 - t2 / 120 * (1 - t2 / 42 * (1 - t2 / 72 * (1 - t2 / 110)))
    b = np.where(small, series, (t - np.sin(t)) / t**3)
    return np.sinc(angle / (2 * np.pi)) ** 2 / 2, b


def inverse_left_jacobian_term(angle: Array) -> Array:
    """(1 - (angle / 2) cot(angle / 2)) / angle^2, which tends to 1/12."""
    small = angle < SERIES_ANGLE
    t, t2 = np.where(small, 1.0, angle), angle * angle
    series = 1 / 12 + t2 / 720 * (1 + t2 / 42 * (1 + t2 / 40 * (1 + t2 * 30240 / 1197504)))
    return np.where(small, series, (1 - t / 2 / np.tan(t / 2)) / t**2)

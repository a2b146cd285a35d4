"""The bounds of the certificate, for eight poses at once; `gough.certificate` explains them.

The functions calculate with the slots of an array `z` of reals (see lanes.py), or with a list of
NumPy arrays; `shared` holds what all poses have in common. Operations are carried out in the
order written here, as the bounds on rounding assume (products and sums may become one fused
operation, which only saves a rounding).
"""

from __future__ import annotations

import numpy as np

from gough.kernel.jit import jit
from gough.kernel.lanes import LANES, Reals, compiled, larger, loop

UNIT = 2.0**-53
# Bounds on rounding, in UNITs, derived in docs/proofs.md and rounded up generously:
STRUT = 96.0  # error of a computed strut over the sum of the lengths it is made of
SQUARE = 8.0  # further error of d.d - l^2 over d.d + l^2
SLACK = 1.0 + 1e-9  # for the arithmetic of the bounds themselves

# Slots of `z`
E, T, BASE, LENGTH = 0, 4, 7, 25  # a pose, (rotated) base joints, strut lengths
RADIUS, ERROR = 31, 32  # the result: radii of uniqueness and of existence
A, F, BOUND = 33, 69, 75  # Jacobian, (d.d - l^2) / 2, the b_i
ROUND_F, ROUND_A = 81, 87  # what rounding may have changed F_i and the row A_i by
SLOTS = 93

# Slots of `shared`: the rotation of the base frame as quaternion and matrix; the platform joints
# from their centre, the centre, their root mean square
TURN, MATRIX, ARMS, CENTRE, SIZE = 0, 4, 13, 31, 34


@jit(fast=False)
def bound_rows(shared, base, lengths, position, wxyz, radius, error, z):
    """Fill radius and error (N,) for N poses; rows that fail keep what they have.

    Args:
        shared: (SIZE + 1,), see the slots.
        base: (N or 1, 6, 3), already rotated.
        lengths, position, wxyz: (N, 6), (N, 3), (N, 4).
        z: (SLOTS * LANES,) to work in.
    """
    count = lengths.shape[0]
    for first in range(0, count, LANES):
        for w in range(LANES):
            row = min(first + w, count - 1)
            for i in range(6):
                z[(LENGTH + i) * LANES + w] = lengths[row, i]
                if first == 0 or base.shape[0] > 1:
                    for k in range(3):
                        z[(BASE + 3 * i + k) * LANES + w] = base[row % base.shape[0], i, k]
            for k in range(3):
                z[(T + k) * LANES + w] = position[row, k]
            for k in range(4):
                z[(E + k) * LANES + w] = wxyz[row, k]
        _bound(z, shared)
        for w in range(min(LANES, count - first)):
            good, near = z[RADIUS * LANES + w], z[ERROR * LANES + w]
            if good > near >= 0.0:  # false for NaN
                radius[first + w], error[first + w] = good, near


def bound(z, shared) -> None:
    """Radii of uniqueness and of existence of the poses in `z`."""
    equations(z, shared)
    a = [[z[A + 6 * i + j] for j in range(6)] for i in range(6)]
    beta, delta, kappa = _norms(z, a, invert(a))
    # the Study quadric adds a component to the translation: 2 g0 = -(2 L r).(2 c) / (2 L)
    size = shared[SIZE]
    kappa = np.sqrt(kappa * kappa + 0.25 / size / size) * SLACK
    free = 1.0 - delta * SLACK
    inner = free * free - kappa * beta * 4.0 * SLACK
    z[RADIUS] = free / (kappa * 2.0) * (2.0 - SLACK)
    z[ERROR] = beta * 2.0 / (free + np.sqrt(inner)) * SLACK


_bound = compiled(bound, Reals)


def equations(z, shared) -> None:
    """F(0), A, the b_i, and bounds on rounding."""
    a, b, c, s = (z[E + k] for k in range(4))
    u, v0, v1, v2 = (shared[TURN + k] for k in range(4))
    w = a * u - b * v0 - c * v1 - s * v2
    x = b * u + a * v0 + s * v1 - c * v2
    y = c * u + a * v1 + b * v2 - s * v0
    s = s * u + a * v2 + c * v0 - b * v1
    n = 2.0 / (w * w + x * x + y * y + s * s)
    rotation = [
        [1.0 - (y * y + s * s) * n, (x * y - w * s) * n, (x * s + w * y) * n],
        [(x * y + w * s) * n, 1.0 - (x * x + s * s) * n, (y * s - w * x) * n],
        [(x * s - w * y) * n, (y * s + w * x) * n, 1.0 - (x * x + y * y) * n],
    ]
    t, centre = [z[T + k] for k in range(3)], [shared[CENTRE + k] for k in range(3)]
    matrix = [[shared[MATRIX + 3 * i + k] for k in range(3)] for i in range(3)]
    origin = [_dot(t, matrix[i]) + _dot(rotation[i], centre) for i in range(3)]
    size, per_size = shared[SIZE], 1.0 / shared[SIZE]
    # sums of magnitudes bound norms, for rounding, without square roots
    away = _magnitude(t) + _magnitude(centre)
    for i in loop(z, 6):
        p, base = (
            [shared[ARMS + 3 * i + k] for k in range(3)],
            [z[BASE + 3 * i + k] for k in range(3)],
        )
        q = [_dot(row, p) for row in rotation]
        d = [q[k] + origin[k] - base[k] for k in range(3)]
        m = [q[k] * 2.0 - d[k] for k in range(3)]
        dd, mm, square = _dot(d, d), _dot(m, m), z[LENGTH + i] * z[LENGTH + i]
        f = dd - square
        z[F + i] = f * 0.5
        lever, reach = _magnitude(p), _magnitude(d)
        strut = (_magnitude(base) + away + lever) * (STRUT * UNIT)
        z[ROUND_F + i] = strut * (reach + strut) + (dd + square) * (SQUARE * UNIT)
        z[ROUND_A + i] = strut * (reach + strut + (lever + size)) * per_size
        curved = np.sqrt(dd + mm) * (0.5 * per_size)
        curved = curved + (larger(dd, mm) + abs(f)) * (0.125 * per_size * per_size)
        z[BOUND + i] = (curved + 0.5) * SLACK
        moment = [
            (q[1] * d[2] - q[2] * d[1]) * per_size,
            (q[2] * d[0] - q[0] * d[2]) * per_size,
            (q[0] * d[1] - q[1] * d[0]) * per_size,
        ]
        for k in range(3):
            z[A + 6 * i + 2 * k], z[A + 6 * i + 2 * k + 1] = d[k], moment[k]


def invert(a):
    """About the inverse of a (6 x 6): Gauss and Jordan, without pivoting."""
    y = [list(row) for row in a]
    for k in range(6):
        pivot = 1.0 / y[k][k]
        y[k] = [value * pivot for value in y[k]]
        y[k][k] = pivot
        for i in range(6):
            if i != k:
                factor = y[i][k]
                y[i] = [y[i][j] - factor * y[k][j] for j in range(6)]
                y[i][k] = factor * pivot * -1.0
    return y


def _norms(z, a, y):
    """Upper bounds beta, delta and kappa; rows 0, 2, 4 of Y are the translation's."""
    beta, delta, kappa = [], [], []
    for block in range(2):
        rows = [y[block + 2 * k] for k in range(3)]
        norm = [np.sqrt(_dot(column, column)) for column in zip(*rows, strict=True)]
        step = [_sum(row[i] * z[F + i] for i in range(6)) for row in rows]
        defect = [
            _sum(row[i] * a[i][j] for i in range(6)) - float(j == block + 2 * k)
            for k, row in enumerate(rows)
            for j in range(6)
        ]
        curve, stray, blur = (
            _sum(norm[i] * z[first + i] for i in range(6)) for first in (BOUND, ROUND_F, ROUND_A)
        )
        beta.append(np.sqrt(_sum(v * v for v in step)) + stray)
        delta.append(np.sqrt(_sum(v * v for v in defect) * 2.0) + blur)
        kappa.append(curve)
    return larger(*beta), larger(*delta), larger(*kappa)


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _magnitude(v):
    """Sum of the magnitudes of the components, which is not below the norm."""
    return abs(v[0]) + abs(v[1]) + abs(v[2])


def _sum(terms):
    """Sum from left to right."""
    first, *others = terms
    for term in others:
        first = first + term
    return first

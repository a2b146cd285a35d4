"""A polynomial of six readings, evaluated for a block of poses at once.

The inner loops run over the poses of a block with unsigned indices: with signed ones Numba
must allow for negative (wrapping) indices, and LLVM then gives up on vector code.
"""

from __future__ import annotations

import numpy as np

from gough.kernel.equations import inline, put_quaternion
from gough.kernel.layout import WIDTH

CLAMP = 1.25  # readings further out than this share of the fitted range are drawn in to it
SPAN = np.uint64(WIDTH)


@inline
def _scale(scaling, readings, u):
    """Readings as -1..1 over the fitted range; NaN becomes 0."""
    for leg in range(6):
        centre, factor = scaling[0, leg], scaling[1, leg]
        for k in range(WIDTH):
            value = (readings[leg * WIDTH + k] - centre) * factor
            value = min(max(value, -CLAMP), CLAMP)
            u[leg * WIDTH + k] = value if value == value else 0.0


@inline
def _multiply(lower, u, upper, parent, variable):
    """Monomials of one degree (`upper`) from those of the degree below: parent times variable."""
    for m in range(len(parent)):
        p, v = np.uint64(parent[m]) * SPAN, np.uint64(variable[m]) * SPAN
        o = np.uint64(m) * SPAN
        for k in range(SPAN):
            upper[o + k] = lower[p + k] * u[v + k]


@inline
def _accumulate(coefficients, monomials, total, first, last):
    """Add the terms of monomials first..last, two at a time, to the six outputs."""
    c = coefficients
    o1, o2, o3, o4, o5 = SPAN, SPAN + SPAN, SPAN * 3, SPAN * 4, SPAN * 5
    for m in range(first, last, 2):
        a0, a1, a2, a3, a4, a5 = c[m, 0], c[m, 1], c[m, 2], c[m, 3], c[m, 4], c[m, 5]
        n = m + 1
        b0, b1, b2, b3, b4, b5 = c[n, 0], c[n, 1], c[n, 2], c[n, 3], c[n, 4], c[n, 5]
        p, q = np.uint64(m - first) * SPAN, np.uint64(n - first) * SPAN
        for k in range(SPAN):
            x, y = monomials[p + k], monomials[q + k]
            total[k] += a0 * x + b0 * y
            total[o1 + k] += a1 * x + b1 * y
            total[o2 + k] += a2 * x + b2 * y
            total[o3 + k] += a3 * x + b3 * y
            total[o4 + k] += a4 * x + b4 * y
            total[o5 + k] += a5 * x + b5 * y


@inline
def _place(total, anchor, buffer):
    """Outputs as internal poses: position, and the quaternion (1, h) times the anchor."""
    w, x, y, z = anchor
    for k in range(WIDTH):
        for axis in range(3):
            buffer[axis * WIDTH + k] = total[axis * WIDTH + k]
        a, b, c = total[3 * WIDTH + k], total[4 * WIDTH + k], total[5 * WIDTH + k]
        put_quaternion(
            buffer, k, WIDTH,
            w - a * x - b * y - c * z,
            x + a * w + b * z - c * y,
            y + b * w + c * x - a * z,
            z + c * w + a * y - b * x,
        )  # fmt: skip


@inline
def guess_block(polynomial, readings, work, buffer):
    """Internal poses of a block into the buffer.

    Args:
        polynomial: coefficients (M, 6); parent and variable (M,) of each monomial; scaling
            (2, 6), the readings' centre and inverse half range; first monomial of each degree
            and the end (degree + 2,); anchor (4,), the quaternion that turns are counted from.
            Parents are counted within the degree below; every degree has an even count.
        readings: (6 * WIDTH,), reading i of pose k at i * WIDTH + k.
        work: monomials, (2, largest count of a degree * WIDTH).
    """
    coefficients, parent, variable, scaling, starts, anchor = polynomial
    u, total = np.empty(6 * WIDTH), np.empty(6 * WIDTH)
    _scale(scaling, readings, u)
    for o in range(6):
        total[o * WIDTH : (o + 1) * WIDTH] = coefficients[0, o]
    lower, upper = work[0], work[1]
    lower[:WIDTH] = 1.0
    for degree in range(1, len(starts) - 1):
        first, last = starts[degree], starts[degree + 1]
        _multiply(lower, u, upper, parent[first:last], variable[first:last])
        _accumulate(coefficients, upper, total, first, last)
        lower, upper = upper, lower
    _place(total, anchor, buffer)

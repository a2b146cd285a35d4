"""A polynomial of six readings that gives poses, evaluated for blocks of rows.

The inner loops run over the rows of a block with unsigned indices: with signed ones Numba
must allow for negative (wrapping) indices, and LLVM then gives up on vector code.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from gough.kernel.jit import inline, jit
from gough.kernel.layout import WIDTH

CLAMP = 1.25  # readings further out than this share of the fitted range are drawn in to it
SPAN = np.uint64(WIDTH)
ZERO, ONE, TWO, THREE, FOUR, FIVE = np.arange(6).astype(np.uint64)


@jit()
def evaluate(polynomial, legs, work, out):
    """Fill `out` (N, 7) with the internal poses of readings legs (N, 6).

    Args:
        polynomial: coefficients (M, 6); parent and variable (M,) of each monomial; scaling
            (2, 6), the readings' centre and inverse half range; first monomial of each degree
            and the end (degree + 2,); turn (5,), see `gough.seeds.polynomial.Polynomial`.
            Parents are counted within the degree below; every degree has an even count; whole
            numbers are unsigned.
        work: (6 WIDTH,), (6 WIDTH,) and (2 WIDTH times the largest count of a degree,) to work in.
    """
    coefficients, parent, variable, scaling, degrees, turn = polynomial
    u, total, monomials = work
    half = np.uint64(len(monomials)) // TWO
    for start in range(0, len(legs), WIDTH):
        for k in range(WIDTH):
            row = start + k if start + k < len(legs) else len(legs) - 1
            for leg in range(6):
                total[leg * WIDTH + k] = legs[row, leg]
        for leg in range(6):
            centre, factor, at = scaling[0, leg], scaling[1, leg], np.uint64(leg) * SPAN
            for k in range(SPAN):
                value = (total[at + k] - centre) * factor
                value = value if value < CLAMP else (CLAMP if value == value else 0.0)
                u[at + k] = value if value > -CLAMP else -CLAMP
        for o in range(6):
            for k in range(WIDTH):
                total[o * WIDTH + k] = coefficients[0, o]
        lower, upper = ZERO, half
        for k in range(SPAN):
            monomials[lower + k] = 1.0
        for degree in range(1, len(degrees) - 1):
            first, last = degrees[degree], degrees[degree + 1]
            _multiply(monomials, lower, u, upper, parent, variable, first, last)
            _accumulate(coefficients, monomials, upper, total, first, last)
            lower, upper = upper, lower
        _decode(total, u, turn)
        for k in range(WIDTH if start + WIDTH < len(legs) else len(legs) - start):
            for c in range(3):
                out[start + k, c] = total[c * WIDTH + k]
            for c in range(4):
                out[start + k, 3 + c] = u[c * WIDTH + k]


@inline
def _multiply(monomials, lower, u, upper, parent, variable, first, last):
    """Monomials of one degree, from `upper` on: those of the degree below times a variable."""
    for m in range(first, last):
        p, v, o = lower + parent[m] * SPAN, variable[m] * SPAN, upper + (m - first) * SPAN
        for k in range(SPAN):
            monomials[o + k] = monomials[p + k] * u[v + k]


@inline
def _accumulate(coefficients, monomials, upper, total, first, last):
    """Add the terms of monomials first..last, two at a time, to the six outputs."""
    c = coefficients
    o1, o2, o3, o4, o5 = SPAN, SPAN * TWO, SPAN * THREE, SPAN * FOUR, SPAN * FIVE
    for m in range(first, last, TWO):
        a0, a1, a2, a3, a4, a5 = c[m, 0], c[m, 1], c[m, 2], c[m, 3], c[m, 4], c[m, 5]
        n = m + ONE
        b0, b1, b2, b3, b4, b5 = c[n, 0], c[n, 1], c[n, 2], c[n, 3], c[n, 4], c[n, 5]
        p = upper + (m - first) * SPAN
        q = p + SPAN
        for k in range(SPAN):
            x, y = monomials[p + k], monomials[q + k]
            total[k] += a0 * x + b0 * y
            total[o1 + k] += a1 * x + b1 * y
            total[o2 + k] += a2 * x + b2 * y
            total[o3 + k] += a3 * x + b3 * y
            total[o4 + k] += a4 * x + b4 * y
            total[o5 + k] += a5 * x + b5 * y


@inline
def _decode(total, wxyz, turn):
    """Rotations of a block as quaternions, component c of pose k at wxyz[c * WIDTH + k].

    With u the last three of the six outputs, (turn[4] + sqrt(1 - u.u), u) is along the quaternion
    of the rotation from the reference turn[:4].
    """
    w, x, y, z, offset = turn[0], turn[1], turn[2], turn[3], turn[4]
    o2, o3, o4, o5 = SPAN * TWO, SPAN * THREE, SPAN * FOUR, SPAN * FIVE
    for k in range(SPAN):
        a, b, c = total[o3 + k], total[o4 + k], total[o5 + k]
        rest = 1 - a * a - b * b - c * c
        s = offset + sqrt(rest if rest > 0 else 0.0)
        q0 = s * w - a * x - b * y - c * z
        q1 = s * x + a * w + b * z - c * y
        q2 = s * y + b * w + c * x - a * z
        q3 = s * z + c * w + a * y - b * x
        norm = 1 / sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
        wxyz[k], wxyz[SPAN + k] = q0 * norm, q1 * norm
        wxyz[o2 + k], wxyz[o3 + k] = q2 * norm, q3 * norm

"""Elimination of 6x6 systems in a fixed order: no branch, so that loops become vector code."""

from __future__ import annotations

from gough.kernel.jit import inline

# Elimination of the first unknown from row r by pivot row p, `inverse` being 1 / p[0]. The
# result is one shorter; one function a length, since compiled tuples have a fixed length.


@inline
def _drop7(p, r, inverse):
    m = r[0] * inverse
    return (
        r[1] - m * p[1], r[2] - m * p[2], r[3] - m * p[3],
        r[4] - m * p[4], r[5] - m * p[5], r[6] - m * p[6],
    )  # fmt: skip


@inline
def _drop6(p, r, inverse):
    m = r[0] * inverse
    return (
        r[1] - m * p[1], r[2] - m * p[2], r[3] - m * p[3],
        r[4] - m * p[4], r[5] - m * p[5],
    )  # fmt: skip


@inline
def _drop5(p, r, inverse):
    m = r[0] * inverse
    return r[1] - m * p[1], r[2] - m * p[2], r[3] - m * p[3], r[4] - m * p[4]


@inline
def _drop4(p, r, inverse):
    m = r[0] * inverse
    return r[1] - m * p[1], r[2] - m * p[2], r[3] - m * p[3]


@inline
def _drop3(p, r, inverse):
    m = r[0] * inverse
    return r[1] - m * p[1], r[2] - m * p[2]


@inline
def eliminate(r0, r1, r2, r3, r4, r5):
    """Solve the 6x6 system with rows r_i = (six coefficients, right side), no pivoting.

    Returns the six unknowns and the determinant.
    """
    i0 = 1 / r0[0]
    a1, a2, a3 = _drop7(r0, r1, i0), _drop7(r0, r2, i0), _drop7(r0, r3, i0)
    a4, a5 = _drop7(r0, r4, i0), _drop7(r0, r5, i0)
    i1 = 1 / a1[0]
    b2, b3, b4, b5 = _drop6(a1, a2, i1), _drop6(a1, a3, i1), _drop6(a1, a4, i1), _drop6(a1, a5, i1)
    i2 = 1 / b2[0]
    c3, c4, c5 = _drop5(b2, b3, i2), _drop5(b2, b4, i2), _drop5(b2, b5, i2)
    i3 = 1 / c3[0]
    d4, d5 = _drop4(c3, c4, i3), _drop4(c3, c5, i3)
    i4 = 1 / d4[0]
    e5 = _drop3(d4, d5, i4)
    x5 = e5[1] / e5[0]
    x4 = (d4[2] - d4[1] * x5) * i4
    x3 = (c3[3] - c3[1] * x4 - c3[2] * x5) * i3
    x2 = (b2[4] - b2[1] * x3 - b2[2] * x4 - b2[3] * x5) * i2
    x1 = (a1[5] - a1[1] * x2 - a1[2] * x3 - a1[3] * x4 - a1[4] * x5) * i1
    x0 = (r0[6] - r0[1] * x1 - r0[2] * x2 - r0[3] * x3 - r0[4] * x4 - r0[5] * x5) * i0
    return x0, x1, x2, x3, x4, x5, r0[0] * a1[0] * b2[0] * c3[0] * d4[0] * e5[0]

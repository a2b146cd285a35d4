"""From the ends of paths to real poses: which ends are real, refined to rounding.

The solutions for real readings are closed under conjugation, so an end is either real or one
of a pair; both stand far apart in practice (below 1e-10 against above 1e-2). An end that is
close to real is refined by real Newton steps, and counts as real if they converge near by.
"""

from __future__ import annotations

import numpy as np

from gough.kernel.jit import jit
from gough.kernel.paths import FINITE, STUCK

COMPLEX, REAL, DOUBTFUL = 0, 1, 2  # kinds of ends; DOUBTFUL: close to real, Newton undecided
NEAR_REAL = 1e-3  # imaginary part over size from which an end is complex beyond doubt
SAME = 1e-6  # difference of complex poses over their size below which they are one
FAR = 10.0  # times the largest distance of a real pose, from which a path has left for infinity
STEPS = 8  # of Newton at most, with residuals that still fall


@jit()
def solve6(a, x):
    """Solve a x = x in place, by elimination with partial pivoting. False if singular."""
    for k in range(6):
        best = k
        for i in range(k + 1, 6):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if a[best, k] == 0.0:
            return False
        if best != k:
            for j in range(k, 6):
                a[k, j], a[best, j] = a[best, j], a[k, j]
            x[k], x[best] = x[best], x[k]
        for i in range(k + 1, 6):
            factor = a[i, k] / a[k, k]
            for j in range(k + 1, 6):
                a[i, j] -= factor * a[k, j]
            x[i] -= factor * x[k]
    for i in range(5, -1, -1):
        for j in range(i + 1, 6):
            x[i] -= a[i, j] * x[j]
        x[i] /= a[i, i]
    return True


@jit()
def rotate(e, p, q):
    """q = R(e) p for a unit quaternion and (6, 3) points."""
    w, x, y, z = e[0], e[1], e[2], e[3]
    for i in range(p.shape[0]):
        a, b, c = p[i, 0], p[i, 1], p[i, 2]
        u, v, s = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
        q[i, 0] = a + w * u + y * s - z * v
        q[i, 1] = b + w * v + z * u - x * s
        q[i, 2] = c + w * s + x * v - y * u


@jit()
def legs_at(p, base, squares, e, t, a, x):
    """Rows (d, q x d) into a (6, 6), (l^2 - d.d) / 2 into x (6,); returns the largest |x|."""
    q = np.empty((6, 3))
    rotate(e, p, q)
    worst = 0.0
    for i in range(6):
        d0, d1, d2 = (
            q[i, 0] + t[0] - base[i, 0],
            q[i, 1] + t[1] - base[i, 1],
            q[i, 2] + t[2] - base[i, 2],
        )
        a[i, 0], a[i, 1], a[i, 2] = d0, d1, d2
        a[i, 3] = q[i, 1] * d2 - q[i, 2] * d1
        a[i, 4] = q[i, 2] * d0 - q[i, 0] * d2
        a[i, 5] = q[i, 0] * d1 - q[i, 1] * d0
        x[i] = 0.5 * (squares[i] - (d0 * d0 + d1 * d1 + d2 * d2))
        worst = max(worst, abs(x[i]))
    return worst


@jit()
def turn_and_shift(e, t, x):
    """Move a real pose by x = (shift, rotation vector), to first order, and renormalise."""
    r0, r1, r2 = 0.5 * x[3], 0.5 * x[4], 0.5 * x[5]
    w, i, j, k = e[0], e[1], e[2], e[3]
    e[0] = w - r0 * i - r1 * j - r2 * k
    e[1] = i + r0 * w + r1 * k - r2 * j
    e[2] = j + r1 * w + r2 * i - r0 * k
    e[3] = k + r2 * w + r0 * j - r1 * i
    n = 1.0 / np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3])
    for m in range(4):
        e[m] *= n
    for m in range(3):
        t[m] += x[m]


@jit()
def refine(p, base, squares, e, t):
    """Newton from a real pose, in place, while the residual falls.

    Returns:
        The largest |l^2 - d.d| / 2 that is left, and how far the pose has moved.
    """
    a, x = np.empty((6, 6)), np.empty(6)
    best_e, best_t = e.copy(), t.copy()
    best, moved = np.inf, 0.0
    for _ in range(STEPS):
        left = legs_at(p, base, squares, e, t, a, x)
        if not left < best:
            break
        best = left
        best_e[:], best_t[:] = e, t
        if left == 0.0 or not solve6(a, x):
            break
        for k in range(6):
            moved += abs(x[k])
        if not moved < 1.0:
            break
        turn_and_shift(e, t, x)
    e[:], t[:] = best_e, best_t
    return best, moved


@jit()
def make_real(e, t, out_e, out_t):
    """Real parts of a complex pose whose e is given up to a complex factor.

    Returns:
        How far the pose is from real: the largest imaginary part of e (its square being 1)
        or t, over the size of t.
    """
    square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]
    factor = 1.0 / np.sqrt(square)
    away, size, norm = 0.0, 1.0, 0.0
    for k in range(4):
        value = e[k] * factor
        out_e[k] = value.real
        norm += value.real * value.real
        away = max(away, abs(value.imag))
    for k in range(4):
        out_e[k] /= np.sqrt(norm)
    for k in range(3):
        out_t[k] = t[k].real
        away = max(away, abs(t[k].imag))
        size = max(size, abs(t[k].real))
    return away / size


@jit()
def real_ends(p, base, squares, e, t, ends, tolerance, out_e, out_t, kind):
    """Find and refine the real ones among the ends of one set of readings.

    Args:
        p: (6, 3); base: (6, 3); squares: (6,), real and normalised.
        e, t, ends: (P, 4), (P, 3) complex, (P,).
        tolerance: largest |l^2 - d.d| / 2 of a pose that has the legs.
        out_e, out_t: (P, 4), (P, 3) the real poses; kind: (P,).
    """
    for k in range(e.shape[0]):
        kind[k] = COMPLEX
        if ends[k] != FINITE:
            continue
        away = make_real(e[k], t[k], out_e[k], out_t[k])
        if not away < NEAR_REAL:
            continue
        left, moved = refine(p, base, squares, out_e[k], out_t[k])
        near = moved <= 100.0 * away + 1e-6
        kind[k] = REAL if left <= tolerance and near else DOUBTFUL


@jit()
def repeated(e, t, ends):
    """Whether two paths of one set of readings ended at the same complex pose.

    Regular solutions are never shared by paths, so one of them has jumped, or both have come
    to a multiple solution.
    """
    paths = e.shape[0]
    for i in range(paths):
        for j in range(i):
            if ends[i] == FINITE and ends[j] == FINITE and _same(e[i], t[i], e[j], t[j]):
                return True
    return False


@jit()
def _same(e, t, f, u):
    """Whether two complex poses agree to SAME of their size."""
    size = 1.0
    for k in range(3):
        size = max(size, abs(t[k]))
    for k in range(3):
        if abs(t[k] - u[k]) > SAME * size:
            return False
    ee, ff, ef = 0j, 0j, 0j
    for k in range(4):
        ee, ff, ef = ee + e[k] * e[k], ff + f[k] * f[k], ef + e[k] * f[k]
    # for e = +-f with e.e = f.f = 1, e.f = +-1
    return abs(ef * ef / (ee * ff) - 1.0) < SAME


@jit()
def finish_rows(
    p, base, squares, e, t, ends, distant, careful, tolerance, out_e, out_t, kind, away, clean
):
    """`real_ends` for N sets of readings; arguments as there, with an axis for the sets.

    Args:
        distant: (P,) starts so far away that their paths lead to no pose: they may be lost.
        careful: steps were short, so that a path that ends far away was meant to.
        away: (N, P) to be filled: paths that went to infinity.
        clean: (N,) to be filled: the other paths arrived, apart and without doubt.
    """
    for row in range(squares.shape[0]):
        real_ends(
            p, base[row % base.shape[0]], squares[row], e[row], t[row], ends[row], tolerance,
            out_e[row], out_t[row], kind[row],
        )  # fmt: skip
        clean[row] = not repeated(e[row], t[row], ends[row])
        for k in range(e.shape[1]):
            if ends[row, k] == FINITE:
                clean[row] = clean[row] and kind[row, k] != DOUBTFUL
            else:
                gone = careful and ends[row, k] == STUCK and is_far(t[row, k], squares[row])
                away[row, k] = distant[k] or gone
                clean[row] = clean[row] and away[row, k]


@jit()
def is_far(t, squares):
    """Whether a position is far beyond any real pose's: a leg and the joints' distances from 0."""
    reach = 2.0 + np.sqrt(np.max(squares))
    return max(abs(t[0]), abs(t[1]), abs(t[2])) > FAR * reach

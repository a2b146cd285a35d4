"""The certificate once more, in ball arithmetic with as many digits as needed.

Slow; it checks `gough.certificate`, whose bounds it repeats, and proves the stored start system
(tools/start_system.py). Every number is a ball that holds the exact one (Arb, through
python-flint). Poses may be complex; norms are Hermitian then, which changes one bound (see
`_curvature`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import flint
import numpy as np
from flint import acb, acb_mat, arb

BITS = 240
Vector = list  # of balls


@dataclass(frozen=True, eq=False)
class Proof:
    """A solution in balls.

    Attributes:
        e, t: four and three balls, the refined pose (exact midpoints).
        error: a solution lies within this of it, in the certificate's measure (a float above).
        radius: and no other within this (a float below).
    """

    e: Vector
    t: Vector
    error: float
    radius: float


def prove(base, moving, squares, e, t, steps: int = 6) -> Proof | None:
    """Refine a pose and prove that exactly one solution is near it; None if that fails.

    Args:
        base, moving: (6, 3); squares: (6,); e: (4,); t: (3,), real or complex, taken as exact.
        steps: of Newton; 0 proves the pose as it is given.
    """
    flint.ctx.prec = BITS
    base, moving = ([numbers(row) for row in m] for m in (base, moving))
    squares, e, t = (numbers(row) if not isinstance(row, list) else row for row in (squares, e, t))
    for _ in range(steps):
        f, a, *_ = equations(base, moving, squares, e, t)
        try:
            x = a.inv() * acb_mat(6, 1, [-v for v in f])
        except ZeroDivisionError:
            return None
        e, t = _moved(moving, e, t, [x[i, 0] for i in range(6)])
        e, t = [acb(v.mid()) for v in e], [acb(v.mid()) for v in t]
    return _radii(base, moving, squares, e, t)


def numbers(values) -> Vector:
    """Numbers as balls that hold just them."""
    return [acb(complex(v)) for v in values]


def size_of(moving) -> arb:
    """L: root mean square distance of the joints from their centre (midpoints)."""
    centre = [sum(row[k] for row in moving) / 6 for k in range(3)]
    total = arb(0)
    for row in moving:
        for k in range(3):
            part = row[k] - centre[k]
            total += part.real * part.real + part.imag * part.imag
    return (total / 6).sqrt()


def equations(base, moving, squares, e, t):
    """F(0) = f / 2, A (rows (d, q x d / L)), struts, m, L, all as in `certificate`."""
    centre = [sum(row[k] for row in moving) / 6 for k in range(3)]
    size = size_of(moving)
    n = sum(v * v for v in e)
    origin = [_rotate(e, n, centre)[k] + t[k] for k in range(3)]
    f, rows, d, m = [], [], [], []
    for i in range(6):
        q = _rotate(e, n, [moving[i][k] - centre[k] for k in range(3)])
        d.append([q[k] + origin[k] - base[i][k] for k in range(3)])
        m.append([2 * q[k] - d[i][k] for k in range(3)])
        f.append((_dot(d[i], d[i]) - squares[i]) / 2)
        rows += d[i] + [v / size for v in _cross(q, d[i])]
    return f, acb_mat(6, 6, rows), d, m, size


def _radii(base, moving, squares, e, t) -> Proof | None:
    f, a, d, m, size = equations(base, moving, squares, e, t)
    try:
        y = a.inv()
    except ZeroDivisionError:
        return None
    step = y * acb_mat(6, 1, f)
    bounds = [_curvature(d[i], m[i], f[i], size) for i in range(6)]
    beta, kappa = arb(0), arb(0)
    for block in (range(3), range(3, 6)):
        beta = beta.max(_norm([step[i, 0] for i in block]))
        kappa = kappa.max(sum(_norm([y[k, i] for k in block]) * bounds[i] for i in range(6)))
    kappa = (kappa**2 + 1 / (4 * size**2)).sqrt()
    inner = 1 - 4 * kappa * beta
    if not inner > 0:
        return None
    error, radius = 2 * beta / (1 + inner.sqrt()), 1 / (2 * kappa)
    return Proof(e, t, _above(error), -_above(-radius))


def _curvature(d: Vector, m: Vector, f: acb, size: arb) -> arb:
    """b_i. For complex r, (r x m).(r x m) and (r x d).(r x d) need not have one sign."""
    dd, mm = _norm(d) * _norm(d), _norm(m) * _norm(m)
    real = all(v.imag == 0 for v in [*d, *m])
    long = dd.max(mm) if real else dd + mm
    return arb(0.5) + (dd + mm).sqrt() / (2 * size) + (long + 2 * _norm([f])) / (8 * size**2)


def _moved(moving, e, t, x):
    """The pose whose Study parameters relative to (e, t), about the joints' centre, are x."""
    size = size_of(moving)
    centre = [sum(row[k] for row in moving) / 6 for k in range(3)]
    c, r = [v / 2 for v in x[:3]], [v / (2 * size) for v in x[3:]]
    n = sum(v * v for v in e)
    before = [_rotate(e, n, centre)[k] + t[k] for k in range(3)]
    rr, rc, cr = _dot(r, r), _dot(r, c), _cross(c, r)
    after = [before[k] + 2 * (c[k] + rc * r[k] - cr[k]) / (1 + rr) for k in range(3)]
    rv = _cross(r, e[1:])
    turned = [e[0] - _dot(r, e[1:])] + [e[1 + k] + r[k] * e[0] + rv[k] for k in range(3)]
    n = sum(v * v for v in turned)
    return turned, [after[k] - _rotate(turned, n, centre)[k] for k in range(3)]


def relative(moving, e, t, f, u) -> tuple[arb, arb]:
    """|2 g| and |2 L r| of the pose (f, u) in the Study parameters about (e, t)."""
    size = size_of(moving)
    centre = [sum(row[k] for row in moving) / 6 for k in range(3)]
    n, k = sum(v * v for v in e), sum(v * v for v in f)
    shift = [_rotate(f, k, centre)[i] + u[i] - _rotate(e, n, centre)[i] - t[i] for i in range(3)]
    back = [e[0], -e[1], -e[2], -e[3]]
    w = f[0] * back[0] - _dot(f[1:], back[1:])
    cross = _cross(f[1:], back[1:])
    r = [(f[0] * back[1 + i] + back[0] * f[1 + i] + cross[i]) / w for i in range(3)]
    # g = t e / 2 with e = (1, r): 2 g = (-t.r, t + t x r)
    turned = _cross(shift, r)
    g = [-_dot(shift, r)] + [shift[i] + turned[i] for i in range(3)]
    return _norm(g), 2 * size * _norm(r)


def _rotate(e: Vector, n, p: Sequence) -> Vector:
    v = e[1:]
    once = _cross(v, p)
    twice = _cross(v, once)
    return [p[k] + 2 * (e[0] * once[k] + twice[k]) / n for k in range(3)]


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a, b) -> Vector:
    return [a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3] for k in range(3)]


def _norm(v: Vector) -> arb:
    """The norm; an upper bound where it may be 0."""
    parts = [part for x in v for part in (acb(x).real, acb(x).imag)]
    square = sum((part * part for part in parts), arb(0))
    return square.sqrt() if square > 0 else arb(square.upper()).sqrt()


def _above(x: arb) -> float:
    return float(np.nextafter(float(x.upper()), np.inf))

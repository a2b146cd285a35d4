"""The six leg equations and their Taylor series along a path, for eight complex poses at once.

A pose is a quaternion e and a position t, here both complex, with R(e) = Q(e) / (e.e). Poses
near one are written relative to it in Study parameters (1, r; g0, c) with g0 = -r.c: a turn
with tan(angle / 2) = |r| about the platform's origin, and a shift by 2 c to first order. With
q = R p the arm of a leg, b its base joint seen from the platform's origin, d = q - b the strut
and m = q + b, the leg's equation times 1 + r.r is exactly (docs/proofs.md derives it)

    f + 4 (c.d + r.(q x d))                                             f = d.d - l^2
      + 4 (g0 g0 + c.c) + 4 m.(c x r) - 4 g0 r.d
      + r.r (m.m - l^2) - 4 (r.q) (r.b)  =  0

a quadratic whose coefficients do not depend on r, c. So the Taylor series of (c, r) along a
path on which l^2 and b change linearly follows order by order, all orders with the one
factorisation of the Jacobian, whose rows are (d, q x d).

All functions work on a flat float64 array `z` of slots (see lanes.py).
"""

from __future__ import annotations

from gough.kernel.jit import jit
from gough.kernel.lanes import SLOT, get, ones, put, reciprocal, zero

ORDER = 6  # of the Taylor series

# Where things lie, in slots. Vectors take three slots, six legs follow one another.
E, T = 0, 4  # quaternion and position
BASE, BASE_RATE = 7, 25  # base joints, and their change along the path
L2, L2_RATE = 43, 49  # squared lengths, and their change along the path
Q, B, D = 55, 73, 91
JAC = 109  # 36 entries, factorised in place
KK = 145  # m.m - l^2 of each leg
SER = 151  # order n at SER + 6 n: c_x, r_x, c_y, r_y, c_z, r_z; order 0 is the Newton step
G0 = SER + 6 * (ORDER + 1)  # by order
RR = G0 + ORDER + 1  # r.r, by order
RQ = RR + ORDER + 1  # order n at RQ + 6 n: r.q of each leg
RB = RQ + 6 * (ORDER + 1)  # r.b
RV = RB + 6 * (ORDER + 1)  # r.b', where the base moves
STEP = RV + 6 * (ORDER + 1)  # how far along the path to go, a real number
X = STEP + 1  # the predicted (c_x, r_x, ...)
SLOTS = X + 6
SIZE = SLOTS * SLOT


@jit()
def dot(z, a, b):
    """a.b without conjugation, of the vectors at slots a and b."""
    return get(z, a) * get(z, b) + get(z, a + 1) * get(z, b + 1) + get(z, a + 2) * get(z, b + 2)


@jit()
def dot_order(z, series, a):
    """v.a for v = every second slot from `series`: c or r of one order."""
    first = get(z, series) * get(z, a) + get(z, series + 2) * get(z, a + 1)
    return first + get(z, series + 4) * get(z, a + 2)


@jit()
def evaluate(z, p):
    """Arms, struts, Jacobian rows and -f / 4 (in order 0 of the series) at (E, T).

    Args:
        p: (6, 3) platform joints.
    """
    w, x, y, s = get(z, E), get(z, E + 1), get(z, E + 2), get(z, E + 3)
    ww, xx, yy, ss = w * w, x * x, y * y, s * s
    n = reciprocal(ww + xx + yy + ss)
    n2 = n * 2.0
    xy, xs, ys = x * y * n2, x * s * n2, y * s * n2
    wx, wy, ws = w * x * n2, w * y * n2, w * s * n2
    r00, r01, r02 = (ww + xx - yy - ss) * n, xy - ws, xs + wy
    r10, r11, r12 = xy + ws, (ww - xx + yy - ss) * n, ys - wx
    r20, r21, r22 = xs - wy, ys + wx, (ww - xx - yy + ss) * n
    t0, t1, t2 = get(z, T), get(z, T + 1), get(z, T + 2)
    for i in range(6):
        px, py, pz = p[i, 0], p[i, 1], p[i, 2]
        q0 = r00 * px + r01 * py + r02 * pz
        q1 = r10 * px + r11 * py + r12 * pz
        q2 = r20 * px + r21 * py + r22 * pz
        b0 = get(z, BASE + 3 * i) - t0
        b1 = get(z, BASE + 3 * i + 1) - t1
        b2 = get(z, BASE + 3 * i + 2) - t2
        d0, d1, d2 = q0 - b0, q1 - b1, q2 - b2
        m0, m1, m2 = q0 + b0, q1 + b1, q2 + b2
        square = get(z, L2 + i)
        put(z, Q + 3 * i, q0)
        put(z, Q + 3 * i + 1, q1)
        put(z, Q + 3 * i + 2, q2)
        put(z, B + 3 * i, b0)
        put(z, B + 3 * i + 1, b1)
        put(z, B + 3 * i + 2, b2)
        put(z, D + 3 * i, d0)
        put(z, D + 3 * i + 1, d1)
        put(z, D + 3 * i + 2, d2)
        put(z, KK + i, m0 * m0 + m1 * m1 + m2 * m2 - square)
        put(z, SER + i, (d0 * d0 + d1 * d1 + d2 * d2 - square) * -0.25)
        row = JAC + 6 * i
        put(z, row, d0)
        put(z, row + 1, q1 * d2 - q2 * d1)
        put(z, row + 2, d1)
        put(z, row + 3, q2 * d0 - q0 * d2)
        put(z, row + 4, d2)
        put(z, row + 5, q0 * d1 - q1 * d0)


@jit()
def factorise(z):
    """The Jacobian into L and U in its place, without pivoting, diagonals inverted.

    With the platform's frames turned at random and the columns of c and r mixed, no leading
    minor vanishes where the matrix itself does not, at special poses either; where one comes
    close, the Newton step is poor, is seen to be, and the path takes another step length.
    """
    for k in range(6):
        inverse = reciprocal(get(z, JAC + 7 * k))
        put(z, JAC + 7 * k, inverse)
        for i in range(k + 1, 6):
            factor = get(z, JAC + 6 * i + k) * inverse
            put(z, JAC + 6 * i + k, factor)
            for j in range(k + 1, 6):
                put(z, JAC + 6 * i + j, get(z, JAC + 6 * i + j) - factor * get(z, JAC + 6 * k + j))


@jit()
def substitute(z, at):
    """Solve for the six right hand sides at slot `at`, in place."""
    for i in range(1, 6):
        value = get(z, at + i)
        for j in range(i):
            value = value - get(z, JAC + 6 * i + j) * get(z, at + j)
        put(z, at + i, value)
    for k in range(6):
        i = 5 - k
        value = get(z, at + i)
        for j in range(i + 1, 6):
            value = value - get(z, JAC + 6 * i + j) * get(z, at + j)
        put(z, at + i, value * get(z, JAC + 7 * i))


@jit()
def expand(z, n, base_moves):
    """Order n of the series, from the orders below it."""
    gg, rr, g0 = zero(), zero(), zero()
    w0, w1, w2 = zero(), zero(), zero()  # g0 r
    x0, x1, x2 = zero(), zero(), zero()  # c x r
    for a in range(1, n):
        u, v = SER + 6 * a, SER + 6 * (n - a)
        c0, c1, c2 = get(z, u), get(z, u + 2), get(z, u + 4)
        s0, s1, s2 = get(z, v + 1), get(z, v + 3), get(z, v + 5)
        scalar = get(z, G0 + a)
        gg = gg + scalar * get(z, G0 + n - a)
        gg = gg + c0 * get(z, v) + c1 * get(z, v + 2) + c2 * get(z, v + 4)
        rr = rr + get(z, u + 1) * s0 + get(z, u + 3) * s1 + get(z, u + 5) * s2
        g0 = g0 - (c0 * s0 + c1 * s1 + c2 * s2)
        w0, w1, w2 = w0 + scalar * s0, w1 + scalar * s1, w2 + scalar * s2
        x0, x1, x2 = x0 + (c1 * s2 - c2 * s1), x1 + (c2 * s0 - c0 * s2), x2 + (c0 * s1 - c1 * s0)
    put(z, G0 + n, g0)
    put(z, RR + n, rr)
    a0, a1, a2 = x0 - w0, x1 - w1, x2 - w2  # m.(c x r) - d.w = q.(x - w) + b.(x + w)
    y0, y1, y2 = x0 + w0, x1 + w1, x2 + w2
    for i in range(6):
        k = 3 * i
        total = gg + get(z, Q + k) * a0 + get(z, Q + k + 1) * a1 + get(z, Q + k + 2) * a2
        total = total + get(z, B + k) * y0 + get(z, B + k + 1) * y1 + get(z, B + k + 2) * y2
        for a in range(1, n):
            total = total - get(z, RQ + 6 * a + i) * get(z, RB + 6 * (n - a) + i)
        quarter = rr * get(z, KK + i)
        if n == 1:
            quarter = quarter - get(z, L2_RATE + i)
        else:
            quarter = quarter - get(z, RR + n - 1) * get(z, L2_RATE + i)
        if base_moves:
            total = total + _moving_base_whole(z, n, i)
            quarter = quarter + _moving_base_quarter(z, n, i)
        put(z, SER + 6 * n + i, (total + quarter * 0.25) * -1.0)
    substitute(z, SER + 6 * n)
    for i in range(6):
        row = SER + 6 * n + 1
        put(z, RQ + 6 * n + i, dot_order(z, row, Q + 3 * i))
        put(z, RB + 6 * n + i, dot_order(z, row, B + 3 * i))
        if base_moves:
            put(z, RV + 6 * n + i, dot_order(z, row, BASE_RATE + 3 * i))


@jit()
def _moving_base_whole(z, n, i):
    """What a base joint's motion v adds to order n, the terms with factor 4.

    With b + s v for b: d loses s v, m gains it; see the equation above.
    """
    v = BASE_RATE + 3 * i
    if n == 1:
        return zero()
    u = SER + 6 * (n - 1)
    v0, v1, v2 = get(z, v), get(z, v + 1), get(z, v + 2)
    q0, q1, q2 = get(z, Q + 3 * i), get(z, Q + 3 * i + 1), get(z, Q + 3 * i + 2)
    s0, s1, s2 = get(z, u + 1), get(z, u + 3), get(z, u + 5)
    # -c.v - r.(q x v)
    total = zero() - (get(z, u) * v0 + get(z, u + 2) * v1 + get(z, u + 4) * v2)
    total = total - s0 * (q1 * v2 - q2 * v1) - s1 * (q2 * v0 - q0 * v2) - s2 * (q0 * v1 - q1 * v0)
    for a in range(1, n - 1):
        f, g = SER + 6 * a, SER + 6 * (n - 1 - a)
        c0, c1, c2 = get(z, f), get(z, f + 2), get(z, f + 4)
        r0, r1, r2 = get(z, g + 1), get(z, g + 3), get(z, g + 5)
        scalar = get(z, G0 + a)
        # v.(c x r) + g0 r.v - (r.q) (r.v)
        total = total + v0 * (c1 * r2 - c2 * r1 + scalar * r0)
        total = total + v1 * (c2 * r0 - c0 * r2 + scalar * r1)
        total = total + v2 * (c0 * r1 - c1 * r0 + scalar * r2)
        total = total - get(z, RQ + 6 * a + i) * get(z, RV + 6 * (n - 1 - a) + i)
    return total


@jit()
def _moving_base_quarter(z, n, i):
    """What a base joint's motion v adds to order n, the terms with factor 1."""
    v = BASE_RATE + 3 * i
    if n == 1:
        return dot(z, D + 3 * i, v) * -2.0
    if n == 2:
        return dot(z, v, v)
    along = (dot(z, Q + 3 * i, v) + dot(z, B + 3 * i, v)) * 2.0
    return get(z, RR + n - 1) * along + get(z, RR + n - 2) * dot(z, v, v)


@jit()
def advance(z):
    """Move (E, T) to the value of the series at STEP; the move itself is left at X."""
    h = get(z, STEP)
    for k in range(6):
        value = get(z, SER + 6 * ORDER + k)
        for n in range(1, ORDER + 1):
            value = value * h + get(z, SER + 6 * (ORDER - n) + k)
        put(z, X + k, value)
    c0, c1, c2 = get(z, X), get(z, X + 2), get(z, X + 4)
    r0, r1, r2 = get(z, X + 1), get(z, X + 3), get(z, X + 5)
    rr = r0 * r0 + r1 * r1 + r2 * r2
    rc = r0 * c0 + r1 * c1 + r2 * c2
    two = reciprocal((ones() + rr) * 0.5)  # 2 / (1 + r.r)
    put(z, T, get(z, T) + two * (c0 + rc * r0 - (c1 * r2 - c2 * r1)))
    put(z, T + 1, get(z, T + 1) + two * (c1 + rc * r1 - (c2 * r0 - c0 * r2)))
    put(z, T + 2, get(z, T + 2) + two * (c2 + rc * r2 - (c0 * r1 - c1 * r0)))
    w, x, y, s = get(z, E), get(z, E + 1), get(z, E + 2), get(z, E + 3)
    put(z, E, w - (r0 * x + r1 * y + r2 * s))
    put(z, E + 1, x + (r0 * w + r1 * s - r2 * y))
    put(z, E + 2, y + (r1 * w + r2 * x - r0 * s))
    put(z, E + 3, s + (r2 * w + r0 * y - r1 * x))

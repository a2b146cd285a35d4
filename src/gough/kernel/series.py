"""The six leg equations and their Taylor series along a path, for eight complex poses at once.

A pose is a position t and a quaternion e, both complex here, with R(e) = Q(e) / (e.e). Poses
near one are written relative to it in Study parameters (1, r; g0, c) with g0 = -r.c: a rotation
with tan(angle / 2) = |r| about the platform's origin, and a translation by 2 c to first order.
With q = R p the lever of a leg, b its base joint seen from the platform's origin, d = q - b the
strut and m = q + b, the leg's equation times 1 + r.r is exactly (docs/proofs.md derives it)

    f + 4 (c.d + r.(q x d))                                             f = d.d - l^2
      + 4 (g0 g0 + c.c) + 4 m.(c x r) - 4 g0 r.d
      + r.r (m.m - l^2) - 4 (r.q) (r.b)  =  0

a quadratic whose coefficients do not depend on r, c. So the Taylor series of (c, r) along a
path on which l^2 and b change linearly follows order by order, all orders with the one
factorisation of the Jacobian, whose rows are (d, q x d).

The functions calculate with the slots of an array `z` (see lanes.py), or with a list of NumPy
arrays. `moving` holds the platform joints (6 x 3) in its slots.
"""

from __future__ import annotations

from gough.kernel.lanes import loop

ORDER = 6  # of the Taylor series

# Slots. Vectors take three of them, six legs follow one another.
T, E, AT = 0, 3, 7  # position, quaternion; how far along the path, 0 to 1 (a real number)
KEPT = 8  # the eight slots before, as they were when the last step began
BASE, L2 = 16, 34  # base joints and squared lengths at the path's start
BASE_RATE, L2_RATE = 40, 58  # and how much they change along the whole path
STEP = 64  # how far to go next, and in its imaginary part the share of a full step
Q, B, D = 65, 83, 101
JAC = 119  # 36 entries, factorised in place
KK = 155  # m.m - l^2 of each leg
SER = 161  # order n at SER + 6 n: c_x, r_x, c_y, r_y, c_z, r_z; order 0 is the Newton step
X = SER + 6 * (ORDER + 1)  # the last step taken (c_x, r_x, ...)
RQ, RB, RV = (X + 6 + 6 * k * ORDER for k in range(3))  # r.q, r.b, r.v: order n at RQ + 6 n
SLOTS = X + 6 + 18 * ORDER


def newton(z, moving) -> None:
    """Levers, struts, the factorised Jacobian and the Newton step, order 0, at (T, E)."""
    _evaluate(z, moving)
    rows = [_six(z, JAC + 6 * i) for i in range(6)]
    _factorise(rows)
    for i in range(6):
        _put(z, JAC + 6 * i, rows[i])
    _put(z, SER, _substitute(rows, _six(z, SER)))


def _dot(a, b):
    """a.b without conjugation."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _get(z, slot, step=1):
    """The vector whose components are at slot, slot + step and slot + 2 step."""
    return [z[slot + k * step] for k in range(3)]


def _put(z, slot, values) -> None:
    for k, value in enumerate(values):
        z[slot + k] = value


def _evaluate(z, moving) -> None:
    """Levers, struts, Jacobian rows and -f / 4 (in order 0 of the series) at (T, E)."""
    t, (w, x, y, s), at = _get(z, T), [z[E + k] for k in range(4)], z[AT].real
    ww, xx, yy, ss = w * w, x * x, y * y, s * s
    n = 1.0 / (ww + xx + yy + ss)
    n2 = n * 2.0
    xy, xs, ys = x * y * n2, x * s * n2, y * s * n2
    wx, wy, ws = w * x * n2, w * y * n2, w * s * n2
    rotation = [
        [(ww + xx - yy - ss) * n, xy - ws, xs + wy],
        [xy + ws, (ww - xx + yy - ss) * n, ys - wx],
        [xs - wy, ys + wx, (ww - xx - yy + ss) * n],
    ]
    for i in loop(z, 6):
        p, base, rate = _get(moving, 3 * i), _get(z, BASE + 3 * i), _get(z, BASE_RATE + 3 * i)
        q = [_dot(row, p) for row in rotation]
        b = [base[k] + at * rate[k] - t[k] for k in range(3)]
        d, m = [q[k] - b[k] for k in range(3)], [q[k] + b[k] for k in range(3)]
        square = z[L2 + i] + at * z[L2_RATE + i]
        _put(z, Q + 3 * i, q)
        _put(z, B + 3 * i, b)
        _put(z, D + 3 * i, d)
        z[KK + i] = _dot(m, m) - square
        z[SER + i] = (_dot(d, d) - square) * -0.25
        moment = _cross(q, d)
        _put(z, JAC + 6 * i, [d[0], moment[0], d[1], moment[1], d[2], moment[2]])


def _six(z, slot):
    return [z[slot + k] for k in range(6)]


def _factorise(a) -> None:
    """The Jacobian into L and U in its place, without pivoting, diagonals inverted.

    With the platform's frames rotated at random and the columns of c and r mixed, no leading
    minor vanishes where the matrix itself does not, at special poses either; where one comes
    close, the Newton step is poor, is seen to be, and the path takes another step length.
    """
    for k in range(6):
        a[k][k] = 1.0 / a[k][k]
        for i in range(k + 1, 6):
            a[i][k] = a[i][k] * a[k][k]
            for j in range(k + 1, 6):
                a[i][j] = a[i][j] - a[i][k] * a[k][j]


def _substitute(a, x):
    """The solution for six right hand sides, given the factors of `_factorise`."""
    for i in range(1, 6):
        for j in range(i):
            x[i] = x[i] - a[i][j] * x[j]
    for i in reversed(range(6)):
        for j in range(i + 1, 6):
            x[i] = x[i] - a[i][j] * x[j]
        x[i] = x[i] * a[i][i]
    return x


def expand(z, moving, base_moves: bool) -> None:
    """Orders 1 to ORDER of the series, each from those below it.

    Lists run by order. 0.0 stands for what is zero on every path, and costs nothing (lanes.py).

    Args:
        base_moves: the base joints change along the path, as those of rotary legs do.
    """
    factors = [_six(z, JAC + 6 * i) for i in range(6)]
    c, r, more = [[0.0] * 3], [[0.0] * 3], [[0.0] * 3]
    g0, rr = [0.0], [1.0]  # rr: 1 + r.r
    for n in range(1, ORDER + 1):
        pairs = [(j, n - j) for j in range(1, n)]
        g0.append(-1.0 * sum(_dot(c[j], r[k]) for j, k in pairs))
        rr.append(sum(_dot(r[j], r[k]) for j, k in pairs))
        square = sum(g0[j] * g0[k] + _dot(c[j], c[k]) for j, k in pairs)
        turned = _sum(_cross(c[j], r[k]) for j, k in pairs)
        scaled = _sum([g0[j] * x for x in r[k]] for j, k in pairs)
        # m.(c x r) - g0 r.d = q.(c x r - g0 r) + b.(c x r + g0 r), as m = q + b and d = q - b
        less = [turned[k] - scaled[k] for k in range(3)]
        more.append([turned[k] + scaled[k] for k in range(3)])
        for i in loop(z, 6):
            q, b = _get(z, Q + 3 * i), _get(z, B + 3 * i)
            total = square + _dot(q, less) + _dot(b, more[n])
            quarter = rr[n] * z[KK + i] - rr[n - 1] * z[L2_RATE + i]
            if n > 1:
                z[RQ + 6 * (n - 1) + i] = _dot(r[n - 1], q)
                z[RB + 6 * (n - 1) + i] = _dot(r[n - 1], b)
                total = total - sum(z[RQ + 6 * j + i] * z[RB + 6 * k + i] for j, k in pairs)
            if base_moves:  # along the path b becomes b + s v, so d loses s v and m gains it
                v = _get(z, BASE_RATE + 3 * i)
                total = total + _dot(v, more[n - 1]) - _dot(c[n - 1], v)
                total = total - _dot(r[n - 1], _cross(q, v))
                if n == 1:
                    quarter = quarter - 2.0 * _dot(_get(z, D + 3 * i), v)
                else:
                    z[RV + 6 * (n - 1) + i] = _dot(r[n - 1], v)
                    before = [(j, k - 1) for j, k in pairs if k > 1]
                    total = total - sum(z[RQ + 6 * j + i] * z[RV + 6 * k + i] for j, k in before)
                    quarter = quarter + rr[n - 1] * (2.0 * (_dot(q, v) + _dot(b, v)))
                    quarter = quarter + rr[n - 2] * _dot(v, v)
            z[SER + 6 * n + i] = (total + quarter * 0.25) * -1.0
        x = _substitute(factors, _six(z, SER + 6 * n))
        _put(z, SER + 6 * n, x)
        c.append(x[0::2])
        r.append(x[1::2])


def advance(z, moving) -> None:
    """Move (T, E) to the value of the series at STEP; the move itself is left at X."""
    h = z[STEP].real
    x = _six(z, SER + 6 * ORDER)
    for n in reversed(range(ORDER)):
        x = [x[k] * h + z[SER + 6 * n + k] for k in range(6)]
    _put(z, X, x)
    c, r = x[0::2], x[1::2]
    two = 2.0 / (1.0 + _dot(r, r))
    cross, along = _cross(c, r), _dot(r, c)
    _put(z, T, [z[T + k] + two * (c[k] + along * r[k] - cross[k]) for k in range(3)])
    w, (x, y, s) = z[E], _get(z, E + 1)
    turn = _cross(r, [x, y, s])
    _put(z, E, [w - _dot(r, [x, y, s])])
    _put(z, E + 1, [v + r[k] * w + turn[k] for k, v in enumerate((x, y, s))])


def _sum(vectors):
    """Sum of vectors; zero if there are none."""
    return [sum(parts) for parts in zip([0.0] * 3, *vectors, strict=True)]

"""Follow solutions of the leg equations along straight paths of l^2 and base joints.

Each of the eight lanes carries one path. A pass over the lanes evaluates the equations at the
predicted pose, takes one Newton step, expands the Taylor series there (the Newton step is its
order 0, so one factorisation serves corrector and predictor) and goes a fixed share of the
series' radius of convergence further: another solution near by, which a path might jump to,
is a branch point near by and shows as a small radius. A Newton step that is not small beside
the last move sends the lane back to try a shorter one. Lanes that end take the next path.
"""

from __future__ import annotations

import numpy as np

from gough.kernel.jit import jit
from gough.kernel.lanes import LANES, SLOT
from gough.kernel.series import (
    BASE,
    BASE_RATE,
    L2,
    L2_RATE,
    ORDER,
    SER,
    SIZE,
    STEP,
    E,
    T,
    X,
    advance,
    evaluate,
    expand,
    factorise,
    substitute,
)

FINITE, STUCK, LOST = 1, 2, 3  # how a path ended; STUCK: just before the target; LOST: elsewhere

SHARE = 0.45  # of the radius of convergence, per step
ACCEPT = 0.05  # Newton step over last move, above which the move is taken back
SETTLE = 0.5  # the same where the last move was itself a Newton step
TINY = 1e-8  # Newton step that is small beside any move
DONE = 1e-5  # Newton step at the end of the path, after which the pose is good to its square
PASSES = 400
SHORTEST = 1e-7  # step, in a path of length 1
LATE = 1e-3  # share of a path that may be left where its end is told from where it is stuck


@jit()
def read(z, slot, w):
    """The complex number of lane w."""
    return complex(z[slot * SLOT + w], z[slot * SLOT + LANES + w])


@jit()
def write(z, slot, w, value):
    """Set the complex number of lane w."""
    z[slot * SLOT + w] = value.real
    z[slot * SLOT + LANES + w] = value.imag


@jit()
def _norm2(z, first, w):
    """Square of the size of six slots from `first`: |c|^2 over the pose's size, plus |r|^2."""
    size, shift, turn = 1.0, 0.0, 0.0
    for k in range(3):
        size += _square(z, T + k, w)
        shift += _square(z, first + 2 * k, w)
        turn += _square(z, first + 2 * k + 1, w)
    return shift / size + turn


@jit()
def _square(z, slot, w):
    re, im = z[slot * SLOT + w], z[slot * SLOT + LANES + w]
    return re * re + im * im


@jit()
def _load(z, w, e, t, base_rate, l2_rate):
    """Put a path's start and its direction into lane w."""
    for k in range(4):
        write(z, E + k, w, e[k])
    for k in range(3):
        write(z, T + k, w, t[k])
    for i in range(6):
        write(z, L2_RATE + i, w, l2_rate[i])
        write(z, X + i, w, 0.0)
        for k in range(3):
            write(z, BASE_RATE + 3 * i + k, w, base_rate[i, k])


@jit()
def _place(z, w, s, base, l2, base_moves):
    """Set the parameters of lane w to those at s."""
    for i in range(6):
        write(z, L2 + i, w, l2[i] + s * read(z, L2_RATE + i, w))
        if base_moves or s == 0.0:
            for k in range(3):
                slot = BASE_RATE + 3 * i + k
                write(z, BASE + 3 * i + k, w, base[i, k] + s * read(z, slot, w))


@jit()
def _newton(z, p):
    """Evaluate at (E, T); the Newton step becomes order 0 of the series."""
    evaluate(z, p)
    factorise(z)
    substitute(z, SER)


@jit()
def _small(z, w, limit):
    """Whether the Newton step is small beside the last move."""
    step = _norm2(z, SER, w)
    return step <= limit * limit * _norm2(z, X, w) or step <= TINY * TINY


@jit()
def _radius(z, w):
    """Radius of convergence of the series in lane w, by the root test on its last orders."""
    first = _norm2(z, SER + 6, w)
    if first == 0.0:
        return 1e300
    last = (_norm2(z, SER + 6 * ORDER, w) / first) ** (0.5 / (ORDER - 1))
    other = (_norm2(z, SER + 6 * (ORDER - 1), w) / first) ** (0.5 / (ORDER - 2))
    return 1.0 / (max(last, other) + 1e-300)


@jit()
def _accept(z, w, pose, s, last_s, shrink, base, l2, base_moves):
    """Keep the pose of lane w, or take its last move back. Returns True if kept."""
    if _small(z, w, SETTLE if s[w] == last_s[w] else ACCEPT):
        for k in range(4):
            pose[w, k] = read(z, E + k, w)
        for k in range(3):
            pose[w, 4 + k] = read(z, T + k, w)
        last_s[w] = s[w]
        shrink[w] = min(1.0, 1.5 * shrink[w])
        return True
    for k in range(4):
        write(z, E + k, w, pose[w, k])
    for k in range(3):
        write(z, T + k, w, pose[w, 4 + k])
    s[w] = last_s[w]
    shrink[w] *= 0.3
    _place(z, w, s[w], base, l2, base_moves)
    return False


@jit()
def _next_step(z, w, s, shrink, spent, share):
    """How far lane w goes next, and how its path ends if it does (0: it goes on)."""
    if spent > PASSES:
        return 0.0, STUCK if 1.0 - s < LATE else LOST
    if s >= 1.0:
        return 0.0, FINITE if _norm2(z, SER, w) <= DONE * DONE else 0
    h = share * shrink * _radius(z, w)
    if not h > SHORTEST:
        return 0.0, STUCK if 1.0 - s < LATE else LOST
    return min(h, 1.0 - s), 0


@jit()
def track(
    p, start_e, start_t, base, base_rates, l2, l2_rates, base_moves, share,
    out_e, out_t, ends, passes,
):  # fmt: skip
    """Follow every start solution to every target.

    Arrays are complex128 unless said otherwise; joints and lengths in normalised units.

    Args:
        p: (6, 3) platform joints.
        start_e, start_t: (P, 4), (P, 3) solutions at the start.
        base, l2: (6, 3), (6,) base joints and squared lengths at the start.
        base_rates, l2_rates: (N or 1, 6, 3), (N, 6): those at the target minus the start's.
        base_moves: whether base_rates are other than zero.
        share: of the radius of convergence, per step.
        out_e, out_t: (N, P, 4), (N, P, 3) where the paths ended; e not normalised.
        ends, passes: (N, P) uint8 and int32: how each ended, after how many passes.
    """
    z = np.zeros(SIZE)
    paths = start_e.shape[0]
    jobs = l2_rates.shape[0] * paths
    job, spent = np.full(LANES, -1), np.zeros(LANES, np.int64)
    s, last_s, shrink = np.zeros(LANES), np.zeros(LANES), np.ones(LANES)
    pose = np.zeros((LANES, 7), np.complex128)  # where the last move began
    kept = np.ones(LANES, np.bool_)
    ended = np.full(LANES, FINITE)  # a lane that has ended takes the next path
    taken, running = 0, 0
    while True:
        for w in range(LANES):
            if ended[w] != 0 and (taken < jobs or taken < LANES):
                row, path = (taken % jobs) // paths, taken % paths
                _load(z, w, start_e[path], start_t[path],
                      base_rates[row % base_rates.shape[0]], l2_rates[row])  # fmt: skip
                for k in range(4):
                    pose[w, k] = start_e[path, k]
                for k in range(3):
                    pose[w, 4 + k] = start_t[path, k]
                _place(z, w, 0.0, base, l2, base_moves)
                # lanes beyond the last path follow a copy that nobody reads
                job[w] = taken if taken < jobs else -1
                running += 1 if taken < jobs else 0
                ended[w] = 0
                taken += 1
                s[w], last_s[w], shrink[w], spent[w] = 0.0, 0.0, 1.0, 0
        if running == 0:
            return
        _newton(z, p)
        kept_all = True
        for w in range(LANES):
            kept[w] = _accept(z, w, pose, s, last_s, shrink, base, l2, base_moves)
            kept_all = kept_all and kept[w]
        if not kept_all:
            _newton(z, p)
        for n in range(1, ORDER + 1):
            expand(z, n, base_moves)
        for w in range(LANES):
            spent[w] += 1
            h, end = _next_step(z, w, s[w], shrink[w], spent[w], share)
            if not kept[w]:
                h = 0.0  # a Newton step first: the pose kept may be a few per cent of a move off
            write(z, STEP, w, h)
            if h > 0.0:
                s[w] = 1.0 if h == 1.0 - s[w] else s[w] + h
                _place(z, w, s[w], base, l2, base_moves)
            ended[w] = end
        advance(z)
        for w in range(LANES):
            if ended[w] != 0 and job[w] >= 0:
                row, path = job[w] // paths, job[w] % paths
                ends[row, path], passes[row, path] = ended[w], spent[w]
                for k in range(4):
                    out_e[row, path, k] = read(z, E + k, w)
                for k in range(3):
                    out_t[row, path, k] = read(z, T + k, w)
                job[w] = -1
                running -= 1

"""Follow solutions of the leg equations along straight paths of l^2 and base joints.

Each of the eight lanes carries one path. A pass over the lanes evaluates the equations at the
predicted pose, takes one Newton step, expands the Taylor series there (the Newton step is its
order 0, so one factorisation serves corrector and predictor) and goes a fixed share of the
series' radius of convergence further: another solution near by, which a path might jump to,
is a branch point near by and shows as a small radius. A Newton step that is not small beside
the last move sends the lane back to try a shorter one. Lanes that end take the next path.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numba import int64
from numpy.typing import NDArray

from gough.kernel import series
from gough.kernel.jit import inner, jit
from gough.kernel.lanes import LANES, SLOT, Complexes, compiled
from gough.kernel.series import AT, BASE, BASE_RATE, KEPT, ORDER, SER, SLOTS, STEP, T, X

Complex = NDArray[np.complex128]

FINITE, STUCK, LOST = 1, 2, 3  # how a path ended; STUCK: just before the target; LOST: elsewhere

SHARE = 0.4  # of the series' radius of convergence per step: fewest passes, see docs/proofs.md
ACCEPT = 0.05  # Newton step over last move, above which the move is taken back
SETTLE = 0.5  # the same where the last move was itself a Newton step
TINY = 1e-8  # Newton step that is small beside any move
DONE = 1e-5  # Newton step at the end of the path, after which the pose is good to its square
PASSES = 400
SHORTEST = 1e-7  # step, in a path of length 1
LATE = 1e-3  # share of a path that may be left where its end counts as STUCK, not LOST

POSE, RATES = 2 * 7, 2 * 24  # doubles of a complex pose; of six base joints and squared lengths
_JOB, _PASSES, _END, _KEPT = range(4)  # rows of the lanes' counters

_newton = compiled(series.newton, Complexes)
_expand, _expand_moving = (
    compiled(partial(series.expand, base_moves=moves), Complexes) for moves in (False, True)
)
_advance = compiled(series.advance, Complexes)


@dataclass(frozen=True, eq=False)
class LegEquations:
    """Coefficients of the six leg equations, in normalised units (see `gough.modes.frames`).

    Attributes:
        base: (6, 3) complex base joints.
        moving: (6, 3) complex platform joints.
        squares: (6,) complex squared strut lengths.
    """

    base: Complex
    moving: Complex
    squares: Complex


@dataclass(frozen=True, eq=False)
class Ends:
    """Ends of the paths from P start poses to N targets.

    Attributes:
        pose: (N, P, 7) complex positions and quaternions; quaternions are not normalised.
        how: (N, P) uint8: FINITE, STUCK or LOST.
        passes: (N, P) int32, evaluations of the equations.
    """

    pose: Complex
    how: NDArray[np.uint8]
    passes: NDArray[np.int32]

    def finite(self, target: int = 0) -> Complex:
        """Poses (F, 7) of one target whose paths arrived."""
        return self.pose[target][self.how[target] == FINITE]


def track_paths(
    start: Complex,
    at: LegEquations,
    squares: NDArray,
    base: NDArray | None = None,
    share: float = SHARE,
) -> Ends:
    """Follow solutions of the leg equations to other squared lengths and base joints.

    Args:
        start: (P, 7) solutions at `at`: complex positions, then quaternions.
        squares: (N, 6) of the targets.
        base: (N, 6, 3) or (1, 6, 3) of the targets; None: as at the start.
        share: of the series' radius of convergence that a step may take.
    """
    count, paths = len(squares), len(start)
    ends = Ends(
        np.zeros((count, paths, 7), complex), np.zeros((count, paths), np.uint8),
        np.zeros((count, paths), np.int32),
    )  # fmt: skip
    if not ends.how.size:
        return ends
    rates = np.zeros((count, 24), complex)
    if base is not None:
        rates[:, :18] = (base - at.base).reshape(-1, 18)
    rates[:, 18:] = squares - at.squares
    origin = np.concatenate([at.base.ravel(), at.squares])
    _track(
        _doubles(at.moving.ravel()), _doubles(start), _doubles(origin), _doubles(rates),
        _doubles(ends.pose), base is not None, share, ends.how, ends.passes,
        np.zeros(SLOTS * SLOT), np.zeros((4, LANES), np.int64),
    )  # fmt: skip
    return ends


def _doubles(numbers: NDArray) -> NDArray[np.float64]:
    """Complex numbers as pairs of doubles, in the last axis."""
    return np.ascontiguousarray(numbers, complex).view(np.float64)


@jit()
def _track(
    moving, start, origin, rates, ends, base_moves, share, how, passes, z, counters
):  # fmt: skip
    """Follow every start solution to every target.

    Complex numbers are pairs of doubles here.

    Args:
        moving: (36,) platform joints.
        start: (P, 14) solutions at the start.
        origin: (48,) base joints and squared lengths at the start.
        rates: (N, 48): those at the target minus the start's.
        ends: (N, P, 14) to be filled.
        base_moves: the base joints change along the paths.
        share, how, passes: as for `track_paths` and `Ends`.
        z, counters: zeros, to work in.
    """
    paths = start.shape[0]
    jobs = rates.shape[0] * paths
    for w in range(LANES):
        counters[_END, w] = FINITE  # a lane that has ended takes the next path
        for k in range(RATES):
            z[(2 * BASE + k) * LANES + w] = origin[k]
    taken, running = 0, 0
    while True:
        for w in range(LANES):
            if counters[_END, w] != 0 and (taken < jobs or taken < LANES):
                # lanes beyond the last path follow a copy that nobody reads
                _load(z, w, start[taken % paths], rates[(taken % jobs) // paths])
                counters[_JOB, w] = taken if taken < jobs else -1
                counters[_PASSES, w] = counters[_END, w] = 0
                running += 1 if taken < jobs else 0
                taken += 1
        if running == 0:
            return
        checked = False
        while True:  # a second time if a lane went back
            _newton(z, moving)
            if checked:
                break
            checked, kept = True, 0
            for w in range(LANES):
                counters[_KEPT, w] = _keep(z, w)
                kept += counters[_KEPT, w]
            if kept == LANES:
                break
        if base_moves:
            _expand_moving(z, moving)
        else:
            _expand(z, moving)
        for w in range(LANES):
            counters[_PASSES, w] += 1
            counters[_END, w] = _choose_step(z, w, share, counters[_PASSES, w], counters[_KEPT, w])
        _advance(z, moving)
        for w in range(LANES):
            if counters[_END, w] != 0 and counters[_JOB, w] >= 0:
                row, path = counters[_JOB, w] // paths, counters[_JOB, w] % paths
                how[row, path], passes[row, path] = counters[_END, w], counters[_PASSES, w]
                for k in range(POSE):
                    ends[row, path, k] = z[(2 * T + k) * LANES + w]
                counters[_JOB, w] = -1
                running -= 1


@inner
def _load(z, w, start, rates):
    """Put the start and the direction of a path into lane w."""
    for k in range(POSE):
        z[(2 * T + k) * LANES + w] = start[k]
    for k in range(RATES):
        z[(2 * BASE_RATE + k) * LANES + w] = rates[k]
    for k in range(12):
        z[(2 * X + k) * LANES + w] = 0.0
    z[2 * AT * LANES + w] = 0.0
    z[(2 * STEP + 1) * LANES + w] = 1.0
    _copy(z, w, int64(T), int64(KEPT))


@inner
def _copy(z, w, source, to):
    """Copy position, quaternion and place along the path of lane w."""
    for k in range(16):
        z[(2 * to + k) * LANES + w] = z[(2 * source + k) * LANES + w]


@inner
def _size(z, w, first):
    """Square of the size of six slots from `first`: |c|^2 over the pose's size, plus |r|^2."""
    size, translation, rotation = 1.0, 0.0, 0.0
    for k in range(6):
        size += z[(2 * T + k) * LANES + w] ** 2
    for k in range(3):
        for part in range(2):
            translation += z[(2 * (first + 2 * k) + part) * LANES + w] ** 2
            rotation += z[(2 * (first + 2 * k + 1) + part) * LANES + w] ** 2
    return translation / size + rotation


@inner
def _keep(z, w):
    """Keep the pose of lane w if its Newton step is small beside the last move, else go back.

    Returns:
        1 if it was kept, else 0.
    """
    moved, first = z[2 * AT * LANES + w] - z[2 * (KEPT + AT) * LANES + w], int64(SER)
    limit = SETTLE if moved == 0.0 else ACCEPT
    step = _size(z, w, first)
    share = (2 * STEP + 1) * LANES + w
    if step <= limit * limit * _size(z, w, int64(X)) or step <= TINY * TINY:
        _copy(z, w, int64(T), int64(KEPT))
        z[share] = min(1.0, 1.5 * z[share])
        return 1
    _copy(z, w, int64(KEPT), int64(T))
    z[share] *= 0.3
    return 0


@inner
def _choose_step(z, w, share, spent, kept):
    """Set the next step of lane w; returns how its path ends, or 0 if it goes on."""
    left, step = 1.0 - z[2 * AT * LANES + w], 2 * STEP * LANES + w
    z[step] = 0.0
    failed = STUCK if left < LATE else LOST
    if spent > PASSES:
        return failed
    if left <= 0.0:
        return FINITE if _size(z, w, int64(SER)) <= DONE * DONE else 0
    h = share * z[step + LANES] * _radius(z, w)
    if not h > SHORTEST:
        return failed
    if kept == 1:  # else a Newton step first: the pose kept may be a few per cent of a move off
        z[step] = min(h, left)
        z[2 * AT * LANES + w] = 1.0 if h >= left else 1.0 - left + h
    return 0


@inner
def _radius(z, w):
    """Radius of convergence of the series in lane w, by the root test on its last orders."""
    first = _size(z, w, int64(SER + 6))
    if first == 0.0:
        return 1e300
    last = (_size(z, w, int64(SER + 6 * ORDER)) / first) ** (0.5 / (ORDER - 1))
    other = (_size(z, w, int64(SER + 6 * (ORDER - 1))) / first) ** (0.5 / (ORDER - 2))
    return 1.0 / (max(last, other) + 1e-300)

"""The row solvers: one row after another, by plain Newton or from several starts.

`settle_rows` takes small batches. `solve_rows` takes the rows that it, or the block solver of large
batches, leaves open; it takes twice as long to compile, and is compiled when a row needs it.
"""

from __future__ import annotations

from math import inf, nan, sqrt

import numpy as np

from gough.kernel.descent import SOLVED, STATIONARY, UNFINISHED, descend, strut_errors
from gough.kernel.equations import assess, newton
from gough.kernel.home_mode import reached_from
from gough.kernel.jit import inner, jit
from gough.kernel.layout import (
    BASE,
    COMPONENTS,
    COUNT,
    DETERMINANT,
    FIRST,
    HOME_POSE,
    HOME_SIGN,
    INSIDE,
    JOINTS,
    LENGTH,
    OPEN,
    RADIUS,
    REGULAR,
    RESIDUAL,
    SINGLE,
    SIZE,
    STATED,
)
from gough.kernel.linear import pivoted_solve, smallest_singular_value
from gough.kernel.pose_io import get_pose, in_stroke, put_pose, put_reading, put_user_position
from gough.status import Status

CONVERGED, OUTSIDE_STROKE = int(Status.CONVERGED), int(Status.OUTSIDE_STROKE)
NEAR_SINGULARITY, OUTSIDE_WORKSPACE = int(Status.NEAR_SINGULARITY), int(Status.OUTSIDE_WORKSPACE)
UNREACHABLE, NOT_CONVERGED = int(Status.UNREACHABLE), int(Status.NOT_CONVERGED)
INVALID_INPUT, AMBIGUOUS = int(Status.INVALID_INPUT), int(Status.AMBIGUOUS)
OTHER_MODE = int(Status.OTHER_MODE)

STEPS = np.int64(10)  # of plain Newton, in blocks too, before the damped method tries
# Further starts after which a pose is taken for the answer: one in another assembly mode, and one
# in home's, but outside the workspace.
ENOUGH_STARTS, FEW_STARTS = 8, 2
# Ranks of poses: the machine's is looked for in this order.
NO_POSE, OTHER, OURS, WITHIN = 0, 1, 2, 3  # OURS: home's mode; WITHIN: in the workspace, too
FARTHEST = 5.0  # length of a leg, as a share of the size, that none could have
PATIENCE = 6  # times the limit, for the last look at a row that no start settled


@jit()
def settle_rows(constants, legs, guess, tolerance, steps, first, last, buffer, out):
    """Solve rows first..last of legs (N, 6) by plain Newton, as `solve_blocks` does many.

    Args:
        guess: (last - first, 7) internal poses to start from.
        tolerance: largest strut error, as a share of the platform's size.
        steps: limit of Newton steps.
        buffer: (COMPONENTS,) to work in.
        out: as for `solve_rows`; the status is OPEN where the row needs that.

    Returns:
        How many of the rows are open or invalid.
    """
    position, wxyz, residuals, iterations, statuses = out
    troubled = 0
    for row in range(first, last):
        valid = put_reading(constants, legs, row, buffer, FIRST, SINGLE)
        put_pose(buffer, FIRST, SINGLE, guess, row - first)
        status = OPEN if valid else INVALID_INPUT
        if valid and newton(constants, buffer, tolerance, steps):
            put_user_position(constants, buffer, FIRST, SINGLE)
            get_pose(buffer, FIRST, SINGLE, position, wxyz, row)
            residuals[row] = buffer[RESIDUAL] * constants[SIZE]
            iterations[row] = int(buffer[COUNT])
            if buffer[INSIDE] == 1.0 and buffer[REGULAR] == 1.0:
                status = CONVERGED if in_stroke(constants, legs, row) else OUTSIDE_STROKE
        statuses[row] = status
        troubled += 1 if status >= INVALID_INPUT else 0
    return troubled


@jit()
def solve_rows(constants, legs, rows, guess, starts, settings, work, out):
    """Solve chosen rows one by one; results replace those in `out`.

    Args:
        rows: (K,) which rows of legs (N, 6).
        guess: (K, 7) internal poses that each row tries first.
        starts: (S, 7) internal poses tried next, in order, until one leads into the workspace
            and home's assembly mode.
        settings: (4,) tolerance as a share of the platform's size; limit of steps from each
            start; distance to singularity below which a pose is called near one; 1 if a row
            stays in the assembly mode that plain Newton reaches from its guess, else 0.
        work: (COMPONENTS,), (COMPONENTS,) and (4, 6, 6) to work in.
        out: position (N, 3), wxyz (N, 4), residual (N,) [platform unit], iterations (N,),
            status (N,).

    Returns:
        How many of the rows are invalid; nothing but their status is written.
    """
    position, wxyz, residuals, iterations, statuses = out
    buffer, best, matrices = work
    invalid = 0
    for n in range(len(rows)):
        row = rows[n]
        if not put_reading(constants, legs, row, buffer, FIRST, SINGLE):
            statuses[row] = INVALID_INPUT
            invalid += 1
            continue
        outcome, count, rank = _solve_row(
            constants, buffer, guess, n, starts, settings, matrices, best
        )
        if outcome == SOLVED:
            ours = rank >= OURS
            status = status_of_pose(constants, buffer, legs, row, settings[2], ours, matrices)
        else:
            status = UNREACHABLE if outcome == STATIONARY else NOT_CONVERGED
        statuses[row] = status
        put_user_position(constants, buffer, FIRST, SINGLE)
        get_pose(buffer, FIRST, SINGLE, position, wxyz, row)
        if status == UNREACHABLE:  # the nearest pose is none of the machine's
            for i in range(3):
                position[row, i] = nan
            for i in range(4):
                wxyz[row, i] = nan
        residuals[row] = buffer[RESIDUAL] * constants[SIZE]
        iterations[row] = count
    return invalid


@inner
def _solve_row(constants, buffer, guess, n, starts, settings, work, best):
    """Solve the reading in `buffer`, from guess n and then from the starts; leave the pose there.

    Taken is the first pose inside the workspace; else the first in home's mode; else the first
    with these lengths; else the one that misses them least. A platform that states no workspace
    has all of home's mode for it.

    Returns:
        SOLVED, STATIONARY or UNFINISHED, the steps taken in all, and the rank of the pose.
    """
    tolerance, limit = settings[0], int(settings[1])
    put_pose(buffer, FIRST, SINGLE, guess, n)
    chosen, least, total, first, tries, rank = UNFINISHED, inf, 0, 0, len(starts), NO_POSE
    enough = WITHIN if constants[STATED] == 1.0 else OURS
    stays = settings[3] == 1.0
    if limit > 0:
        solved = newton(constants, buffer, tolerance, STEPS if limit > STEPS else limit)
        total = int(buffer[COUNT])
        if solved:
            rank = _rank(constants, buffer, guess, n, stays, work)
            if stays or rank >= enough:
                return SOLVED, total, rank
            chosen, first = SOLVED, 1
            _copy(buffer, best)
        put_pose(buffer, FIRST, SINGLE, guess, n)
    hopeless = _out_of_reach(constants, buffer)
    tries = 0 if hopeless else tries
    for attempt in range(first, 1 + tries):
        if attempt > 0:
            put_pose(buffer, FIRST, SINGLE, starts, attempt - 1)
        outcome, count, error = descend(constants, buffer, work, tolerance, limit)
        total += count
        _measure(constants, buffer, work)
        found = _rank(constants, buffer, guess, n, stays, work) if outcome == SOLVED else NO_POSE
        if found >= enough:
            return outcome, total, found
        if attempt == 0 or found > rank or (rank == NO_POSE and error < least):
            chosen, least, rank = outcome, error, found
            _copy(buffer, best)
        if chosen == SOLVED and attempt >= (FEW_STARTS if rank == OURS else ENOUGH_STARTS):
            break
    _copy(best, buffer)
    if chosen == UNFINISHED and tries > 0:  # a pose, or a miss? A longer look, once
        chosen, count, error = descend(constants, buffer, work, tolerance, PATIENCE * limit)
        total += count
        _measure(constants, buffer, work)
        rank = _rank(constants, buffer, guess, n, stays, work) if chosen == SOLVED else NO_POSE
    if hopeless and chosen != SOLVED:
        chosen = STATIONARY
    return chosen, total, rank


@inner
def _rank(constants, buffer, guess, n, stays, work):
    """Return how far the assessed pose in `buffer` is to be believed: WITHIN, OURS or OTHER."""
    if buffer[INSIDE] == 1.0:
        return WITHIN
    start = work[3, 2], work[3, 3]
    for i in range(3):
        start[0][i] = constants[HOME_POSE + i]
    for i in range(4):
        start[1][i] = constants[HOME_POSE + 3 + i]
    ours = reached_from(constants, buffer, start, work)
    if stays and not ours:
        for i in range(3):
            start[0][i] = guess[n, i]
        for i in range(4):
            start[1][i] = guess[n, 3 + i]
        ours = reached_from(constants, buffer, start, work)
    return OURS if ours else OTHER


@inner
def _copy(source, target):
    """Copy a buffer: by a loop, since Numba compiles much more for `target[:] = source`."""
    for i in range(COMPONENTS):
        target[i] = source[i]


@inner
def _measure(constants, buffer, work):
    """Store determinant and residual of the pose that `descend` ended at, and `assess` it."""
    determinant = pivoted_solve(work[0], work[3, 0], work[2], work[3, 2])
    rho = constants[RADIUS]
    for i in range(6):
        determinant *= buffer[LENGTH + i]
    buffer[DETERMINANT] = determinant * (rho * rho * rho)
    assess(constants, buffer, FIRST, SINGLE)


@inner
def status_of_pose(constants, buffer, legs, row, singular, ours, work):
    """Return the status of the assessed pose in `buffer`, which has the readings of the row.

    Args:
        ours: the pose is in the machine's assembly mode, as far as is known.
    """
    for i in range(6):
        if buffer[LENGTH + i] > FARTHEST:
            return UNREACHABLE
    if not ours:
        return OTHER_MODE if constants[HOME_SIGN] != 0.0 else AMBIGUOUS
    if buffer[REGULAR] == 0.0:
        strut_errors(constants, buffer, work[0], work[3, 0])
        if smallest_singular_value(work[0], work[2]) < singular:
            return NEAR_SINGULARITY
    if not in_stroke(constants, legs, row):
        return OUTSIDE_STROKE
    beyond = constants[STATED] == 1.0 and buffer[INSIDE] == 0.0
    return OUTSIDE_WORKSPACE if beyond else CONVERGED


@inner
def _out_of_reach(constants, buffer):
    """Return whether a leg is longer than any could be, or lengths break the triangle inequality.

    Legs i and j join points whose distances are B on the base and Q on the platform, so
    l_i + l_j + Q >= B,  l_i + l_j + B >= Q  and  |l_i - l_j| <= B + Q. A wrong unit breaks one
    of them at once, and the row need not be tried from every start.
    """
    for i in range(6):
        for j in range(i):
            B, Q = 0.0, 0.0
            for axis in range(3):
                b = buffer[BASE + 3 * i + axis] - buffer[BASE + 3 * j + axis]
                q = constants[JOINTS + 3 * i + axis] - constants[JOINTS + 3 * j + axis]
                B, Q = B + b * b, Q + q * q
            B, Q = sqrt(B), sqrt(Q)
            li, lj = buffer[LENGTH + i], buffer[LENGTH + j]
            slack = 1e-9 * (B + Q + li + lj)
            if li > FARTHEST or lj > FARTHEST:
                return True
            if li + lj + slack < abs(B - Q) or abs(li - lj) > B + Q + slack:
                return True
    return False

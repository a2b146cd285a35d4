"""The row solver: one row after another, from several starts where need be.

It solves all rows of small batches, and of large ones those that the block solver left open.
"""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from gough.kernel.descent import SOLVED, STATIONARY, UNFINISHED, descend, strut_errors
from gough.kernel.equations import assess, newton
from gough.kernel.jit import inner, jit
from gough.kernel.layout import (
    BASE,
    COMPONENTS,
    COUNT,
    DETERMINANT,
    FIRST,
    INSIDE,
    JOINTS,
    LENGTH,
    RADIUS,
    REGULAR,
    RESIDUAL,
    SINGLE,
    SIZE,
)
from gough.kernel.linear import pivoted_solve, smallest_singular_value
from gough.kernel.pose_io import get_pose, in_stroke, put_pose, put_reading, put_user_position
from gough.status import Status

CONVERGED, OUTSIDE_STROKE = int(Status.CONVERGED), int(Status.OUTSIDE_STROKE)
NEAR_SINGULARITY, OUTSIDE_WORKSPACE = int(Status.NEAR_SINGULARITY), int(Status.OUTSIDE_WORKSPACE)
UNREACHABLE, NOT_CONVERGED = int(Status.UNREACHABLE), int(Status.NOT_CONVERGED)
INVALID_INPUT = int(Status.INVALID_INPUT)

STEPS = np.int64(10)  # of plain Newton, in blocks too, before the damped method tries
ENOUGH_STARTS = 8  # after which a pose outside the workspace is taken for the answer
PATIENCE = 6  # times the limit, for the last look at a row that no start settled


@jit()
def solve_rows(constants, legs, rows, guess, starts, settings, work, out):
    """Solve chosen rows one by one; results replace those in `out`.

    Args:
        rows: (K,) which rows of legs (N, 6).
        guess: (K, 7) internal poses that each row tries first.
        starts: (S, 7) internal poses tried next, in order, until one leads into the workspace
            on home's side of the singularities.
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
        outcome, count = _solve_row(constants, buffer, guess, n, starts, settings, matrices, best)
        if outcome == SOLVED:
            status = status_of_pose(constants, buffer, legs, row, settings[2], matrices)
        else:
            status = UNREACHABLE if outcome == STATIONARY else NOT_CONVERGED
        statuses[row] = status
        put_user_position(constants, buffer, FIRST, SINGLE)
        get_pose(buffer, FIRST, SINGLE, position, wxyz, row)
        residuals[row] = buffer[RESIDUAL] * constants[SIZE]
        iterations[row] = count
    return invalid


@inner
def _solve_row(constants, buffer, guess, n, starts, settings, work, best):
    """Solve the reading in `buffer`, from guess n and then from the starts; leave the pose there.

    Taken is the first pose inside the workspace; else the first with these lengths; else the
    one that misses them least.

    Returns:
        SOLVED, STATIONARY or UNFINISHED, and the steps taken in all.
    """
    tolerance, limit = settings[0], int(settings[1])
    put_pose(buffer, FIRST, SINGLE, guess, n)
    chosen, least, total, first, tries = UNFINISHED, inf, 0, 0, len(starts)
    if limit > 0:
        solved = newton(constants, buffer, tolerance, STEPS if limit > STEPS else limit)
        total = int(buffer[COUNT])
        if solved and (buffer[INSIDE] == 1.0 or settings[3] == 1.0):
            return SOLVED, total
        if solved:
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
        if outcome == SOLVED and buffer[INSIDE] == 1.0:
            return outcome, total
        if chosen == SOLVED and attempt >= ENOUGH_STARTS:
            break
        if attempt == 0 or (chosen != SOLVED and (outcome == SOLVED or error < least)):
            chosen, least = outcome, error
            _copy(buffer, best)
    _copy(best, buffer)
    if chosen == UNFINISHED and tries > 0:  # a pose, or a miss? A longer look, once
        chosen, count, error = descend(constants, buffer, work, tolerance, PATIENCE * limit)
        total += count
        _measure(constants, buffer, work)
    if hopeless and chosen != SOLVED:
        chosen = STATIONARY
    return chosen, total


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
def status_of_pose(constants, buffer, legs, row, singular, work):
    """Return the status of the assessed pose in `buffer`, which has the readings of the row."""
    if buffer[INSIDE] == 0.0:
        return OUTSIDE_WORKSPACE
    if buffer[REGULAR] == 0.0:
        strut_errors(constants, buffer, work[0], work[3, 0])
        if smallest_singular_value(work[0], work[2]) < singular:
            return NEAR_SINGULARITY
    return CONVERGED if in_stroke(constants, legs, row) else OUTSIDE_STROKE


@inner
def _out_of_reach(constants, buffer):
    """Return whether the lengths are impossible by the triangle inequality alone.

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
            if li + lj + slack < abs(B - Q) or abs(li - lj) > B + Q + slack:
                return True
    return False

"""The row solver: rows that the block solver left open, from several starts if need be."""

from __future__ import annotations

import numpy as np

from gough.kernel.descent import SOLVED, STATIONARY, UNFINISHED, descend
from gough.kernel.equations import assess
from gough.kernel.jit import jit
from gough.kernel.layout import (
    BASE,
    COMPONENTS,
    DETERMINANT,
    INSIDE,
    JOINTS,
    LENGTH,
    RADIUS,
    REGULAR,
    RESIDUAL,
    SIZE,
)
from gough.kernel.linear import pivoted_solve, smallest_singular_value
from gough.kernel.pose_io import give_pose, in_stroke, place, put_pose, take_reading
from gough.status import Status

CONVERGED, OUTSIDE_STROKE = int(Status.CONVERGED), int(Status.OUTSIDE_STROKE)
NEAR_SINGULARITY, OUTSIDE_WORKSPACE = int(Status.NEAR_SINGULARITY), int(Status.OUTSIDE_WORKSPACE)
UNREACHABLE, NOT_CONVERGED = int(Status.UNREACHABLE), int(Status.NOT_CONVERGED)
INVALID_INPUT = int(Status.INVALID_INPUT)

OTHER_MODE = 8  # starts after which a pose outside the workspace is taken for the answer
PATIENCE = 6  # times the limit, for the last look at a row that no start settled


@jit()
def rescue_rows(constants, legs, rows, guess, starts, tolerance, limit, singular, out):
    """Solve chosen rows one by one; results replace those in `out`.

    Args:
        rows: (K,) which rows of legs (N, 6).
        guess: (K, 7) internal poses that each row tries first.
        starts: (S, 7) internal poses tried next, in order, until one leads into the workspace
            on home's side of the singularities.
        limit: steps from each start.
        singular: distance to singularity below which a pose is called near one.
        out: position (N, 3), wxyz (N, 4), residual (N,) [platform unit], iterations (N,),
            status (N,).
    """
    position, wxyz, residuals, iterations, statuses = out
    buffer, best = np.zeros(COMPONENTS), np.zeros(COMPONENTS)
    work = np.zeros((4, 6, 6))
    for n in range(len(rows)):
        row = rows[n]
        if not take_reading(constants, legs, row, buffer, 0, 1):
            statuses[row] = INVALID_INPUT
            continue
        outcome, count = solve_row(
            constants, buffer, guess, n, starts, tolerance, limit, work, best
        )
        stroke = in_stroke(constants, legs, row)
        statuses[row] = judge(buffer, outcome, stroke, singular, work)
        place(constants, buffer, 0, 1)
        give_pose(buffer, 0, 1, position, wxyz, row)
        residuals[row] = buffer[RESIDUAL] * constants[SIZE]
        iterations[row] += count
    return len(rows)


@jit()
def solve_row(constants, buffer, guess, n, starts, tolerance, limit, work, best):
    """The reading in `buffer`, from guess n and then from the starts; the pose stays there.

    Taken is the first pose inside the workspace; else the first with these lengths; else the
    one that misses them least. Returns the outcome and the steps taken in all.
    """
    chosen, least, total = -1, np.inf, 0
    hopeless = out_of_reach(constants, buffer)
    tries = 1 if hopeless else 1 + len(starts)
    for attempt in range(tries):
        if attempt == 0:
            put_pose(buffer, 0, 1, guess, n)
        else:
            put_pose(buffer, 0, 1, starts, attempt - 1)
        outcome, count, error = descend(constants, buffer, work, tolerance, limit)
        total += count
        _measure(constants, buffer, work)
        if outcome == SOLVED and buffer[INSIDE] == 1.0:
            return outcome, total
        if chosen == SOLVED and attempt >= OTHER_MODE:
            break
        if _better(outcome, error, chosen, least):
            chosen, least = outcome, error
            best[:] = buffer
    buffer[:] = best
    if chosen == UNFINISHED and tries > 1:  # a pose, or a miss? A longer look, once
        chosen, count, _ = descend(constants, buffer, work, tolerance, PATIENCE * limit)
        total += count
        _measure(constants, buffer, work)
    return (STATIONARY if hopeless and chosen != SOLVED else chosen), total


@jit()
def _better(outcome, error, chosen, least):
    if chosen == SOLVED:
        return False
    return chosen == -1 or outcome == SOLVED or error < least


@jit()
def _measure(constants, buffer, work):
    """Determinant, residual and place of the pose that `descend` ended at."""
    determinant = pivoted_solve(work[0], work[3, 0], work[2], work[3, 2])
    rho = constants[RADIUS]
    product = rho * rho * rho
    for i in range(6):
        product *= buffer[LENGTH + i]
    buffer[DETERMINANT] = determinant * product
    assess(constants, buffer, 0, 1)


@jit()
def judge(buffer, outcome, stroke, singular, work):
    """The status of the pose in `buffer`; work[0] holds J of the last pose tried."""
    if outcome == SOLVED:
        if buffer[INSIDE] == 0.0:
            return OUTSIDE_WORKSPACE
        if buffer[REGULAR] == 0.0 and smallest_singular_value(work[0], work[2]) < singular:
            return NEAR_SINGULARITY
        return CONVERGED if stroke else OUTSIDE_STROKE
    return UNREACHABLE if outcome == STATIONARY else NOT_CONVERGED


@jit()
def out_of_reach(constants, buffer):
    """Whether the lengths are impossible by the triangle inequality alone.

    Legs i and j join points whose distances are B on the base and Q on the platform, so
    l_i + l_j + Q >= B,  l_i + l_j + B >= Q  and  |l_i - l_j| <= B + Q. A wrong unit breaks one
    of them at once, and the row need not be tried from every start.
    """
    for i in range(6):
        for j in range(i):
            B, Q = 0.0, 0.0
            for axis in range(3):
                B += (buffer[BASE + 3 * i + axis] - buffer[BASE + 3 * j + axis]) ** 2
                Q += (constants[JOINTS + 3 * i + axis] - constants[JOINTS + 3 * j + axis]) ** 2
            B, Q = np.sqrt(B), np.sqrt(Q)
            li, lj = buffer[LENGTH + i], buffer[LENGTH + j]
            slack = 1e-9 * (B + Q + li + lj)
            if li + lj + slack < abs(B - Q) or abs(li - lj) > B + Q + slack:
                return True
    return False

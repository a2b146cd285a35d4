"""The bulk solver: blocks of poses, one vector instruction for several at a time.

Everything is compiled into `solve_blocks`. Were its parts compiled apart, the process that
compiles them would run other machine code for them than those that load `solve_blocks` from
the cache, and round some last digits differently.
"""

from __future__ import annotations

from math import inf

import numpy as np

from gough.kernel.equations import SETTLED, assess, newton_step
from gough.kernel.jit import inline, jit
from gough.kernel.lanes import LANES
from gough.kernel.layout import (
    COUNT,
    GAIN,
    INSIDE,
    LENGTH,
    OPEN,
    ORDER,
    PER_SIZE,
    QUATERNION,
    REGULAR,
    RESIDUAL,
    ROTARY,
    SIZE,
    SQUARE,
    STEP,
    WIDTH,
    ZERO,
)
from gough.kernel.polynomial import POSE, READING, guess_poses
from gough.kernel.pose_io import get_pose, in_stroke, put_pose, put_reading, put_user_position
from gough.kernel.rows import CONVERGED, INVALID_INPUT, OUTSIDE_STROKE


@jit()
def solve_blocks(constants, legs, guess, polynomial, tolerance, steps, first, last, work, out):
    """Solve rows first..last of legs (N, 6) by plain Newton.

    Args:
        guess: (last - first, 7) internal poses to start from; none: the polynomial's.
        polynomial: numbers and table, see `gough.kernel.polynomial`.
        tolerance: largest strut error, as a share of the platform's size.
        steps: limit of Newton steps.
        work: (COMPONENTS WIDTH,), (6 WIDTH,), (WIDTH,) and what a polynomial's evaluation takes,
            to work in.
        out: position (N, 3), wxyz (N, 4), residual (N,) [platform unit], iterations (N,),
            status (N,), which is OPEN where the row needs the row solver.

    Returns:
        How many of the rows are open or invalid.
    """
    buffer, readings, valid, z = work
    for k in range(WIDTH):  # puts the base joints, which most machines never move
        put_reading(constants, legs, first, buffer, k, WIDTH)
    troubled = 0
    for start in range(first, last, WIDTH):
        _load(constants, legs, start, last, readings, buffer, valid)
        if len(guess) == 0:
            _guess(polynomial, readings, z, buffer)
        else:
            for k in range(WIDTH):
                row = start + k if start + k < last else last - 1
                put_pose(buffer, k, WIDTH, guess, row - first)
        _refine(constants, buffer, tolerance, steps)
        troubled += _store(constants, buffer, legs, valid, start, last, tolerance, out)
    return troubled


@inline
def _guess(polynomial, readings, z, buffer):
    """Store the poses that a polynomial gives for a block's readings."""
    numbers, table = polynomial
    for first in range(0, WIDTH, LANES):
        for leg in range(6):
            for w in range(LANES):
                z[(READING + leg) * LANES + w] = readings[leg * WIDTH + first + w]
        guess_poses(z, numbers, table)
        for c in range(7):
            at = (c if c < 3 else QUATERNION + c - 3) * WIDTH + first
            for w in range(LANES):
                buffer[at + w] = z[(POSE + c) * LANES + w]


@inline
def _load(constants, legs, start, last, readings, buffer, valid):
    """Store the struts of a block's readings; `valid` is 1 for rows that have them, else 0.

    The last block is filled up with its last row.
    """
    for k in range(WIDTH):
        row = start + k if start + k < last else last - 1
        for leg in range(6):
            readings[leg * WIDTH + k] = legs[row, leg]
    rotary = constants[ROTARY] == 1
    good = 0 if rotary else _load_lengths(constants, readings, buffer)
    for k in range(WIDTH):
        valid[k] = 1.0
    if good == 6 * WIDTH:
        return
    for k in range(WIDTH):
        fine = not rotary
        for i in range(6):
            length = buffer[(LENGTH + i) * WIDTH + k]
            fine &= (length > 0) & (length < inf)
        if not fine:  # rows beside a bad one keep what they have, to the last bit
            row = start + k if start + k < last else last - 1
            valid[k] = 1.0 if put_reading(constants, legs, row, buffer, k, WIDTH) else 0.0


@inline
def _load_lengths(constants, readings, buffer):
    """Store the lengths of all legs of a block, as vector code; count those above zero."""
    inverse = constants[PER_SIZE]
    good = 0
    for i in range(6):
        gain, zero = constants[GAIN + i], constants[ZERO + i]
        column = np.uint64(constants[ORDER + i]) * np.uint64(WIDTH)
        at, square = np.uint64((LENGTH + i) * WIDTH), np.uint64((SQUARE + i) * WIDTH)
        for k in range(np.uint64(WIDTH)):
            length = (gain * readings[column + k] + zero) * inverse
            buffer[at + k] = length
            buffer[square + k] = length * length
            good += 1 if (length > 0) & (length < inf) else 0
    return good


@inline
def _refine(constants, buffer, tolerance, steps):
    """Take Newton steps of the block until every pose has settled or `steps` are used up.

    A pose that settled with too large a residual (a step can be small and still lack digits
    where the system is ill-conditioned) is set going again.
    """
    for k in range(WIDTH):
        buffer[COUNT * WIDTH + k] = 0.0
        buffer[STEP * WIDTH + k] = inf
    for step in range(steps):
        for k in range(WIDTH):
            newton_step(constants, buffer, k, WIDTH)
        largest = 0.0
        for k in range(WIDTH):
            size = buffer[STEP * WIDTH + k]
            size = size if size == size else inf
            largest = size if size > largest else largest
        if largest <= SETTLED or step == steps - 1:
            for k in range(WIDTH):
                assess(constants, buffer, k, WIDTH)
            above = 0
            for k in range(WIDTH):
                missed = not buffer[RESIDUAL * WIDTH + k] <= tolerance
                buffer[STEP * WIDTH + k] = inf if missed else buffer[STEP * WIDTH + k]
                above += 1 if missed else 0
            if above == 0:
                return


@inline
def _store(constants, buffer, legs, valid, start, last, tolerance, out):
    """Copy a block's results to `out`; return how many rows are open or invalid."""
    position, wxyz, residuals, iterations, statuses = out
    troubled = 0
    for k in range(WIDTH):  # all of them: a shorter loop would round its last poses differently
        put_user_position(constants, buffer, k, WIDTH)
    for k in range(WIDTH if start + WIDTH < last else last - start):
        row = start + k
        get_pose(buffer, k, WIDTH, position, wxyz, row)
        residuals[row] = buffer[RESIDUAL * WIDTH + k] * constants[SIZE]
        iterations[row] = int(buffer[COUNT * WIDTH + k])
        status = CONVERGED if in_stroke(constants, legs, row) else OUTSIDE_STROKE
        solved = buffer[RESIDUAL * WIDTH + k] <= tolerance
        if not solved or buffer[INSIDE * WIDTH + k] < 1.0 or buffer[REGULAR * WIDTH + k] == 0.0:
            status = OPEN
        if valid[k] == 0.0:
            status = INVALID_INPUT
        statuses[row] = status
        troubled += 1 if status >= INVALID_INPUT else 0
    return troubled

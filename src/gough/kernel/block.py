"""The bulk solver: blocks of poses, one vector instruction for several at a time.

Everything is compiled into `solve_rows`. Were its parts compiled apart, the process that
compiles them would run other machine code for them than those that load `solve_rows` from the
cache, and round some last digits differently.
"""

from __future__ import annotations

import numpy as np

from gough.kernel.equations import SMALL, assess, inline, newton_step
from gough.kernel.jit import jit
from gough.kernel.layout import (
    COMPONENTS,
    COUNT,
    GAIN,
    INSIDE,
    LENGTH,
    OPEN,
    ORDER,
    PER_SIZE,
    REGULAR,
    RESIDUAL,
    ROTARY,
    SIZE,
    SQUARE,
    STEP,
    WIDTH,
    ZERO,
)
from gough.kernel.polynomial import guess_block
from gough.kernel.pose_io import give_pose, in_stroke, place, put_pose, take_reading
from gough.status import Status

# A row's verdict is its status, or what it still needs.
DONE = int(Status.CONVERGED)
OUT_OF_STROKE = int(Status.OUTSIDE_STROKE)
INVALID = int(Status.INVALID_INPUT)
MAYBE_SINGULAR = OPEN
MAYBE_OTHER_MODE = OPEN + 1
UNSETTLED = OPEN + 2


@jit()
def solve_rows(constants, legs, guess, polynomial, tolerance, sweeps, first, last, out):
    """Rows first..last of legs (N, 6): pose, verdict, residual and count of each.

    Args:
        guess: internal poses (N, 7) to start from, or (0, 7) to use the polynomial.
        polynomial: see `polynomial.Polynomial.arrays`.
        tolerance: largest strut error, as a share of the platform's size.
        sweeps: limit of Newton sweeps.
        out: position (N, 3), wxyz (N, 4), residual (N,) [platform unit], iterations (N,),
            verdict (N,).

    Returns:
        How many of the rows are no plain success: open, or invalid.
    """
    buffer = np.zeros(COMPONENTS * WIDTH)
    readings = np.empty(6 * WIDTH)
    starts = polynomial[4]
    work = np.empty((2, np.max(starts[1:] - starts[:-1]) * WIDTH))
    valid = np.empty(WIDTH, np.bool_)
    for k in range(WIDTH):  # puts the base joints, which most machines never move
        take_reading(constants, legs, first, buffer, k, WIDTH)
    troubled = 0
    for start in range(first, last, WIDTH):
        _load(constants, legs, start, last, readings, buffer, valid)
        if len(guess) > 0:
            for k in range(WIDTH):
                put_pose(buffer, k, WIDTH, guess, min(start + k, last - 1))
        else:
            guess_block(polynomial, readings, work, buffer)
        _refine(constants, buffer, tolerance, sweeps)
        troubled += _store(constants, buffer, legs, valid, start, last, tolerance, out)
    return troubled


@inline
def _load(constants, legs, start, last, readings, buffer, valid):
    """Readings of a block, leg by leg, and the struts they stand for.

    The last block is filled up with its last row.
    """
    for k in range(WIDTH):
        row = min(start + k, last - 1)
        for leg in range(6):
            readings[leg * WIDTH + k] = legs[row, leg]
    rotary = constants[ROTARY] == 1
    if not rotary and _load_lengths(constants, readings, buffer):
        valid[:] = True
        return
    for k in range(WIDTH):
        valid[k] = not rotary and _has_lengths(buffer, k)
        if not valid[k]:  # rows beside a bad one keep what they have, to the last bit
            row = min(start + k, last - 1)
            valid[k] = take_reading(constants, legs, row, buffer, k, WIDTH)


@inline
def _has_lengths(buffer, k):
    good = True
    for i in range(6):
        length = buffer[(LENGTH + i) * WIDTH + k]
        good &= (length > 0) & (length < np.inf)
    return good


@inline
def _load_lengths(constants, readings, buffer):
    """Lengths of all legs of a block as vector code; whether all of them are above zero."""
    inverse = constants[PER_SIZE]
    good = 0
    for i in range(6):
        leg, gain, zero = int(constants[ORDER + i]), constants[GAIN + i], constants[ZERO + i]
        reading = readings[leg * WIDTH : (leg + 1) * WIDTH]
        for k in range(WIDTH):
            length = (gain * reading[k] + zero) * inverse
            buffer[(LENGTH + i) * WIDTH + k] = length
            buffer[(SQUARE + i) * WIDTH + k] = length * length
            good += 1 if (length > 0) & (length < np.inf) else 0
    return good == 6 * WIDTH


@inline
def _refine(constants, buffer, tolerance, sweeps):
    """Newton sweeps over the block until every pose has settled or `sweeps` are used up.

    A pose that settled with too large a residual (a step can be small and still lack digits
    where the system is ill-conditioned) is set going again.
    """
    for k in range(WIDTH):
        buffer[COUNT * WIDTH + k] = 0.0
        buffer[STEP * WIDTH + k] = np.inf
    for sweep in range(sweeps):
        for k in range(WIDTH):
            newton_step(constants, buffer, k, WIDTH)
        if _largest_step(buffer) <= SMALL or sweep == sweeps - 1:
            for k in range(WIDTH):
                assess(constants, buffer, k, WIDTH)
            if _wake(buffer, tolerance) == 0:
                return
    if sweeps == 0:
        for k in range(WIDTH):
            assess(constants, buffer, k, WIDTH)


@inline
def _largest_step(buffer):
    """Largest squared step of the sweep, infinite for NaN."""
    largest = 0.0
    for k in range(WIDTH):
        step = buffer[STEP * WIDTH + k]
        largest = max(largest, step if step == step else np.inf)
    return largest


@inline
def _wake(buffer, tolerance):
    """Set poses going again whose residual is above the tolerance; how many there are."""
    count = 0
    for k in range(WIDTH):
        above = not buffer[RESIDUAL * WIDTH + k] <= tolerance
        buffer[STEP * WIDTH + k] = np.inf if above else buffer[STEP * WIDTH + k]
        count += 1 if above else 0
    return count


@inline
def _store(constants, buffer, legs, valid, start, last, tolerance, out):
    position, wxyz, residuals, iterations, verdicts = out
    troubled = 0
    for k in range(WIDTH):  # all of them: a shorter loop would round its last poses differently
        place(constants, buffer, k, WIDTH)
    for k in range(min(WIDTH, last - start)):
        row = start + k
        give_pose(buffer, k, WIDTH, position, wxyz, row)
        residuals[row] = buffer[RESIDUAL * WIDTH + k] * constants[SIZE]
        iterations[row] = int(buffer[COUNT * WIDTH + k])
        stroke = in_stroke(constants, legs, row)
        found = verdict(buffer, k, WIDTH, tolerance, stroke) if valid[k] else INVALID
        verdicts[row] = found
        troubled += 1 if found >= INVALID else 0
    return troubled


@inline
def verdict(buffer, k, stride, tolerance, stroke):
    """What an assessed pose still needs."""
    if not buffer[RESIDUAL * stride + k] <= tolerance:
        return UNSETTLED
    if buffer[INSIDE * stride + k] == 0.0:
        return MAYBE_OTHER_MODE
    if buffer[REGULAR * stride + k] == 0.0:
        return MAYBE_SINGULAR
    return DONE if stroke else OUT_OF_STROKE

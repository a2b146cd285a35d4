"""Consecutive readings, compiled: cycle after cycle, as a control loop takes them."""

from __future__ import annotations

from gough.kernel.cycle import cycle
from gough.kernel.jit import jit
from gough.kernel.layout import COUNT, FIRST, OPEN, RESIDUAL, SIZE


@jit()
def follow(constants, legs, first, reading, state, limits, buffer, work, position, wxyz, out):
    """Follow rows of legs (N, 6) from row `first` on, as far as each follows from the one before.

    Args:
        reading: (1, 6) to hold a row.
        state, limits, buffer, work, position, wxyz: as for `cycle`.
        out: position (N, 3), wxyz (N, 4), residual (N,) [platform unit], iterations (N,),
            status (N,); rows that were followed are written.

    Returns:
        The first row that could not be followed, or N.
    """
    positions, quaternions, residuals, iterations, statuses = out
    for row in range(first, len(legs)):
        for leg in range(6):
            reading[FIRST, leg] = legs[row, leg]
        code = cycle(constants, reading, state, limits, buffer, work, position, wxyz)
        if code >= OPEN:
            return row
        for i in range(3):
            positions[row, i] = position[FIRST, i]
        for i in range(4):
            quaternions[row, i] = wxyz[FIRST, i]
        residuals[row] = buffer[RESIDUAL] * constants[SIZE]
        iterations[row] = int(buffer[COUNT])
        statuses[row] = code
    return len(legs)

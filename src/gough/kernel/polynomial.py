"""A polynomial of six readings that gives poses, evaluated for eight rows at once.

`guess` is traced into vector instructions (see lanes.py): its sums stay in registers.
"""

from __future__ import annotations

import numpy as np

from gough.kernel.jit import jit
from gough.kernel.lanes import LANES, Reals, compiled, larger, registers, rows

CLAMP = 1.25  # readings further out than this share of the fitted range are drawn in to it

# Slots of `z`: readings, which become shares of the fitted range; the internal pose; monomials
READING, POSE, MONOMIAL = 0, 6, 13
# Places in `numbers`: the readings' centre and inverse half range; turn, see
# `gough.seeds.polynomial.Polynomial`; six coefficients of each monomial
CENTRE, FACTOR, TURN, COEFFICIENT = 0, 6, 12, 17


@jit()
def evaluate(numbers, table, legs, z, out):
    """Fill `out` (N, 7) with the internal poses of readings legs (N, 6).

    Args:
        numbers, table: as for `guess`; floats and int64.
        z: ((MONOMIAL + M) LANES,) for M monomials, to work in.
    """
    for first in range(0, len(legs), LANES):
        for w in range(LANES):
            row = first + w if first + w < len(legs) else len(legs) - 1
            for leg in range(6):
                z[(READING + leg) * LANES + w] = legs[row, leg]
        guess_poses(z, numbers, table)
        for w in range(LANES if first + LANES < len(legs) else len(legs) - first):
            for c in range(7):
                out[first + w, c] = z[(POSE + c) * LANES + w]


def guess(z, numbers, table) -> None:
    """Internal poses of the readings in `z`.

    Args:
        table: (M - 1, 2) the monomials after the first: which other one each is a multiple of,
            and by which of the six readings.
    """
    for leg in range(6):
        share = (z[READING + leg] - numbers[CENTRE + leg]) * numbers[FACTOR + leg]
        z[READING + leg] = -larger(-larger(share, -CLAMP), -CLAMP)
    total = registers(z, 6)
    for k in range(6):
        total[k] = 0.0 * z[READING] + numbers[COEFFICIENT + k]
    z[MONOMIAL] = 0.0 * z[READING] + 1.0
    for m, (parent, variable) in rows(z, table):
        value = z[MONOMIAL + parent] * z[READING + variable]
        z[MONOMIAL + 1 + m] = value
        for k in range(6):
            total[k] = total[k] + numbers[COEFFICIENT + 6 + k + 6 * m] * value
    for k in range(3):
        z[POSE + k] = total[k]
    _put_rotation(z, [total[k] for k in range(3, 6)], [numbers[TURN + k] for k in range(5)])


guess_poses = compiled(guess, Reals, table=True)


def _put_rotation(z, u, turn) -> None:
    """Store the quaternion along (turn[4] + sqrt(1 - u.u), u) times the reference turn[:4]."""
    a, b, c = u
    w, x, y, s, offset = turn
    real = offset + np.sqrt(larger(1.0 - a * a - b * b - c * c, 0.0))
    q = [
        real * w - a * x - b * y - c * s,
        real * x + a * w + b * s - c * y,
        real * y + b * w + c * x - a * s,
        real * s + c * w + a * y - b * x,
    ]
    over = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for k in range(4):
        z[POSE + 3 + k] = q[k] * over

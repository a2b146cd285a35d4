"""The rule that tells home's assembly mode from others, for many poses at once.

Repeats `gough.home_mode.reached_from` for legs without motors: what `kernel.home_mode` does for one
pose of any machine, this does for blocks of poses, whose ways vector instructions walk side by
side. Its elimination does not pivot: a way where that fails counts as not passed.
"""

from __future__ import annotations

from math import sqrt

from gough.home_mode import MOST_POINTS, ROTATION_STEP, TRANSLATION_STEP
from gough.kernel.equations import assess, newton_step, put_quaternion
from gough.kernel.jit import inline, jit
from gough.kernel.layout import DETERMINANT, HOME_POSE, HOME_SIGN, LENGTH, REGULAR, STEP, WIDTH
from gough.kernel.pose_io import in_stroke, put_reading
from gough.kernel.rows import CONVERGED, FARTHEST, OUTSIDE_STROKE


@jit()
def accept_reached(constants, legs, rows, poses, first, last, work, statuses):
    """Set the status of solved rows whose pose is reached from home on a way without singularity.

    Args:
        rows: (K,) which rows of legs (N, 6) are solved, apart from their status.
        poses: (K, 7) their internal poses.
        first, last: which of the K rows.
        work: (COMPONENTS WIDTH,), (7 WIDTH,), (WIDTH,) and (WIDTH,) to work in.
        statuses: (N,), unchanged for rows that are not reached, or are near a singularity.

    Returns:
        How many rows were given a status.
    """
    buffer, ends, count, passed = work
    accepted = 0
    for start in range(first, last, WIDTH):
        for k in range(WIDTH):
            n = start + k if start + k < last else last - 1
            put_reading(constants, legs, rows[n], buffer, k, WIDTH)
            for c in range(7):
                ends[c * WIDTH + k] = poses[n, c]
        most = _measure_ways(constants, ends, count, passed)
        for n in range(1, most + 1):
            for k in range(WIDTH):
                _pass_point(constants, buffer, ends, count, passed, k, n)
        for k in range(WIDTH):  # all of them are at their ends now
            assess(constants, buffer, k, WIDTH)
        for k in range(WIDTH if start + WIDTH < last else last - start):
            row = rows[start + k]
            fine = passed[k] * buffer[REGULAR * WIDTH + k] == 1.0
            for i in range(6):
                fine &= buffer[(LENGTH + i) * WIDTH + k] <= FARTHEST
            if fine:
                statuses[row] = CONVERGED if in_stroke(constants, legs, row) else OUTSIDE_STROKE
                accepted += 1
    return accepted


@inline
def _measure_ways(constants, ends, count, passed):
    """Store the number of points of the ways from home to each end; return the largest.

    Of the two quaternions of each end the one nearer to home's is kept.
    """
    most = 1
    for k in range(WIDTH):
        along, square = 0.0, 1.0
        for i in range(4):
            along += ends[(3 + i) * WIDTH + k] * constants[HOME_POSE + 3 + i]
        for i in range(3):
            step = (ends[i * WIDTH + k] - constants[HOME_POSE + i]) / TRANSLATION_STEP
            square += step * step
        for i in range(3, 7):
            at = i * WIDTH + k
            ends[at] = -ends[at] if along < 0 else ends[at]
            step = 2 * (ends[at] - constants[HOME_POSE + i]) / ROTATION_STEP
            square += step * step
        points = int(sqrt(square)) if square < MOST_POINTS * MOST_POINTS else MOST_POINTS
        count[k], passed[k] = points, 1.0
        most = points if points > most else most
    return most


@inline
def _pass_point(constants, buffer, ends, count, passed, k, n):
    """Put pose k at point n of its way; clear `passed` unless det J has home's sign there."""
    t = n / count[k] if n < count[k] else 1.0
    s, h = 1.0 - t, HOME_POSE
    for i in range(3):
        buffer[i * WIDTH + k] = s * constants[h + i] + t * ends[i * WIDTH + k]
    put_quaternion(
        buffer, k, WIDTH,
        s * constants[h + 3] + t * ends[3 * WIDTH + k],
        s * constants[h + 4] + t * ends[4 * WIDTH + k],
        s * constants[h + 5] + t * ends[5 * WIDTH + k],
        s * constants[h + 6] + t * ends[6 * WIDTH + k],
    )  # fmt: skip
    buffer[STEP * WIDTH + k] = 0.0  # settled: the step is not taken, but tells the determinant
    newton_step(constants, buffer, k, WIDTH)
    determinant = buffer[DETERMINANT * WIDTH + k]
    passed[k] *= 1.0 if determinant * constants[HOME_SIGN] >= 0 else 0.0

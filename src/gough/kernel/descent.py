"""Downhill from one start: damped least squares on the strut errors of a single pose.

Levenberg-Marquardt on r_i = |d_i| - l_i. The damping falls as steps succeed; once it is
negligible, steps come from a pivoted solve of J step = r instead of the normal equations,
which would square the condition number near a singularity.
"""

from __future__ import annotations

from math import sqrt

from gough.kernel.equations import get_quaternion, move, rotation, strut
from gough.kernel.jit import inner
from gough.kernel.layout import FIRST, LENGTH, QUATERNION, RADIUS, SINGLE, YES
from gough.kernel.linear import damped_solve, pivoted_solve

SOLVED = 0  # a pose with these lengths
STATIONARY = 1  # misses them, and no small motion comes closer
UNFINISHED = 2  # neither, within the limit

LONGEST_TRANSLATION = 0.25  # of the platform's size: limit of one step
LARGEST_ROTATION = 0.5  # [rad]: limit of one step
NEGLIGIBLE = 1e-9  # damping below which the pivoted solve takes over
HOPELESS = 1e8  # damping above which a step is lost in rounding

# A point is stationary where |gradient| <= FLAT error^(3/2). On the way to a pose at distance x
# from a singular one, error ~ x^2 and |gradient| / error ~ x ~ sqrt(error); a limit well below
# that does not mistake such a pose for a miss.
FLAT = 1e-3


@inner
def descend(constants, buffer, work, tolerance, limit):
    """Move the pose in `buffer` (stride 1) downhill, in place.

    Args:
        work: (4, 6, 6); afterwards work[0] is J and work[3, 0] is r at the pose.

    Returns:
        SOLVED, STATIONARY or UNFINISHED; steps taken; root of the sum of squared errors.
    """
    J, trial_J, system = work[0], work[1], work[2]
    r, trial_r, step = work[3, 0], work[3, 1], work[3, 2]
    before = work[3, 3]
    damping = 1e-3
    cost, largest = strut_errors(constants, buffer, J, r)
    outcome, count = UNFINISHED, 0
    while count < limit and largest > 0.1 * tolerance:
        if damping >= NEGLIGIBLE or pivoted_solve(J, r, system, step) == 0.0:
            damping = damping if damping > NEGLIGIBLE else NEGLIGIBLE
            gradient = damped_solve(J, r, damping, system, step)
            if gradient <= FLAT * sqrt(sqrt(cost)) * sqrt(cost):
                outcome = STATIONARY
                break
        _limit_step(step, constants[RADIUS])
        w, x, y, z = get_quaternion(buffer, FIRST, SINGLE)
        for i in range(3):
            before[i] = buffer[i]
        move(buffer, FIRST, SINGLE, YES, -step[0], -step[1], -step[2], -step[3], -step[4], -step[5])
        trial, trial_largest = strut_errors(constants, buffer, trial_J, trial_r)
        if trial < cost:
            for i in range(6):
                r[i] = trial_r[i]
                for j in range(6):
                    J[i, j] = trial_J[i, j]
            cost, largest = trial, trial_largest
            damping *= 0.1
            count += 1
            continue
        for i in range(3):
            buffer[i] = before[i]
        q = QUATERNION
        buffer[q], buffer[q + 1], buffer[q + 2], buffer[q + 3] = w, x, y, z
        damping = 10 * (damping if damping > NEGLIGIBLE else NEGLIGIBLE)
        if damping > HOPELESS or largest <= tolerance:
            outcome = STATIONARY
            break
        count += 1
    return SOLVED if largest <= tolerance else outcome, count, sqrt(cost)


@inner
def strut_errors(constants, buffer, J, r):
    """Fill J (6, 6), rows (n_i, a_i x n_i / radius), and r (6,) = |d_i| - l_i.

    Dividing the rotation columns by the joints' radius makes all unknowns lengths, and J the
    matrix whose smallest singular value is the distance to singularity.

    Returns:
        The sum of squares of r and its largest entry's size.
    """
    w, x, y, z = get_quaternion(buffer, FIRST, SINGLE)
    R = rotation(w, x, y, z)
    cost, largest = 0.0, 0.0
    for i in range(6):
        a, d = strut(constants, buffer, FIRST, SINGLE, R, i)
        length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        n = 1 / (length if length > 1e-300 else 1e-300)
        m = n / constants[RADIUS]
        J[i, 0], J[i, 1], J[i, 2] = d[0] * n, d[1] * n, d[2] * n
        J[i, 3] = (a[1] * d[2] - a[2] * d[1]) * m
        J[i, 4] = (a[2] * d[0] - a[0] * d[2]) * m
        J[i, 5] = (a[0] * d[1] - a[1] * d[0]) * m
        r[i] = length - buffer[LENGTH + i]
        cost += r[i] * r[i]
        largest = abs(r[i]) if abs(r[i]) > largest else largest
    return cost, largest


@inner
def _limit_step(step, radius):
    """Turn rotations into radians, and shorten the whole step if it moves or rotates too far."""
    translation, rotated = 0.0, 0.0
    for i in range(3):
        step[i + 3] /= radius
        translation += step[i] * step[i]
        rotated += step[i + 3] * step[i + 3]
    excess = sqrt(translation) / LONGEST_TRANSLATION
    turn = sqrt(rotated) / LARGEST_ROTATION
    excess = turn if turn > excess else excess
    if excess > 1.0:
        for i in range(6):
            step[i] /= excess

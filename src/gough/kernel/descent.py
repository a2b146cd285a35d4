"""Downhill from one start: damped least squares on the strut errors of a single pose.

Levenberg-Marquardt on r_i = |d_i| - l_i. The damping falls as steps succeed; once it is
negligible, steps come from a fully pivoted solve of J step = r instead of the normal
equations, which would square the condition number near a singularity.
"""

from __future__ import annotations

import numpy as np

from gough.kernel.equations import get_quaternion, move, rotation, strut
from gough.kernel.jit import jit
from gough.kernel.layout import LENGTH, QUATERNION, RADIUS
from gough.kernel.linear import pivoted_solve, shifted_solve

SOLVED = 0  # a pose with these lengths
STATIONARY = 1  # misses them, and no small motion comes closer
UNFINISHED = 2  # neither, within the limit

LONGEST_SHIFT = 0.25  # of the platform's size: limit of one step
LARGEST_TURN = 0.5  # [rad]: limit of one step
NEGLIGIBLE = 1e-9  # damping below which the pivoted solve takes over
HOPELESS = 1e8  # damping above which a step is lost in rounding
FLAT = 1e-3  # see `_is_flat`


@jit()
def descend(constants, buffer, work, tolerance, limit):
    """From the pose in `buffer` (stride 1) downhill, in place.

    Args:
        work: (4, 6, 6); afterwards work[0] is J and work[3, 0] is r at the pose.

    Returns:
        SOLVED, STATIONARY or UNFINISHED; steps taken; root of the sum of squared errors.
    """
    J, trial_J, system = work[0], work[1], work[2]
    r, trial_r, step = work[3, 0], work[3, 1], work[3, 2]
    damping = 1e-3
    cost = strut_errors(constants, buffer, J, r)
    for count in range(limit):
        if _largest(r) <= 0.1 * tolerance:
            return SOLVED, count, np.sqrt(cost)
        if damping >= NEGLIGIBLE or pivoted_solve(J, r, system, step) == 0.0:
            gradient = shifted_solve(J, r, max(damping, NEGLIGIBLE), system, step)
            if _is_flat(gradient, np.sqrt(cost)):
                return _end(r, tolerance, STATIONARY), count, np.sqrt(cost)
        _limit(step, constants[RADIUS])
        before = _pose(buffer)
        move(buffer, 0, 1, True, -step[0], -step[1], -step[2], -step[3], -step[4], -step[5])
        trial = strut_errors(constants, buffer, trial_J, trial_r)
        if trial < cost:
            J[:], r[:], cost = trial_J, trial_r, trial
            damping *= 0.1
            continue
        _put_back(buffer, before)
        damping = max(damping, NEGLIGIBLE) * 10
        if damping > HOPELESS or _largest(r) <= tolerance:
            return _end(r, tolerance, STATIONARY), count, np.sqrt(cost)
    return _end(r, tolerance, UNFINISHED), limit, np.sqrt(cost)


@jit()
def strut_errors(constants, buffer, J, r):
    """Fill J (6, 6), rows (n_i, a_i x n_i / radius), and r (6,); the sum of squares of r.

    Dividing the rotation columns by the joints' radius makes all unknowns lengths, and J the
    matrix whose smallest singular value is the distance to singularity.
    """
    w, x, y, z = get_quaternion(buffer, 0, 1)
    R = rotation(w, x, y, z)
    cost = 0.0
    for i in range(6):
        a, d = strut(constants, buffer, 0, 1, R, i)
        length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        n = 1 / max(length, 1e-300)
        m = n / constants[RADIUS]
        J[i, 0], J[i, 1], J[i, 2] = d[0] * n, d[1] * n, d[2] * n
        J[i, 3] = (a[1] * d[2] - a[2] * d[1]) * m
        J[i, 4] = (a[2] * d[0] - a[0] * d[2]) * m
        J[i, 5] = (a[0] * d[1] - a[1] * d[0]) * m
        r[i] = length - buffer[LENGTH + i]
        cost += r[i] * r[i]
    return cost


@jit()
def _is_flat(gradient, error):
    """Whether a point counts as stationary, by its gradient relative to its error.

    On the way to a pose at distance x from a singular one, error ~ x^2 and gradient / error
    ~ x ~ sqrt(error); a limit well below that does not mistake such a pose for a miss.
    """
    return gradient <= FLAT * np.sqrt(error) * error


@jit()
def _limit(step, radius):
    """Rotations into radians, and the whole step shortened if it moves or turns too far."""
    for i in range(3, 6):
        step[i] /= radius
    shift = np.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
    turn = np.sqrt(step[3] ** 2 + step[4] ** 2 + step[5] ** 2)
    excess = max(1.0, max(shift / LONGEST_SHIFT, turn / LARGEST_TURN))
    for i in range(6):
        step[i] /= excess


@jit()
def _end(r, tolerance, otherwise):
    return SOLVED if _largest(r) <= tolerance else otherwise


@jit()
def _largest(r):
    largest = 0.0
    for i in range(6):
        largest = max(largest, abs(r[i]))
    return largest


@jit()
def _pose(buffer):
    q = QUATERNION
    return buffer[0], buffer[1], buffer[2], buffer[q], buffer[q + 1], buffer[q + 2], buffer[q + 3]


@jit()
def _put_back(buffer, pose):
    buffer[0], buffer[1], buffer[2] = pose[0], pose[1], pose[2]
    q = QUATERNION
    buffer[q], buffer[q + 1], buffer[q + 2], buffer[q + 3] = pose[3], pose[4], pose[5], pose[6]

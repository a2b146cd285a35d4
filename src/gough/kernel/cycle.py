"""One cycle of a control loop, compiled: warm start, Newton, checks; nothing is allocated."""

from __future__ import annotations

import numpy as np

from gough.kernel.block import MAYBE_OTHER_MODE, MAYBE_SINGULAR, UNSETTLED, verdict
from gough.kernel.descent import strut_errors
from gough.kernel.equations import SMALL, assess, newton_step
from gough.kernel.jit import jit
from gough.kernel.layout import DETERMINANT, OPEN, QUATERNION, STEP
from gough.kernel.linear import smallest_singular_value
from gough.kernel.pose_io import give_pose, in_stroke, place, put_pose, take_reading
from gough.status import Status

# What a cycle may say besides a status: the pose is as it was before.
FAILED = OPEN
JUMPED = OPEN + 1
CROSSED = OPEN + 2
BAD_READING = OPEN + 3

STEPS = 12  # a warm start needs one to three
STATE = 8  # internal pose 7, sign of the determinant 1

CONVERGED, OUTSIDE_STROKE = int(Status.CONVERGED), int(Status.OUTSIDE_STROKE)
NEAR_SINGULARITY, OUTSIDE_WORKSPACE = int(Status.NEAR_SINGULARITY), int(Status.OUTSIDE_WORKSPACE)


@jit()
def cycle(constants, legs, state, limits, buffer, work, position, wxyz):
    """Follow readings legs (1, 6) from the pose in `state` (1, STATE).

    Args:
        limits: tolerance, distance to singularity called near, and how far a pose may be from
            the last: squared shift [share of the size], squared sine of half the turn.
        buffer, work: (COMPONENTS,) and (4, 6, 6) to work in.
        position, wxyz: (1, 3) and (1, 4), the pose as the user sees it.

    Returns:
        A status, with the new pose in state, position and wxyz; or one of the codes above.
    """
    if not take_reading(constants, legs, 0, buffer, 0, 1):
        return BAD_READING
    put_pose(buffer, 0, 1, state, 0)
    buffer[STEP] = np.inf
    for _ in range(STEPS):
        newton_step(constants, buffer, 0, 1)
        if not buffer[STEP] > SMALL:
            break
    assess(constants, buffer, 0, 1)
    found = verdict(buffer, 0, 1, limits[0], in_stroke(constants, legs, 0))
    if found == UNSETTLED:
        return FAILED
    if buffer[DETERMINANT] * state[0, 7] < 0:
        return CROSSED
    if moved_too_far(buffer, state, limits[2], limits[3]):
        return JUMPED
    keep(constants, buffer, state, position, wxyz)
    if found == MAYBE_OTHER_MODE:
        return OUTSIDE_WORKSPACE
    if found == MAYBE_SINGULAR:
        strut_errors(constants, buffer, work[0], work[3, 0])
        near = smallest_singular_value(work[0], work[1]) < limits[1]
        stroke = in_stroke(constants, legs, 0)
        return NEAR_SINGULARITY if near else (CONVERGED if stroke else OUTSIDE_STROKE)
    return found


@jit()
def moved_too_far(buffer, state, shift, turn):
    """Whether the pose in `buffer` is too far from that in `state`; limits as in `cycle`."""
    q = QUATERNION
    moved, along = 0.0, 0.0
    for i in range(3):
        moved += (buffer[i] - state[0, i]) ** 2
    for i in range(4):
        along += buffer[q + i] * state[0, q + i]
    return moved > shift or 1 - along * along > turn


@jit()
def keep(constants, buffer, state, position, wxyz):
    """Take the pose in `buffer` for the present one."""
    for i in range(7):
        state[0, i] = buffer[i]
    state[0, 7] = 1.0 if buffer[DETERMINANT] > 0 else -1.0
    place(constants, buffer, 0, 1)
    give_pose(buffer, 0, 1, position, wxyz, 0)

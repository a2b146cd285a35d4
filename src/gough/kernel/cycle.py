"""One cycle of a control loop, compiled: warm start, Newton, checks; nothing is allocated."""

from __future__ import annotations

import numpy as np

from gough.kernel.equations import newton
from gough.kernel.jit import jit
from gough.kernel.layout import (
    DETERMINANT,
    FIRST,
    HOME_SIGN,
    INSIDE,
    OPEN,
    QUATERNION,
    SINGLE,
    USER_POSITION,
)
from gough.kernel.pose_io import get_pose, put_pose, put_reading, put_user_position
from gough.kernel.rows import status_of_pose

# What a cycle may return besides a status: the pose is as it was before.
FAILED = OPEN  # Newton's method did not settle
TOO_FAR = OPEN + 1  # the pose is too far from the last
CROSSED = OPEN + 2  # a singularity lies between the pose and the last
BAD_READING = OPEN + 3  # not finite, or not above zero

STEPS = np.int64(12)  # a warm start needs one to three
# The state: internal pose 7; sign of the determinant; 1 where the mode is the machine's, else 0;
# the pose before, as the user sees it: position 3, quaternion 4.
STATE, SIGN, OURS, LAST_POSITION, LAST_WXYZ = 16, 7, 8, 9, 12


@jit()
def cycle(constants, legs, state, limits, buffer, work, position, wxyz):
    """Follow readings legs (1, 6) from the pose in `state` (1, STATE).

    Args:
        limits: tolerance, distance to singularity called near, and how far a pose may be from
            the last: squared translation [platform unit^2], squared sine of half the rotation.
        buffer, work: (COMPONENTS,) and (4, 6, 6) to work in.
        position, wxyz: (1, 3) and (1, 4), the pose as the user sees it.

    Returns:
        A status, with the new pose in state, position and wxyz; or one of the codes above.
    """
    if not put_reading(constants, legs, FIRST, buffer, FIRST, SINGLE):
        return BAD_READING
    put_pose(buffer, FIRST, SINGLE, state, FIRST)
    if not newton(constants, buffer, limits[0], STEPS):
        return FAILED
    if buffer[DETERMINANT] * state[0, SIGN] < 0:
        return CROSSED
    put_user_position(constants, buffer, FIRST, SINGLE)
    moved, along = 0.0, 0.0
    for i in range(3):
        step = buffer[USER_POSITION + i] - position[0, i]
        moved += step * step
    for i in range(4):
        along += buffer[QUATERNION + i] * wxyz[0, i]
    if moved > limits[2] or 1 - along * along > limits[3]:
        return TOO_FAR
    for i in range(7):
        state[0, i] = buffer[i]
    for i in range(3):
        state[0, LAST_POSITION + i] = position[0, i]
    for i in range(4):
        state[0, LAST_WXYZ + i] = wxyz[0, i]
    state[0, SIGN] = 1.0 if buffer[DETERMINANT] > 0 else -1.0
    if buffer[INSIDE] == 1.0 and constants[HOME_SIGN] != 0.0:
        state[0, OURS] = 1.0
    get_pose(buffer, FIRST, SINGLE, position, wxyz, FIRST)
    return status_of_pose(constants, buffer, legs, FIRST, limits[1], state[0, OURS] == 1.0, work)

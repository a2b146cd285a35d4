"""The rule that tells home's assembly mode from others, compiled.

Repeats `gough.home_mode.reached_from`.
"""

from __future__ import annotations

from math import sqrt

from gough.home_mode import MOST_POINTS, ROTATION_STEP, SAME_TIP, TRANSLATION_STEP
from gough.kernel.equations import rotation, turned
from gough.kernel.jit import inner
from gough.kernel.layout import (
    ARM_X,
    ARM_Y,
    BASE,
    BRANCH,
    FIXED,
    HOME_SIGN,
    JOINTS,
    QUATERNION,
    ROD,
    ROTARY,
)
from gough.kernel.linear import pivoted_solve


@inner
def reached_from(constants, buffer, start, work):
    """Return whether det J has home's sign all along the way to the pose in `buffer`.

    Args:
        start: position and quaternion of the internal pose where the way begins.
        work: (4, 6, 6) to work in, up to work[3, 1].
    """
    position, quaternion, right, unknowns = work[1, 0], work[1, 1], work[3, 0], work[3, 1]
    first, turned_by = start
    square, along = 1.0, 0.0
    for i in range(4):
        along += buffer[QUATERNION + i] * turned_by[i]
    side = -1.0 if along < 0 else 1.0  # of the two quaternions of the pose the nearer one
    for i in range(3):
        step = (buffer[i] - first[i]) / TRANSLATION_STEP
        square += step * step
    for i in range(4):
        step = 2 * (side * buffer[QUATERNION + i] - turned_by[i]) / ROTATION_STEP
        square += step * step
    count = int(sqrt(square)) if square < MOST_POINTS * MOST_POINTS else MOST_POINTS
    for n in range(1, count + 1):
        t = n / count
        for i in range(3):
            position[i] = (1 - t) * first[i] + t * buffer[i]
        square = 0.0
        for i in range(4):
            quaternion[i] = (1 - t) * turned_by[i] + t * side * buffer[QUATERNION + i]
            square += quaternion[i] * quaternion[i]
        for i in range(4):
            quaternion[i] /= sqrt(square)
        if not _put_struts(constants, buffer, position, quaternion, work[0], n == count):
            return False
        for i in range(6):
            right[i] = 0.0
        determinant = pivoted_solve(work[0], right, work[2], unknowns)
        if not determinant * constants[HOME_SIGN] >= 0:
            return False
    return True


@inner
def _put_struts(constants, buffer, position, quaternion, rows, last):
    """Fill rows (6, 6) with (d_i, a_i x d_i) of the struts that a pose has.

    Returns False where a motor cannot reach the pose, and, at the last one, where it reaches it on
    another branch than the readings in `buffer` do.
    """
    R = rotation(quaternion[0], quaternion[1], quaternion[2], quaternion[3])
    for i in range(6):
        j = JOINTS + 3 * i
        a = turned(R, constants[j], constants[j + 1], constants[j + 2])
        for k in range(3):
            rows[i, k] = a[k] + position[k] - constants[FIXED + 3 * i + k]
        if constants[ROTARY] == 1 and not _reach(constants, buffer, rows, i, last):
            return False
        x, y, z = rows[i, 0], rows[i, 1], rows[i, 2]
        rows[i, 3] = a[1] * z - a[2] * y
        rows[i, 4] = a[2] * x - a[0] * z
        rows[i, 5] = a[0] * y - a[1] * x
    return True


@inner
def _reach(constants, buffer, rows, i, last):
    """Take the motor arm from strut i, which starts at the arm's centre; False if out of reach.

    Repeats `gough.struts.motor_angles`, with the cosine and sine of the angle.
    """
    x, y, square, arm = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        along_x, along_y = constants[ARM_X + 3 * i + k], constants[ARM_Y + 3 * i + k]
        x, y = x + rows[i, k] * along_x, y + rows[i, k] * along_y
        square, arm = square + rows[i, k] * rows[i, k], arm + along_x * along_x
    reach = sqrt(x * x + y * y)
    c = (square + arm - constants[ROD + i] * constants[ROD + i]) / (2 * reach)
    if not abs(c) <= 1:
        return False
    s = constants[BRANCH + i] * sqrt((1 - c) * (1 + c))
    cosine, sine = (x * c - y * s) / reach, (y * c + x * s) / reach
    miss = 0.0
    for k in range(3):
        tip = cosine * constants[ARM_X + 3 * i + k] + sine * constants[ARM_Y + 3 * i + k]
        gap = constants[FIXED + 3 * i + k] + tip - buffer[BASE + 3 * i + k]
        miss += gap * gap
        rows[i, k] -= tip
    return not last or miss <= SAME_TIP * SAME_TIP

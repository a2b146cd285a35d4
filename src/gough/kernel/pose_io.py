"""Readings into the buffer, poses out of it; the compiled code's two ends."""

from __future__ import annotations

from math import cos, inf, sin

from gough.kernel.equations import get_quaternion, put_quaternion, rotation, turned
from gough.kernel.jit import inline
from gough.kernel.layout import (
    ARM_X,
    ARM_Y,
    BASE,
    FIXED,
    GAIN,
    HOME_READINGS,
    LENGTH,
    ORDER,
    ORIGIN,
    PER_SIZE,
    PIVOT,
    ROD,
    ROTARY,
    SIZE,
    SQUARE,
    STROKE,
    USER_POSITION,
    ZERO,
)


@inline
def put_reading(constants, legs, row, buffer, k, stride):
    """Store lengths and base joints of pose k for the readings in row `row` of legs (N, 6).

    Repeats `gough.struts.equivalent`. Returns False, and takes the readings at home instead,
    where a reading is not finite or a length not above zero.
    """
    rotary = constants[ROTARY] == 1
    valid = True
    for i in range(6):
        reading = legs[row, int(constants[ORDER + i])]
        length = constants[GAIN + i] * reading + constants[ZERO + i]
        # by comparison, since Numba's isfinite is x - x == 0, which fast-math folds to True
        valid &= (abs(length) < inf) & ((length > 0) | rotary)
    for i in range(6):
        leg = int(constants[ORDER + i])
        reading = legs[row, leg] if valid else constants[HOME_READINGS + leg]
        true = constants[GAIN + i] * reading + constants[ZERO + i]
        length = true * constants[PER_SIZE]
        cosine, sine = 0.0, 0.0
        if rotary:
            length = constants[ROD + i]
            cosine, sine = cos(true), sin(true)
        buffer[(LENGTH + i) * stride + k] = length
        buffer[(SQUARE + i) * stride + k] = length * length
        for j in range(3 * i, 3 * i + 3):
            tip = cosine * constants[ARM_X + j] + sine * constants[ARM_Y + j]
            buffer[(BASE + j) * stride + k] = constants[FIXED + j] + tip
    return valid


@inline
def in_stroke(constants, legs, row):
    """Return whether all readings of the row are within the widened stroke limits.

    Repeats `gough.limit_rules.in_stroke`.
    """
    within = True
    for i in range(6):
        low, high = constants[STROKE + 2 * i], constants[STROKE + 2 * i + 1]
        within &= (legs[row, i] >= low) & (legs[row, i] <= high)
    return within


@inline
def put_pose(buffer, k, stride, poses, row):
    """Store row `row` of internal poses (N, 7) as pose k."""
    buffer[k] = poses[row, 0]
    buffer[stride + k] = poses[row, 1]
    buffer[2 * stride + k] = poses[row, 2]
    put_quaternion(buffer, k, stride, poses[row, 3], poses[row, 4], poses[row, 5], poses[row, 6])


@inline
def put_user_position(constants, buffer, k, stride):
    """Store pose k's position as the user sees it: of the pivot, in base coordinates.

    Repeats `gough.kernel.constants.from_internal`.
    """
    w, x, y, z = get_quaternion(buffer, k, stride)
    lever = turned(
        rotation(w, x, y, z), constants[PIVOT], constants[PIVOT + 1], constants[PIVOT + 2]
    )
    size, at = constants[SIZE], USER_POSITION * stride + k
    buffer[at] = size * (buffer[k] + lever[0]) + constants[ORIGIN]
    buffer[at + stride] = size * (buffer[stride + k] + lever[1]) + constants[ORIGIN + 1]
    buffer[at + 2 * stride] = size * (buffer[2 * stride + k] + lever[2]) + constants[ORIGIN + 2]


@inline
def get_pose(buffer, k, stride, position, wxyz, row):
    """Copy pose k to row `row` of position (N, 3) [platform unit] and wxyz (N, 4).

    `put_user_position` comes before.
    """
    at = USER_POSITION * stride + k
    position[row, 0] = buffer[at]
    position[row, 1] = buffer[at + stride]
    position[row, 2] = buffer[at + 2 * stride]
    wxyz[row, 0], wxyz[row, 1], wxyz[row, 2], wxyz[row, 3] = get_quaternion(buffer, k, stride)

"""Readings into the buffer, poses out of it; the compiled code's two ends."""

from __future__ import annotations

import numpy as np

from gough.kernel.equations import get_quaternion, inline, put_quaternion, rotation, turned
from gough.kernel.layout import (
    ARM_X,
    ARM_Y,
    BASE,
    FIXED,
    GAIN,
    LENGTH,
    ORDER,
    ORIGIN,
    PER_SIZE,
    PIVOT,
    PLACE,
    REST,
    ROD,
    ROTARY,
    SIZE,
    SQUARE,
    STROKE,
    ZERO,
)


@inline
def take_reading(constants, legs, row, buffer, k, stride):
    """Lengths and base joints of pose k from row `row` of legs (N, 6).

    Returns False, and takes the readings at home instead, where a reading is not finite or a
    length not above zero.
    """
    valid = True
    for i in range(6):
        reading = legs[row, int(constants[ORDER + i])]
        length = constants[GAIN + i] * reading + constants[ZERO + i]
        # by comparison, since Numba's isfinite is x - x == 0, which fast-math folds to True
        valid &= (np.abs(length) < np.inf) & ((length > 0) | (constants[ROTARY] == 1))
    for i in range(6):
        leg = int(constants[ORDER + i])
        reading = legs[row, leg] if valid else constants[REST + leg]
        true = constants[GAIN + i] * reading + constants[ZERO + i]
        length = true * constants[PER_SIZE]
        cosine, sine = 0.0, 0.0
        if constants[ROTARY] == 1:
            length = constants[ROD + i]
            cosine, sine = np.cos(true), np.sin(true)
        buffer[(LENGTH + i) * stride + k] = length
        buffer[(SQUARE + i) * stride + k] = length * length
        for axis in range(3):
            j = 3 * i + axis
            tip = cosine * constants[ARM_X + j] + sine * constants[ARM_Y + j]
            buffer[(BASE + j) * stride + k] = constants[FIXED + j] + tip
    return valid


@inline
def in_stroke(constants, legs, row):
    """Whether all readings of the row are within the stroke limits."""
    within = True
    for i in range(6):
        reading = legs[row, i]
        low, high = constants[STROKE + 2 * i], constants[STROKE + 2 * i + 1]
        within &= (reading >= low) & (reading <= high)
    return within


@inline
def put_pose(buffer, k, stride, poses, row):
    """Pose k from row `row` of internal poses (N, 7)."""
    buffer[k] = poses[row, 0]
    buffer[stride + k] = poses[row, 1]
    buffer[2 * stride + k] = poses[row, 2]
    put_quaternion(buffer, k, stride, poses[row, 3], poses[row, 4], poses[row, 5], poses[row, 6])


@inline
def place(constants, buffer, k, stride):
    """Pose k's position as the user sees it: of the pivot, in base coordinates."""
    w, x, y, z = get_quaternion(buffer, k, stride)
    lever = turned(
        rotation(w, x, y, z), constants[PIVOT], constants[PIVOT + 1], constants[PIVOT + 2]
    )
    size, at = constants[SIZE], PLACE * stride + k
    buffer[at] = size * (buffer[k] + lever[0]) + constants[ORIGIN]
    buffer[at + stride] = size * (buffer[stride + k] + lever[1]) + constants[ORIGIN + 1]
    buffer[at + 2 * stride] = size * (buffer[2 * stride + k] + lever[2]) + constants[ORIGIN + 2]


@inline
def give_pose(buffer, k, stride, position, wxyz, row):
    """Pose k, once placed, into row `row` of position (N, 3) [platform unit] and wxyz (N, 4)."""
    at = PLACE * stride + k
    position[row, 0] = buffer[at]
    position[row, 1] = buffer[at + stride]
    position[row, 2] = buffer[at + 2 * stride]
    wxyz[row, 0], wxyz[row, 1], wxyz[row, 2], wxyz[row, 3] = get_quaternion(buffer, k, stride)

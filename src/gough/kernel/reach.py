"""Compiled search for the distance that each axis of a pose can move until a limit ends it."""

from __future__ import annotations

from math import ceil, cos, inf, nan, sin

import numpy as np

from gough.kernel.equations import rotation, turned
from gough.kernel.jit import inner, jit
from gough.kernel.limit_constants import KINDS, NO_PART
from gough.kernel.margins import PART, SHARE, pose_margins

HALVINGS = 45  # of the step in which an axis meets its first limit


@jit()
def reach_rows(c, position, wxyz, first, last, spans, axes, point, work, out):
    """Fill how far poses first..last can move along and about each axis, both ways.

    Args:
        spans: (6, 2) step and longest way of each axis [platform unit], [rad].
        axes: (3, 3) directions of the axes in base coordinates, one a row.
        point: (3,) that moves along them and that rotations leave at rest, from the pivot, in
            platform coordinates.
        work: as of `gough.kernel.margins.margin_rows`.
        out: distance (N, 6, 2) and part (N, 6, 2) of the limit that ends it.
    """
    distance, part = out
    pose, lever = np.empty(7), np.empty(3)
    for row in range(first, last):
        for k in range(3):
            pose[k] = position[row, k]
        for k in range(4):
            pose[3 + k] = wxyz[row, k]
        R = rotation(pose[3], pose[4], pose[5], pose[6])
        lever[0], lever[1], lever[2] = turned(R, point[0], point[1], point[2])
        for axis in range(6):
            for way in range(2):
                moves = axes[axis % 3], lever
                found = _reach(c, pose, axis, moves, 2.0 * way - 1.0, spans, work)
                distance[row, axis, way], part[row, axis, way] = found[0], np.uint8(found[1])
    return 0


@inner
def _reach(c, pose, axis, moves, way, spans, work):
    """Distance to the first limit along one axis, and the limit's part.

    Steps of `spans` find the first pose beyond a limit; bisection between it and the last pose
    within all limits finds the distance. The pose at the distance returned was found within.
    """
    step, longest = spans[axis, 0], spans[axis, 1]
    within, beyond = 0.0, 0.0
    if not abs(np.sum(pose)) < inf:
        return nan, NO_PART
    count = ceil(longest / step) + 1
    for k in range(count):
        beyond = min(k * step, longest)
        if _breaks(c, pose, axis, moves, way * beyond, work):
            break
        within = beyond
        if k == count - 1:
            return within, NO_PART
    for _ in range(HALVINGS if beyond > 0 else 0):
        middle = 0.5 * (within + beyond)
        if _breaks(c, pose, axis, moves, way * middle, work):
            beyond = middle
        else:
            within = middle
    _breaks(c, pose, axis, moves, way * beyond, work)
    return within, _worst_part(work[0])


@inner
def _breaks(c, pose, axis, moves, way, work):
    """Return whether the pose, moved along or about an axis, breaks a limit.

    Args:
        moves: direction (3,) of the axis, and lever (3,) from the pose's position to the point
            that rotations leave at rest, both in base coordinates.
    """
    along, lever = moves
    x, y, z = pose[0], pose[1], pose[2]
    qw, qx, qy, qz = pose[3], pose[4], pose[5], pose[6]
    if axis < 3:
        x, y, z = x + way * along[0], y + way * along[1], z + way * along[2]
        return pose_margins(c, x, y, z, qw, qx, qy, qz, work[0], work) != 0
    half, sine = cos(0.5 * way), sin(0.5 * way)
    a, b, d = sine * along[0], sine * along[1], sine * along[2]
    tx, ty, tz = turned(rotation(half, a, b, d), lever[0], lever[1], lever[2])
    x, y, z = x + lever[0] - tx, y + lever[1] - ty, z + lever[2] - tz
    rw, rx = half * qw - a * qx - b * qy - d * qz, half * qx + a * qw + b * qz - d * qy
    ry, rz = half * qy + b * qw + d * qx - a * qz, half * qz + d * qw + a * qy - b * qx
    return pose_margins(c, x, y, z, rw, rx, ry, rz, work[0], work) != 0


@inner
def _worst_part(w):
    """The part with the least share."""
    worst, least = NO_PART, inf
    for kind in range(KINDS):
        if w[SHARE + kind] < least:
            worst, least = np.int64(w[PART + kind]), w[SHARE + kind]
    return worst

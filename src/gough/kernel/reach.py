"""Compiled search for the distance that each axis of a pose can move until a limit ends it."""

from __future__ import annotations

from math import ceil, cos, inf, nan, sin

import numpy as np

from gough.kernel.jit import inner, jit
from gough.kernel.limit_constants import KINDS, NO_PART
from gough.kernel.margins import PART, SHARE, pose_margins

HALVINGS = 45  # of the step in which an axis meets its first limit


@jit()
def reach_rows(c, position, wxyz, first, last, spans, work, out):
    """Fill how far poses first..last can move along and about each base axis, both ways.

    Args:
        spans: (6, 2) step and longest way of each axis [platform unit], [rad].
        work: as of `gough.kernel.margins.margin_rows`.
        out: distance (N, 6, 2) and part (N, 6, 2) of the limit that ends it.
    """
    distance, part = out
    pose = np.empty(7)
    for row in range(first, last):
        for k in range(3):
            pose[k] = position[row, k]
        for k in range(4):
            pose[3 + k] = wxyz[row, k]
        for axis in range(6):
            for way in range(2):
                found = _reach(c, pose, axis, 2.0 * way - 1.0, spans, work)
                distance[row, axis, way], part[row, axis, way] = found[0], np.uint8(found[1])
    return 0


@inner
def _reach(c, pose, axis, way, spans, work):
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
        if _breaks(c, pose, axis, way * beyond, work):
            break
        within = beyond
        if k == count - 1:
            return within, NO_PART
    for _ in range(HALVINGS if beyond > 0 else 0):
        middle = 0.5 * (within + beyond)
        if _breaks(c, pose, axis, way * middle, work):
            beyond = middle
        else:
            within = middle
    _breaks(c, pose, axis, way * beyond, work)
    return within, _worst_part(work[0])


@inner
def _breaks(c, pose, axis, way, work):
    """Return whether the pose, moved along or about a base axis, breaks a limit."""
    x, y, z = pose[0], pose[1], pose[2]
    qw, qx, qy, qz = pose[3], pose[4], pose[5], pose[6]
    if axis < 3:
        x += way if axis == 0 else 0.0
        y += way if axis == 1 else 0.0
        z += way if axis == 2 else 0.0
        return pose_margins(c, x, y, z, qw, qx, qy, qz, work[0], work) != 0
    half, sine = cos(0.5 * way), sin(0.5 * way)
    a = sine if axis == 3 else 0.0
    b = sine if axis == 4 else 0.0
    d = sine if axis == 5 else 0.0
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

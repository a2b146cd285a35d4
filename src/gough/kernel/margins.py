"""Margins of a pose to every limit of its platform, compiled.

`gough.limit_geometry` states angles, gaps and forces, `gough.struts` the legs and
`gough.limit_rules` stroke and workspace; what stands here repeats them for one pose. `c` holds the
constants of `limit_constants`, `w` the slots below; all are in the units of the platform.

Every function from `_strokes` on keeps the least share of its kind and returns the bits of what is
broken: 1 << leg, or those of workspace and singularity.
"""

from __future__ import annotations

from math import atan2, floor, inf, nan, pi, sqrt

import numpy as np

from gough.kernel.elimination import eliminate
from gough.kernel.equations import from_home, rotation, turned
from gough.kernel.jit import inline, inner, jit
from gough.kernel.limit_constants import (
    ARM,
    ARM_LENGTH,
    AXIS_X,
    AXIS_Y,
    AXIS_Z,
    BASE,
    BASE_AXIS,
    BASE_CONE,
    BASE_COSINE,
    BASE_JOINT,
    BOX_HALF,
    BOX_MIDDLE,
    BRANCH,
    CENTRE,
    CLEARANCE,
    FIRST_PART,
    FORCE,
    FORCES,
    GAP,
    HOME_DETERMINANT,
    HOME_POSITION,
    HOME_QUATERNION,
    KINDS,
    MOVING,
    MOVING_AXIS,
    MOVING_CONE,
    MOVING_COSINE,
    MOVING_JOINT,
    NO_PART,
    ORDER,
    PER_FORCE,
    PER_GAIN,
    PER_GAP,
    PER_STROKE,
    PIVOT,
    RADIUS,
    ROD_LENGTH,
    ROTARY,
    SAME_CONES,
    SINGULARITY,
    SIZE,
    SLACKS,
    STATED,
    STROKE,
    STROKES,
    WEIGHT,
    WORKSPACE,
    ZERO,
)
from gough.kernel.linear import pivoted_solve

# Slots of w: results by kind, then for every leg LEG numbers
MARGIN, SHARE, PART, LEGS = 0, 8, 16, 24
LEVER, SOCKET, PER_LENGTH, COSINE, SINE = 0, 3, 12, 13, 14
LEG = 15
# Rods, or legs, and arms are bodies of 7 numbers: lower end, vector to the upper end, 1 / its
# square. Number k of leg i is at k * WIDE + i, that of legs 1 to 4 at k * WIDE + 6 + i as well: so
# legs i and i + 1, 2 or 3 are in neighbouring slots for all i, and the loop over i is vector code.
WIDE = 12
WAY, PER_SQUARE, BODY = 3 * WIDE, 6 * WIDE, 7 * WIDE
ROD = LEGS + 6 * LEG
ARM_BODY = ROD + BODY
SQUARE = ARM_BODY + BODY  # squared distance of legs i and i + apart at 8 (apart - 1) + i
SLOTS = SQUARE + 24
WORKSPACE_BIT, SINGULARITY_BIT = 6, 7
GOOD_ENOUGH = 1e-11  # residual of the forces / largest, above which elimination pivots


@jit()
def margin_rows(c, kinds, position, wxyz, first, last, work, out):
    """Fill the margins of poses first..last.

    Args:
        kinds: (K,) the kinds of limits that are wanted.
        position, wxyz: (N, 3) and (N, 4).
        work: (SLOTS,), and (6, 6), (6, 6), (6,), (6,) for the forces.
        out: margin (N, K), share (N, K), part (N, K), broken (N,).
    """
    margin, share, part, broken = out
    w = work[0]
    for row in range(first, last):
        broken[row] = pose_margins(
            c, position[row, 0], position[row, 1], position[row, 2],
            wxyz[row, 0], wxyz[row, 1], wxyz[row, 2], wxyz[row, 3], w, work,
        )  # fmt: skip
        for k in range(len(kinds)):
            margin[row, k] = w[MARGIN + kinds[k]]
            share[row, k] = w[SHARE + kinds[k]]
            part[row, k] = np.uint8(w[PART + kinds[k]])
    return 0


@inner
def pose_margins(c, x, y, z, qw, qx, qy, qz, w, work):
    """Fill the results of one pose; return the bits of what is broken, 0 for a pose of NaN."""
    known = abs(x + y + z + qw + qx + qy + qz) < inf
    start = inf if known else nan
    for kind in range(KINDS):
        w[MARGIN + kind] = start
        w[SHARE + kind] = start
        w[PART + kind] = NO_PART
    if not known:
        return 0
    R = rotation(qw, qx, qy, qz)
    broken = 0
    if c[STATED + WORKSPACE] == 1:
        broken |= _workspace(c, x, y, z, qw, qx, qy, qz, w)
    unreached = _place_legs(c, R, x, y, z, w)
    if unreached != 0:
        for kind in (STROKE, BASE_JOINT, MOVING_JOINT, CLEARANCE, FORCE, SINGULARITY):
            w[MARGIN + kind] = nan
            w[SHARE + kind] = nan
        return broken | unreached
    if c[STATED + STROKE] == 1:
        broken |= _strokes(c, w)
    if c[STATED + BASE_JOINT] == 1:
        broken |= _base_cones(c, w)
    if c[STATED + MOVING_JOINT] == 1:
        broken |= _moving_cones(c, R, w)
    if c[STATED + CLEARANCE] == 1:
        broken |= _gaps(c, w)
    if c[STATED + FORCE] == 1 or c[STATED + SINGULARITY] == 1:
        broken |= _forces(c, R, w, work)
    return broken


@inline
def _note(c, w, kind, index, value, per_scale, bits):
    """Keep the margin of a part of a kind if its share is the least so far.

    Returns the bits if the margin is broken, else 0.
    """
    share = value * per_scale
    if share < w[SHARE + kind]:
        w[MARGIN + kind] = value
        w[SHARE + kind] = share
        w[PART + kind] = FIRST_PART[kind] + index
    return bits if value < -c[SLACKS + kind] else 0


# ---- legs -----------------------------------------------------------------------------


@inner
def _place_legs(c, R, x, y, z, w):
    """Store the bodies, lever and so on of each leg; return bits of those out of reach.

    Repeats `gough.limit_geometry.leg_bodies`. Notes the margins of motor arms: by how much the rod
    is longer than the least and shorter than the greatest distance of the platform joint from
    the circle of the arm's tip.
    """
    unreached = 0
    for i in range(6):
        at, j = LEGS + LEG * i, 3 * i
        lever = turned(R, c[MOVING + j], c[MOVING + j + 1], c[MOVING + j + 2])
        w[at + LEVER], w[at + LEVER + 1], w[at + LEVER + 2] = lever
        dx = lever[0] + c[PIVOT] + x - c[BASE + j]
        dy = lever[1] + c[PIVOT + 1] + y - c[BASE + j + 1]
        dz = lever[2] + c[PIVOT + 2] + z - c[BASE + j + 2]
        for k in range(3):
            w[ROD + k * WIDE + i] = c[BASE + j + k]
        if c[ROTARY] == 1:
            if not _swing(c, i, dx, dy, dz, w):
                unreached |= 1 << i
                continue
            arm = ARM_BODY + WAY + i
            dx, dy, dz = dx - w[arm], dy - w[arm + WIDE], dz - w[arm + 2 * WIDE]
        way = ROD + WAY + i
        w[way], w[way + WIDE], w[way + 2 * WIDE] = dx, dy, dz
        per_square = 1 / (dx * dx + dy * dy + dz * dz)
        w[ROD + PER_SQUARE + i] = per_square
        w[at + PER_LENGTH] = sqrt(per_square)
        if not per_square < inf:
            unreached |= 1 << i
    return unreached


@inline
def _swing(c, i, dx, dy, dz, w):
    """Store the directions and body of arm i, and its rod's lower end; False out of reach.

    Repeats `gough.struts.motor_angles` for the angle's cosine and sine: with both of
    atan2(v, u) known, no angle is needed.
    """
    at, j = LEGS + LEG * i, 3 * i
    x, y = AXIS_X + j, AXIS_Y + j
    u = dx * c[x] + dy * c[x + 1] + dz * c[x + 2]
    v = dx * c[y] + dy * c[y + 1] + dz * c[y + 2]
    arm, rod, flat = c[ARM_LENGTH + i], c[ROD_LENGTH + i], sqrt(u * u + v * v)
    total, twice = dx * dx + dy * dy + dz * dz + arm * arm, 2 * arm * flat
    nearest, farthest = sqrt(total - twice if total > twice else 0.0), sqrt(total + twice)
    left = min(rod - nearest, farthest - rod)
    _note(c, w, ARM, i, left, 1 / arm, 0)
    inner_cosine = (total - rod * rod) / twice
    if not abs(inner_cosine) <= 1:
        return False
    inner_sine = c[BRANCH + i] * sqrt((1 - inner_cosine) * (1 + inner_cosine))
    along = (u * inner_cosine - v * inner_sine) / flat
    ahead = (v * inner_cosine + u * inner_sine) / flat
    w[at + COSINE], w[at + SINE] = along, ahead
    for k in range(3):
        socket, body = at + SOCKET + k, ARM_BODY + k * WIDE + i
        w[socket] = along * c[x + k] + ahead * c[y + k]
        w[socket + 3] = along * c[y + k] - ahead * c[x + k]
        w[socket + 6] = c[AXIS_Z + j + k]
        w[body] = c[BASE + j + k]
        w[body + WAY] = arm * w[socket]
        w[ROD + k * WIDE + i] += w[body + WAY]
    w[ARM_BODY + PER_SQUARE + i] = 1 / (arm * arm)
    return True


@inner
def _strokes(c, w):
    """Note readings within their stroke; repeats `gough.struts.readings`."""
    broken = 0
    for i in range(6):
        at = LEGS + LEG * i
        if c[ROTARY] == 1:
            angle = atan2(w[at + SINE], w[at + COSINE]) - c[ZERO + i]
            reading = (angle - 2 * pi * floor(angle / (2 * pi) + 0.5)) * c[PER_GAIN + i]
        else:
            reading = (1 / w[at + PER_LENGTH] - c[ZERO + i]) * c[PER_GAIN + i]
        value = min(reading - c[STROKES + 2 * i], c[STROKES + 2 * i + 1] - reading)
        broken |= _note(c, w, STROKE, i, value, c[PER_STROKE + i], 1 << i)
    return broken


# ---- joints ---------------------------------------------------------------------------


@inner
def _base_cones(c, w):
    """Note the angles at the base joints; repeats `gough.limit_geometry.joint_angles`.

    Of equal cones the widest angle is all that counts, and cosines find it.
    """
    if c[SAME_CONES] == 0:
        broken = 0
        for i in range(6):
            broken |= _note_base(c, w, i)
        return broken
    least, worst, broken = inf, 0, 0
    for i in range(6):
        cosine = _dot(_base_axis(c, w, i), w, i, 1.0) * w[LEGS + LEG * i + PER_LENGTH]
        worst, least = (i, cosine) if cosine < least else (worst, least)
        broken |= 1 << i if cosine < c[BASE_COSINE] else 0
    return broken | _note_base(c, w, worst)


@inner
def _moving_cones(c, R, w):
    """Note the angles at the platform joints, as `_base_cones` does."""
    if c[SAME_CONES + 1] == 0:
        broken = 0
        for i in range(6):
            broken |= _note_moving(c, R, w, i)
        return broken
    least, worst, broken = inf, 0, 0
    for i in range(6):
        cosine = _dot(_moving_axis(c, R, i), w, i, -1.0) * w[LEGS + LEG * i + PER_LENGTH]
        worst, least = (i, cosine) if cosine < least else (worst, least)
        broken |= 1 << i if cosine < c[MOVING_COSINE] else 0
    return broken | _note_moving(c, R, w, worst)


@inline
def _note_base(c, w, i):
    cone = c[BASE_CONE + i]
    value = cone - _angle(_base_axis(c, w, i), w, i, 1.0)
    return _note(c, w, BASE_JOINT, i, value, 1 / cone, 1 << i)


@inline
def _note_moving(c, R, w, i):
    cone = c[MOVING_CONE + i]
    value = cone - _angle(_moving_axis(c, R, i), w, i, -1.0)
    return _note(c, w, MOVING_JOINT, i, value, 1 / cone, 1 << i)


@inline
def _base_axis(c, w, i):
    """Axis of base joint i in base coordinates; that of a rotary leg swings with its arm."""
    at = BASE_AXIS + 3 * i
    a, b, d = c[at], c[at + 1], c[at + 2]
    if c[ROTARY] == 0:
        return a, b, d
    s = LEGS + LEG * i + SOCKET
    return (
        a * w[s] + b * w[s + 3] + d * w[s + 6],
        a * w[s + 1] + b * w[s + 4] + d * w[s + 7],
        a * w[s + 2] + b * w[s + 5] + d * w[s + 8],
    )


@inline
def _moving_axis(c, R, i):
    at = MOVING_AXIS + 3 * i
    return turned(R, c[at], c[at + 1], c[at + 2])


@inline
def _rod(w, i):
    """The rod of leg i, or the leg, a triple."""
    return w[ROD + WAY + i], w[ROD + WAY + WIDE + i], w[ROD + WAY + 2 * WIDE + i]


@inline
def _dot(a, w, i, sign):
    """Product of a triple and the rod of leg i, or its opposite."""
    x, y, z = _rod(w, i)
    return sign * (a[0] * x + a[1] * y + a[2] * z)


@inline
def _angle(a, w, i, sign):
    """Angle [rad] between a triple and the rod of leg i, or its opposite."""
    x, y, z = _rod(w, i)
    p, q, s = a[1] * z - a[2] * y, a[2] * x - a[0] * z, a[0] * y - a[1] * x
    return atan2(sqrt(p * p + q * q + s * s), _dot(a, w, i, sign))


# ---- gaps -----------------------------------------------------------------------------


@inner
def _gaps(c, w):
    """Note the distances between the legs; repeats `gough.limit_geometry.leg_gaps`."""
    rotary, broken = c[ROTARY] == 1, 0
    for number in range(7 * (2 if rotary else 1)):
        for i in range(4):
            w[ROD + number * WIDE + 6 + i] = w[ROD + number * WIDE + i]
    _square_distances(w, rotary, 1)
    _square_distances(w, rotary, 2)
    _square_distances(w, rotary, 3)
    for apart in range(1, 4):
        for i in range(6 if apart < 3 else 3):
            j = (i + apart) % 6
            first, second = min(i, j), max(i, j)
            pair = first * (11 - first) // 2 + second - first - 1
            if c[PER_GAP + pair] > 0:
                value = sqrt(w[SQUARE + 8 * (apart - 1) + i]) - c[GAP + pair]
                bits = (1 << i) | (1 << j)
                broken |= _note(c, w, CLEARANCE, pair, value, c[PER_GAP + pair], bits)
    return broken


@inline
def _square_distances(w, rotary, apart):
    """Store the squared distances of legs i and i + apart, the least of their bodies'."""
    out = SQUARE + 8 * (apart - 1)
    for k in range(8):
        w[out + k] = inf
    _less_squares(w, ROD, ROD + apart, out)
    if rotary:
        _less_squares(w, ARM_BODY, ROD + apart, out)
        _less_squares(w, ROD, ARM_BODY + apart, out)
        _less_squares(w, ARM_BODY, ARM_BODY + apart, out)


@inline
def _less_squares(w, p, q, out):
    """Lower the squared distances at `out` to those of bodies p and q, where these are less."""
    for k in range(8):
        a, b = p + k, q + k
        square = _square_distance(
            w[a] - w[b], w[a + WIDE] - w[b + WIDE], w[a + 2 * WIDE] - w[b + 2 * WIDE],
            w[a + WAY], w[a + WAY + WIDE], w[a + WAY + 2 * WIDE],
            w[b + WAY], w[b + WAY + WIDE], w[b + WAY + 2 * WIDE],
            w[a + PER_SQUARE], w[b + PER_SQUARE],
        )  # fmt: skip
        w[out + k] = square if square < w[out + k] else w[out + k]


@inline
def _square_distance(dx, dy, dz, ux, uy, uz, vx, vy, vz, per_a, per_e):
    """Squared distance of two segments u and v whose starts are d apart.

    Repeats `gough.limit_geometry.segment_distance`; per_a and per_e are 1 / |u|^2 and 1 / |v|^2.
    """
    a, e = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    b = ux * vx + uy * vy + uz * vz
    f, g = ux * dx + uy * dy + uz * dz, vx * dx + vy * dy + vz * dz
    s = _share((b * g - f * e) / (a * e - b * b))
    t = _share((b * s + g) * per_e)
    s = _share((b * t - f) * per_a)
    x, y, z = dx + s * ux - t * vx, dy + s * uy - t * vy, dz + s * uz - t * vz
    return x * x + y * y + z * z


@inline
def _share(value):
    """The value within 0 and 1; 0 for NaN."""
    value = value if value < 1.0 else 1.0
    return value if value > 0 else 0.0


# ---- forces ---------------------------------------------------------------------------


@inner
def _forces(c, R, w, work):
    """Note the forces under the payload, and the determinant as a share of home's.

    The forces along the rods solve sum f_i (n_i, a_i x n_i) = wrench; a motor's torque is its
    rod's force times the rate at which the arm's tip moves along the rod. Repeats
    `gough.limit_geometry.payload_forces`; the determinant is that of
    `gough.kinematics.normalised_jacobian`, since moving the point of moments does not change it.
    """
    _, matrix, system, wrench, force = work
    per_size = 1 / c[SIZE]
    for k in range(6):
        at = LEGS + LEG * int(c[ORDER + k])
        x, y, z = _rod(w, int(c[ORDER + k]))
        inverse = w[at + PER_LENGTH]
        nx, ny, nz = x * inverse, y * inverse, z * inverse
        ax, ay = w[at + LEVER] * per_size, w[at + LEVER + 1] * per_size
        az = w[at + LEVER + 2] * per_size
        matrix[0, k], matrix[1, k], matrix[2, k] = nx, ny, nz
        matrix[3, k], matrix[4, k] = ay * nz - az * ny, az * nx - ax * nz
        matrix[5, k] = ax * ny - ay * nx
    wx, wy, wz = c[WEIGHT], c[WEIGHT + 1], c[WEIGHT + 2]
    lx, ly, lz = turned(R, c[CENTRE] * per_size, c[CENTRE + 1] * per_size, c[CENTRE + 2] * per_size)
    wrench[0], wrench[1], wrench[2] = -wx, -wy, -wz
    wrench[3], wrench[4], wrench[5] = lz * wy - ly * wz, lx * wz - lz * wx, ly * wx - lx * wy
    determinant = _solve(matrix, wrench, system, force)
    broken = 0
    if c[STATED + SINGULARITY] == 1:
        home, radius = c[HOME_DETERMINANT], c[RADIUS]
        value = (determinant if home > 0 else -determinant) / (radius * radius * radius)
        broken |= _note(c, w, SINGULARITY, 0, value, 1 / abs(home), 1 << SINGULARITY_BIT)
    if c[STATED + FORCE] == 0:
        return broken
    for k in range(6):
        i, value = int(c[ORDER + k]), force[k]
        if c[ROTARY] == 1:
            at = LEGS + LEG * i
            along = _dot((w[at + SOCKET + 3], w[at + SOCKET + 4], w[at + SOCKET + 5]), w, i, 1.0)
            value *= c[ARM_LENGTH + i] * along * w[at + PER_LENGTH]
        least = min(value - c[FORCES + 2 * i], c[FORCES + 2 * i + 1] - value)
        # at a singularity no forces hold the load
        least = least if (determinant != 0) & (abs(least) < inf) else -inf
        broken |= _note(c, w, FORCE, i, least, c[PER_FORCE + i], 1 << i)
    return broken


@inner
def _solve(matrix, right, system, found):
    """Solve a system and return its determinant; pivots only where a fixed order loses digits."""
    x0, x1, x2, x3, x4, x5, determinant = eliminate(
        _row(matrix, right, 0), _row(matrix, right, 1), _row(matrix, right, 2),
        _row(matrix, right, 3), _row(matrix, right, 4), _row(matrix, right, 5),
    )  # fmt: skip
    found[0], found[1], found[2], found[3], found[4], found[5] = x0, x1, x2, x3, x4, x5
    largest, residual = 0.0, 0.0
    for i in range(6):
        error = -right[i]
        for k in range(6):
            error += matrix[i, k] * found[k]
        largest, residual = max(largest, abs(found[i])), max(residual, abs(error))
    if residual <= GOOD_ENOUGH * largest and largest > 0:
        return determinant
    return pivoted_solve(matrix, right, system, found)


@inline
def _row(matrix, right, i):
    return (
        matrix[i, 0], matrix[i, 1], matrix[i, 2], matrix[i, 3], matrix[i, 4], matrix[i, 5],
        right[i],
    )  # fmt: skip


@inner
def _workspace(c, x, y, z, qw, qx, qy, qz, w):
    """Note position and Euler angles from home; repeats `gough.workspace.Workspace.contains`."""
    T, p = from_home(c, HOME_QUATERNION, qw, qx, qy, qz), HOME_POSITION
    bit, broken = 1 << WORKSPACE_BIT, 0
    for i in range(3):
        value = c[BOX_HALF + i] - abs((x, y, z)[i] - c[p + i] - c[BOX_MIDDLE + i])
        _note(c, w, WORKSPACE, i, value, 1 / c[BOX_HALF + i], 0)
        broken |= bit if value < -c[SLACKS + ARM] else 0  # lengths have another slack than angles
    broken |= _note_angle(c, w, 3, atan2(-T[5], T[8]))
    broken |= _note_angle(c, w, 4, atan2(T[2], sqrt(T[5] * T[5] + T[8] * T[8])))
    return broken | _note_angle(c, w, 5, atan2(-T[1], T[0]))


@inline
def _note_angle(c, w, i, angle):
    away = abs(angle - c[BOX_MIDDLE + i])
    value = c[BOX_HALF + i] - (2 * pi - away if away > pi else away)
    return _note(c, w, WORKSPACE, i, value, 1 / c[BOX_HALF + i], 1 << WORKSPACE_BIT)

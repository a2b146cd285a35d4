"""The mathematics of the refinement, once; blocks, single rows and the control loop run it.

Everything here is free of units: lengths are divided by the platform's size, positions are
those of the centre of the platform joints seen from the centre of the base joints, and q_i
are the platform joints from their own centre. A pose (s, R) then leaves in leg i

    a_i = R q_i,      d_i = a_i + s - b_i,      f_i = (l_i^2 - d_i . d_i) / 2,

and a step (v, w), s -> s + v, R -> exp(w) R, changes d_i by v + w x a_i to first order. So
Newton's method solves, without any square root,

    d_i . v + (a_i x d_i) . w = f_i          i = 1..6                          (Merlet 5.1)

by Gaussian elimination in a fixed order of the legs, chosen for the platform by partial
pivoting at home (`constants.py`): no branch, so a loop over poses becomes vector code. Rows
whose pivots turn bad elsewhere do not settle and go to the damped method of `descent.py`.
The rotation is stepped by the Cayley quaternion (1, w / 2), normalised: it agrees with
exp(w) to second order and never turns by more than 180 deg, which damps wild steps.

State lives in one flat buffer, component c of pose k at `buffer[c * stride + k]`: constant
strides and one base pointer are what lets LLVM vectorise the loop over k.
"""

from __future__ import annotations

from math import sqrt

from gough.kernel.elimination import eliminate
from gough.kernel.jit import inline, inner
from gough.kernel.layout import (
    BASE,
    BOX_HIGH,
    BOX_LOW,
    BOX_X,
    BOX_Y,
    BOX_Z,
    COUNT,
    DETERMINANT,
    FIRST,
    HOME_POSITION,
    HOME_QUATERNION,
    HOME_SIGN,
    INSIDE,
    JOINTS,
    LEG_1,
    LEG_2,
    LEG_3,
    LEG_4,
    LEG_5,
    LEG_6,
    LENGTH,
    PIVOT,
    QUATERNION,
    RADIUS,
    REGULAR,
    REGULAR_DETERMINANT,
    RESIDUAL,
    SINGLE,
    SQUARE,
    STEP,
)

SETTLED = 1e-16  # squared Newton step after which the method's error is at rounding


@inline
def rotation(w, x, y, z):
    """Rows of the rotation matrix of a unit quaternion, nine numbers.

    Repeats `gough.quaternion.to_matrix`.
    """
    return (
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    )  # fmt: skip


@inline
def from_home(constants, h, w, x, y, z):
    """Rows of the matrix of the rotation from home's quaternion, at constants[h], to another."""
    hw, hx, hy, hz = constants[h], constants[h + 1], constants[h + 2], constants[h + 3]
    return rotation(
        hw * w + hx * x + hy * y + hz * z,
        hw * x - hx * w - hy * z + hz * y,
        hw * y + hx * z - hy * w - hz * x,
        hw * z - hx * y + hy * x - hz * w,
    )


@inline
def turned(R, x, y, z):
    """R (x, y, z)."""
    return (
        R[0] * x + R[1] * y + R[2] * z,
        R[3] * x + R[4] * y + R[5] * z,
        R[6] * x + R[7] * y + R[8] * z,
    )


@inline
def strut(constants, buffer, k, stride, R, i):
    """Leg i of pose k: a_i = R q_i and d_i, two triples."""
    j = JOINTS + 3 * i
    a = turned(R, constants[j], constants[j + 1], constants[j + 2])
    b = (BASE + 3 * i) * stride + k
    d = (
        a[0] + (buffer[k] - buffer[b]),
        a[1] + (buffer[stride + k] - buffer[b + stride]),
        a[2] + (buffer[2 * stride + k] - buffer[b + 2 * stride]),
    )
    return a, d


@inline
def equation(constants, buffer, k, stride, R, i):
    """Row i of the linear system: d_i, a_i x d_i, f_i as seven numbers."""
    a, d = strut(constants, buffer, k, stride, R, i)
    f = 0.5 * (buffer[(SQUARE + i) * stride + k] - (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]))
    return (
        d[0], d[1], d[2],
        a[1] * d[2] - a[2] * d[1], a[2] * d[0] - a[0] * d[2], a[0] * d[1] - a[1] * d[0],
        f,
    )  # fmt: skip


@inline
def put_quaternion(buffer, k, stride, w, x, y, z):
    """Normalise a quaternion and store it as pose k's."""
    inverse = 1 / sqrt(w * w + x * x + y * y + z * z)
    buffer[QUATERNION * stride + k] = w * inverse
    buffer[(QUATERNION + 1) * stride + k] = x * inverse
    buffer[(QUATERNION + 2) * stride + k] = y * inverse
    buffer[(QUATERNION + 3) * stride + k] = z * inverse


@inline
def get_quaternion(buffer, k, stride):
    """Pose k's quaternion, four numbers."""
    c = QUATERNION * stride + k
    return buffer[c], buffer[c + stride], buffer[c + 2 * stride], buffer[c + 3 * stride]


@inline
def move(buffer, k, stride, active, v0, v1, v2, w0, w1, w2):
    """Step pose k by translation v and rotation w (in base coordinates), if `active`."""
    w, x, y, z = get_quaternion(buffer, k, stride)
    a, b, c = 0.5 * w0, 0.5 * w1, 0.5 * w2
    # selected, not multiplied by zero: even normalising again would change a last digit
    buffer[k] = buffer[k] + v0 if active else buffer[k]
    buffer[stride + k] = buffer[stride + k] + v1 if active else buffer[stride + k]
    buffer[2 * stride + k] = buffer[2 * stride + k] + v2 if active else buffer[2 * stride + k]
    new_w, new_x = w - a * x - b * y - c * z, x + a * w + b * z - c * y
    new_y, new_z = y + b * w + c * x - a * z, z + c * w + a * y - b * x
    inverse = 1 / sqrt(new_w * new_w + new_x * new_x + new_y * new_y + new_z * new_z)
    at = QUATERNION * stride + k
    buffer[at] = new_w * inverse if active else w
    buffer[at + stride] = new_x * inverse if active else x
    buffer[at + 2 * stride] = new_y * inverse if active else y
    buffer[at + 3 * stride] = new_z * inverse if active else z


@inline
def newton_step(constants, buffer, k, stride):
    """One Newton step of pose k, in place; stores its squared size and the determinant.

    A pose whose last step was SETTLED stays where it is, so that a row's answer does not
    depend on how long its neighbours in the block take.
    """
    active = buffer[STEP * stride + k] > SETTLED
    w, x, y, z = get_quaternion(buffer, k, stride)
    R = rotation(w, x, y, z)
    v0, v1, v2, w0, w1, w2, determinant = eliminate(
        equation(constants, buffer, k, stride, R, LEG_1),
        equation(constants, buffer, k, stride, R, LEG_2),
        equation(constants, buffer, k, stride, R, LEG_3),
        equation(constants, buffer, k, stride, R, LEG_4),
        equation(constants, buffer, k, stride, R, LEG_5),
        equation(constants, buffer, k, stride, R, LEG_6),
    )
    move(buffer, k, stride, active, v0, v1, v2, w0, w1, w2)
    buffer[COUNT * stride + k] += 1.0 if active else 0.0
    buffer[STEP * stride + k] = v0 * v0 + v1 * v1 + v2 * v2 + w0 * w0 + w1 * w1 + w2 * w2
    buffer[DETERMINANT * stride + k] = determinant


@inline
def _strut_error(constants, buffer, k, stride, R, i):
    """| |d_i| - l_i |."""
    _, d = strut(constants, buffer, k, stride, R, i)
    length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    return abs(length - buffer[(LENGTH + i) * stride + k])


@inline
def _angle_within(constants, box, sine, cosine):
    """Return 1.0 if the angle of (cosine, sine), of any length, is in the axis' range, else 0.0."""
    along = cosine * constants[box] + sine * constants[box + 1]  # |.| cos(angle - mid)
    return 1.0 if along >= constants[box + 2] * sqrt(sine * sine + cosine * cosine) else 0.0


@inline
def assess(constants, buffer, k, stride):
    """Store the residual of pose k, where it is, and whether it is surely regular.

    The determinant is that of the last Newton step's start, which at the end of a converged
    iteration is the pose itself to half its digits. The box of the workspace repeats
    `gough.limit_rules.in_workspace`.
    """
    w, x, y, z = get_quaternion(buffer, k, stride)
    R = rotation(w, x, y, z)
    e0 = _strut_error(constants, buffer, k, stride, R, LEG_1)
    e1 = _strut_error(constants, buffer, k, stride, R, LEG_2)
    e2 = _strut_error(constants, buffer, k, stride, R, LEG_3)
    e3 = _strut_error(constants, buffer, k, stride, R, LEG_4)
    e4 = _strut_error(constants, buffer, k, stride, R, LEG_5)
    e5 = _strut_error(constants, buffer, k, stride, R, LEG_6)
    a, b, c = e0 if e0 > e1 else e1, e2 if e2 > e3 else e3, e4 if e4 > e5 else e5
    a = a if a > b else b
    a = a if a > c else c
    # a comparison may drop a NaN; a sum cannot
    buffer[RESIDUAL * stride + k] = a + 0.0 * (e0 + e1 + e2 + e3 + e4 + e5)

    at = LENGTH * stride + k
    product = buffer[at] * buffer[at + stride] * buffer[at + 2 * stride]
    product *= buffer[at + 3 * stride] * buffer[at + 4 * stride] * buffer[at + 5 * stride]
    determinant = buffer[DETERMINANT * stride + k]
    rho = constants[RADIUS]
    regular = abs(determinant) > constants[REGULAR_DETERMINANT] * product * (rho * rho * rho)
    buffer[REGULAR * stride + k] = 1.0 if regular else 0.0

    inside = 1.0 if determinant * constants[HOME_SIGN] >= 0 else 0.5
    p = turned(R, constants[PIVOT], constants[PIVOT + 1], constants[PIVOT + 2])
    x0 = buffer[k] + p[0] - constants[HOME_POSITION]
    x1 = buffer[stride + k] + p[1] - constants[HOME_POSITION + 1]
    x2 = buffer[2 * stride + k] + p[2] - constants[HOME_POSITION + 2]
    low, high = BOX_LOW, BOX_HIGH
    inside *= 1.0 if (x0 >= constants[low]) & (x0 <= constants[high]) else 0.0
    inside *= 1.0 if (x1 >= constants[low + 1]) & (x1 <= constants[high + 1]) else 0.0
    inside *= 1.0 if (x2 >= constants[low + 2]) & (x2 <= constants[high + 2]) else 0.0
    T = from_home(constants, HOME_QUATERNION, w, x, y, z)
    inside *= _angle_within(constants, BOX_X, -T[5], T[8])
    inside *= _angle_within(constants, BOX_Y, T[2], sqrt(T[5] * T[5] + T[8] * T[8]))
    inside *= _angle_within(constants, BOX_Z, -T[1], T[0])
    buffer[INSIDE * stride + k] = inside


@inner
def newton(constants, buffer, tolerance, limit):
    """Newton steps of the one pose in `buffer`; return whether it settled within `tolerance`.

    The same steps as the block solver's, with the same end: a pose that settled with too large
    a residual (a step can be small and still lack digits where the system is ill-conditioned)
    goes on, up to `limit` steps.
    """
    buffer[COUNT] = 0.0
    buffer[STEP] = 1.0
    for sweep in range(limit):
        newton_step(constants, buffer, FIRST, SINGLE)
        if not buffer[STEP] > SETTLED or sweep == limit - 1:
            if buffer[STEP] != buffer[STEP]:
                return False
            assess(constants, buffer, FIRST, SINGLE)
            if buffer[RESIDUAL] <= tolerance:
                return True
            buffer[STEP] = 1.0
    return False

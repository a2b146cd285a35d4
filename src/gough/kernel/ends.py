"""Real poses among the ends of paths: find the ends that are real, refine them to rounding.

The solutions for real readings are closed under conjugation, so an end is either real or one
of a pair; both stand far apart in practice (below 1e-10 against above 1e-2). An end that is
close to real is refined by real Newton steps, and counts as real if they converge near by.

Poses are a position and a quaternion in seven numbers, in normalised units (see
`gough.modes.frames`). `leg_equations` repeats `gough.struts`, which a test compares it with.
"""

from __future__ import annotations

import numpy as np

from gough.kernel.jit import inner, jit
from gough.kernel.linear import pivoted_solve
from gough.kernel.paths import FINITE

# Kinds of ends. DOUBTFUL: close to real, Newton undecided; OPEN: the path did not arrive;
# BEYOND: nor did this one, and it stopped far beyond any real pose.
COMPLEX, REAL, DOUBTFUL, OPEN, BEYOND = range(5)
NEAR_REAL = 1e-3  # imaginary part over size from which an end is complex beyond doubt
SAME = 1e-6  # difference of complex poses over their size below which they are one
FAR = 10.0  # times the largest distance of a real pose, from which a path has left for infinity
STEPS = 8  # of Newton at most, with residuals that still fall
TOLERANCE = 1e-11  # largest |l^2 - d.d| / 2 of a pose that has the legs
SCRATCH = (4, 7, 7)  # shape of an array to work in: two matrices, some vectors


@jit()
def refine_ends(moving, base, squares, ends, how, poses, kind, shared, work):
    """Find and refine the real poses among the ends of paths, for N sets of readings.

    Args:
        moving, base, squares: (6, 3), (N or 1, 6, 3), (N, 6), all real.
        ends, how: (N, P, 7) complex, (N, P), as `track_paths` returns them.
        poses: (N, P, 7) to be filled: the real poses.
        kind: (N, P) to be filled: the kinds of the ends.
        shared: (N,) to be filled: two paths arrived at the same complex pose. Paths never share
            a regular solution, so one has jumped, or both have come to a multiple solution.
        work: (SCRATCH) to work in.
    """
    for row in range(squares.shape[0]):
        joints = base[row % base.shape[0]]
        for k in range(ends.shape[1]):
            if how[row, k] != FINITE:
                kind[row, k] = BEYOND if _is_beyond(ends[row, k], squares[row]) else OPEN
                continue
            kind[row, k] = _real_pose(
                moving, joints, squares[row], ends[row, k], poses[row, k], work
            )
            for other in range(k):
                if how[row, other] == FINITE and _same_end(ends[row, k], ends[row, other]):
                    shared[row] = True


@inner
def _real_pose(moving, base, squares, end, pose, work):
    """Refine the real pose that an end is close to; return the kind of the end.

    Newton steps are taken while the residual falls.
    """
    away = make_real(end, pose)
    if not away < NEAR_REAL:
        return COMPLEX
    a, system, x, step, best = work[0], work[1], work[2, 0], work[2, 1], work[3, 0]
    left, moved = np.inf, 0.0
    for _ in range(STEPS):
        now = leg_equations(moving, base, squares, pose, a, x)
        if not now < left:
            break
        left = now
        for k in range(7):
            best[k] = pose[k]
        if left == 0.0 or pivoted_solve(a, x, system, step) == 0.0:
            break
        for k in range(6):
            moved += abs(step[k])
        if not moved < 1.0:
            break
        move(pose, step)
    for k in range(7):
        pose[k] = best[k]
    return REAL if left <= TOLERANCE and moved <= 100.0 * away + 1e-6 else DOUBTFUL


@jit()
def leg_equations(moving, base, squares, pose, a, x):
    """Rows (d, q x d) into a (6, 6), (l^2 - d.d) / 2 into x (6,); returns the largest |x|.

    q is the lever R(e) p of a leg, d = q + t - b its strut.
    """
    t0, t1, t2 = pose[0], pose[1], pose[2]
    w, i, j, k = pose[3], pose[4], pose[5], pose[6]
    worst = 0.0
    for leg in range(6):
        p0, p1, p2 = moving[leg, 0], moving[leg, 1], moving[leg, 2]
        u, v, s = 2.0 * (j * p2 - k * p1), 2.0 * (k * p0 - i * p2), 2.0 * (i * p1 - j * p0)
        q0 = p0 + w * u + j * s - k * v
        q1 = p1 + w * v + k * u - i * s
        q2 = p2 + w * s + i * v - j * u
        d0, d1, d2 = q0 + t0 - base[leg, 0], q1 + t1 - base[leg, 1], q2 + t2 - base[leg, 2]
        a[leg, 0], a[leg, 1], a[leg, 2] = d0, d1, d2
        a[leg, 3], a[leg, 4], a[leg, 5] = q1 * d2 - q2 * d1, q2 * d0 - q0 * d2, q0 * d1 - q1 * d0
        x[leg] = 0.5 * (squares[leg] - (d0 * d0 + d1 * d1 + d2 * d2))
        if not abs(x[leg]) <= worst:
            worst = abs(x[leg])
    return worst


@jit()
def move(pose, twist):
    """Move a real pose by (translation, rotation vector), to first order, and renormalise."""
    r0, r1, r2 = 0.5 * twist[3], 0.5 * twist[4], 0.5 * twist[5]
    w, i, j, k = pose[3], pose[4], pose[5], pose[6]
    pose[3] = w - r0 * i - r1 * j - r2 * k
    pose[4] = i + r0 * w + r1 * k - r2 * j
    pose[5] = j + r1 * w + r2 * i - r0 * k
    pose[6] = k + r2 * w + r0 * j - r1 * i
    square = pose[3] * pose[3] + pose[4] * pose[4] + pose[5] * pose[5] + pose[6] * pose[6]
    for m in range(3, 7):
        pose[m] /= np.sqrt(square)
    for m in range(3):
        pose[m] += twist[m]


@jit()
def make_real(end, pose):
    """Real parts of a complex pose, whose quaternion is given up to a complex factor.

    Returns:
        Distance of the pose from real: the largest imaginary part of the quaternion (its square
        having norm 1) or of the position, over the size of the position.
    """
    largest, square = 3, 0.0
    for k in range(3, 7):
        now = end[k].real * end[k].real + end[k].imag * end[k].imag
        if now > square:
            largest, square = k, now
    c, s = end[largest].real / square, -end[largest].imag / square
    away, norm = 0.0, 0.0
    for k in range(3, 7):
        re, im = end[k].real, end[k].imag
        pose[k] = re * c - im * s  # over the largest component
        norm += pose[k] * pose[k]
        if not abs(re * s + im * c) <= away:
            away = abs(re * s + im * c)
    norm, size = np.sqrt(norm), 1.0
    away /= norm
    for k in range(3, 7):
        pose[k] /= norm
    for k in range(3):
        pose[k] = end[k].real
        if not abs(end[k].imag) <= away:
            away = abs(end[k].imag)
        if abs(pose[k]) > size:
            size = abs(pose[k])
    return away / size


@inner
def _same_end(a, b):
    """True if two complex poses agree to SAME of their size."""
    size = 1.0
    for k in range(3):
        size = max(size, _square(a[k]))
    for k in range(3):
        if _square(a[k] - b[k]) > SAME * SAME * size:
            return False
    aa, bb, ab = 0j, 0j, 0j
    for k in range(3, 7):
        aa, bb, ab = aa + a[k] * a[k], bb + b[k] * b[k], ab + a[k] * b[k]
    # for quaternions a = +-b with a.a = b.b = 1, a.b = +-1
    return _square(ab * ab - aa * bb) < SAME * SAME * _square(aa * bb)


@inner
def _is_beyond(end, squares):
    """True if a position is far beyond any real pose's: a leg and the joints' distances from 0."""
    longest = 0.0
    for i in range(6):
        longest = max(longest, squares[i])
    limit = (FAR * (2.0 + np.sqrt(longest))) ** 2
    return _square(end[0]) > limit or _square(end[1]) > limit or _square(end[2]) > limit


@inner
def _square(number):
    """Square of the magnitude of a complex number."""
    return number.real * number.real + number.imag * number.imag

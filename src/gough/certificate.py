"""Proof that exactly one pose with the given legs lies near a computed one.

In the Study parameters (1, r; g0, c) relative to the computed pose, about the centre of the
platform joints, the legs' equations and the Study quadric g0 + r.c = 0 are quadratic with
constant coefficients (docs/proofs.md). Write x = (2 g, 2 L r), L the joints' root mean square
distance from their centre, so that x is a length: 2 g the shift, 2 L r the turn. Half the
equation of leg i is

    F_i(x) = f_i / 2 + A_i x + B_i(x, x),       A_i = (d_i, q_i x d_i / L),

    |B_i(x, x)| <= b_i |x|^2,
    b_i = 1/2 + sqrt(d^2 + m^2) / (2 L) + (max(d^2, m^2) + |f|) / (8 L^2)

in the norm |x| = max(|2 g|, |2 L r|). For any matrix Y close to A's inverse, with

    beta >= |Y F(0)|,   delta >= |1 - Y A|,   kappa >= |Y| b   (block norms)

the map x - Y F(x) sends the ball of radius rho into one of radius beta + delta rho +
kappa rho^2 and contracts where delta + 2 kappa rho < 1 (Newton-Kantorovich; Krawczyk 1969).
So exactly one solution lies within (1 - delta) / (2 kappa), and it is within about beta, as
soon as (1 - delta)^2 > 4 kappa beta. Rounding enters as bounds on f, A and Y A; nothing is
assumed of Y, which is inverted without care and judged by its delta.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough import quaternion
from gough.checks import Array
from gough.kernel.jit import jit
from gough.kernel.lanes import LANES, get_real, larger, magnitude, put_real, root
from gough.kinematics import equivalent_struts
from gough.platform import Platform
from gough.pose import Pose
from gough.tables import Table

UNIT = 2.0**-53
# Bounds on rounding, in UNITs, derived in docs/proofs.md with room to spare:
STRUT = 96.0  # error of a computed strut over the sum of the lengths it is made of
SQUARE = 8.0  # further error of d.d - l^2 over d.d + l^2
SLACK = 1.0 + 1e-9  # for the arithmetic of the bounds themselves

# Rotations of the base frame in no special position, so that inversion needs no pivots at
# symmetric poses. Rows that fail with one, perhaps by a small pivot, are tried with the other.
TURNS = np.array([[0.52, 0.37, -0.61, 0.47], [0.29, -0.73, 0.44, 0.43]])
TURNS /= np.linalg.norm(TURNS, axis=1, keepdims=True)

# Slots of eight reals
E, T, BASE, LENGTH, A, Y, F, BOUND = 0, 4, 7, 25, 31, 67, 103, 109
ROUND_F, ROUND_A = 115, 121  # what rounding may have changed F_i and the row A_i by
OUT = 127  # uniqueness radius, existence radius
SLOTS = 129


@dataclass(frozen=True, eq=False)
class Certificate:
    """What is proven about poses (...).

    Attributes:
        certified: exactly one pose with these legs lies within `radius`.
        radius: [platform unit] radius of uniqueness. It covers every pose that differs by a
            shift s of the platform joints' centre and a turn a with s / cos(a / 2) <= radius
            and 2 L tan(a / 2) <= radius, L the joints' root mean square distance from their
            centre. 0 where nothing is proven.
        error: [platform unit] the true solution is within this, in the same measure; infinite
            where nothing is proven.
        unit: name of the length unit, a label.
    """

    certified: NDArray[np.bool_]
    radius: Array
    error: Array
    unit: str = ""

    def __getitem__(self, index: Any) -> Certificate:
        return Certificate(self.certified[index], self.radius[index], self.error[index], self.unit)

    def __repr__(self) -> str:
        known = self.radius[self.certified]
        unit = f" [{self.unit}]" if self.unit else ""
        told = f"; smallest radius {np.min(known):.3g}{unit}" if np.size(known) else ""
        return f"Certificate({np.sum(self.certified)} of {np.size(self.certified)} certified{told})"

    def _repr_html_(self) -> str:
        from gough.text import length_head, number, page, rows_of

        def cells(i: tuple[int, ...]) -> list[str]:
            at = self[i]
            return ["yes" if at.certified else "no", number(at.radius), number(at.error, ".2g")]

        heads = ["", "certified", length_head("radius", self.unit), length_head("error", self.unit)]
        return page(repr(self), heads, rows_of(np.shape(self.certified), cells))


def certify(platform: Platform, legs: ArrayLike | Table, pose: Pose) -> Certificate:
    """Prove that each pose is within `error` of a pose with these legs, alone in its `radius`.

    Args:
        legs: readings (..., 6), or a table as for `solve`.
        pose: batch (...), the computed solutions.
    """
    base, lengths = equivalent_struts(platform, legs)
    pivot = platform.pivot_point
    shape = np.broadcast_shapes(lengths.shape[:-1], pose.batch)
    # with a pivot c, joints are R (p - c) + c + t: p - c and b - c have the pose as it is
    if platform.rotary is None:  # one base for all rows
        base = (platform.base - pivot)[None]
    else:
        base = np.broadcast_to(base - pivot, (*shape, 6, 3)).reshape(-1, 6, 3)
    lengths = np.broadcast_to(lengths, (*shape, 6)).reshape(-1, 6)
    position = np.broadcast_to(pose.position, (*shape, 3)).reshape(-1, 3)
    wxyz = np.broadcast_to(pose.wxyz, (*shape, 4)).reshape(-1, 4)
    certified, radius, error = _certify(base, platform.moving - pivot, lengths, position, wxyz)
    return Certificate(
        certified.reshape(shape), radius.reshape(shape), error.reshape(shape), platform.unit
    )


def certify_batch(
    base: Array, moving: Array, lengths: Array, position: Array, wxyz: Array
) -> tuple[NDArray[np.bool_], Array]:
    """`certify` on bare arrays, for solvers.

    Args:
        base: (N, 6, 3) or (1, 6, 3); moving: (6, 3); lengths: (N, 6); position: (N, 3),
            wxyz: (N, 4): joints are R(wxyz) moving + position [platform unit].

    Returns:
        Whether certified (N,), and radii of uniqueness (N,) [platform unit], 0 where not.
    """
    return _certify(base, moving, lengths, position, wxyz)[:2]


def _certify(
    base: Array, moving: Array, lengths: Array, position: Array, wxyz: Array
) -> tuple[NDArray[np.bool_], Array, Array]:
    """Whether certified, radii and errors, each (N,)."""
    count = len(lengths)
    radius, error = np.zeros(count), np.full(count, np.inf)
    todo: slice | NDArray[np.int64] = slice(None)
    for turn in TURNS:
        rows = base if len(base) == 1 else base[todo]
        found = _bulk_with(turn, rows, moving, lengths[todo], position[todo], wxyz[todo])
        radius[todo], error[todo] = found
        todo = np.flatnonzero(radius == 0)
        if not len(todo):
            break
    return radius > 0, radius, error


def _bulk_with(
    turn: Array, base: Array, moving: Array, lengths: Array, position: Array, wxyz: Array
) -> tuple[Array, Array]:
    """Radii and errors (n,), with the base frame turned by a quaternion."""
    count = len(lengths)
    radius, error = np.zeros(count), np.full(count, np.inf)
    centre = moving.mean(axis=0)
    arms = moving - centre
    size = float(np.sqrt(np.mean(np.sum(arms**2, axis=1))))
    matrix = quaternion.to_matrix(turn)
    _bulk(
        np.ascontiguousarray(base @ matrix.T), arms, centre, size, np.ascontiguousarray(lengths),
        np.ascontiguousarray(position), np.ascontiguousarray(wxyz), turn, matrix, radius, error,
    )  # fmt: skip
    return radius, error


@jit()
def _bulk(base, arms, centre, size, lengths, position, wxyz, turn, matrix, radius, error):
    """Fill radius and error (N,); rows that fail keep 0 and infinity.

    Args:
        base: (N or 1, 6, 3), already turned by `matrix`.
        arms: (6, 3) platform joints from their `centre` (3,); size: their mean square root.
        turn, matrix: the rotation of the base frame, as quaternion and matrix.
    """
    z = np.zeros(SLOTS * LANES)
    count = lengths.shape[0]
    if base.shape[0] == 1:
        for i in range(6):
            for k in range(3):
                for w in range(LANES):
                    z[(BASE + 3 * i + k) * LANES + w] = base[0, i, k]
    for first in range(0, count, LANES):
        for w in range(LANES):
            row = min(first + w, count - 1)
            for i in range(6):
                z[(LENGTH + i) * LANES + w] = lengths[row, i]
                if base.shape[0] > 1:
                    for k in range(3):
                        z[(BASE + 3 * i + k) * LANES + w] = base[row, i, k]
            for k in range(3):
                z[(T + k) * LANES + w] = position[row, k]
            for k in range(4):
                z[(E + k) * LANES + w] = wxyz[row, k]
        _equations(z, arms, centre, size, turn, matrix)
        _invert(z)
        _radii(z, size)
        for w in range(min(LANES, count - first)):
            good, near = z[OUT * LANES + w], z[(OUT + 1) * LANES + w]
            if good > near >= 0.0:  # false for NaN
                radius[first + w], error[first + w] = good, near


@jit()
def _equations(z, arms, centre, size, turn, matrix):
    """F(0), A (twice: one copy is inverted), the b_i, and bounds on rounding, for eight poses."""
    a, b, c, s = get_real(z, E), get_real(z, E + 1), get_real(z, E + 2), get_real(z, E + 3)
    u, v0, v1, v2 = turn[0], turn[1], turn[2], turn[3]
    w = a * u - b * v0 - c * v1 - s * v2
    x = b * u + a * v0 + s * v1 - c * v2
    y = c * u + a * v1 + b * v2 - s * v0
    s = s * u + a * v2 + c * v0 - b * v1
    n = 2.0 / (w * w + x * x + y * y + s * s)
    r00, r11, r22 = (y * y + s * s) * n, (x * x + s * s) * n, (x * x + y * y) * n
    r00, r11, r22 = 1.0 - r00, 1.0 - r11, 1.0 - r22
    r01, r02, r12 = (x * y - w * s) * n, (x * s + w * y) * n, (y * s - w * x) * n
    r10, r20, r21 = (x * y + w * s) * n, (x * s - w * y) * n, (y * s + w * x) * n
    t0, t1, t2 = get_real(z, T), get_real(z, T + 1), get_real(z, T + 2)
    c0, c1, c2 = centre[0], centre[1], centre[2]
    o0 = t0 * matrix[0, 0] + t1 * matrix[0, 1] + t2 * matrix[0, 2]
    o1 = t0 * matrix[1, 0] + t1 * matrix[1, 1] + t2 * matrix[1, 2]
    o2 = t0 * matrix[2, 0] + t1 * matrix[2, 1] + t2 * matrix[2, 2]
    o0 = o0 + r00 * c0 + r01 * c1 + r02 * c2
    o1 = o1 + r10 * c0 + r11 * c1 + r12 * c2
    o2 = o2 + r20 * c0 + r21 * c1 + r22 * c2
    # sums of magnitudes bound norms, for rounding, without square roots
    away = magnitude(t0) + magnitude(t1) + magnitude(t2) + (abs(c0) + abs(c1) + abs(c2))
    for i in range(6):
        p0, p1, p2 = arms[i, 0], arms[i, 1], arms[i, 2]
        b0, b1, b2 = (
            get_real(z, BASE + 3 * i),
            get_real(z, BASE + 3 * i + 1),
            get_real(z, BASE + 3 * i + 2),
        )
        q0 = r00 * p0 + r01 * p1 + r02 * p2
        q1 = r10 * p0 + r11 * p1 + r12 * p2
        q2 = r20 * p0 + r21 * p1 + r22 * p2
        d0, d1, d2 = q0 + o0 - b0, q1 + o1 - b1, q2 + o2 - b2
        m0, m1, m2 = q0 * 2.0 - d0, q1 * 2.0 - d1, q2 * 2.0 - d2
        length = get_real(z, LENGTH + i)
        dd, mm, square = d0 * d0 + d1 * d1 + d2 * d2, m0 * m0 + m1 * m1 + m2 * m2, length * length
        f = dd - square
        put_real(z, F + i, f * 0.5)
        arm = abs(p0) + abs(p1) + abs(p2)
        whole = magnitude(b0) + magnitude(b1) + magnitude(b2) + away + arm
        reach = magnitude(d0) + magnitude(d1) + magnitude(d2)
        strut = whole * (STRUT * UNIT)
        put_real(z, ROUND_F + i, strut * (reach + strut) + (dd + square) * (SQUARE * UNIT))
        put_real(z, ROUND_A + i, strut * (reach + strut + (arm + size)) * (1.0 / size))
        long = larger(dd, mm)
        bound = root(dd + mm) * (0.5 / size) + (long + magnitude(f)) * (0.125 / size / size)
        put_real(z, BOUND + i, (bound + 0.5) * SLACK)
        row = 6 * i
        n0, n1, n2 = q1 * d2 - q2 * d1, q2 * d0 - q0 * d2, q0 * d1 - q1 * d0
        n0, n1, n2 = n0 * (1.0 / size), n1 * (1.0 / size), n2 * (1.0 / size)
        put_real(z, A + row, d0)
        put_real(z, A + row + 1, n0)
        put_real(z, A + row + 2, d1)
        put_real(z, A + row + 3, n1)
        put_real(z, A + row + 4, d2)
        put_real(z, A + row + 5, n2)
        put_real(z, Y + row, d0)
        put_real(z, Y + row + 1, n0)
        put_real(z, Y + row + 2, d1)
        put_real(z, Y + row + 3, n1)
        put_real(z, Y + row + 4, d2)
        put_real(z, Y + row + 5, n2)


@jit()
def _invert(z):
    """Y, a copy of A, to about its inverse: Gauss and Jordan in place, without pivoting."""
    for k in range(6):
        pivot = 1.0 / get_real(z, Y + 7 * k)
        put_real(z, Y + 7 * k, pivot)
        for j in range(6):
            if j != k:
                put_real(z, Y + 6 * k + j, get_real(z, Y + 6 * k + j) * pivot)
        for i in range(6):
            if i != k:
                factor = get_real(z, Y + 6 * i + k)
                for j in range(6):
                    if j != k:
                        value = get_real(z, Y + 6 * i + j) - factor * get_real(z, Y + 6 * k + j)
                        put_real(z, Y + 6 * i + j, value)
                put_real(z, Y + 6 * i + k, factor * pivot * -1.0)


@jit()
def _radii(z, size):
    """Radii of uniqueness and of existence from F, A, Y and the bounds."""
    nought = get_real(z, F) * 0.0
    beta, kappa, delta = nought, nought, nought
    for block in range(2):  # rows 0, 2, 4 of Y belong to the shift, 1, 3, 5 to the turn
        curve, stray, blur = nought, nought, nought
        for i in range(6):
            y0 = get_real(z, Y + 6 * block + i)
            y1 = get_real(z, Y + 6 * (block + 2) + i)
            y2 = get_real(z, Y + 6 * (block + 4) + i)
            norm = root(y0 * y0 + y1 * y1 + y2 * y2)
            curve = curve + norm * get_real(z, BOUND + i)
            stray = stray + norm * get_real(z, ROUND_F + i)
            blur = blur + norm * get_real(z, ROUND_A + i)
        step, defect = nought, nought
        for k in range(3):
            row = Y + 6 * (block + 2 * k)
            value = nought
            for i in range(6):
                value = value + get_real(z, row + i) * get_real(z, F + i)
            step = step + value * value
            for j in range(6):
                value = nought
                for i in range(6):
                    value = value + get_real(z, row + i) * get_real(z, A + 6 * i + j)
                if j == block + 2 * k:
                    value = value - 1.0
                defect = defect + value * value
        kappa = larger(curve, kappa)
        beta = larger(root(step) + stray, beta)
        delta = larger(root(defect * 2.0) + blur, delta)
    # the Study quadric adds a component to the shift: 2 g0 = -(2 L r).(2 c) / (2 L)
    kappa = root(kappa * kappa + 0.25 / size / size) * SLACK
    free = 1.0 - delta * SLACK
    inner = free * free - kappa * beta * 4.0 * SLACK
    put_real(z, OUT, free / (kappa * 2.0) * (2.0 - SLACK))
    put_real(z, OUT + 1, beta * 2.0 / (free + root(inner)) * SLACK)

"""Poses where the Jacobian is singular: multiple solutions, and curves of poses (self-motion).

Slow and careful NumPy, used for the few readings whose paths do not all arrive apart. All in
normalised units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.modes.finish import legs_at, make_real, turn_and_shift
from gough.modes.study import Complex

NEAR = 0.1  # imaginary part over size up to which an end might belong to a real pose
STEPS = 80  # of Gauss and Newton; at a double solution each halves the distance
SMALL = 1e-5  # singular value over the largest, below which a pose counts as singular
TOGETHER = 3e-6  # distance of refined poses that are one multiple solution
CURVE_STEP = 0.02  # between the points of a curve of poses
CURVE_POINTS = 3000  # at most
SAMPLES = 36  # poses that stand for a curve in an answer


@dataclass(frozen=True, eq=False)
class Found:
    """Real poses near the ends of paths.

    Attributes:
        e, t: (M, 4), (M, 3).
        paths: (M,) how many paths ended there; 0 for samples of a curve of poses.
        unresolved: paths that led to no pose, though they should.
        curve: a curve of poses was found.
    """

    e: Array
    t: Array
    paths: NDArray[np.int32]
    unresolved: int
    curve: bool


def gather(
    problem: Problem, regular: tuple[Array, Array], ends: tuple[Complex, Complex]
) -> tuple[Array, Array, NDArray[np.int32]]:
    """The real poses of one set of readings, some of whose paths did not arrive.

    Args:
        regular: (R, 4), (R, 3) real poses at which paths arrived.
        ends: where the others stopped, close to a solution or to several that meet.

    Returns:
        (M, 4), (M, 3), and how many paths belong to each, (M,).
    """
    extra = [pose for e, t in zip(*ends, strict=True) if (pose := problem.near(e, t)) is not None]
    e = np.concatenate([regular[0], np.array([pose[0] for pose in extra]).reshape(-1, 4)])
    t = np.concatenate([regular[1], np.array([pose[1] for pose in extra]).reshape(-1, 3)])
    return merge(e, t, np.ones(len(e), np.int32))


def classify(problem: Problem, e: Array, t: Array, paths: NDArray[np.int32]) -> Found:
    """Tell regular poses from multiple ones and from points of a curve of poses."""
    paths, on_curve, unresolved = paths.copy(), [], 0
    for k in range(len(e)):
        values, null = problem.singular_values(e[k], t[k])
        if values[-1] > SMALL * values[0]:
            unresolved += int(paths[k]) - 1  # a path has come to another's pose
            paths[k] = 1
        elif problem.moves_along(e[k], t[k], null):
            on_curve.append(k)
        else:
            paths[k] = max(2, paths[k])
    if not on_curve:
        return Found(e, t, paths, unresolved, False)
    k = on_curve[0]
    curve_e, curve_t = problem.curve(e[k], t[k])
    kept = np.array([k not in on_curve for k in range(len(e))], dtype=bool)
    zeros = np.zeros(len(curve_e), np.int32)
    return Found(
        np.concatenate([e[kept], curve_e]), np.concatenate([t[kept], curve_t]),
        np.concatenate([paths[kept], zeros]), unresolved, True,
    )  # fmt: skip


def curve_of_poses(problem: Problem, home: tuple[Array, Array], seed: int) -> tuple[Array, Array]:
    """Samples of a curve of poses for a machine whose legs are dependent at every pose.

    Starts at home, then at random poses; empty if no pose has the legs.
    """
    rng = np.random.default_rng(seed)
    for attempt in range(50):
        e, t = home[0].copy(), home[1].copy()
        if attempt:
            e, t = rng.normal(size=4), home[1] + rng.normal(size=3)
            e /= np.linalg.norm(e)
        if problem.settle(e, t, damped=True):
            return problem.curve(e, t)
    return np.zeros((0, 4)), np.zeros((0, 3))


def merge(e: Array, t: Array, paths: NDArray[np.int32]) -> tuple[Array, Array, NDArray[np.int32]]:
    """Poses that are the same become one, their paths added."""
    kept: list[int] = []
    counts: list[int] = []
    for i in range(len(e)):
        for n, k in enumerate(kept):
            if apart(e[i], t[i], e[k], t[k]) < TOGETHER:
                counts[n] += int(paths[i])
                break
        else:
            kept.append(i)
            counts.append(int(paths[i]))
    return e[kept], t[kept], np.array(counts, np.int32)


def apart(e: Array, t: Array, f: Array, u: Array) -> float:
    """Distance of two real poses: shift, or twice the sine of a quarter turn."""
    return float(max(np.abs(t - u).max(), min(np.abs(e - f).max(), np.abs(e + f).max())))


@dataclass(frozen=True, eq=False)
class Problem:
    """Six legs to be matched: (6, 3), (6, 3), (6,), largest |l^2 - d.d| / 2 that counts as 0."""

    p: Array
    base: Array
    squares: Array
    tolerance: float

    def linear(self, e: Array, t: Array) -> tuple[Array, Array]:
        """Jacobian (6, 6) and what is missing (6,) at a pose."""
        a, x = np.empty((6, 6)), np.empty(6)
        legs_at(self.p, self.base, self.squares, e, t, a, x)
        return a, x

    def near(self, e: Complex, t: Complex) -> tuple[Array, Array] | None:
        """The real pose that a complex end is close to, if there is one."""
        real_e, real_t = np.empty(4), np.empty(3)
        if not make_real(e, t, real_e, real_t) < NEAR:
            return None
        before = real_e.copy(), real_t.copy()
        if not self.settle(real_e, real_t, damped=False):
            return None
        return (real_e, real_t) if apart(real_e, real_t, *before) < NEAR else None

    def settle(self, e: Array, t: Array, damped: bool) -> bool:
        """Gauss-Newton in place, shortest steps; True if the legs are matched."""
        damping = 1.0 if damped else 0.0
        a, x = self.linear(e, t)
        for _ in range(STEPS if not damped else 3 * STEPS):
            left = np.abs(x).max()
            if left < 0.01 * self.tolerance:
                return True
            if damped:
                step = np.linalg.solve(a.T @ a + damping * np.eye(6), a.T @ x)
            else:
                step = np.linalg.lstsq(a, x, rcond=1e-10)[0]
            length = np.linalg.norm(step)
            new_e, new_t = e.copy(), t.copy()
            turn_and_shift(new_e, new_t, step * min(1.0, 0.3 / (length + 1e-300)))
            new_a, new_x = self.linear(new_e, new_t)
            if damped and np.abs(new_x).max() > left:
                damping = max(4 * damping, 1e-8)
                continue
            damping *= 0.2
            e[:], t[:], a, x = new_e, new_t, new_a, new_x
        return bool(np.abs(x).max() <= self.tolerance)

    def singular_values(self, e: Array, t: Array) -> tuple[Array, Array]:
        """Singular values of the Jacobian, and the direction of the smallest."""
        values, directions = np.linalg.svd(self.linear(e, t)[0])[1:]
        return values, directions[-1]

    def moves_along(self, e: Array, t: Array, null: Array) -> bool:
        """Whether the platform can leave a singular pose with its legs locked.

        A step along the null direction is corrected: at an isolated multiple solution the
        correction leads back, or no pose is found; on a curve it stays where it is.
        """
        for sign in (1.0, -1.0):
            f, u = e.copy(), t.copy()
            turn_and_shift(f, u, sign * CURVE_STEP * null)
            there = f.copy(), u.copy()
            if self.settle(f, u, damped=False) and apart(f, u, *there) < CURVE_STEP / 10:
                return True
        return False

    def curve(self, e: Array, t: Array) -> tuple[Array, Array]:
        """Points of the curve of poses through one of its points, evenly chosen."""
        points = [(e.copy(), t.copy())]
        along = self.singular_values(e, t)[1]
        for _ in range(CURVE_POINTS):
            f, u = points[-1][0].copy(), points[-1][1].copy()
            turn_and_shift(f, u, CURVE_STEP * along)
            if not self.settle(f, u, damped=False):
                break
            if len(points) > 3 and apart(f, u, *points[0]) < CURVE_STEP:
                break
            points.append((f, u))
            null = self.singular_values(f, u)[1]
            along = null if null @ along > 0 else -null
        chosen = np.unique(np.linspace(0, len(points) - 1, SAMPLES).round().astype(int))
        return np.array([points[k][0] for k in chosen]), np.array([points[k][1] for k in chosen])

"""Poses where the Jacobian is singular: multiple solutions, and curves of poses (self-motion).

Slow and careful, used for the few readings whose paths do not all arrive apart. Poses are seven
numbers in normalised units, see `gough.modes.frames`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.kernel.ends import TOLERANCE, leg_equations, make_real, move
from gough.kernel.paths import Complex
from gough.modes.frames import Problem

NEAR = 0.1  # imaginary part over size up to which an end might belong to a real pose
STEPS = 80  # of Gauss and Newton; at a double solution each halves the distance
SMALL = 1e-5  # singular value over the largest, below which a pose counts as singular
TOGETHER = 3e-6  # distance of refined poses that are one multiple solution
CURVE_STEP = 0.02  # between the points of a curve of poses
CURVE_POINTS = 3000  # at most
SAMPLES = 36  # poses that stand for a curve in an answer
TRIES = 50  # starting poses for finding a pose of an architecturally singular machine


@dataclass(frozen=True, eq=False)
class Meeting:
    """Real poses of one set of readings, some of whose paths came together.

    Attributes:
        poses: (M, 7).
        multiplicity: (M,) number of solutions that meet there; 0 for samples of a curve of poses.
        unresolved: number of paths that led to no pose, though they should.
        curve: a curve of poses was found.
    """

    poses: Array
    multiplicity: NDArray[np.int32]
    unresolved: int
    curve: bool


def poses_near(legs: Legs, ends: Complex) -> Array:
    """Real poses (M, 7) that the ends (E, 7) of paths are close to."""
    found = [pose for end in ends if (pose := legs.near(end)) is not None]
    return np.array(found).reshape(-1, 7)


def merge(poses: Array, paths: NDArray[np.int32]) -> tuple[Array, NDArray[np.int32]]:
    """Those of the poses (M, 7) that differ, and the sum of `paths` (M,) at each."""
    kept: list[int] = []
    counts: list[int] = []
    for i, pose in enumerate(poses):
        same = (n for n, k in enumerate(kept) if apart(pose, poses[k]) < TOGETHER)
        n = next(same, len(kept))
        if n == len(kept):
            kept.append(i)
            counts.append(0)
        counts[n] += int(paths[i])
    return poses[kept], np.array(counts, np.int32)


def classify(legs: Legs, poses: Array, paths: NDArray[np.int32]) -> Meeting:
    """Regular poses, multiple ones and a curve of poses, of poses (M, 7) at which paths ended."""
    multiplicity, on_curve, unresolved = paths.copy(), np.zeros(len(poses), bool), 0
    for k, pose in enumerate(poses):
        values, null = legs.singular_values(pose)
        if values[-1] > SMALL * values[0]:
            unresolved += int(paths[k]) - 1  # a path has come to another's pose
            multiplicity[k] = 1
        elif legs.moves_along(pose, null):
            on_curve[k] = True
        else:
            multiplicity[k] = max(2, paths[k])
    if not np.any(on_curve):
        return Meeting(poses, multiplicity, unresolved, False)
    curve = legs.curve(poses[np.argmax(on_curve)])
    zeros = np.zeros(len(curve), np.int32)
    return Meeting(
        np.concatenate([poses[~on_curve], curve]),
        np.concatenate([multiplicity[~on_curve], zeros]), unresolved, True,
    )  # fmt: skip


def curve_of_poses(legs: Legs, home: Array, seed: int) -> Array:
    """Samples (M, 7) of a curve of poses for a machine whose legs are dependent at every pose.

    Starts at home (7,), then at random poses; empty if no pose has the legs.
    """
    rng = np.random.default_rng(seed)
    for attempt in range(TRIES):
        pose = home.copy()
        if attempt:
            pose[3:] = rng.normal(size=4)
            pose[:3] += rng.normal(size=3)
            pose[3:] /= np.linalg.norm(pose[3:])
        settled = legs.settle(pose, damped=True)
        if settled is not None:
            return legs.curve(settled)
    return np.zeros((0, 7))


def apart(a: Array, b: Array) -> float:
    """Distance of two real poses: of position, or twice the sine of a quarter of the angle."""
    e, f = a[3:], b[3:]
    return float(max(np.abs(a - b)[:3].max(), min(np.abs(e - f).max(), np.abs(e + f).max())))


@dataclass(frozen=True, eq=False)
class Legs:
    """Leg equations of one set of readings: joints (6, 3) and (6, 3), squared lengths (6,)."""

    moving: Array
    base: Array
    squares: Array

    @classmethod
    def of(cls, problem: Problem, row: int) -> Legs:
        """Those of one set of a problem."""
        return cls(problem.moving, problem.base[row % len(problem.base)], problem.squares[row])

    def linear(self, pose: Array) -> tuple[Array, Array]:
        """Jacobian (6, 6) and what is missing in half the squared lengths (6,) at a pose."""
        a, x = np.empty((6, 6)), np.empty(6)
        leg_equations(self.moving, self.base, self.squares, pose, a, x)
        return a, x

    def near(self, end: Complex) -> Array | None:
        """The real pose that a complex end is close to, if there is one."""
        pose = np.empty(7)
        if not make_real(end, pose) < NEAR:
            return None
        settled = self.settle(pose, damped=False)
        return settled if settled is not None and apart(settled, pose) < NEAR else None

    def settle(self, pose: Array, damped: bool) -> Array | None:
        """The pose to which Gauss-Newton's shortest steps lead, if it matches the legs."""
        damping = 1.0 if damped else 0.0
        a, x = self.linear(pose)
        for _ in range(STEPS if not damped else 3 * STEPS):
            left = np.abs(x).max()
            if left < 0.01 * TOLERANCE:
                return pose
            if damped:
                step = np.linalg.solve(a.T @ a + damping * np.eye(6), a.T @ x)
            else:
                step = np.linalg.lstsq(a, x, rcond=1e-10)[0]
            new = moved(pose, step * min(1.0, 0.3 / float(np.linalg.norm(step) + 1e-300)))
            new_a, new_x = self.linear(new)
            if damped and np.abs(new_x).max() > left:
                damping = max(4 * damping, 1e-8)
                continue
            damping *= 0.2
            pose, a, x = new, new_a, new_x
        return pose if np.abs(x).max() <= TOLERANCE else None

    def singular_values(self, pose: Array) -> tuple[Array, Array]:
        """Singular values of the Jacobian, and the direction of the smallest."""
        values, directions = np.linalg.svd(self.linear(pose)[0])[1:]
        return values, directions[-1]

    def moves_along(self, pose: Array, null: Array) -> bool:
        """True if the platform can leave a singular pose with its legs locked.

        A step along the null direction is corrected: at an isolated multiple solution the
        correction leads back, or no pose is found; on a curve it stays where it is.
        """
        for sign in (1.0, -1.0):
            there = moved(pose, sign * CURVE_STEP * null)
            settled = self.settle(there, damped=False)
            if settled is not None and apart(settled, there) < CURVE_STEP / 10:
                return True
        return False

    def curve(self, pose: Array) -> Array:
        """Points (M, 7) of the curve of poses through one of its points, evenly chosen."""
        points = [pose]
        along = self.singular_values(pose)[1]
        for _ in range(CURVE_POINTS):
            settled = self.settle(moved(points[-1], CURVE_STEP * along), damped=False)
            if settled is None or (len(points) > 3 and apart(settled, pose) < CURVE_STEP):
                break
            points.append(settled)
            null = self.singular_values(settled)[1]
            along = null if null @ along > 0 else -null
        chosen = np.unique(np.linspace(0, len(points) - 1, SAMPLES).round().astype(int))
        return np.array(points)[chosen]


def moved(pose: Array, twist: NDArray) -> Array:
    """The pose after a translation and a rotation vector (6,), to first order."""
    there = pose.copy()
    move(there, np.ascontiguousarray(twist))
    return there

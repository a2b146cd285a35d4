"""Two-stage methods: a first guess, and the second stage that refines it, all in one form.

The paper's "CPU-NR" (Newton-Raphson one sample at a time with LAPACK's pseudo-inverse, after Parikh
and Lam's hybrid method (2005)) and SciPy's `root` are yardsticks, slow by design; `gough.solve` is
the solver.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.fk.solve import solve
from gough.kinematics import equivalent_struts
from gough.learn.metrics import same_pose
from gough.learn.newton import batched_newton
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.base import Seed

F_MAX = 20  # inner iterations of the paper's method
SINGULAR = 1e-12  # smallest over largest singular value of a Jacobian without an inverse


@dataclass(frozen=True)
class Ends:
    """Final state of each row of a second stage.

    Attributes:
        pose: (N,); the last finite pose of rows that did not converge.
        converged, singular: (N,); neither: not within the allowed iterations.
        iterations: (N,).
    """

    pose: Pose
    converged: NDArray[np.bool_]
    singular: NDArray[np.bool_]
    iterations: NDArray[np.int64]


SecondStage = Callable[[Pose, Array, float], Ends]


@dataclass(frozen=True)
class Method:
    """A first guess and a second stage.

    Attributes:
        name: as tables show it.
        run: from readings (N, 6) and gamma to `Ends`.
        counts: meaning of its number of iterations: the sum over "samples", or "sweeps" of the
            whole batch.
    """

    name: str
    run: Callable[[Array, float], Ends]
    counts: str = "samples"

    @classmethod
    def of(cls, seed: Seed, second: SecondStage, name: str, counts: str = "samples") -> Method:
        """Combine a seed with a second stage."""
        return cls(
            f"{seed.name} + {name}",
            lambda legs, gamma: second(seed.guess(legs), legs, gamma),
            counts,
        )


def sequential(platform: Platform, seed: Seed) -> Method:
    """The paper's CPU-NR: one sample at a time, LAPACK's pseudo-inverse."""
    return Method.of(seed, lambda *row: cpu_newton(platform, *row), "CPU-NR")


def scipy(platform: Platform, seed: Seed) -> Method:
    """SciPy's `root`, one sample at a time."""
    return Method.of(seed, lambda *row: scipy_root(platform, *row), "SciPy root")


def batched(platform: Platform, seed: Seed, f_max: int = F_MAX, scaled: bool = False) -> Method:
    """The paper's GPU-friendly method, here on the CPU; `scaled` is not the paper's."""

    def second(guess: Pose, legs: Array, gamma: float) -> Ends:
        end = batched_newton(platform, guess, legs, gamma=gamma, f_max=f_max, scaled=scaled)
        return Ends(end.pose, end.converged, end.singular, end.iterations)

    name = "batched NR" + (" scaled" if scaled else "")
    name += f", f_max = {f_max}" if f_max != F_MAX else ""
    return Method.of(seed, second, name, "sweeps")


def ours(platform: Platform, seed: Seed) -> Method:
    """This package's solver, always to rounding, with its further tries."""

    def run(legs: Array, gamma: float) -> Ends:
        end = solve(platform, legs, seed=seed)
        return Ends(end.pose, end.usable, np.zeros(len(legs), bool), end.iterations.astype(int))

    return Method(f"{seed.name} + gough.solve", run)


@dataclass(frozen=True)
class Success:
    """Numbers of rows by the result of a method.

    Attributes:
        count: W of the paper's success rate.
        singular, imprecise: its N_1 and N_2.
        wrong: converged, but at another pose than the true one: the paper counts these as solved.
        iterations: summed over samples, or sweeps.
    """

    count: int
    singular: int
    imprecise: int
    wrong: int
    iterations: int

    @classmethod
    def of(cls, platform: Platform, method: Method, end: Ends, truth: Pose) -> Success:
        """Compare final poses with the true poses (W,)."""
        true = same_pose(platform, end.pose, truth)
        total = end.iterations.max if method.counts == "sweeps" else end.iterations.sum
        return cls(
            len(truth),
            int(np.sum(end.singular)),
            int(np.sum(~end.converged & ~end.singular)),
            int(np.sum(end.converged & ~true)),
            int(total(initial=0)),
        )


# ---- one sample at a time -----------------------------------------------------------------


class Equations:
    """F(xi) = IK(exp(xi)) - l and its Jacobian for one reading l (6,).

    With ad the 6 x 6 matrix [[hat w, hat rho], [0, hat w]] of xi = (rho [unit], w [rad]), the
    exponential of [[ad, I], [0, 0]] holds the rotation R in its first corner and the left Jacobian
    L of SE(3) in its upper right half (Van Loan, Computing integrals involving the matrix
    exponential (1978)). Then t = L_11 rho, and L maps d xi to the spatial twist, which changes a
    strut by n . v + (p x n) . w with p its joint from the base's origin. SciPy's `expm` computes
    it: no formula of `gough.pose` is used.
    """

    def __init__(self, platform: Platform, reading: Array) -> None:
        self.ends, self.lengths = equivalent_struts(platform, reading)
        self.joints = platform.moving - platform.pivot_point
        self.pivot, self.size = platform.pivot_point, platform.size

    def __call__(self, xi: Array) -> tuple[Array, Array]:
        """Length errors (6,) [platform unit] and their Jacobian (6, 6) with respect to xi (6,)."""
        from scipy.linalg import expm

        block = np.zeros((12, 12))
        block[:3, :3] = block[3:6, 3:6] = _hat(xi[3:])
        block[:3, 3:6] = _hat(xi[:3] / self.size)  # entries of order one keep all digits
        block[:6, 6:] = np.eye(6)
        exponential: Any = expm(block)  # SciPy types it as perhaps complex
        R, L = exponential[:3, :3], exponential[:6, 6:]
        L[:3, 3:] *= self.size
        joints = self.joints @ R.T + L[:3, :3] @ xi[:3]
        struts = joints + self.pivot - self.ends
        lengths = np.sqrt(np.sum(struts**2, axis=1))
        n = struts / lengths[:, None]
        return lengths - self.lengths, np.concatenate([n, np.cross(joints, n)], axis=1) @ L


def cpu_newton(
    platform: Platform, guess: Pose, legs: Array, gamma: float, z_max: int = 100
) -> Ends:
    """Refine guesses (N,) for readings (N, 6), one after the other.

    Args:
        platform: the machine.
        guess: first poses.
        legs: readings.
        gamma: a row has converged when |xi_new - xi|_1 is below; xi is in [unit] and [rad].
        z_max: most iterations of a row.
    """
    ends = [
        _refine_one(Equations(platform, reading), xi, gamma, z_max)
        for xi, reading in zip(guess.log(), legs, strict=True)
    ]
    xi, converged, singular, iterations = (np.array(x) for x in zip(*ends, strict=True))
    return Ends(Pose.exp(xi), converged, singular, iterations)


def _refine_one(equations: Equations, xi: Array, gamma: float, z_max: int) -> tuple:
    """Last xi (6,), converged, singular, iterations."""
    for z in range(1, z_max + 1):
        F, J = equations(xi)
        if not np.all(np.isfinite(J)):
            return xi, False, False, z
        u, s, vt = np.linalg.svd(J)  # J^+ = V S^-1 U^T
        if s[-1] <= SINGULAR * s[0]:
            return xi, False, True, z
        step = vt.T @ ((u.T @ F) / s)
        xi = xi - step
        if np.sum(np.abs(step)) < gamma:
            return xi, True, False, z
    return xi, False, False, z_max


def scipy_root(platform: Platform, guess: Pose, legs: Array, gamma: float) -> Ends:
    """Solve the same equations by SciPy's `root` (MINPACK hybrj), one sample at a time.

    Its tolerance is relative to the unknowns, so gamma is divided by the platform's size.
    """
    from scipy.optimize import root

    ends = [
        root(Equations(platform, reading), xi, jac=True, tol=gamma / platform.size)
        for xi, reading in zip(guess.log(), legs, strict=True)
    ]
    xi = np.array([end.x for end in ends])
    converged = np.array([bool(end.success) for end in ends])
    calls = np.array([int(end.nfev) for end in ends])
    return Ends(Pose.exp(xi), converged, np.zeros(len(ends), bool), calls)


def _hat(v: Array) -> Array:
    """The cross product by v (3,) as a matrix."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])

"""Newton-Raphson one sample at a time with LAPACK's pseudo-inverse: the paper's "CPU-NR".

The second stage of Parikh and Lam's hybrid method (2005) as the DisGNet paper compares with it:
xi = log(T) in se(3), F(xi) = IK(T) - l, xi <- xi - J^+ F until |step|_1 < gamma. The same equations
serve SciPy's `root`. A yardstick, slow by design; `gough.solve` is the solver.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.kinematics import equivalent_struts
from gough.platform import Platform
from gough.pose import Pose

SINGULAR = 1e-12  # smallest over largest singular value of a Jacobian without an inverse
SMALL = 0.1  # [rad] below which the coefficients come from their series


@dataclass(frozen=True)
class Refined:
    """Where each row ended.

    Attributes:
        pose: (N,); rows that did not converge hold their last finite pose.
        converged, singular: (N,); neither: not within the allowed iterations.
        iterations: (N,).
    """

    pose: Pose
    converged: NDArray[np.bool_]
    singular: NDArray[np.bool_]
    iterations: NDArray[np.int64]


class Equations:
    """F and its Jacobian for one reading (6,), by xi = (rho [unit], phi [rad]) = log(T).

    With V the left Jacobian of SO(3), t = V rho and R = exp(phi); a change d_xi moves the plate by
    the spatial twist [[V, Q], [0, V]] d_xi, Q as in Barfoot, State Estimation for Robotics (2017),
    eq. 7.86. A leg's length changes by n . v + (p x n) . w with p its joint from the base's origin.
    """

    def __init__(self, platform: Platform, reading: Array) -> None:
        self.base, self.lengths = equivalent_struts(platform, reading)
        self.arms = platform.moving - platform.pivot_point
        self.pivot = platform.pivot_point

    def __call__(self, xi: Array) -> tuple[Array, Array]:
        """Length errors (6,) [unit] and their Jacobian (6, 6) with respect to xi."""
        rho, phi = xi[:3], xi[3:]
        P, W = _hat(rho), _hat(phi)
        a, b, c, d, sine = _coefficients(float(np.sqrt(phi @ phi)))
        W2 = W @ W
        R = np.eye(3) + sine * W + a * W2
        V = np.eye(3) + a * W + b * W2
        WP, PW = W @ P, P @ W
        WPW = WP @ W
        Q = P / 2 + b * (WP + PW + WPW) + c * (W @ WP + PW @ W - 3 * WPW)
        Q += d * (WPW @ W + W @ WPW)
        joints = self.arms @ R.T + (V @ rho + self.pivot)
        struts = joints - self.base
        lengths = np.sqrt(np.sum(struts**2, axis=1))
        n = struts / lengths[:, None]
        # the twist's velocity is that of the point at the base's origin, where the pose's t is
        # measured from; joints are measured from there too
        m = np.cross(joints - self.pivot, n)
        J = np.concatenate([n @ V, n @ Q + m @ V], axis=1)
        return lengths - self.lengths, J


def cpu_newton(platform: Platform, guess: Pose, legs: Array, *, gamma: float,
               z_max: int = 100) -> Refined:  # fmt: skip
    """Refine guesses (N,) for readings (N, 6), one after the other.

    Args:
        gamma: a row has converged when |xi_new - xi|_1 is below; xi is in [unit] and [rad].
        z_max: iterations at most.
    """
    ends = [
        _one(Equations(platform, reading), xi, gamma, z_max)
        for xi, reading in zip(guess.log(), legs, strict=True)
    ]
    xi, converged, singular, iterations = (np.array(x) for x in zip(*ends, strict=True))
    return Refined(Pose.exp(xi), converged, singular, iterations)


def _one(equations: Equations, xi: Array, gamma: float, z_max: int) -> tuple:
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


def scipy_root(platform: Platform, guess: Pose, legs: Array, *, gamma: float) -> Refined:
    """SciPy's `root` (MINPACK hybrj) on the same equations, one sample at a time.

    Its tolerance is relative to the unknowns, so gamma is divided by the platform's size.
    """
    from scipy.optimize import root

    starts = guess.log()
    ends = [
        root(Equations(platform, reading), xi, jac=True, tol=gamma / platform.size)
        for xi, reading in zip(starts, legs, strict=True)
    ]
    xi = np.array([end.x for end in ends])
    converged = np.array([bool(end.success) for end in ends])
    calls = np.array([int(end.nfev) for end in ends])
    return Refined(Pose.exp(xi), converged, np.zeros(len(ends), bool), calls)


def _hat(v: Array) -> Array:
    """The cross product by v (3,) as a matrix."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _coefficients(t: float) -> tuple[float, float, float, float, float]:
    """(1 - cos)/t^2, (t - sin)/t^3, (t^2/2 + cos - 1)/t^4, (2t - 3 sin + t cos)/(2 t^5), sin/t."""
    s = t * t
    if t < SMALL:
        return (
            1 / 2 - s / 24 * (1 - s / 30 * (1 - s / 56)),
            1 / 6 - s / 120 * (1 - s / 42 * (1 - s / 72)),
            1 / 24 - s / 720 * (1 - s / 56 * (1 - s / 90)),
            1 / 120 - s / 2520 * (1 - s / 48 * (1 - s * 5 / 330)),
            1 - s / 6 * (1 - s / 20 * (1 - s / 42)),
        )
    sin, cos = np.sin(t), np.cos(t)
    return (
        (1 - cos) / s,
        (t - sin) / (s * t),
        (s / 2 + cos - 1) / s**2,
        (2 * t - 3 * sin + t * cos) / (2 * s**2 * t),
        sin / t,
    )

"""The estimate: maximum a posteriori, by Gauss and Newton on the whitened normal equations.

Each pose has m errors r (n, m) whose covariance C (n, m, m) comes from the instrument and from the
readings, both through the Jacobian, so that the six legs of one pose are weighted together. The
drawing is a measurement, too: every parameter x_k has the drawn value d_k and a tolerance s_k. So

    cost(x, y) = sum_n  r_n^T C_n^-1 r_n  +  sum_k ((x_k - d_k) / s_k)^2

over the parameters x and the placement y. With C = L L^T and A the stacked L^-1 dr/d(x, y), a step
solves (A^T A + P) step = -(A^T L^-1 r + P (x - d)), P = diag(1 / s^2, 0). At the minimum
(A^T A + P)^-1 is the covariance of the posterior, and, averaged over machines drawn from the
tolerance, the Cramer-Rao bound with a prior (Van Trees 1968, sec. 2.4): no unbiased use of the same
data has smaller errors. The weights follow the estimate from step to step.

Without frames of their own the data fix 42 combinations of a telescopic machine's 42 parameters and
the 12 of the frames: moving all base joints with F, or all platform joints with H, changes nothing.
The prior decides these 12, which thereby are the best fit of the found joints to the drawing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gough.calibration.arrays import Array
from gough.calibration.parameters import Parameters
from gough.calibration.residuals import Rigid
from gough.calibration.sensors import Rows, Sensor
from gough.errors import GoughError
from gough.fk.solve import solve
from gough.platform import Platform
from gough.pose import Pose

FOUND = 1e-6  # of the machine's size: residual up to which a pose has the readings
LOOSE = 1e-9  # weight of a placement's numbers relative to the data: keeps unseen ones in place


@dataclass(frozen=True)
class State:
    """An estimate: parameters (6, K), placement, and poses X (n) close to those of the readings."""

    values: Array
    place: Any
    near: Rigid


@dataclass(frozen=True, eq=False)
class Problem:
    """Measurements of an instrument, and their standard deviations.

    Attributes:
        parameters: layout, drawing and tolerance.
        sensor: the instrument and its n measurements.
        legs: (n, 6) readings.
        leg_sigma: standard deviation of a reading.
        free: fit the placement.
    """

    parameters: Parameters
    sensor: Sensor
    legs: Array
    leg_sigma: float
    free: bool = True

    def __len__(self) -> int:
        return len(self.legs)

    @property
    def numbers(self) -> int:
        """m, how many numbers the instrument measures in a pose."""
        return self.sensor.numbers

    def __getitem__(self, rows: Any) -> Problem:
        return replace(self, sensor=self.sensor[rows], legs=self.legs[rows])

    def rows(self, state: State) -> tuple[Rows, State]:
        """Errors and derivatives at an estimate, and the estimate with its poses brought along."""
        rows, near = self.sensor.rows(
            self.parameters, state.values, state.place, self.legs, self.leg_sigma, state.near
        )
        if not self.free:
            rows = replace(rows, place=rows.place[..., :0])
        return rows, replace(state, near=near)

    def place_prior(self, state: State) -> tuple[Array, Array]:
        """Gradient and information (c,) of what is known of the placement beforehand: nothing."""
        none = np.zeros(state.place.count if self.free else 0)
        return none, none

    def moved(self, state: State, step: Array) -> State:
        """The estimate after a step in parameters (6 K) and placement."""
        count = state.values.size
        values = state.values + step[:count].reshape(state.values.shape)
        place = state.place.moved(step[count:]) if self.free else state.place
        return replace(state, values=values, place=place)


@dataclass(frozen=True, eq=False)
class Estimate:
    """Result of a minimisation.

    Attributes:
        state: parameters and placement.
        distance: (n,) squared Mahalanobis distance of each pose's errors; m on average.
        information: (P, P) A^T A of the data alone.
        covariance: (P, P) of parameters and placement, prior included.
        cost: the minimum.
        weights: (n,) weight of each pose, 1 unless fitted robustly.
    """

    state: State
    distance: Array
    information: Array
    covariance: Array
    cost: float
    weights: Array


def whiten(rows: Rows, weights: Array | None = None) -> tuple[Array, Array]:
    """Errors (n, m) and derivatives (n, m, P) divided by the square root of the covariance.

    Args:
        weights: (n,) of the poses, by whose square roots the derivatives are multiplied.
    """
    root = inverse_root(rows.covariance)
    errors = (root @ rows.errors[..., None])[..., 0]
    if weights is not None:
        root = root * np.sqrt(weights)[:, None, None]
    n, m = errors.shape
    legs = rows.struts.shape[1] * rows.struts.shape[2]
    A = np.empty((n, m, legs + rows.place.shape[-1]))
    by_leg = A[..., :legs].reshape(n, m, *rows.struts.shape[1:])  # a view
    np.multiply((root @ rows.by_strut)[..., None], rows.struts[:, None], out=by_leg)
    np.matmul(root, rows.place, out=A[..., legs:])
    return errors, A


def inverse_root(covariance: Array) -> Array:
    """L^-1 (n, m, m) of covariances L L^T."""
    return np.linalg.inv(np.linalg.cholesky(covariance))


def squared_distances(problem: Problem, state: State) -> Array:
    """Squared Mahalanobis distance (n,) of each pose's errors at an estimate."""
    rows = problem.rows(state)[0]
    return np.sum((inverse_root(rows.covariance) @ rows.errors[..., None]) ** 2, axis=(1, 2))


class _Normal:
    """Normal equations of the whole problem at one estimate."""

    def __init__(self, problem: Problem, state: State, weights: Array | None) -> None:
        rows, self.state = problem.rows(state)
        errors, A = whiten(rows, weights)
        self.distance = np.sum(errors**2, axis=1)
        if weights is not None:
            errors = errors * np.sqrt(weights)[:, None]
        parameters = problem.parameters
        gap = ((state.values - parameters.drawn) / parameters.tolerance).ravel()
        flat = A.reshape(-1, A.shape[-1])
        self.information = flat.T @ flat
        self.gradient = flat.T @ errors.ravel()
        count = gap.size
        self.gradient[:count] += gap / parameters.tolerance.ravel()
        self.prior = np.zeros(len(self.gradient))
        self.prior[:count] = parameters.tolerance.ravel() ** -2
        gradient, known = problem.place_prior(self.state)
        self.gradient[count:] += gradient
        self.prior[count:] = known + LOOSE * np.diag(self.information)[count:]
        self.prior[count:][self.prior[count:] == 0] = 1.0  # not seen at all: stays where it is
        data = np.sum(self.distance if weights is None else weights * self.distance)
        self.cost = float(data + gap @ gap + _prior_cost(gradient, known))

    def factor(self, damping: float = 0.0) -> tuple[Array, Array]:
        """Cholesky factor of the scaled normal matrix, and the scale (P,)."""
        matrix = self.information + np.diag(self.prior)
        scale = 1 / np.sqrt(np.diag(matrix))
        scaled = matrix * np.outer(scale, scale)
        scaled[np.diag_indices_from(scaled)] += damping
        return np.linalg.cholesky(scaled), scale

    def step(self, damping: float) -> Array:
        factor, scale = self.factor(damping)
        half = np.linalg.solve(factor, -scale * self.gradient)
        return scale * np.linalg.solve(factor.T, half)

    def covariance(self) -> Array:
        factor, scale = self.factor(1e-14)
        half = np.linalg.inv(factor) * scale
        return half.T @ half


def _prior_cost(gradient: Array, known: Array) -> float:
    """x^T P x of P x and the diagonal P."""
    used = known > 0
    return float(np.sum(gradient[used] ** 2 / known[used]))


def minimise(
    problem: Problem, start: State, weights: Array | None = None, iterations: int = 25
) -> Estimate:
    """Find the estimate by damped Gauss-Newton steps; the damping is 0 unless a step fails.

    Args:
        weights: (n,) of the poses, 1 unless given.
    """
    now = _Normal(problem, start, weights)
    damping = 0.0
    for _ in range(iterations):
        tried = now
        try:
            tried = _Normal(problem, problem.moved(now.state, now.step(damping)), weights)
            better = tried.cost <= now.cost * (1 + 1e-9)
        except np.linalg.LinAlgError:
            better = False
        if not better:
            damping = max(10 * damping, 1e-8)
            if damping > 1:
                break
            continue
        done = now.cost - tried.cost < 1e-7 * now.cost
        now, damping = tried, damping / 10 if damping > 1e-10 else 0.0
        if done:
            break
    ones = np.ones(len(problem)) if weights is None else weights
    return Estimate(now.state, now.distance, now.information, now.covariance(), now.cost, ones)


def place_instrument(
    problem: Problem, start: State, weights: Array | None = None, iterations: int = 20
) -> tuple[State, Array]:
    """Fit the placement alone, the machine as drawn; errors count beside the drawing's tolerance.

    Returns:
        The estimate, and (n,) squared distances of the poses' errors; m on average where the
        drawing is within tolerance.
    """
    tolerance = problem.parameters.tolerance
    state, cost, damping = start, np.inf, 0.0
    errors, B = np.zeros(0), np.zeros((0, 0))
    best: tuple[State, Array] | None = None
    for _ in range(iterations):
        rows, tried = problem.rows(state)
        whitening = inverse_root(rows.covariance + rows.covariance_of(tolerance))
        white = (whitening @ rows.errors[..., None])[..., 0]
        distance = np.sum(white**2, axis=1)
        root = np.ones(len(white)) if weights is None else np.sqrt(weights)
        now = float(np.sum(root**2 * distance))
        if not np.isfinite(now):
            break
        if now <= cost * (1 + 1e-9):
            done = cost - now < 1e-6 * now
            cost, best, damping = now, (tried, distance), damping / 10
            B = ((whitening * root[:, None, None]) @ rows.place).reshape(white.size, -1)
            errors = (white * root[:, None]).ravel()
            if done or not B.shape[1]:
                break
        else:
            damping = max(10 * damping, 1e-6)
            if damping > 1e3:
                break
        assert best is not None
        scale = np.linalg.norm(B, axis=0)
        scale[scale == 0] = 1
        matrix = (B / scale).T @ (B / scale) + (damping + 1e-12) * np.eye(len(scale))
        step = -np.linalg.solve(matrix, (B / scale).T @ errors) / scale
        state = replace(best[0], place=best[0].place.moved(step))
    if best is None:
        raise GoughError("the first fit of the instrument's placement did not converge")
    return best


def poses_of_readings(
    problem: Problem, machine: Platform | None = None
) -> tuple[Rigid, NDArray[np.bool_]]:
    """Solve the readings on the drawing: poses X (n), home where there is none; which are found.

    On another `machine` where one is given. A pose counts as found out of workspace or stroke,
    too: the true machine may be within.
    """
    drawing = machine or problem.parameters.drawing
    found = solve(drawing, problem.legs)
    usable = found.residual < FOUND * drawing.size  # not so where it is NaN
    at = found.pose
    pose = Pose(
        np.where(usable[:, None], at.position, drawing.home.position),
        np.where(usable[:, None], at.wxyz, drawing.home.wxyz),
    )
    return Rigid.of(pose, drawing.pivot_point), usable

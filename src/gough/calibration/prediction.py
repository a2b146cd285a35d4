"""Errors to expect of a calibrated machine, and whether it is better than its drawing.

What an instrument would measure at a pose depends on parameters and placement, y = h(x); with G its
derivative and C the covariance of x, its errors have the covariance G C G^T. Averaged over poses of
the workspace that is the predicted error. The drawing's own error is estimated by the difference
between its predictions and the calibrated machine's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gough.calibration.arrays import Array
from gough.calibration.estimate import Estimate, Problem, State, place_instrument
from gough.calibration.residuals import Rigid, forward
from gough.calibration.sensors import per_leg
from gough.kinematics import leg_lengths
from gough.workspace import Workspace as Box

POSES = 200  # of the workspace, over which errors are averaged
DRAWS = 1000  # of the posterior, for the probability that the calibration is better


@dataclass(frozen=True)
class Error:
    """Root mean square errors over the workspace.

    Attributes:
        position: of poses, targets or distances [platform unit]; NaN where only angles are
            measured.
        rotation: of poses, orientations or tilts [rad]; NaN where only positions are measured.
    """

    position: float
    rotation: float


@dataclass(frozen=True, eq=False)
class Workspace:
    """Readings over a machine's workspace, with errors as the instrument sees them.

    Attributes:
        problem: the instrument, and the layout of the parameters.
        legs: (t, 6) readings.
        near: (t) poses close to those of the readings.
    """

    problem: Problem
    legs: Array
    near: Rigid

    @classmethod
    def of(cls, problem: Problem) -> Workspace:
        """Sample the drawing's workspace within stroke, or a small box where it states none."""
        drawing = problem.parameters.drawing
        box = drawing.workspace or Box.about_home(0.1 * drawing.size, 10.0)
        poses = replace(drawing, workspace=box).sample_poses(8 * POSES, seed=1)
        legs = leg_lengths(drawing, poses)
        good = np.all(np.isfinite(legs), axis=-1)
        if drawing.stroke is not None:
            low, high = drawing.stroke.T
            good &= np.all((legs >= low) & (legs <= high), axis=-1)
        chosen = np.flatnonzero(good)[:POSES]
        return cls(problem, legs[chosen], Rigid.of(poses[chosen], drawing.pivot_point))

    def derivatives(self, state: State) -> tuple[Array, Rigid]:
        """G (t, m, P) of what is measured by parameters and placement, and the poses X (t)."""
        problem = self.problem
        pose, found = forward(problem.parameters, state.values, self.legs, self.near)
        by_pose, by_place = problem.sensor.sensitivity(state.place, pose)
        own = per_leg(-by_pose @ np.linalg.inv(found.twist), found.legs)
        if not problem.free:
            by_place = by_place[..., :0]
        return np.concatenate([own, np.broadcast_to(by_place, (*own.shape[:2], by_place.shape[2]))],
                              axis=-1), pose  # fmt: skip

    def differences(self, a: State, b: State) -> Array:
        """Difference of the measurements of two machines, a minus b, (t, m)."""
        parameters = self.problem.parameters
        seen = [(s.place, forward(parameters, s.values, self.legs, self.near)[0]) for s in (a, b)]
        return self.problem.sensor.difference(*seen)

    def mean_squares(self, errors: Array) -> tuple[Array, Array]:
        """Squared errors of position and of rotation, (...), of errors (..., m)."""
        squares = errors**2
        kind = self.problem.sensor.kind
        none = np.full(squares.shape[:-1], np.nan)
        if kind == "pose":
            return squares[..., :3].sum(-1), squares[..., 3:].sum(-1)
        if kind in ("inclinometer", "orientation"):
            return none, squares.sum(-1)
        per = squares.shape[-1] if kind == "distances" else squares.shape[-1] // 3
        return squares.sum(-1) / per, none

    def error(self, state: State, covariance: Array) -> Error:
        """The predicted error of an estimate with this covariance (P, P)."""
        G, _ = self.derivatives(state)
        variance = np.sum((G @ covariance) * G, axis=-1)  # (t, m)
        return self.summary(np.sqrt(np.maximum(variance, 0)))

    def summary(self, errors: Array) -> Error:
        """Root mean square of errors (t, m)."""
        return Error(*(float(np.sqrt(np.mean(x))) for x in self.mean_squares(errors)))

    def probability_better(self, estimate: Estimate, drawn: State) -> float:
        """Probability, by the posterior, that mean errors are smaller than the drawing's.

        By draws of the true machine around the estimate.
        """
        some = slice(None, None, 4)
        G = self.derivatives(estimate.state)[0][some]
        shift = self.differences(drawn, estimate.state)[some]
        if self.problem.sensor.kind == "pose":  # judged by position
            G, shift = G[:, :3], shift[:, :3]
        t, m, P = G.shape
        rng = np.random.default_rng(0)
        root = np.linalg.cholesky(_symmetric(estimate.covariance))
        ours = ((G.reshape(-1, P) @ root) @ rng.normal(size=(P, DRAWS))).reshape(t, m, DRAWS)
        size = lambda e: np.sqrt(np.sum(e**2, axis=1)).mean(axis=0)  # noqa: E731
        return float(np.mean(size(ours) < size(ours - shift[..., None])))


def _symmetric(matrix: Array) -> Array:
    """A covariance made safe for a Cholesky factor."""
    scale = np.sqrt(np.diag(matrix))
    even = (matrix + matrix.T) / 2 / np.outer(scale, scale)
    return (even + 1e-12 * np.eye(len(scale))) * np.outer(scale, scale)


def leave_one_out(problem: Problem, estimate: Estimate, drawn: State) -> tuple[Array, Array]:
    """Squared distances (n,) of each pose from fits without it: calibrated, and as drawn.

    For a linear fit the error of a pose that was left out is (I - S)^-1 e, with S = A C A^T its
    share in the fit of its own error e (Allen 1974, PRESS); the fit is linear enough.
    Both are weighed by the noise alone.
    """
    rows, _ = problem.rows(estimate.state)
    noise = np.linalg.cholesky(rows.covariance)
    A = np.linalg.solve(noise, np.concatenate([rows.legs, rows.place], axis=-1))
    ours = _without(np.linalg.solve(noise, rows.errors[..., None]), A, estimate.covariance,
                    estimate.weights)  # fmt: skip

    rows, _ = problem.rows(drawn)
    loose = rows.covariance_of(problem.parameters.tolerance)
    root = np.linalg.cholesky(rows.covariance + loose)
    errors = np.linalg.solve(root, rows.errors[..., None])
    if problem.free:
        A = np.linalg.solve(root, rows.place)
        flat = (A * np.sqrt(estimate.weights)[:, None, None]).reshape(-1, A.shape[-1])
        errors = _without(errors, A, np.linalg.pinv(flat.T @ flat), estimate.weights)
    theirs = np.linalg.solve(np.linalg.cholesky(rows.covariance), root @ errors)
    return np.sum(ours[..., 0] ** 2, axis=1), np.sum(theirs[..., 0] ** 2, axis=1)


def _without(errors: Array, A: Array, covariance: Array, weights: Array) -> Array:
    share = A @ covariance @ np.swapaxes(A, 1, 2) * weights[:, None, None]
    return np.linalg.solve(np.eye(share.shape[1]) - share + 1e-12 * np.eye(share.shape[1]), errors)


def refit_drawing(problem: Problem, start: State, weights: Array) -> State:
    """The drawing with the placement that fits it best."""
    if not problem.free:
        return State(problem.parameters.drawn, start.place, start.near)
    first = State(problem.parameters.drawn, start.place, start.near)
    return place_instrument(problem, first, weights)[0]

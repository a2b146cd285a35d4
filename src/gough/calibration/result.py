"""A calibration: the machine as it is, how sure that is, and what there is to say about it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gough.calibration import prediction
from gough.calibration.arrays import Array
from gough.calibration.estimate import Estimate, Problem, State
from gough.calibration.parameters import Parameters
from gough.calibration.placements import Frames, Targets
from gough.platform import Platform
from gough.pose import Pose

SURE = 0.998  # probability of being better than the drawing from which a calibration is written
NOTICEABLE = 2.0  # standard errors by which held-out poses must fit better than on the drawing


@dataclass(frozen=True, eq=False)
class Calibration:
    """The machine as measured, and how far to trust it.

    Attributes:
        problem: what was measured, with the layout of the parameters; bad rows are left out.
        estimate: parameters and placement at the optimum, with their covariance.
        start: the estimate that the fit started from: the drawing.
        rows: (n,) rows of the input that were used.
        rank: how many combinations of the legs' parameters the data fix, the placement known.
        notes: sentences about the input, with which `messages` begins.
    """

    problem: Problem
    estimate: Estimate
    start: State
    rows: NDArray[np.intp]
    rank: int
    notes: tuple[str, ...] = ()

    @property
    def parameters(self) -> Parameters:
        """Layout, drawn values and tolerances of the parameters."""
        return self.problem.parameters

    @cached_property
    def messages(self) -> list[str]:
        """Sentences that a person should read."""
        from gough.calibration.advice import advice

        return [*self.notes, *advice(self)]

    @cached_property
    def drawn(self) -> State:
        """The drawing with the placement that fits it best."""
        return prediction.refit_drawing(self.problem, self.start, self.estimate.weights)

    @cached_property
    def platform(self) -> Platform:
        """The calibrated machine."""
        return self.parameters.platform(self.estimate.state.values)

    @property
    def frame(self) -> Pose:
        """Base to measuring coordinates; the identity for instruments without a frame."""
        place = self.estimate.state.place
        return place.frame.pose() if isinstance(place, (Frames, Targets)) else Pose.identity()

    @property
    def tool(self) -> Pose:
        """Platform to tool coordinates; the identity for instruments that measure no pose."""
        place = self.estimate.state.place
        return place.tool.pose() if isinstance(place, Frames) else Pose.identity()

    @property
    def changes(self) -> Array:
        """(6, K) calibrated minus drawn values, in the columns `parameters.names`."""
        return self.estimate.state.values - self.parameters.drawn

    @property
    def covariance(self) -> Array:
        """(6 K, 6 K) of the legs' parameters, leg by leg."""
        count = self.changes.size
        return self.estimate.covariance[:count, :count]

    @property
    def deviations(self) -> Array:
        """(6, K) standard deviations of the parameters."""
        return np.sqrt(np.diag(self.covariance)).reshape(self.changes.shape)

    @cached_property
    def residuals(self) -> Array:
        """(n, m) what is left of each pose: strut errors of poses, else computed minus measured."""
        return self.problem.rows(self.estimate.state)[0].errors

    @property
    def distances(self) -> Array:
        """(n,) Mahalanobis distance of each pose; its square is m on average for good ones."""
        return np.sqrt(self.estimate.distance)

    @property
    def inliers(self) -> NDArray[np.bool_]:
        """(n,) poses that count; all of them unless the fit was robust."""
        return self.estimate.weights > 0.5

    @cached_property
    def workspace(self) -> prediction.Workspace:
        """Poses over which errors are averaged."""
        return prediction.Workspace.of(self.problem)

    @cached_property
    def predicted_error(self) -> prediction.Error:
        """Root mean square error over the workspace that the calibrated machine still has."""
        return self.workspace.error(self.estimate.state, self.estimate.covariance)

    @cached_property
    def error_before(self) -> prediction.Error:
        """The drawing's error over the workspace, by its difference to the calibrated machine."""
        return self.workspace.summary(self.workspace.differences(self.drawn, self.estimate.state))

    @cached_property
    def probability_better(self) -> float:
        """Probability that the calibrated machine errs less than the drawing."""
        return self.workspace.probability_better(self.estimate, self.drawn)

    @cached_property
    def held_out(self) -> tuple[Array, Array]:
        """(n,) distances of each pose from fits without it: calibrated machine, drawing."""
        ours, theirs = prediction.leave_one_out(self.problem, self.estimate, self.drawn)
        return np.sqrt(ours), np.sqrt(theirs)

    @cached_property
    def cross_validated(self) -> tuple[float, float]:
        """Root mean square error of held-out poses in standard deviations: calibrated, drawing."""
        m = self.residuals.shape[1]
        a, b = (float(np.sqrt(np.mean(d[self.inliers] ** 2) / m)) for d in self.held_out)
        return a, b

    @cached_property
    def noticeable(self) -> float:
        """By how many standard errors held-out poses fit better than on the drawing."""
        ours, theirs = (d[self.inliers] ** 2 for d in self.held_out)
        gain = theirs - ours
        spread = np.std(gain) / np.sqrt(len(gain))
        return float(np.mean(gain) / spread) if spread > 0 else 0.0

    @property
    def better(self) -> bool:
        """True if the calibrated machine is surely better than its drawing; else do not use it."""
        return self.probability_better >= SURE and self.noticeable >= NOTICEABLE

    def __repr__(self) -> str:
        unit = self.parameters.drawing.unit
        error = self.predicted_error
        told = [
            f"{self.error_before.position:.3g} to {error.position:.3g} [{unit}]"
            if np.isfinite(error.position)
            else f"{np.degrees(self.error_before.rotation):.3g} to "
            f"{np.degrees(error.rotation):.3g} [deg]"
        ]
        return (
            f"Calibration({self.parameters.drawing.name!r}, {np.sum(self.inliers)} of "
            f"{len(self.rows)} poses, rank {self.rank} of {self.changes.size}, error {told[0]})"
        )

"""A slow change over the time of measuring, such as warming up: of zeros and of the frame.

Over the time from first to last pose, counted as s from -1/2 to 1/2, the true lengths or angles of
the legs change by s r (r six numbers) and the measuring frame moves by the twist s f (six more,
for instruments that have a frame). Both are taken out of the data, not put into the model:
readings become q + s r / gain, measurements are moved by -s f. Beside the other unknowns they are
fitted with the tolerance as their standard deviation. The data show a drift where the cost drops
by more than chance allows: without one the drop is chi squared, a degree of freedom for each rate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gough.calibration.arrays import Array
from gough.calibration.estimate import Estimate, Problem, State, minimise
from gough.calibration.parameters import OFFSET
from gough.calibration.residuals import Rigid
from gough.calibration.robust import chi_squared
from gough.calibration.sensors import PoseSensor, Rows, Sensor, TargetSensor
from gough.errors import GoughError

CERTAIN = 3.7  # [sigma of a normal number] drop of the cost that shows a drift: 1 in 10,000


@dataclass(frozen=True)
class Drifting:
    """A placement with the rates of a drift beside it."""

    place: Any
    zeros: Array  # (6,) [platform unit] or [rad], over the whole time
    twist: Array  # (6,) of the frame, or () where the instrument has none
    deviations: Array | None = None  # (6,) of the zeros, once they are fitted

    @property
    def count(self) -> int:
        return self.place.count + len(self.zeros) + len(self.twist)

    def moved(self, step: Array) -> Drifting:
        c = len(step) - 6 - len(self.twist)
        place = self.place.moved(step[:c]) if c else self.place
        return Drifting(place, self.zeros + step[c : c + 6], self.twist + step[c + 6 :])


@dataclass(frozen=True, eq=False)
class DriftProblem(Problem):
    """A problem whose placement is a `Drifting`.

    Attributes:
        when: (n,) time of each pose from -1/2 to 1/2.
    """

    when: Array = None  # pyright: ignore[reportAssignmentType]
    placed: bool = True  # fit the placement, too

    def corrected(self, drift: Drifting) -> Problem:
        """The same data without the drift."""
        zeros = self.when[:, None] * drift.zeros
        legs = self.legs + zeros / self.parameters.drawing.gain
        sensor = _moved_back(self.sensor, self.when, drift.twist) if len(drift.twist) \
            else self.sensor  # fmt: skip
        return Problem(self.parameters, sensor, legs, self.leg_sigma, self.placed)

    def rows(self, state: State) -> tuple[Rows, State]:
        drift: Drifting = state.place
        plain = replace(state, place=drift.place)
        rows, moved = self.corrected(drift).rows(plain)
        when = self.when[:, None, None]
        parts = [rows.place, when * rows.by_strut * rows.struts[:, None, :, OFFSET]]
        if len(drift.twist):
            full = rows
            if not self.placed:
                full = replace(self.corrected(drift), free=True).rows(plain)[0]
            parts.append(when * full.place[..., :6])
        return replace(rows, place=np.concatenate(parts, axis=-1)), replace(moved, place=drift)

    def place_prior(self, state: State) -> tuple[Array, Array]:
        drift: Drifting = state.place
        tolerance = self.parameters.tolerance
        limit = tolerance[0, 0] * np.ones(len(drift.twist))
        limit[3:] /= self.parameters.drawing.size
        sigma = np.concatenate([tolerance[:, OFFSET], limit])
        rates = np.concatenate([drift.zeros, drift.twist])
        none = np.zeros(drift.place.count if self.placed else 0)
        return np.concatenate([none, rates / sigma**2]), np.concatenate([none, sigma**-2.0])


def fit_drift(
    problem: Problem, estimate: Estimate, time: Array
) -> tuple[Problem, Estimate, Drifting | None]:
    """Fit a drift beside an estimate, and keep it where the data show one.

    Args:
        time: (n,) of the poses, in any unit.

    Returns:
        The problem without drift in its data, the estimate, and the drift; unchanged and None
        where the data show none.

    Raises:
        GoughError: all times are the same, or one is missing.
    """
    span = np.ptp(time)
    if not span > 0:
        raise GoughError("time: expected numbers that differ, to see a drift over them")
    when = (time - time.min()) / span - 0.5
    twist = np.zeros(6 if isinstance(problem.sensor, (PoseSensor, TargetSensor)) else 0)
    drifting = DriftProblem(problem.parameters, problem.sensor, problem.legs, problem.leg_sigma,
                            True, when, problem.free)  # fmt: skip
    start = replace(estimate.state, place=Drifting(estimate.state.place, np.zeros(6), twist))
    found = minimise(drifting, start, estimate.weights)
    rates = 6 + len(twist)
    if estimate.cost - found.cost < chi_squared(rates, CERTAIN):
        return problem, estimate, None
    kept = len(found.covariance) - rates
    deviations = np.sqrt(np.diag(found.covariance)[kept : kept + 6])
    drift: Drifting = replace(found.state.place, deviations=deviations)
    plain = drifting.corrected(drift)
    return (
        plain,
        replace(
            found,
            state=replace(found.state, place=drift.place),
            information=found.information[:kept, :kept],
            covariance=found.covariance[:kept, :kept],
        ),
        drift,
    )


def _moved_back(sensor: Sensor, when: Array, twist: Array) -> Sensor:
    """Measurements as they would have been in the frame of the middle of the time."""
    back = Rigid.identity().moved(-when[:, None] * twist)
    if isinstance(sensor, PoseSensor):
        return replace(sensor, pose=back @ sensor.pose)
    assert isinstance(sensor, TargetSensor)
    values = sensor.values @ np.swapaxes(back.R, 1, 2) + back.t[:, None]
    return replace(sensor, values=values)

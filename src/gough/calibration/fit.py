"""`gough.calibrate`: from readings and measurements to a calibrated machine, with every warning."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough.calibration import identify
from gough.calibration.drift import Drifting, fit_drift
from gough.calibration.estimate import (
    Problem,
    State,
    place_instrument,
    poses_of_readings,
)
from gough.calibration.mistakes import FAR, LOOKED_AT, likely_mistake
from gough.calibration.parameters import Parameters
from gough.calibration.residuals import Rigid
from gough.calibration.result import Calibration
from gough.calibration.robust import find_start, plain_fit, robust_fit
from gough.calibration.sensors import (
    KINDS,
    Bars,
    DistanceSensor,
    Frames,
    InclinometerSensor,
    Level,
    PoseSensor,
    Targets,
    TargetSensor,
    check_sigma,
)
from gough.checks import as_batch
from gough.errors import GoughError
from gough.platform import Platform
from gough.pose import Pose, as_pose
from gough.tables import Table, as_readings

Kind = Literal["pose", "position", "targets", "distances", "inclinometer"]
SHAPES = {"position": (3,), "targets": (3,), "distances": (), "inclinometer": (2,)}
HOPELESS = 20.0  # times noise and tolerance beyond which data without a known mistake are refused
FOUR = 4.0  # tolerances or standard errors beyond which something is called unlikely


def calibrate(
    platform: Platform,
    legs: ArrayLike | Table,
    measured: Pose | ArrayLike | Table,
    *,
    sigma: float | tuple[float, float],
    leg_sigma: float,
    tolerance: float,
    kind: Kind = "pose",
    gains: bool = False,
    frames: Literal["unknown", "known"] = "unknown",
    robust: bool = False,
    targets: ArrayLike | None = None,
    stations: ArrayLike | None = None,
    time: ArrayLike | None = None,
) -> Calibration:
    """Find the joints and sensor zeros that a machine really has, from poses measured on it.

    Args:
        platform: the machine as drawn.
        legs: readings (n, 6), or a table with columns leg_1 to leg_6.
        measured: what the instrument measured at these readings, by `kind`: poses (n) or a table
            of them; positions of one target (n, 3) or of k targets (n, k, 3), k distances (n, k)
            [platform unit]; or the angles (n, 2) [rad] by which an inclinometer's x and y axes
            point above the horizontal. Rows with NaN are left out.
        sigma: standard deviation of what is measured [platform unit], or [rad] for an
            inclinometer; for poses a pair, of position and of rotation [rad].
        leg_sigma: standard deviation of the readings, in their unit.
        tolerance: standard deviation of joints and lengths from the drawing [platform unit].
        kind: "pose", "position", "targets", "distances" or "inclinometer".
        gains: fit a gain of each leg's sensor, too.
        frames: "unknown": where the instrument and what it looks at stand is fitted, too;
            "known": measurements are in base coordinates, of the platform itself.
        robust: find the poses that do not fit, and leave them out.
        targets: (k, 3) points that are looked at [platform coordinates]; a first guess where
            frames are unknown.
        stations: (k, 3) fixed ends of the distances [base coordinates]; likewise.
        time: (n,) of each row, in any unit: fit a drift of zeros and frame over it, and keep it
            where the data show one.

    Returns:
        The calibrated machine with its covariance, predicted error and warnings. `better` says
        whether it is surely better than the drawing.

    Raises:
        GoughError: data of another shape, too few poses, data that do not fit the machine at all
            (with the likely mistake by name).

    Source: Van Trees, Detection, Estimation and Modulation Theory (1968), sec. 2.4; derivation in
        docs/calibration.md.
    """
    if kind not in KINDS:
        raise GoughError(f"kind: expected one of {', '.join(KINDS)}; found {kind!r}")
    if frames not in ("unknown", "known"):
        raise GoughError(f"frames: expected 'unknown' or 'known', found {frames!r}")
    readings = as_readings(legs)
    if readings.ndim != 2:
        raise GoughError(f"legs: expected (n, 6), got {readings.shape}")
    sensor, good = _sensor(platform, kind, measured, sigma, frames == "known")
    if len(sensor) != len(readings):
        raise GoughError(
            f"legs, measured: expected as many rows, found {len(readings)} and {len(sensor)}"
        )
    good &= np.all(np.isfinite(readings), axis=1)
    rows = np.flatnonzero(good)
    parameters = Parameters(platform, check_sigma("tolerance", tolerance), gains)
    problem = Problem(
        parameters, sensor[rows], readings[rows], check_sigma("leg_sigma", leg_sigma),
        frames == "unknown",
    )  # fmt: skip
    left_out = len(readings) - len(rows)
    messages = [f"{left_out} of {len(readings)} rows hold NaN and are left out."] * bool(left_out)
    given = _given_place(platform, kind, sensor, targets, stations, problem.free)
    start, rank = _start(problem, given, robust)
    estimate = robust_fit(problem, start) if robust else plain_fit(problem, start)
    if time is not None:
        when = as_batch("time", time, ())
        if when.shape != (len(readings),):
            raise GoughError(f"time: expected ({len(readings)},), got {when.shape}")
        if not np.all(np.isfinite(when[rows])):
            raise GoughError("time: a row with measurements has none")
        problem, estimate, drift = fit_drift(problem, estimate, when[rows])
        messages.append(_drift_text(platform, drift))
    return Calibration(problem, estimate, start, rows, rank, tuple(messages))


# ---- input ----------------------------------------------------------------------------


def _sensor(
    platform: Platform, kind: str, measured: Any, sigma: Any, known: bool
) -> tuple[Any, NDArray[np.bool_]]:
    """The instrument with all rows, and which of them (n,) hold numbers throughout."""
    if kind == "pose":
        pose = as_pose(measured)
        if len(pose.batch) != 1:
            raise GoughError(f"measured: expected poses (n), found batch axes {pose.batch}")
        pair = np.atleast_1d(as_batch("sigma", sigma, ()))
        if pair.shape != (2,):
            raise GoughError("sigma: expected a pair, of position and of rotation [rad]")
        noise = (check_sigma("sigma[0]", pair[0]), check_sigma("sigma[1]", pair[1]))
        good = np.all(np.isfinite(pose.position), -1) & np.all(np.isfinite(pose.wxyz), -1)
        filled = Pose(
            np.where(good[:, None], pose.position, 0), np.where(good[:, None], pose.wxyz, 1)
        )
        return PoseSensor(Rigid.of(filled, platform.pivot_point if known else 0.0), noise), good
    number = as_batch("sigma", sigma, ())
    if number.shape != ():
        raise GoughError(f"sigma: expected one number for {kind}, found {sigma!r}")
    noise = check_sigma("sigma", float(number))
    values = as_batch("measured", measured, SHAPES[kind])
    dimensions = {"position": 2, "targets": 3, "distances": 2, "inclinometer": 2}[kind]
    if values.ndim != dimensions or values.size == 0:
        wanted = {"position": "(n, 3)", "targets": "(n, k, 3)", "distances": "(n, k)"}
        raise GoughError(
            f"measured: expected {wanted.get(kind, '(n, 2)')} for {kind}, got {values.shape}"
        )
    good = np.all(np.isfinite(values.reshape(len(values), -1)), axis=1)
    if kind == "position":
        return TargetSensor(values[:, None], noise), good
    if kind == "targets":
        if values.shape[1] < 2:
            raise GoughError("measured: one target is kind 'position'; expected two or more")
        return TargetSensor(values, noise), good
    if kind == "distances":
        return DistanceSensor(values, noise), good
    return InclinometerSensor(np.sin(values), noise), good


def _given_place(
    platform: Platform, kind: str, sensor: Any, targets: Any, stations: Any, free: bool
) -> Any:
    """The placement that the caller states, or None where it is to be found."""
    points = None if targets is None else as_batch("targets", targets, (3,)).reshape(-1, 3)
    ends = None if stations is None else as_batch("stations", stations, (3,)).reshape(-1, 3)
    k = {"pose": 0, "inclinometer": 0}.get(kind)
    k = (sensor.points if kind in ("position", "targets") else sensor.distances).shape[1] \
        if k is None else k  # fmt: skip
    for name, value in (("targets", points), ("stations", ends)):
        if value is not None and len(value) != k:
            raise GoughError(f"{name}: expected {k} points, found {len(value)}")
    if kind == "pose":
        return None if free else Frames(Rigid.identity(), Rigid.identity())
    if kind == "inclinometer":
        return None if free else Level(np.array([0.0, 0.0, 1.0]), np.eye(3))
    if kind == "distances":
        if points is not None and ends is not None:
            return Bars(ends, points)
        if not free:
            raise GoughError("targets, stations: needed for distances with known frames")
        return None
    if free:
        return None
    return Targets(Rigid.identity(), np.zeros((k, 3)) if points is None else points)


# ---- start ------------------------------------------------------------------------------


def _start(problem: Problem, given: Any, robust: bool) -> tuple[State, int]:
    """A first estimate, the drawing's; refuses too few poses and data that do not fit.

    Returns:
        The estimate, and the rank that the instrument can reach.
    """
    parameters, sensor = problem.parameters, problem.sensor
    near, found = poses_of_readings(problem)
    if not len(problem):
        raise GoughError("measured: no row without NaN is left")
    if given is not None:
        state = State(parameters.drawn, given, near)
    elif found.sum() >= 4:
        state = find_start(problem, near, found, robust)
    else:
        text = f"only {found.sum()} of {len(problem)} readings have a pose on the drawn machine"
        raise GoughError(_misfit_text(likely_mistake(problem), text))
    m = problem.rows(state)[0].errors.shape[1]
    reachable = identify.rank(parameters, sensor, state.place)
    needed = identify.needed_poses(parameters, reachable, m)
    if len(problem) < needed:
        raise GoughError(
            f"measured: {len(problem)} usable poses are too few; {sensor.kind} measurements need "
            f"at least {needed} to fix the {reachable} combinations that they can show, and 20 or "
            "more to be accurate"
        )
    step = max(1, len(problem) // LOOKED_AT)
    part = problem[::step]
    state_part = replace(state, near=state.near[::step])
    _, distance = place_instrument(part, state_part, iterations=1)
    if np.median(distance) > FAR * m:
        times = np.sqrt(np.median(distance) / m)
        text = f"errors are {times:.0f} times what noise and tolerance explain"
        mistake = likely_mistake(problem)
        if mistake or times > HOPELESS:
            raise GoughError(_misfit_text(mistake, text))
    return state, reachable


def _misfit_text(mistake: str | None, what: str) -> str:
    if mistake:
        return f"measured: the data do not fit the machine ({what}); likely mistake: {mistake}"
    return (
        f"measured: the data do not fit the machine ({what}), and none of the usual mistakes "
        "explains it; check the platform file, units, leg order, and that rows belong together"
    )


def _drift_text(platform: Platform, drift: Drifting | None) -> str:
    if drift is None:
        return "The data show no drift over time; the fit is without."
    unit = "rad" if platform.rotary is not None else platform.unit
    zeros = ", ".join(f"{z:+.3g}" for z in drift.zeros)
    text = f"The data show a drift, and it is taken out: zeros of the legs by {zeros} {unit}"
    if len(drift.twist):
        moved = np.linalg.norm(drift.twist[:3])
        turned = np.degrees(np.linalg.norm(drift.twist[3:]))
        text += f", the frame by {moved:.3g} {platform.unit} and {turned:.3g} deg"
    return text + " from first to last pose. The calibration is for the middle of the time."

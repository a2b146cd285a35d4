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
from gough.calibration.inputs import as_sensor, check_kind, check_sigma, known_place
from gough.calibration.kinds import Kind
from gough.calibration.mistakes import FAR, LOOKED_AT, likely_mistake
from gough.calibration.parameters import Parameters
from gough.calibration.result import Calibration
from gough.calibration.robust import find_start, plain_fit, robust_fit
from gough.calibration.words import row_numbers
from gough.checks import as_batch
from gough.errors import GoughError
from gough.platform import Platform
from gough.pose import Pose
from gough.tables import Table, as_readings

HOPELESS = 20.0  # times noise and tolerance beyond which data without a known mistake are refused


def calibrate(
    platform: Platform,
    legs: ArrayLike | Table,
    measured: Pose | ArrayLike | Table,
    *,
    sigma: ArrayLike,
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
            of them, also for the rotations of an orientation; positions of one target (n, 3) or
            of k targets (n, k, 3), k distances (n, k) [platform unit]; or the angles (n, 2) [rad]
            by which an inclinometer's x and y axes point above the horizontal. Rows with NaN are
            left out.
        sigma: standard deviation of what is measured [platform unit], or [rad] for orientations
            and inclinometers; for poses a pair, of position and of rotation [rad]. Stated once,
            or for each row: (n,) or (n, 2).
        leg_sigma: standard deviation of the readings, in their unit.
        tolerance: standard deviation of joints and lengths from the drawing [platform unit].
        kind: "pose", "position", "orientation", "targets", "distances" or "inclinometer".
        gains: fit a gain of each leg's sensor, too.
        frames: "unknown": where the instrument and what it looks at stand is fitted, too;
            "known": measurements are in base coordinates, of the platform itself.
        robust: find the poses that do not fit, and leave them out.
        targets: (k, 3) points that are looked at [platform coordinates], where frames are known;
            a first guess of the distances' ends where they are not.
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
    check_kind(kind)
    if frames not in ("unknown", "known"):
        raise GoughError(f"frames: expected 'unknown' or 'known', found {frames!r}")
    readings = as_readings(legs)
    if readings.ndim != 2:
        raise GoughError(f"legs: expected (n, 6), got {readings.shape}")
    pivot = platform.pivot_point if frames == "known" else np.zeros(3)
    sensor, good = as_sensor(kind, measured, sigma, pivot)
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
    messages = _left_out(good)
    given = known_place(kind, sensor, targets, stations, problem.free)
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


def _left_out(good: NDArray[np.bool_]) -> list[str]:
    bad = np.flatnonzero(~good) + 1
    if not len(bad):
        return []
    return [f"{len(bad)} of {len(good)} rows hold NaN and are left out: {row_numbers(bad)}."]


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
    m = problem.numbers
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
    assert drift.deviations is not None
    zeros = ", ".join(
        f"{z:+.2g} (+-{s:.1g})" for z, s in zip(drift.zeros, drift.deviations, strict=True)
    )
    text = f"The data show a drift, and it is taken out: zeros of the legs by {zeros} {unit}"
    if len(drift.twist):
        moved = np.linalg.norm(drift.twist[:3])
        turned = np.degrees(np.linalg.norm(drift.twist[3:]))
        text += f", the frame by {moved:.3g} {platform.unit} and {turned:.3g} deg"
    return text + " from first to last pose. The calibration is for the middle of the time."

"""Mistakes in data, by name: what a file that fits no machine would have to be read as to fit.

Each mistake is undone in turn, the instrument is placed on the drawing again, and the one that
makes the file fit is named. Nothing is corrected silently.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from gough.calibration.estimate import Problem, place_instrument, poses_of_readings
from gough.calibration.residuals import Rigid
from gough.calibration.robust import find_start
from gough.calibration.sensors import (
    DistanceSensor,
    InclinometerSensor,
    PoseSensor,
    Sensor,
    TargetSensor,
)
from gough.pose import Pose

LOOKED_AT = 40  # poses that mistakes are sought in
FAR = 9.0  # squared distance per number from which the fit on the drawing is called impossible
CLEARER = 30.0  # times smaller a squared distance must be for a mistake to be named
ALIKE = 4.0  # times the best squared distance up to which others are named, too
UNITS = {
    "inch, but the machine is in mm": 25.4,
    "mm, but the machine is in inch": 1 / 25.4,
    "m, but the machine is in mm": 1e3,
    "mm, but the machine is in m": 1e-3,
}

Undo = Callable[[Problem], Problem]


def misfit(problem: Problem) -> float:
    """Median squared distance per number of the poses on the drawing; 1 or less is right."""
    near, found = poses_of_readings(problem)
    if found.sum() < max(4, len(problem) // 3):
        return np.inf
    try:
        start = find_start(problem, near, found, robust=False)
        _, distance = place_instrument(problem, start, iterations=3)
    except np.linalg.LinAlgError:
        return np.inf
    return float(np.median(distance[found])) / problem.rows(start)[0].errors.shape[1]


def likely_mistake(problem: Problem) -> str | None:
    """Name the mistake that explains data which do not fit, or None."""
    step = max(1, len(problem) // LOOKED_AT)
    asked = misfit(problem[::step])
    fits: list[tuple[float, str]] = []
    for name, undo in _mistakes(problem):
        try:
            tried = misfit(undo(problem)[::step])
        except (np.linalg.LinAlgError, ValueError):
            continue
        if tried < min(FAR, asked / CLEARER):
            fits.append((tried, name))
    if not fits:
        return None
    best = min(fits)[0]  # on a symmetric machine several explain the data equally well
    return " or ".join(name for fit, name in sorted(fits) if fit < ALIKE * best)


def _mistakes(problem: Problem) -> Iterator[tuple[str, Undo]]:
    sensor = problem.sensor
    if isinstance(sensor, PoseSensor):
        yield "the poses are inverse: measuring frame in tool coordinates", _sensor(_inverse)
        yield "the rotations are transposed", _sensor(_transposed)
        yield "the Euler angles are in another order (Rz Ry Rx, roll-pitch-yaw)", _sensor(_rpy)
        yield "the quaternions are in the order x, y, z, w", _sensor(_xyzw)
        yield "the measuring frame is left-handed (mirrored)", _sensor(_mirrored)
        yield "angles in degrees are given as radians, or the reverse", _sensor(_degrees)
    if isinstance(sensor, TargetSensor):
        yield "the measuring frame is left-handed (mirrored)", _sensor(_mirrored_points)
    for text, factor in UNITS.items():
        yield f"lengths are measured in {text}", _sensor(lambda s, k=factor: _scaled(s, k))
        if not problem.parameters.rotary:
            yield f"the legs are read in {text}", _legs(lambda x, k=factor: x * k)
    for shift, side in ((1, "behind"), (-1, "ahead of")):
        yield f"the measurements are one row {side} the readings", _rows(shift)
    for i, j in combinations(range(6), 2):
        order = np.arange(6)
        order[[i, j]] = order[[j, i]]
        yield f"legs {i + 1} and {j + 1} are swapped", _legs(lambda x, o=order: x[:, o])
    for shift in range(1, 6):
        yield (
            f"the legs are numbered from another one: column leg_1 belongs to leg {shift + 1}",
            _legs(lambda x, k=shift: np.roll(x, k, axis=1)),
        )
    yield "the legs are numbered the other way round", _legs(lambda x: x[:, ::-1])
    if problem.parameters.rotary:
        yield "motor angles are in degrees", _legs(np.radians)


def _sensor(change: Callable[[Sensor], Sensor]) -> Undo:
    return lambda problem: replace(problem, sensor=change(problem.sensor))


def _legs(change: Callable) -> Undo:
    return lambda problem: replace(problem, legs=change(problem.legs))


def _rows(shift: int) -> Undo:
    def undo(problem: Problem) -> Problem:
        keep, other = (slice(shift, None), slice(None, -shift))
        if shift < 0:
            keep, other = slice(None, shift), slice(-shift, None)
        return replace(problem, sensor=problem.sensor[keep], legs=problem.legs[other])

    return undo


def _with(sensor: Sensor, R: np.ndarray, t: np.ndarray | None = None) -> PoseSensor:
    assert isinstance(sensor, PoseSensor)
    return replace(sensor, pose=Rigid(R, sensor.pose.t if t is None else t))


def _inverse(sensor: Sensor) -> Sensor:
    back = sensor.pose.inverse()  # pyright: ignore[reportAttributeAccessIssue]
    return _with(sensor, back.R, back.t)


def _transposed(sensor: Sensor) -> Sensor:
    return _with(sensor, np.swapaxes(sensor.pose.R, 1, 2))  # pyright: ignore[reportAttributeAccessIssue]


def _rpy(sensor: Sensor) -> Sensor:
    pose = sensor.pose.pose()  # pyright: ignore[reportAttributeAccessIssue]
    return _with(sensor, Pose.from_rpy(pose.position, pose.euler).rotation)


def _xyzw(sensor: Sensor) -> Sensor:
    pose = sensor.pose.pose()  # pyright: ignore[reportAttributeAccessIssue]
    return _with(sensor, Pose(pose.position, np.roll(pose.wxyz, 1, axis=-1)).rotation)


def _mirrored(sensor: Sensor) -> Sensor:
    flip = np.array([1.0, -1.0, 1.0])
    pose = sensor.pose  # pyright: ignore[reportAttributeAccessIssue]
    return _with(sensor, flip[:, None] * pose.R * flip, pose.t * flip)


def _degrees(sensor: Sensor) -> Sensor:
    pose = sensor.pose.pose()  # pyright: ignore[reportAttributeAccessIssue]
    return _with(sensor, Pose.from_euler(pose.position, np.radians(pose.euler)).rotation)


def _mirrored_points(sensor: Sensor) -> Sensor:
    assert isinstance(sensor, TargetSensor)
    return replace(sensor, points=sensor.points * [1.0, -1.0, 1.0])


def _scaled(sensor: Sensor, factor: float) -> Sensor:
    if isinstance(sensor, PoseSensor):
        return _with(sensor, sensor.pose.R, sensor.pose.t * factor)
    if isinstance(sensor, TargetSensor):
        return replace(sensor, points=sensor.points * factor)
    if isinstance(sensor, DistanceSensor):
        return replace(sensor, distances=sensor.distances * factor)
    assert isinstance(sensor, InclinometerSensor)
    return sensor

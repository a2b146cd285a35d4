"""Likely mistakes in measurements that fit no machine, such as another order of Euler angles.

Each is undone in turn, the instrument is placed on the drawing again, and the one without which the
measurements fit is named. Nothing is corrected silently.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from gough import quaternion
from gough.calibration.estimate import Problem, place_instrument, poses_of_readings
from gough.calibration.residuals import Rigid
from gough.calibration.robust import find_start
from gough.calibration.sensors import (
    OrientationSensor,
    PoseSensor,
    ReadingsSensor,
    Sensor,
    TargetSensor,
)
from gough.pose import Pose

LOOKED_AT = 40  # poses used in the search
ENOUGH = 6  # iterations with which data that fit are placed
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
        start = find_start(problem, near, found, robust=False, iterations=ENOUGH)
        _, distance = place_instrument(problem, start, iterations=3)
    except np.linalg.LinAlgError:
        return np.inf
    return float(np.median(distance[found])) / problem.numbers


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
        yield (
            "the poses are inverse: measuring frame in tool coordinates",
            _poses(lambda p: p.inverse()),
        )
    if isinstance(sensor, (PoseSensor, OrientationSensor)):
        yield (
            "the rotations are transposed",
            _poses(lambda p: Pose(p.position, quaternion.conjugate(p.wxyz))),
        )
        yield (
            "the Euler angles are in another order (Rz Ry Rx, roll-pitch-yaw)",
            _poses(lambda p: Pose.from_rpy(p.position, p.euler)),
        )
        yield (
            "the quaternions are in the order x, y, z, w",
            _poses(lambda p: Pose(p.position, np.roll(p.wxyz, 1, axis=-1))),
        )
        yield "the measuring frame is left-handed (mirrored)", _poses(_mirrored)
        yield (
            "angles in radians stand in columns of degrees",
            _poses(lambda p: Pose.from_euler(p.position, np.degrees(p.euler))),
        )
        yield (
            "angles in degrees stand in columns of radians",
            _poses(lambda p: Pose.from_euler(p.position, np.radians(p.euler))),
        )
    if isinstance(sensor, TargetSensor):
        yield (
            "the measuring frame is left-handed (mirrored)",
            _sensor(lambda s: replace(s, values=s.values * FLIP)),
        )
    for text, factor in UNITS.items():
        if sensor.kind not in ("inclinometer", "orientation"):
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


def _sensor(change: Callable[[Any], Sensor]) -> Undo:
    return lambda problem: replace(problem, sensor=change(problem.sensor))


def _poses(change: Callable[[Pose], Pose]) -> Undo:
    """Change what a pose or orientation sensor measured."""

    def changed(sensor: PoseSensor | OrientationSensor) -> Sensor:
        if isinstance(sensor, PoseSensor):
            return replace(sensor, pose=Rigid.of(change(sensor.pose.pose())))
        turned = change(Pose.from_rotation(np.zeros(3), sensor.values))
        return replace(sensor, values=turned.rotation)

    return _sensor(changed)


def _legs(change: Callable) -> Undo:
    return lambda problem: replace(problem, legs=change(problem.legs))


def _rows(shift: int) -> Undo:
    def undo(problem: Problem) -> Problem:
        keep, other = (slice(shift, None), slice(None, -shift))
        if shift < 0:
            keep, other = slice(None, shift), slice(-shift, None)
        return replace(problem, sensor=problem.sensor[keep], legs=problem.legs[other])

    return undo


FLIP = np.array([1.0, -1.0, 1.0])


def _mirrored(pose: Pose) -> Pose:
    return Pose(pose.position * FLIP, pose.wxyz * [1.0, -1.0, 1.0, -1.0])


def _scaled(sensor: Sensor, factor: float) -> Sensor:
    if isinstance(sensor, PoseSensor):
        return replace(sensor, pose=Rigid(sensor.pose.R, sensor.pose.t * factor))
    assert isinstance(sensor, ReadingsSensor)
    return replace(sensor, values=sensor.values * factor)

"""Check what a caller of `gough.calibrate` states, and make an instrument of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough.calibration.arrays import Array
from gough.calibration.kinds import KINDS
from gough.calibration.placements import Bars, Frames, Level, Rotations, Targets
from gough.calibration.residuals import Rigid
from gough.calibration.sensors import (
    DistanceSensor,
    InclinometerSensor,
    OrientationSensor,
    PoseSensor,
    Sensor,
    TargetSensor,
)
from gough.checks import as_batch
from gough.errors import GoughError
from gough.pose import Pose, as_pose

SHAPES = {"position": "(n, 3)", "targets": "(n, k, 3)", "distances": "(n, k)",
          "inclinometer": "(n, 2)"}  # fmt: skip


def check_sigma(name: str, value: float) -> float:
    """A standard deviation, above zero and finite.

    Raises:
        GoughError: it is not.
    """
    if not 0 < value < np.inf:
        raise GoughError(f"{name}: expected a standard deviation above 0, found {value!r}")
    return float(value)


def check_kind(kind: str) -> None:
    """Raise if `kind` is none of `KINDS`.

    Raises:
        GoughError: it is not.
    """
    if kind not in KINDS:
        raise GoughError(f"kind: expected one of {', '.join(KINDS)}; found {kind!r}")


def as_sensor(
    kind: str, measured: Any, sigma: Any, pivot: ArrayLike
) -> tuple[Sensor, NDArray[np.bool_]]:
    """The instrument with all rows, and which of them (n,) hold numbers throughout.

    Args:
        sigma: as for `gough.calibrate`.
        pivot: (3,) point about which measured poses rotate.

    Raises:
        GoughError: another shape, standard deviations that are none.
    """
    if kind in ("pose", "orientation"):
        return _pose_sensor(kind, measured, sigma, np.asarray(pivot, dtype=np.float64))
    values = as_batch("measured", measured, () if kind == "distances" else (SIZES[kind],))
    if values.ndim != SHAPES[kind].count(",") + 1 or values.size == 0:
        raise GoughError(f"measured: expected {SHAPES[kind]} for {kind}, got {values.shape}")
    if kind == "targets" and values.shape[1] < 2:
        raise GoughError("measured: one target is kind 'position'; expected two or more")
    good = np.all(np.isfinite(values.reshape(len(values), -1)), axis=1)
    noise = _noise(sigma, len(values), 1, good)[:, 0]
    if kind == "position":
        return TargetSensor(values[:, None], noise), good
    if kind == "targets":
        return TargetSensor(values, noise), good
    if kind == "distances":
        return DistanceSensor(values, noise), good
    return InclinometerSensor(np.sin(values), noise), good


SIZES = {"position": 3, "targets": 3, "inclinometer": 2}  # numbers of the last axis


def _pose_sensor(
    kind: str, measured: Any, sigma: Any, pivot: Array
) -> tuple[Sensor, NDArray[np.bool_]]:
    pose = as_pose(measured)
    if len(pose.batch) != 1:
        raise GoughError(f"measured: expected poses (n), found batch axes {pose.batch}")
    good = np.all(np.isfinite(pose.position), -1) & np.all(np.isfinite(pose.wxyz), -1)
    filled = Pose(np.where(good[:, None], pose.position, 0), np.where(good[:, None], pose.wxyz, 1))
    if kind == "orientation":
        return OrientationSensor(filled.rotation, _noise(sigma, len(good), 1, good)[:, 0]), good
    return PoseSensor(Rigid.of(filled, pivot), _noise(sigma, len(good), 2, good)), good


def _noise(sigma: Any, rows: int, columns: int, good: NDArray[np.bool_]) -> Array:
    """Standard deviations (rows, columns), whether stated once or for each row.

    A row without any is marked in `good` as one that does not count.
    """
    stated = as_batch("sigma", sigma, ())
    once = (2,) if columns == 2 else ()
    if stated.shape not in (once, (rows, *once)):
        what = "a pair, of position and of rotation [rad]" if columns == 2 else "one number"
        raise GoughError(f"sigma: expected {what}, or as many for each of the {rows} rows; "
                         f"got {stated.shape or stated}")  # fmt: skip
    out = np.array(np.broadcast_to(stated.reshape(-1, columns), (rows, columns)))
    if stated.shape == once:
        for i, value in enumerate(np.ravel(stated)):
            check_sigma(f"sigma[{i}]" if columns == 2 else "sigma", float(value))
        return out
    good &= ~np.any(np.isnan(out), axis=1)
    wrong = np.argwhere(~(out > 0) & good[:, None])
    if len(wrong):
        check_sigma(f"sigma, row {wrong[0, 0] + 1}", float(out[tuple(wrong[0])]))
    return np.where(good[:, None], out, 1.0)


def known_place(
    kind: str, sensor: Any, targets: Any, stations: Any, free: bool
) -> Frames | Targets | Bars | Level | None:
    """The placement that the caller states, or None where it is to be found.

    Raises:
        GoughError: another number of points, points that are missing or not used.
    """
    points = None if targets is None else as_batch("targets", targets, (3,)).reshape(-1, 3)
    ends = None if stations is None else as_batch("stations", stations, (3,)).reshape(-1, 3)
    used = {"targets": ("position", "targets", "distances"), "stations": ("distances",)}
    for name, value in (("targets", points), ("stations", ends)):
        if value is None:
            continue
        if kind not in used[name]:
            raise GoughError(f"{name}: not used for kind {kind!r}; leave them out")
        if len(value) != sensor.values.shape[1]:
            raise GoughError(
                f"{name}: expected {sensor.values.shape[1]} points, found {len(value)}"
            )
    if kind == "distances":
        if points is not None and ends is not None:
            return Bars(ends, points)
        if not free:
            raise GoughError("targets, stations: needed for distances with known frames")
        if points is not None or ends is not None:
            raise GoughError("targets, stations: expected both for distances, or neither")
        return None
    if free:
        return None
    here = Rigid.identity()
    if kind == "pose":
        return Frames(here, here)
    if kind == "orientation":
        return Rotations(here, here)
    if kind == "inclinometer":
        return Level(np.array([0.0, 0.0, 1.0]), np.eye(3))
    return Targets(here, np.zeros((sensor.values.shape[1], 3)) if points is None else points)

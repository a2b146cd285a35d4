"""First placements of an instrument, found before anything else is known, to be refined.

The readings and the drawing give poses X_k that are off by the drawing's errors only. Several
closed forms then place the instrument; the caller refines each and keeps the best.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Any

import numpy as np

from gough.calibration.arrays import Array
from gough.calibration.placements import Bars, Frames, Level, Rotations, Targets
from gough.calibration.residuals import Rigid
from gough.calibration.sensors import (
    DistanceSensor,
    InclinometerSensor,
    OrientationSensor,
    PoseSensor,
    TargetSensor,
)


@singledispatch
def candidates(sensor: Any, pose: Rigid) -> list[Any]:
    """First placements of an instrument that measured the poses X (n)."""
    raise NotImplementedError(type(sensor))


@candidates.register
def _(sensor: PoseSensor, pose: Rigid) -> list[Frames]:
    """Hand-eye calibration R_M R_H = R_F R_X, t_M + R_M t_H = R_F t_X + t_F, in two ways.

    By the singular vectors of the sum of R_X (x) R_M, which needs rotations; and by the rotation
    that turns the positions of X into those of M, which needs translations.
    """
    measured = sensor.pose
    turns = _turns_by_rotations(pose.R, measured.R)
    frame = _turn_between(pose.t, measured.t)
    tool = nearest_rotation(np.sum(np.swapaxes(measured.R, 1, 2) @ frame @ pose.R, axis=0))
    turns.append((frame, tool))
    return [Frames(*_positions(pose, measured, *turn)) for turn in turns]


def _turns_by_rotations(pose: Array, measured: Array) -> list[tuple[Array, Array]]:
    """R_F and R_H with R_M R_H = R_F R_X, from rotations (n, 3, 3) alone."""
    K = np.einsum("nij,nkl->ikjl", pose, measured).reshape(9, 9)
    u, _, vt = np.linalg.svd(K)
    turns = []
    for sign in (1, -1):
        frame, tool = (sign * u[:, 0]).reshape(3, 3).T, (sign * vt[0]).reshape(3, 3).T
        if np.linalg.det(frame) > 0:
            turns.append((nearest_rotation(frame), nearest_rotation(tool)))
    return turns


def _positions(pose: Rigid, measured: Rigid, frame: Array, tool: Array) -> tuple[Rigid, Rigid]:
    """t_F and t_H by least squares, given both rotations; the smallest where they are not fixed."""
    rows = np.zeros((len(pose.t), 3, 6))
    rows[:, :, :3], rows[:, :, 3:] = np.eye(3), -measured.R
    right = measured.t - pose.t @ frame.T
    z = np.linalg.lstsq(rows.reshape(-1, 6), right.ravel(), rcond=1e-4)[0]
    return Rigid(frame, z[:3]), Rigid(tool, z[3:])


@candidates.register
def _(sensor: OrientationSensor, pose: Rigid) -> list[Rotations]:
    here = np.zeros(3)
    turns = _turns_by_rotations(pose.R, sensor.values)
    return [Rotations(Rigid(frame, here), Rigid(tool, here)) for frame, tool in turns]


@candidates.register
def _(sensor: TargetSensor, pose: Rigid) -> list[Targets]:
    points = sensor.values
    turns = [_turn_between(pose.t, points.mean(axis=1))]
    if points.shape[1] >= 3:
        body = _body_poses(points)
        turns += [place.frame.R for place in candidates(PoseSensor(body, (1.0, 1.0)), pose)]
    elif len(points) > 13:
        turns.append(_turn_by_products(pose, points[:, 0]))
    return [_place_targets(pose, points, turn) for turn in turns]


def _place_targets(pose: Rigid, points: Array, turn: Array) -> Targets:
    """t_F and targets g with y = R_F (R_X g + t_X) + t_F, given R_F."""
    n, k = points.shape[:2]
    rows = np.zeros((n, k, 3, 3 + 3 * k))
    rows[..., :3] = np.eye(3)
    for j in range(k):
        rows[:, j, :, 3 + 3 * j : 6 + 3 * j] = turn @ pose.R
    right = points - (pose.t @ turn.T)[:, None]
    z = np.linalg.lstsq(rows.reshape(-1, 3 + 3 * k), right.ravel(), rcond=1e-4)[0]
    return Targets(Rigid(turn, z[:3]), z[3:].reshape(k, 3))


def _turn_by_products(pose: Rigid, point: Array) -> Array:
    """R_F from y = R_F t_X + t_F + (R_F (x) g) vec R_X, linear in 13 numbers an axis."""
    columns = [pose.t, np.ones((len(point), 1)), pose.R.reshape(-1, 9)]
    rows = np.concatenate(columns, axis=1)
    return nearest_rotation(np.linalg.lstsq(rows, point, rcond=1e-6)[0][:3].T)


def _body_poses(points: Array) -> Rigid:
    """The motion (n) of three or more targets (n, k, 3) from their places in the first pose."""
    first = points[0] - points[0].mean(axis=0)
    centre = points.mean(axis=1, keepdims=True)
    turns = np.stack([nearest_rotation(p.T @ first) for p in points - centre])
    return Rigid(turns, centre[:, 0] - turns @ points[0].mean(axis=0))


@candidates.register
def _(sensor: DistanceSensor, pose: Rigid) -> list[Bars]:
    """Squared distances |R g + t - a|^2 are linear in a, g, their products and the rest.

    Twice: for the target in the platform's origin (4 unknowns), and for any (16 unknowns).
    """
    simple, full = [], []
    square = np.sum(pose.t**2, axis=1)
    ones = np.ones((len(square), 1))
    seen = np.einsum("nji,nj->ni", pose.R, pose.t)
    for d in sensor.values.T:
        right = d**2 - square
        z = _scaled_least_squares(np.concatenate([-2 * pose.t, ones], axis=1), right)
        simple.append((z[:3], np.zeros(3)))
        rows = np.concatenate([-2 * pose.t, 2 * seen, -2 * pose.R.reshape(-1, 9), ones], axis=1)
        z = _scaled_least_squares(rows, right)
        full.append((z[:3], z[3:6]))
    starts = [simple, full] if len(square) > 16 else [simple]
    return [Bars(*(np.array(x) for x in zip(*start, strict=True))) for start in starts]


def _scaled_least_squares(rows: Array, right: Array) -> Array:
    scale = np.linalg.norm(rows, axis=0)
    scale[scale == 0] = 1
    return np.linalg.lstsq(rows / scale, right, rcond=1e-6)[0] / scale


@candidates.register
def _(sensor: InclinometerSensor, pose: Rigid) -> list[Level]:
    """R_X Q a = u for the vertical a that the instrument sees: a null vector of 12 numbers."""
    sines = sensor.values
    up = np.sqrt(np.maximum(1 - np.sum(sines**2, axis=1), 0))
    seen = np.concatenate([sines, up[:, None]], axis=1)
    rows = np.concatenate(
        [
            np.einsum("nij,nk->nijk", pose.R, seen).reshape(-1, 3, 9),
            np.broadcast_to(-np.eye(3), pose.R.shape),
        ],
        axis=2,
    )
    z = np.linalg.svd(rows.reshape(-1, 12), full_matrices=False)[2][-1]
    found = [Level(np.array([0.0, 0.0, 1.0]), np.eye(3))]
    for sign in (1, -1):
        mount = sign * z[:9].reshape(3, 3)
        length = np.linalg.norm(z[9:])
        if np.linalg.det(mount) > 0 and length > 0:
            found.append(Level(sign * z[9:] / length, nearest_rotation(mount)))
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    found += [Level(found[0].up, np.linalg.matrix_power(quarter, k)) for k in (1, 2, 3)]
    return found


def _turn_between(a: Array, b: Array) -> Array:
    """The rotation that turns points a (n, 3) into b (n, 3), their centres aside."""
    return nearest_rotation((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)))


def nearest_rotation(matrix: Array) -> Array:
    """The rotation (3, 3) closest to a matrix (Kabsch 1976)."""
    u, _, vt = np.linalg.svd(matrix)
    return (u * [1, 1, np.linalg.det(u) * np.linalg.det(vt)]) @ vt

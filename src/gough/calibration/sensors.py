"""Instruments: what each measures of a pose, and where it may stand.

An instrument has a placement: where its frame, targets or stations are. Those numbers are unknown
unless the frames are, and are fitted beside the machine's. Twists act from the left, as in
`gough.calibration.residuals`; X is the pose of the platform in base coordinates.

A full pose is compared with the struts directly. Any other instrument is compared with the pose
that the readings have, X(legs; values): its derivative by the parameters follows from the struts,

    dX = -(de/dX)^-1 (de/dvalues dvalues + de/dreading dreading),

which also says what noise of the readings does to it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from gough.calibration.arrays import Array
from gough.calibration.parameters import Parameters
from gough.calibration.residuals import Rigid, Struts, exp_rotation, forward, struts
from gough.errors import GoughError
from gough.pose import Pose

KINDS = ("pose", "position", "targets", "distances", "inclinometer")


@dataclass(frozen=True)
class Rows:
    """Weighted least squares of n poses with m numbers each, before the weights.

    Attributes:
        errors: (n, m).
        legs: (n, m, 6 K) derivatives by the parameters of the legs.
        place: (n, m, c) derivatives by the placement.
        covariance: (n, m, m) of the errors: instrument and readings.
    """

    errors: Array
    legs: Array
    place: Array
    covariance: Array


class Sensor(Protocol):
    """An instrument and what it measured in n poses."""

    kind: str

    def rows(
        self, parameters: Parameters, values: Array, place: Any, legs: Array, leg_sigma: float,
        near: Rigid,
    ) -> tuple[Rows, Rigid]: ...  # fmt: skip

    def sensitivity(self, place: Any, pose: Rigid) -> tuple[Array, Array]: ...

    def difference(self, a: tuple[Any, Rigid], b: tuple[Any, Rigid]) -> Array: ...

    def __getitem__(self, rows: Any) -> Sensor: ...

    def __len__(self) -> int: ...


# ---- placements -----------------------------------------------------------------------


@dataclass(frozen=True)
class Frames:
    """The measuring frame (base to measuring) and the tool (platform to tool): 12 numbers."""

    frame: Rigid
    tool: Rigid
    count = 12

    def moved(self, step: Array) -> Frames:
        """After a step (12,)."""
        return Frames(self.frame.moved(step[:6]), self.tool.moved(step[6:]))


@dataclass(frozen=True)
class Targets:
    """The measuring frame, and targets (k, 3) in platform coordinates: 6 + 3 k numbers."""

    frame: Rigid
    points: Array

    @property
    def count(self) -> int:
        return 6 + self.points.size

    def moved(self, step: Array) -> Targets:
        return Targets(
            self.frame.moved(step[:6]), self.points + step[6:].reshape(self.points.shape)
        )


@dataclass(frozen=True)
class Bars:
    """Stations (k, 3) in base and targets (k, 3) in platform coordinates: 6 k numbers."""

    stations: Array
    points: Array

    @property
    def count(self) -> int:
        return 2 * self.points.size

    def moved(self, step: Array) -> Bars:
        a, b = step.reshape(2, *self.points.shape)
        return Bars(self.stations + a, self.points + b)


@dataclass(frozen=True)
class Level:
    """The vertical in base coordinates and the instrument's axes on the platform: 5 numbers."""

    up: Array  # (3,)
    mount: Array  # (3, 3): instrument to platform
    count = 5

    def tangents(self) -> Array:
        """Two directions (2, 3) in which the vertical can lean."""
        return np.linalg.svd(self.up[None])[2][1:]

    def moved(self, step: Array) -> Level:
        up = self.up + step[:2] @ self.tangents()
        return Level(up / np.linalg.norm(up), exp_rotation(step[2:]) @ self.mount)


# ---- instruments ----------------------------------------------------------------------


@dataclass(frozen=True)
class PoseSensor:
    """Poses (n) of a tool in a measuring frame; noise of position [unit] and rotation [rad]."""

    pose: Rigid
    sigma: tuple[float, float]
    kind = "pose"

    def __len__(self) -> int:
        return len(self.pose.t)

    def __getitem__(self, rows) -> PoseSensor:
        return replace(self, pose=self.pose[rows])

    def rows(self, parameters, values, place, legs, leg_sigma, near) -> tuple[Rows, Rigid]:
        found = struts(parameters, values, legs, self.pose, place.frame, place.tool)
        n, k = len(legs), parameters.count
        own = np.zeros((n, 6, 6, k))
        own[:, range(6), range(6)] = found.legs
        scaled = found.twist * np.repeat(self.sigma, 3)
        covariance = scaled @ np.swapaxes(scaled, 1, 2)
        covariance[:, range(6), range(6)] += (found.reading * leg_sigma) ** 2
        place_columns = np.concatenate([found.frame, found.tool], axis=-1)
        return Rows(found.errors, own.reshape(n, 6, 6 * k), place_columns, covariance), near

    def difference(self, a: tuple[Frames, Rigid], b: tuple[Frames, Rigid]) -> Array:
        """Measured pose at placement and pose a minus that at b: position, rotation vector."""
        one, other = (place.frame @ pose @ place.tool.inverse() for place, pose in (a, b))
        turn = Pose.from_rotation(one.t, one.R @ np.swapaxes(other.R, 1, 2)).rotation_vector
        return np.concatenate([one.t - other.t, turn], axis=-1)

    def sensitivity(self, place: Frames, pose: Rigid) -> tuple[Array, Array]:
        """Twist of the measured pose (n, 6, .) by twist of X (6) and by the placement (12)."""
        F, H = place.frame, place.tool
        origin = pose.R @ H.inverse().t  # the tool's origin from the platform's, base axes
        by_pose = np.broadcast_to(_adjoint(F.R, -F.R @ _skew(origin)), (len(pose.t), 6, 6))
        there = (origin + pose.t) @ F.R.T
        by_frame = _adjoint(np.broadcast_to(np.eye(3), pose.R.shape), -_skew(there))
        turn = F.R @ pose.R @ H.R.T
        by_tool = -_adjoint(turn, turn @ _skew(H.t))
        return by_pose, np.concatenate([by_frame, by_tool], axis=-1)


class _ThroughReadings:
    """Instruments that are compared with the pose that the readings have."""

    def difference(self, a: tuple[Any, Rigid], b: tuple[Any, Rigid]) -> Array:
        """Difference of the measurements at placements and poses a and b, (n, m)."""
        return self.predicted(*a) - self.predicted(*b)

    def predicted(self, place, pose: Rigid) -> Array:
        raise NotImplementedError

    def measured(self) -> Array:
        raise NotImplementedError

    def variance(self) -> float:
        raise NotImplementedError

    def sensitivity(self, place, pose: Rigid) -> tuple[Array, Array]:
        raise NotImplementedError

    def rows(self, parameters, values, place, legs, leg_sigma, near) -> tuple[Rows, Rigid]:
        pose, found = forward(parameters, values, legs, near)
        by_pose, by_place = self.sensitivity(place, pose)
        per_error, own = through_struts(by_pose, found)
        errors = self.predicted(place, pose) - self.measured()
        noisy = per_error * (found.reading * leg_sigma)[:, None]
        covariance = noisy @ np.swapaxes(noisy, 1, 2)
        covariance[:, range(errors.shape[1]), range(errors.shape[1])] += self.variance()
        return Rows(errors, own, by_place, covariance), pose


def through_struts(by_pose: Array, found: Struts) -> tuple[Array, Array]:
    """Derivatives (n, m, .) by strut errors and by the legs' parameters, from those by the pose."""
    per_error = -by_pose @ np.linalg.inv(found.twist)
    own = per_error[..., None] * found.legs[:, None]
    return per_error, own.reshape(*own.shape[:2], -1)


@dataclass(frozen=True)
class TargetSensor(_ThroughReadings):
    """Positions (n, k, 3) of k targets on the platform, in a measuring frame; noise [unit]."""

    points: Array
    sigma: float

    @property
    def kind(self) -> str:
        return "position" if self.points.shape[1] == 1 else "targets"

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, rows) -> TargetSensor:
        return replace(self, points=self.points[rows])

    def measured(self) -> Array:
        return self.points.reshape(len(self), -1)

    def variance(self) -> float:
        return self.sigma**2

    def predicted(self, place: Targets, pose: Rigid) -> Array:
        at = place.points @ np.swapaxes(pose.R, -1, -2) + pose.t[:, None]
        return (at @ place.frame.R.T + place.frame.t).reshape(len(pose.t), -1)

    def sensitivity(self, place: Targets, pose: Rigid) -> tuple[Array, Array]:
        n, k = len(pose.t), len(place.points)
        F = place.frame.R
        lever = place.points @ np.swapaxes(pose.R, -1, -2)  # (n, k, 3)
        by_pose = np.empty((n, k, 3, 6))
        by_pose[..., :3], by_pose[..., 3:] = F, -F @ _skew(lever)
        by_place = np.zeros((n, k, 3, 6 + 3 * k))
        by_place[..., :3] = np.eye(3)
        by_place[..., 3:6] = -_skew((lever + pose.t[:, None]) @ F.T)
        for j in range(k):
            by_place[:, j, :, 6 + 3 * j : 9 + 3 * j] = F @ pose.R
        return by_pose.reshape(n, 3 * k, 6), by_place.reshape(n, 3 * k, -1)


@dataclass(frozen=True)
class DistanceSensor(_ThroughReadings):
    """Distances (n, k) from stations on the base to targets on the platform; noise [unit]."""

    distances: Array
    sigma: float
    kind = "distances"

    def __len__(self) -> int:
        return len(self.distances)

    def __getitem__(self, rows) -> DistanceSensor:
        return replace(self, distances=self.distances[rows])

    def measured(self) -> Array:
        return self.distances

    def variance(self) -> float:
        return self.sigma**2

    def predicted(self, place: Bars, pose: Rigid) -> Array:
        return np.linalg.norm(self._bars(place, pose)[0], axis=-1)

    def sensitivity(self, place: Bars, pose: Rigid) -> tuple[Array, Array]:
        bars, lever = self._bars(place, pose)
        n = bars / np.sqrt(np.sum(bars**2, axis=-1, keepdims=True))
        count, k = len(pose.t), len(place.points)
        by_place = np.zeros((count, k, 2, k, 3))
        by_place[:, range(k), 0, range(k)] = -n
        by_place[:, range(k), 1, range(k)] = n @ pose.R
        return np.concatenate([n, np.cross(lever, n)], -1), by_place.reshape(count, k, 6 * k)

    @staticmethod
    def _bars(place: Bars, pose: Rigid) -> tuple[Array, Array]:
        lever = place.points @ np.swapaxes(pose.R, -1, -2)
        return lever + pose.t[:, None] - place.stations, lever


@dataclass(frozen=True)
class InclinometerSensor(_ThroughReadings):
    """Sines (n, 2) of the angles of an instrument's x and y axes above the horizontal."""

    sines: Array
    sigma: float
    kind = "inclinometer"

    def __len__(self) -> int:
        return len(self.sines)

    def __getitem__(self, rows) -> InclinometerSensor:
        return replace(self, sines=self.sines[rows])

    def measured(self) -> Array:
        return self.sines

    def variance(self) -> float:
        return self.sigma**2

    def predicted(self, place: Level, pose: Rigid) -> Array:
        return (place.up @ pose.R @ place.mount)[:, :2]

    def sensitivity(self, place: Level, pose: Rigid) -> tuple[Array, Array]:
        # y = E Q^T R^T u; R -> exp(w) R changes R^T u by R^T (u x w), Q likewise
        back = np.swapaxes(pose.R @ place.mount, 1, 2)[:, :2]
        by_pose = np.zeros((len(pose.t), 2, 6))
        by_pose[..., 3:] = back @ _skew(place.up)
        seen = place.up @ pose.R  # the vertical in platform coordinates, (n, 3)
        by_mount = place.mount.T[:2] @ _skew(seen)
        return by_pose, np.concatenate([back @ place.tangents().T, by_mount], axis=-1)


def _skew(v: Array) -> Array:
    """Matrices (..., 3, 3) with S x = v x x."""
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return out - np.swapaxes(out, -1, -2)


def _adjoint(turn: Array, corner: Array) -> Array:
    """Matrices (..., 6, 6) [[turn, corner], [0, turn]]."""
    shape = np.broadcast_shapes(turn.shape, corner.shape)[:-2]
    out = np.zeros((*shape, 6, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = turn
    out[..., :3, 3:] = corner
    return out


def check_sigma(name: str, value: float) -> float:
    """A standard deviation, above zero and finite.

    Raises:
        GoughError: it is not.
    """
    if not 0 < value < np.inf:
        raise GoughError(f"{name}: expected a standard deviation above 0, found {value!r}")
    return float(value)

"""Instruments: what each measures of a pose X of the platform in base coordinates.

A full pose is compared with the struts directly. Any other instrument is compared with the pose
that the readings have, X(legs; values): its derivative by the parameters follows from the struts,

    dX = -(de/dX)^-1 (de/dvalues dvalues + de/dreading dreading),

which also says what noise of the readings does to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from gough.calibration.arrays import Array
from gough.calibration.parameters import Parameters
from gough.calibration.placements import Bars, Frames, Level, Targets
from gough.calibration.residuals import Rigid, forward, struts
from gough.quaternion import from_matrix, to_rotation_vector


@dataclass(frozen=True)
class Rows:
    """Least squares of n poses with m errors each, before they are weighted.

    A parameter acts on the strut of its own leg alone, so the derivatives by the parameters are
    kept in two factors.

    Attributes:
        errors: (n, m).
        by_strut: (n, m, 6) derivatives by the errors of the struts.
        struts: (n, 6, K) derivatives of each strut's error by the parameters of its leg.
        place: (n, m, c) derivatives by the placement.
        covariance: (n, m, m) of the errors: instrument and readings.
    """

    errors: Array
    by_strut: Array
    struts: Array
    place: Array
    covariance: Array

    @property
    def legs(self) -> Array:
        """(n, m, 6 K) derivatives by the parameters of the legs."""
        return per_leg(self.by_strut, self.struts)

    def covariance_of(self, tolerance: Array) -> Array:
        """(n, m, m) covariance that parameters with standard deviations (6, K) add."""
        loose = np.sqrt(np.sum((self.struts * tolerance) ** 2, axis=-1))
        return _squared(self.by_strut * loose[:, None])


def per_leg(by_strut: Array, struts: Array) -> Array:
    """The product (n, m, 6 K) of derivatives (n, m, 6) by struts with theirs (n, 6, K) by legs."""
    out = by_strut[..., None] * struts[:, None]
    return out.reshape(*out.shape[:2], -1)


def _squared(matrix: Array) -> Array:
    """M M^T of matrices (..., m, k)."""
    return matrix @ np.swapaxes(matrix, -1, -2)


class Sensor(Protocol):
    """An instrument and the m numbers that it measured in each of n poses."""

    @property
    def kind(self) -> str: ...

    @property
    def numbers(self) -> int: ...

    def rows(
        self, parameters: Parameters, values: Array, place: Any, legs: Array, leg_sigma: float,
        near: Rigid,
    ) -> tuple[Rows, Rigid]: ...  # fmt: skip

    def sensitivity(self, place: Any, pose: Rigid) -> tuple[Array, Array]: ...

    def difference(self, a: tuple[Any, Rigid], b: tuple[Any, Rigid]) -> Array: ...

    def __getitem__(self, rows: Any) -> Sensor: ...

    def __len__(self) -> int: ...


@dataclass(frozen=True)
class PoseSensor:
    """Poses (n) of a tool in a measuring frame.

    Attributes:
        pose: what was measured.
        sigma: (2,) or (n, 2) noise of position [platform unit] and of rotation [rad].
    """

    pose: Rigid
    sigma: Any
    kind = "pose"
    numbers = 6

    def __len__(self) -> int:
        return len(self.pose.t)

    def __getitem__(self, rows) -> PoseSensor:
        return PoseSensor(self.pose[rows], np.broadcast_to(self.sigma, (len(self), 2))[rows])

    def rows(self, parameters, values, place, legs, leg_sigma, near) -> tuple[Rows, Rigid]:
        found = struts(parameters, values, legs, self.pose, place.frame, place.tool)
        noise = np.repeat(np.broadcast_to(self.sigma, (len(self), 2)), 3, axis=1)
        covariance = _squared(found.twist * noise[:, None])
        covariance[:, range(6), range(6)] += (found.reading * leg_sigma) ** 2
        each = np.broadcast_to(np.eye(6), covariance.shape)
        by_place = np.concatenate([found.frame, found.tool], axis=-1)
        return Rows(found.errors, each, found.legs, by_place, covariance), near

    def difference(self, a: tuple[Frames, Rigid], b: tuple[Frames, Rigid]) -> Array:
        """Measured pose at placement and pose a minus that at b: position, rotation vector."""
        one, other = (place.frame @ pose @ place.tool.inverse() for place, pose in (a, b))
        return np.concatenate([one.t - other.t, _turned(one.R, other.R)], axis=-1)

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


@dataclass(frozen=True)
class ReadingsSensor:
    """An instrument that is compared with the poses that the readings have.

    Attributes:
        values: (n, ...) what was measured.
        sigma: one standard deviation of these numbers, or (n,).
    """

    values: Array
    sigma: Any

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, rows):
        return type(self)(self.values[rows], np.broadcast_to(self.sigma, len(self))[rows])

    @property
    def numbers(self) -> int:
        """m, how many numbers are measured in a pose."""
        return int(np.prod(self.values.shape[1:]))

    def predicted(self, place, pose: Rigid) -> Array:
        """Measurements (n, m) to expect of the instrument, placed so, at poses X (n)."""
        raise NotImplementedError

    def sensitivity(self, place, pose: Rigid) -> tuple[Array, Array]:
        """Derivatives (n, m, .) by twist of X (6) and by the placement."""
        raise NotImplementedError

    def difference(self, a: tuple[Any, Rigid], b: tuple[Any, Rigid]) -> Array:
        """Difference of the measurements at placements and poses a and b, (n, m)."""
        return self.predicted(*a) - self.predicted(*b)

    def errors(self, place, pose: Rigid) -> Array:
        """Expected minus actual measurements, (n, m)."""
        return self.predicted(place, pose) - self.values.reshape(len(self), -1)

    def rows(self, parameters, values, place, legs, leg_sigma, near) -> tuple[Rows, Rigid]:
        pose, found = forward(parameters, values, legs, near)
        by_pose, by_place = self.sensitivity(place, pose)
        by_strut = -by_pose @ np.linalg.inv(found.twist)
        errors = self.errors(place, pose)
        covariance = _squared(by_strut * (found.reading * leg_sigma)[:, None])
        own = np.broadcast_to(self.sigma, len(self))[:, None] ** 2
        covariance[:, range(errors.shape[1]), range(errors.shape[1])] += own
        return Rows(errors, by_strut, found.legs, by_place, covariance), pose


class OrientationSensor(ReadingsSensor):
    """Rotations (n, 3, 3) of a tool in a measuring frame; noise [rad]."""

    kind = "orientation"

    @property
    def numbers(self) -> int:
        return 3

    def difference(self, a: tuple[Frames, Rigid], b: tuple[Frames, Rigid]) -> Array:
        """Rotation vectors (n, 3) from the measurements at b to those at a."""
        return _turned(*(place.frame.R @ pose.R @ place.tool.R.T for place, pose in (a, b)))

    def errors(self, place: Frames, pose: Rigid) -> Array:
        return _turned(place.frame.R @ pose.R @ place.tool.R.T, self.values)

    def sensitivity(self, place: Frames, pose: Rigid) -> tuple[Array, Array]:
        shape = pose.R.shape
        turn = np.broadcast_to(place.frame.R, shape)
        by_pose = np.concatenate([np.zeros(shape), turn], axis=-1)
        unit = np.broadcast_to(np.eye(3), shape)
        return by_pose, np.concatenate([unit, -turn @ pose.R @ place.tool.R.T], axis=-1)


class TargetSensor(ReadingsSensor):
    """Positions (n, k, 3) of k targets on the platform, in a measuring frame; noise [unit]."""

    @property
    def kind(self) -> str:
        return "position" if self.values.shape[1] == 1 else "targets"

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


class DistanceSensor(ReadingsSensor):
    """Distances (n, k) from stations on the base to targets on the platform; noise [unit]."""

    kind = "distances"

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


class InclinometerSensor(ReadingsSensor):
    """Sines (n, 2) of the angles of an instrument's x and y axes above the horizontal."""

    kind = "inclinometer"

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


def _turned(a: Array, b: Array) -> Array:
    """Rotation vectors (..., 3) from rotations b to a (..., 3, 3)."""
    return to_rotation_vector(from_matrix(a @ np.swapaxes(b, -1, -2)))


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

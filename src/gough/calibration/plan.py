"""Poses to measure: those that leave the smallest error over the workspace.

With H the information of prior and poses chosen so far, C = H^-1, and M the mean of G^T G over the
workspace (`gough.calibration.prediction`), the mean squared error that is left is tr(C M). A pose
with whitened rows A (m, P) lowers it by

    tr(S^-1 A C M C A^T),      S = I + A C A^T

(V-optimal design: Fedorov 1972; the update is Woodbury's). Poses are added one by one, the best
first, and then exchanged until none is better. They are put in an order of little leg travel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gough.calibration.arrays import Array
from gough.calibration.estimate import LOOSE, Problem, State, whiten
from gough.calibration.inputs import check_kind, check_sigma
from gough.calibration.kinds import Kind
from gough.calibration.parameters import Parameters
from gough.calibration.placements import Bars, Frames, Level, Rotations, Targets
from gough.calibration.prediction import Error, Workspace
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
from gough.kinematics import joint_radius, leg_lengths
from gough.platform import Platform
from gough.pose import Pose
from gough.units import LENGTHS

INSTRUMENTS = {"tracker": (0.01, 0.002), "camera": (0.1, 0.05)}  # [mm], [deg]
CANDIDATES = 500  # poses to choose from: half from the box, half at its corners and faces
SWEEPS = 2  # of exchanging each pose for a better one
UNSEEN = 10.0  # [platform sizes], [rad]: standard deviation of a placement before any measurement


@dataclass(frozen=True, eq=False)
class Plan:
    """Poses to measure, in order.

    Attributes:
        poses: (n,) of the platform, as `gough.solve` gives them.
        legs: (n, 6) readings there, by the drawing.
        reference: (n,) returns to the reference pose, which show drift.
        error: error over the workspace to expect after the calibration.
    """

    poses: Pose
    legs: Array
    reference: NDArray[np.bool_]
    error: Error


def plan_poses(
    platform: Platform,
    count: int,
    sensor: Literal["tracker", "camera"] = "tracker",
    *,
    kind: Kind = "pose",
    sigma: Any = None,
    leg_sigma: float | None = None,
    tolerance: float | None = None,
    gains: bool = False,
    reference_every: int = 0,
    seed: int = 0,
) -> Plan:
    """Choose the poses whose measurements calibrate a machine best.

    Args:
        platform: the machine as drawn, with a workspace; only readings within stroke are chosen.
        count: how many poses.
        sensor: "tracker" (0.01 mm, 0.002 deg) or "camera" (0.1 mm, 0.05 deg), where the machine's
            unit is known; or state `sigma`.
        kind: what the instrument measures, as for `calibrate`; targets and stations are taken
            to be at the joints.
        sigma: its standard deviation, as for `calibrate`.
        leg_sigma: of the readings, in their unit; 0.003 mm unless given, 1e-5 rad for motors.
        tolerance: of joints [platform unit]; 0.5 mm unless given.
        gains: plan for a fit of gains, too.
        reference_every: after so many poses return to home; 0: never.
        seed: of the poses to choose from.

    Raises:
        GoughError: no workspace, a unit that is not known, options out of range.
    """
    if count < 1 or reference_every < 0:
        raise GoughError(f"count, reference_every: expected above 0, found {count}, "
                         f"{reference_every}")  # fmt: skip
    check_kind(kind)
    noise, leg_noise, spread = _stated(platform, sensor, kind, sigma, leg_sigma, tolerance)
    poses, legs, near = _candidates(platform, seed)
    parameters = Parameters(platform, spread, gains)
    instrument, place = _instrument(platform, kind, noise, near)
    problem = Problem(parameters, instrument, legs, leg_noise)
    state = State(parameters.drawn, place, near)
    workspace = Workspace.of(problem)
    G = workspace.derivatives(state)[0]
    rows, weighted = whiten(problem.rows(state)[0])[1], _weighted(G, kind, platform)
    chosen, covariance = _choose(rows, _prior(parameters, place, rows), weighted, count)
    chosen = _little_travel(legs[chosen], platform.home_legs, chosen)
    error = workspace.error(state, covariance)
    return _with_reference(platform, poses[chosen], legs[chosen], reference_every, error)


def _stated(
    platform: Platform, sensor: str, kind: str, sigma: Any, leg_sigma: float | None,
    tolerance: float | None,
) -> tuple[Any, float, float]:  # fmt: skip
    """Noise of the instrument and of the readings, and the tolerance, stated or usual."""
    unit = LENGTHS["mm"] / LENGTHS[platform.unit] if platform.unit in LENGTHS else None
    rotary = platform.rotary is not None
    if unit is None and (sigma is None or tolerance is None or (leg_sigma is None and not rotary)):
        raise GoughError(
            f"platform {platform.name!r} is in {platform.unit or 'no named unit'}: state sigma, "
            "leg_sigma and tolerance"
        )
    if sigma is None:
        if sensor not in INSTRUMENTS:
            raise GoughError(f"sensor: expected {' or '.join(INSTRUMENTS)}; found {sensor!r}")
        position, degrees = INSTRUMENTS[sensor]
        pair = position * (unit or 1.0), float(np.radians(degrees))
        sigma = pair if kind == "pose" else pair[kind in ("inclinometer", "orientation")]
    if kind == "pose":
        numbers = as_batch("sigma", sigma, (2,))
        sigma = tuple(check_sigma("sigma", float(x)) for x in numbers)
    else:
        sigma = check_sigma("sigma", float(sigma))
    usual = 1e-5 if rotary else 0.003 * (unit or 1.0)
    leg = check_sigma("leg_sigma", usual if leg_sigma is None else leg_sigma)
    wide = check_sigma("tolerance", 0.5 * (unit or 1.0) if tolerance is None else tolerance)
    return sigma, leg, wide


def _candidates(platform: Platform, seed: int) -> tuple[Pose, Array, Rigid]:
    """Poses within workspace and stroke, their readings, and the poses as rigid motions."""
    box = platform.workspace
    if box is None:
        raise GoughError(f"workspace: platform {platform.name!r} states none to plan poses in")
    rng = np.random.default_rng(seed)
    share = rng.uniform(size=(6 * CANDIDATES, 6))
    corner = rng.uniform(size=share.shape) < 0.6
    corner[::2] = False
    share = np.where(corner, np.round(share), share)
    shift = box.translation[:, 0] + share[:, :3] * np.diff(box.translation)[:, 0]
    angle = np.radians(box.rotation_deg[:, 0] + share[:, 3:] * np.diff(box.rotation_deg)[:, 0])
    home = platform.home
    turned = Pose(np.zeros(3), home.wxyz) @ Pose.from_euler(np.zeros(3), angle)
    poses = Pose(home.position + shift, turned.wxyz)
    legs = leg_lengths(platform, poses)
    good = np.all(np.isfinite(legs), axis=1)
    if platform.stroke is not None:
        good &= np.all((legs >= platform.stroke[:, 0]) & (legs <= platform.stroke[:, 1]), axis=1)
    chosen = np.flatnonzero(good)[:CANDIDATES]
    if len(chosen) < 10:
        raise GoughError(f"workspace: only {len(chosen)} of {len(good)} poses are within stroke")
    return poses[chosen], legs[chosen], Rigid.of(poses[chosen], platform.pivot_point)


def _instrument(platform: Platform, kind: str, sigma: Any, pose: Rigid) -> tuple[Sensor, Any]:
    """The instrument, measuring the poses exactly, and a plausible placement of it."""
    frame, n = Rigid.identity(), len(pose.t)
    if kind == "pose":
        return PoseSensor(pose, sigma), Frames(frame, frame)
    if kind == "orientation":
        return OrientationSensor(pose.R, sigma), Rotations(frame, frame)
    if kind == "inclinometer":
        level = Level(np.array([0.0, 0.0, 1.0]), np.eye(3))
        return InclinometerSensor(np.zeros((n, 2)), sigma), level
    if kind == "distances":
        bars = Bars(platform.base[::2] + 0.0, platform.moving[1::2] + 0.0)
        return DistanceSensor(np.zeros((n, 3)), sigma), bars
    points = platform.moving[::2] + 0.0
    points = points[:1] if kind == "position" else points
    return TargetSensor(np.zeros((n, len(points), 3)), sigma), Targets(frame, points)


def _prior(parameters: Parameters, place: Any, A: Array) -> Array:
    """Information (P, P) before any pose."""
    count = parameters.drawn.size
    lengths = np.full(place.count, parameters.drawing.size * UNSEEN)
    if isinstance(place, (Level, Rotations)):
        lengths[:] = UNSEEN
    elif not isinstance(place, Bars):
        lengths[3:6] = UNSEEN
        if isinstance(place, Frames):
            lengths[9:12] = UNSEEN
    prior = np.concatenate([parameters.tolerance.ravel() ** -2, lengths**-2.0])
    prior[count:] = np.maximum(prior[count:], LOOSE * np.sum(A[..., count:] ** 2, axis=(0, 1)))
    return np.diag(prior)


def _weighted(G: Array, kind: str, platform: Platform) -> Array:
    """G (t m, P) with rotations of poses counted as they move the platform joints."""
    if kind == "pose":
        G = G * np.repeat([1.0, joint_radius(platform)], 3)[:, None]
    return G.reshape(-1, G.shape[-1]) / np.sqrt(len(G))


class _Design:
    """Information of the poses chosen, and by how much each candidate would lower the error."""

    def __init__(self, A: Array, prior: Array, G: Array) -> None:
        self.A = A
        scale = 1 / np.sqrt(np.diag(prior))
        self.scale = scale
        self.A = A * scale
        self.C = np.linalg.inv(prior * np.outer(scale, scale))
        triangle = np.asarray(np.linalg.qr(G * scale, mode="r"))
        self.M = triangle.T  # (P, r) with M M^T = mean of G^T G
        flat = self.A.reshape(-1, A.shape[-1])
        self.AC = (flat @ self.C).reshape(A.shape)
        self.Y = (self.AC.reshape(flat.shape) @ self.M).reshape(*A.shape[:2], -1)

    def gains(self) -> Array:
        """By how much each candidate lowers the mean squared error, (n,)."""
        S = np.eye(self.A.shape[1]) + self.AC @ np.swapaxes(self.A, 1, 2)
        return np.einsum("nab,nba->n", np.linalg.inv(S), self.Y @ np.swapaxes(self.Y, 1, 2))

    def take(self, i: int, sign: float = 1.0) -> None:
        """Add candidate i (sign 1), or take it away (-1)."""
        A, AC = self.A[i], self.AC[i].copy()
        S = np.eye(len(A)) + sign * AC @ A.T
        half = sign * np.linalg.solve(S, AC)  # (m, P)
        flat = self.A.reshape(-1, A.shape[-1])
        seen = (flat @ AC.T).reshape(*self.A.shape[:2], -1)  # A_n C A_i^T
        self.C = self.C - AC.T @ half
        self.AC = self.AC - seen @ half
        self.Y = self.Y - seen @ (half @ self.M)


def _choose(A: Array, prior: Array, G: Array, count: int) -> tuple[list[int], Array]:
    """Indices of the best poses, and the covariance (P, P) that their measurements leave."""
    design = _Design(A, prior, G)
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(int(np.argmax(design.gains())))
        design.take(chosen[-1])
    for _ in range(SWEEPS):
        before = list(chosen)
        for k in range(count):
            design.take(chosen[k], -1.0)
            chosen[k] = int(np.argmax(design.gains()))
            design.take(chosen[k])
        if chosen == before:
            break
    rows = A[chosen].reshape(-1, A.shape[-1])
    scale = design.scale
    covariance = np.linalg.inv((rows * scale).T @ (rows * scale) + np.eye(len(scale)))
    return chosen, covariance * np.outer(scale, scale)


def _little_travel(legs: Array, home: Array, chosen: list[int]) -> NDArray[np.intp]:
    """The chosen poses in an order in which legs travel little: nearest next, then 2-opt."""
    points = np.concatenate([home[None], legs])
    cost = np.abs(points[:, None] - points).max(axis=-1)
    order, left = [0], set(range(1, len(points)))
    while left:
        order.append(min(left, key=lambda j: cost[order[-1], j]))
        left.remove(order[-1])
    improved = True
    while improved:
        improved = False
        for i in range(1, len(order) - 1):
            for j in range(i + 1, len(order)):
                after = cost[order[j], order[j + 1]] if j + 1 < len(order) else 0.0
                new = cost[order[i], order[j + 1]] if j + 1 < len(order) else 0.0
                gain = cost[order[i - 1], order[i]] + after - cost[order[i - 1], order[j]] - new
                if gain > 1e-12 * cost.max():
                    order[i : j + 1] = order[i : j + 1][::-1]
                    improved = True
    return np.array(chosen, dtype=np.intp)[np.array(order[1:]) - 1]


def _with_reference(platform: Platform, poses: Pose, legs: Array, every: int, error: Error) -> Plan:
    """The plan with returns to home in between: first, last, and after every so many poses."""
    n = len(legs)
    if not every:
        return Plan(poses, legs, np.zeros(n, dtype=bool), error)
    index: list[int] = []
    for start in range(0, n, every):
        index += [-1, *range(start, min(start + every, n))]
    at = np.array([*index, -1])
    home = at < 0
    position = np.where(home[:, None], platform.home.position, poses.position[at])
    wxyz = np.where(home[:, None], platform.home.wxyz, poses.wxyz[at])
    readings = np.where(home[:, None], platform.home_legs, legs[at])
    return Plan(Pose(position, wxyz), readings, home, error)

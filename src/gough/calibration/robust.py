"""Fits that outliers do not spoil: reweighting by the distance of whole poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gough.calibration.arrays import Array
from gough.calibration.estimate import (
    Estimate,
    Problem,
    State,
    minimise,
    place_instrument,
    poses_of_readings,
    squared_distances,
)
from gough.calibration.placing import candidates
from gough.calibration.residuals import Rigid
from gough.calibration.sensors import PoseSensor
from gough.errors import PlatformError

STARTS = 80  # poses used to find a start
SUBSETS, SUBSET = 8, 8  # random draws of poses for a robust start, and poses in each
CUT = 3.54  # [sigma of a normal number] distance from which a pose is an outlier: 1 of 5000


def find_start(
    problem: Problem, near: Rigid, usable: NDArray[np.bool_], robust: bool, iterations: int = 20
) -> State:
    """A placement to start from: the best of the closed forms, each refined on the drawing.

    Args:
        near: (n) poses of the readings on the drawing, of which the `usable` (n,) are looked at.
        robust: try random subsets of the poses too, and judge by the median pose.
        iterations: of refining, the most.
    """
    rows = np.flatnonzero(usable)
    rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), STARTS)).astype(int)]
    part, pose = problem[rows], near[rows]
    draws = [np.arange(len(rows))]
    if robust:
        rng = np.random.default_rng(0)
        size = max(SUBSET, min(len(rows) // 3, 3 * SUBSET))
        draws += [rng.permutation(len(rows))[:size] for _ in range(SUBSETS)]
    best: tuple[float, State] | None = None
    for draw in draws:
        for place in candidates(part[draw].sensor, pose[draw]):
            first = State(problem.parameters.drawn, place, pose[draw])
            try:
                found, _ = place_instrument(
                    part[draw], first, iterations=2 if robust else iterations
                )
                score, state = _judge(part, replace(found, near=pose), robust)
            except np.linalg.LinAlgError:
                continue
            if np.isfinite(score) and (best is None or score < best[0]):
                best = score, state
    if best is None:
        place = candidates(part.sensor, pose)[0]
        return State(problem.parameters.drawn, place, near)
    state = polish_start(part, best[1]) if robust else place_instrument(part, best[1])[0]
    return replace(state, near=near)


def _judge(problem: Problem, state: State, robust: bool) -> tuple[float, State]:
    """Score of a placement over all poses, the lower the better; robustly refined if asked for."""
    found, distance = place_instrument(problem, state, iterations=1)
    return float(np.median(distance) if robust else np.mean(distance)), found


def polish_start(problem: Problem, state: State) -> State:
    """Refine a placement on the drawing, poses beyond the median's scale counting less."""
    for _ in range(6):
        _, distance = place_instrument(problem, state, iterations=1)
        scale = np.median(distance)
        weights = np.minimum(1.0, np.sqrt(scale / np.maximum(distance, 1e-300)))
        weights[distance > 9 * scale] = 0.0
        state, _ = place_instrument(problem, state, weights, iterations=4)
    return state


def plain_fit(problem: Problem, start: State) -> Estimate:
    """Fit all poses with equal weights; where there are many, first with a part of them."""
    if len(problem) > 2 * STARTS:
        some = np.linspace(0, len(problem) - 1, STARTS).astype(int)
        first = minimise(problem[some], replace(start, near=start.near[some])).state
        start = replace(first, near=start.near)
    return with_right_poses(problem, start, minimise(problem, start))


def with_right_poses(problem: Problem, start: State, estimate: Estimate) -> Estimate:
    """Fit again where the drawing gave a reading the pose of another assembly mode.

    An instrument that measures less than a pose is compared with the pose of the readings. A few of
    these can be in another mode on the drawing; on the machine without them they are not.
    """
    cut = chi_squared(problem.numbers, 2 * CUT)
    if isinstance(problem.sensor, PoseSensor) or np.all(estimate.distance < cut):
        return estimate
    others = robust_fit(problem, start)
    try:
        machine = problem.parameters.platform(others.state.values)
    except PlatformError:
        return estimate
    near, found = poses_of_readings(problem, machine)
    new = found & (others.weights == 0)
    old = others.state.near
    mixed = Rigid(
        np.where(new[:, None, None], near.R, old.R), np.where(new[:, None], near.t, old.t)
    )
    again = minimise(problem, replace(others.state, near=mixed))
    return again if again.cost < estimate.cost else estimate


def robust_fit(problem: Problem, start: State) -> Estimate:
    """Fit with poses weighted by their distance: first by group L1, then in or out.

    The scale falls from the median's to 1. A pose is out beyond `CUT`, at which a good pose is
    with a probability of about 1 in 5000.
    """
    if len(problem) > 2 * STARTS:  # most of the way with some of the poses
        some = np.linspace(0, len(problem) - 1, STARTS).astype(int)
        first = robust_fit(problem[some], replace(start, near=start.near[some])).state
        return _in_or_out(problem, replace(first, near=start.near))
    m = problem.numbers
    cut, middle = np.sqrt(chi_squared(m, CUT)), chi_squared(m, 0.0)
    knee = float(np.sqrt(middle))
    estimate = minimise(problem, start, _first_weights(problem, start, knee, middle), iterations=3)
    last: Array | None = None
    for sweep in range(30):
        scale = max(1.0, float(np.median(estimate.distance)) / middle)
        far = np.sqrt(estimate.distance / scale)
        soft = sweep < 4
        weights = np.minimum(1.0, knee / np.maximum(far, 1e-12)) if soft else 1.0 * (far < cut)
        if not soft and scale == 1.0 and last is not None and np.array_equal(weights, last):
            break
        last = weights
        estimate = minimise(problem, estimate.state, weights, iterations=2 if soft else 6)
    return estimate


def _in_or_out(problem: Problem, start: State) -> Estimate:
    """Fit the poses within the cut, from an estimate that is good already."""
    cut = chi_squared(problem.numbers, CUT)
    weights = 1.0 * (squared_distances(problem, start) < cut)
    estimate = minimise(problem, start, weights, iterations=3)
    for _ in range(4):
        weights = 1.0 * (estimate.distance < cut)
        if np.array_equal(weights, estimate.weights):
            break
        estimate = minimise(problem, estimate.state, weights, iterations=4)
    return estimate


def _first_weights(problem: Problem, start: State, knee: float, middle: float) -> Array:
    _, distance = place_instrument(problem, start, iterations=1)
    far = np.sqrt(distance / max(float(np.median(distance)) / middle, 1e-300))
    return np.minimum(1.0, knee / np.maximum(far, 1e-12)) * (far < 3 * knee)


def chi_squared(freedom: int, sigma: float) -> float:
    """Quantile of chi squared at a normal number's `sigma` (Wilson and Hilferty 1931)."""
    share = 2 / (9 * freedom)
    return float(freedom * (1 - share + sigma * np.sqrt(share)) ** 3)

"""`gough.calibrate`: optimum, errors, outliers, drift, messages, mistakes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from calibration.machines import TRACKER, measure, options, truth
from scipy.optimize import least_squares

import gough
from gough import GoughError, Platform, Pose, leg_lengths
from gough.calibration.estimate import State, whiten
from gough.calibration.residuals import Rigid, exp_rotation

REFERENCE = truth("reference", 3)
LEGS, POSES = measure(REFERENCE, REFERENCE.poses(40, 5), 7)


def _true_errors(known, found) -> np.ndarray:
    """Distances (100,) between measured-frame positions of the calibrated and the true machine."""
    pose = known.poses(100, 99)
    legs = leg_lengths(known.platform, pose)
    solved = gough.solve(found.platform, legs, seed=pose)
    assert np.all(solved.residual < 1e-9 * known.drawing.size)
    body = Rigid.of(solved.pose, known.drawing.pivot_point)
    seen = Rigid.of(found.frame) @ body @ Rigid.of(found.tool).inverse()
    return np.linalg.norm(seen.t - known.seen(pose).t, axis=1) / known.mm


@pytest.mark.parametrize("name", ["reference", "nasa_msfc", "rubin_camera", "reachy_mini"])
def test_the_error_is_what_was_predicted(name: str) -> None:
    known = truth(name, 1, 0.1 if name == "reachy_mini" else 0.5)
    leg = 0.0005 if name == "reachy_mini" else 0.003
    told: dict[str, Any] = options(known, leg=leg) | (
        {"tolerance": 1e-4} if name == "reachy_mini" else {}
    )
    if name == "reachy_mini":
        told["leg_sigma"] = leg * known.mm
    legs, poses = measure(known, known.poses(40, 1), 1, leg=leg)
    found = gough.calibrate(known.drawing, legs, poses, **told)
    errors = _true_errors(known, found)
    predicted = found.predicted_error.position / known.mm
    assert 0.4 * predicted < np.sqrt(np.mean(errors**2)) < 2.0 * predicted
    # tilts of 0.36 deg show so little that a machine close to its drawing stays as drawn
    assert found.better or name == "rubin_camera"
    assert found.rank == found.changes.size
    assert found.error_before.position > 1.5 * found.predicted_error.position


def test_scipy_finds_the_same_minimum() -> None:
    """The whitened errors at the optimum, weights fixed there, handed to SciPy as they are."""
    found = gough.calibrate(REFERENCE.drawing, LEGS, POSES, **options(REFERENCE))
    problem, state = found.problem, found.estimate.state
    layout = problem.parameters
    root = np.linalg.inv(np.linalg.cholesky(problem.rows(state)[0].covariance))

    def errors(step: np.ndarray) -> np.ndarray:
        moved: State = problem.moved(state, step * scale)
        rows = problem.rows(moved)[0].errors
        gap = (moved.values - layout.drawn) / layout.tolerance
        return np.concatenate([(root @ rows[..., None]).ravel(), gap.ravel()])

    scale = np.sqrt(np.diag(found.estimate.covariance))
    away = np.random.default_rng(0).normal(size=len(scale))
    end = least_squares(errors, away, method="lm", xtol=1e-12, ftol=1e-12)
    assert np.abs(end.x).max() < 0.02  # standard deviations; weights follow the estimate in ours
    assert np.sum(errors(0 * end.x) ** 2) == pytest.approx(2 * end.cost, rel=1e-4)
    white, A = whiten(problem.rows(state)[0])
    assert white.shape == (40, 6)
    curvature = np.linalg.inv(end.jac.T @ end.jac)
    np.testing.assert_allclose(np.sqrt(np.diag(curvature)), 1.0, atol=0.05)
    assert A.shape == (40, 6, 54)


def test_known_frames_need_no_placement() -> None:
    known = REFERENCE
    pose = known.poses(30, 2)
    legs = leg_lengths(known.platform, pose)
    found = gough.calibrate(known.drawing, legs, pose, frames="known", **options(known))
    np.testing.assert_allclose(found.frame.matrix, np.eye(4), atol=0)
    solved = gough.solve(found.platform, legs, seed=pose)
    assert np.max(solved.pose.distance(pose)[0]) < 0.02


def test_outliers_are_found_and_named() -> None:
    rng = np.random.default_rng(0)
    bad = np.array([3, 17, 30])
    position = POSES.position.copy()
    position[bad] += rng.normal(0, 5, (3, 3))
    spoilt = Pose(position, POSES.wxyz)
    found = gough.calibrate(REFERENCE.drawing, LEGS, spoilt, robust=True, **options(REFERENCE))
    assert np.flatnonzero(~found.inliers).tolist() == bad.tolist()
    assert any("outliers and left out: rows 4, 18, 31" in text for text in found.messages)
    assert np.mean(_true_errors(REFERENCE, found)) < 0.02


def test_gains_are_fitted() -> None:
    known = truth("reference", 4, gains=2e-4)
    legs, poses = measure(known, known.poses(60, 4), 4)
    found = gough.calibrate(known.drawing, legs, poses, gains=True, **options(known))
    assert found.changes.size == 48
    assert np.mean(_true_errors(known, found)) < 0.02
    np.testing.assert_allclose(found.platform.gain, known.platform.gain, atol=1e-4)


def test_a_drift_is_seen_and_taken_out() -> None:
    time = np.arange(40.0)
    share = (time - time.min()) / np.ptp(time) - 0.5
    drifted = LEGS - share[:, None] * np.array([0.05, -0.04, 0.06, 0.05, -0.03, 0.04])
    told = options(REFERENCE)
    found = gough.calibrate(REFERENCE.drawing, drifted, POSES, time=time, **told)
    assert any("show a drift" in text for text in found.messages)
    without = gough.calibrate(REFERENCE.drawing, drifted, POSES, **told)
    assert np.mean(_true_errors(REFERENCE, found)) < 0.7 * np.mean(_true_errors(REFERENCE, without))
    steady = gough.calibrate(REFERENCE.drawing, LEGS, POSES, time=time, **told)
    assert steady.messages == ["The data show no drift over time; the fit is without."]


@pytest.mark.parametrize(
    ("kind", "rank", "with_gains"),
    [
        ("position", 39, 45), ("targets", 42, 48), ("distances", 42, 48),
        ("one distance", 36, 42), ("orientation", 36, 41), ("inclinometer", 35, 40),
    ],
)  # fmt: skip
def test_partial_instruments_reach_their_rank(kind: str, rank: int, with_gains: int) -> None:
    known = REFERENCE
    pose = known.poses(60, 3)
    legs = leg_lengths(known.platform, pose)
    F = known.frames.frame
    points = np.array([[150.0, 20, 5], [-60, 120, 10], [-60, -120, 0]])
    stations = np.array([[2000.0, 0, 0], [0, 2500, 0], [-500, -500, 2200]])
    joints = points @ np.swapaxes(pose.rotation, 1, 2) + pose.position[:, None]
    seen = joints @ F.R.T + F.t
    rng = np.random.default_rng(1)
    up = np.array([0.01, 0.02, 1]) / np.linalg.norm([0.01, 0.02, 1])
    tilts = np.arcsin((up @ pose.rotation @ exp_rotation(np.array([0.02, 0.01, 0.3])))[:, :2])
    distances = np.linalg.norm(joints - stations, axis=-1) + rng.normal(0, 0.005, (60, 3))
    wobble = exp_rotation(rng.normal(0, TRACKER[1], (60, 3)))
    turned = wobble @ known.seen(pose).R
    measured, sigma = {
        "position": (seen[:, 0] + rng.normal(0, 0.01, (60, 3)), 0.01),
        "targets": (seen + rng.normal(0, 0.01, seen.shape), 0.01),
        "distances": (distances, 0.005),
        "one distance": (distances[:, :1], 0.005),
        "orientation": (Pose.from_rotation(np.zeros((60, 3)), turned), TRACKER[1]),
        "inclinometer": (tilts + rng.normal(0, TRACKER[1], tilts.shape), TRACKER[1]),
    }[kind]  # fmt: skip
    told = options(known) | {"sigma": sigma, "kind": "distances" if "distance" in kind else kind}
    found = gough.calibrate(known.drawing, legs, measured, **told)
    assert found.rank == rank
    assert found.better
    assert found.cross_validated[0] < 0.2 * found.cross_validated[1]
    # calibrated parameters are off by what their covariance says
    off = (found.estimate.state.values - known.values).ravel()
    assert off @ np.linalg.solve(found.covariance, off) < 2 * off.size
    if rank < 42:
        assert any(f"{42 - rank} directions" in text for text in found.messages)
    assert gough.calibrate(known.drawing, legs, measured, gains=True, **told).rank == with_gains


MISTAKES = {
    "angles in radians stand in columns of degrees": lambda legs, pose: (
        legs, Pose.from_euler(pose.position, np.radians(pose.euler))),
    "the poses are inverse": lambda legs, pose: (legs, pose.inverse()),
    "the rotations are transposed": lambda legs, pose: (
        legs, Pose(pose.position, pose.inverse().wxyz)),
    "one row behind": lambda legs, pose: (legs, pose[np.roll(np.arange(20), 1)]),
    "legs 1 and 2 are swapped": lambda legs, pose: (legs[:, [1, 0, 2, 3, 4, 5]], pose),
    "inch, but the machine is in mm": lambda legs, pose: (
        legs, Pose(pose.position / 25.4, pose.wxyz)),
    "Euler angles are in another order": lambda legs, pose: (
        legs, Pose.from_euler(pose.position, pose.rpy)),
    "left-handed": lambda legs, pose: (
        legs, Pose(pose.position * [1, -1, 1], pose.wxyz * [1, -1, 1, -1])),
    "x, y, z, w": lambda legs, pose: (legs, Pose(pose.position, np.roll(pose.wxyz, -1, axis=-1))),
}  # fmt: skip


@pytest.mark.parametrize("name", MISTAKES)
def test_the_likely_mistake_is_named(name: str) -> None:
    legs, poses = MISTAKES[name](LEGS[:20], POSES[:20])
    with pytest.raises(GoughError) as caught:
        gough.calibrate(REFERENCE.drawing, legs, poses, **options(REFERENCE))
    assert "likely mistake" in str(caught.value)
    assert name in str(caught.value)


def _but(**other: Any) -> dict[str, Any]:
    return options(REFERENCE) | other


def test_what_a_person_is_told() -> None:
    drawing, told = REFERENCE.drawing, options(REFERENCE)
    loud = gough.calibrate(drawing, LEGS, POSES, **_but(sigma=(0.002, 2e-6)))
    assert any("times what sigma and leg_sigma state" in text for text in loud.messages)
    tight = gough.calibrate(drawing, LEGS, POSES, **_but(tolerance=0.05))
    assert any("tolerances from the drawing" in text for text in tight.messages)
    with pytest.raises(GoughError, match=r"6 usable poses are too few; pose .* at least 8"):
        gough.calibrate(drawing, LEGS[:6], POSES[:6], **told)
    with pytest.raises(GoughError, match="expected as many rows, found 40 and 39"):
        gough.calibrate(drawing, LEGS, POSES[:39], **told)
    holes = LEGS.copy()
    holes[4, 2] = np.nan
    assert (
        "1 of 40 rows hold NaN and are left out: row 5."
        in gough.calibrate(drawing, holes, POSES, **told).messages
    )
    blind = gough.calibrate(drawing, LEGS, POSES, **_but(sigma=(50.0, 0.2)))
    assert not blind.better
    assert "not surely better than the drawing" in blind.messages[0]


def test_noise_of_each_row_counts() -> None:
    rng = np.random.default_rng(2)
    loud = np.arange(40) >= 20
    position = POSES.position + np.where(loud[:, None], rng.normal(0, 2.0, (40, 3)), 0)
    sigma = np.where(loud[:, None], [2.0, TRACKER[1]], TRACKER)
    seen = Pose(position, POSES.wxyz)
    alike = gough.calibrate(REFERENCE.drawing, LEGS, seen, **_but(sigma=(1.4, TRACKER[1])))
    each = gough.calibrate(REFERENCE.drawing, LEGS, seen, **_but(sigma=sigma))
    assert np.mean(_true_errors(REFERENCE, each)) < 0.1 * np.mean(_true_errors(REFERENCE, alike))
    sigma[3] = np.nan
    with_hole = gough.calibrate(REFERENCE.drawing, LEGS, seen, **_but(sigma=sigma))
    assert with_hole.messages[0] == "1 of 40 rows hold NaN and are left out: row 4."
    sigma[3] = -1
    with pytest.raises(GoughError, match="sigma, row 4: expected a standard deviation above 0"):
        gough.calibrate(REFERENCE.drawing, LEGS, seen, **_but(sigma=sigma))
    with pytest.raises(GoughError, match=r"sigma: expected a pair.* each of the 40 rows"):
        gough.calibrate(REFERENCE.drawing, LEGS, seen, **_but(sigma=0.01))


def test_units_change_nothing() -> None:
    found = gough.calibrate(REFERENCE.drawing, LEGS, POSES, **options(REFERENCE))
    drawing = REFERENCE.drawing
    metres = Platform(
        drawing.base / 1e3, drawing.moving / 1e3, Pose(drawing.home.position / 1e3), unit="m",
        workspace=replace(drawing.workspace, translation=drawing.workspace.translation / 1e3)
        if drawing.workspace else None,
    )  # fmt: skip
    told: dict[str, Any] = options(REFERENCE)
    told["sigma"] = (told["sigma"][0] / 1e3, told["sigma"][1])
    told |= {"leg_sigma": 3e-6, "tolerance": 5e-4}
    small = gough.calibrate(metres, LEGS / 1e3, Pose(POSES.position / 1e3, POSES.wxyz), **told)
    np.testing.assert_allclose(small.changes * 1e3, found.changes, atol=1e-6)

"""Strut errors, instruments and their derivatives, against differences and `gough.struts`."""

from __future__ import annotations

import numpy as np
import pytest
from calibration.machines import truth

from gough import leg_lengths
from gough.calibration.parameters import Parameters
from gough.calibration.placements import Bars, Frames, Level, Rotations, Targets
from gough.calibration.residuals import Rigid, exp_rotation, forward, struts
from gough.calibration.sensors import (
    DistanceSensor,
    InclinometerSensor,
    OrientationSensor,
    PoseSensor,
    TargetSensor,
)

MACHINES = ["reference", "rubin_camera", "reachy_mini"]


@pytest.mark.parametrize("name", MACHINES)
def test_errors_vanish_at_the_truth_and_have_the_stated_derivatives(name: str) -> None:
    tolerance = 0.1 if name == "reachy_mini" else 0.5
    known = truth(name, 1, tolerance, gains=1e-3)
    layout = Parameters(known.drawing, tolerance * known.mm, gains=True)
    np.testing.assert_allclose(layout.values(known.platform), known.values, rtol=0,
                               atol=1e-12 * known.drawing.size)  # fmt: skip
    pose = known.poses(4, 1)
    legs, M = leg_lengths(known.platform, pose), known.seen(pose)
    F, H = known.frames.frame, known.frames.tool
    at = struts(layout, known.values, legs, M, F, H)
    assert np.abs(at.errors).max() < 1e-13 * (known.drawing.size + np.abs(M.t).max())

    def check(moved, found, step) -> None:
        slope = (moved(step) - moved(-step)) / (2 * step)
        np.testing.assert_allclose(slope, found, rtol=0, atol=1e-5 * max(1, np.abs(found).max()))

    size = known.drawing.size
    errors = lambda *a: struts(layout, known.values, legs, *a).errors  # noqa: E731
    for i in range(6):
        unit, step = np.eye(6)[i], 1e-5 * (size if i < 3 else 1.0)
        check(lambda h, u=unit: errors(M.moved(h * u), F, H), at.twist[..., i], step)
        check(lambda h, u=unit: errors(M, F.moved(h * u), H), at.frame[..., i], step)
        check(lambda h, u=unit: errors(M, F, H.moved(h * u)), at.tool[..., i], step)
    for column in range(layout.count):
        unit = np.zeros_like(known.values)
        unit[:, column] = layout.tolerance[:, column]
        scaled = at.legs[..., column] * layout.tolerance[:, column] / known.mm
        check(
            lambda h, u=unit: struts(layout, known.values + h * u, legs, M, F, H).errors / known.mm,
            scaled,
            1e-3,
        )


@pytest.mark.parametrize("name", MACHINES)
def test_forward_finds_the_pose_of_the_readings(name: str) -> None:
    known = truth(name, 2, 0.1)
    layout = Parameters(known.drawing, known.mm)
    pose = known.poses(10, 2)
    body = Rigid.of(pose, known.drawing.pivot_point)
    start = body.moved(np.tile([1e-3 * known.drawing.size] * 3 + [1e-3] * 3, (10, 1)))
    found, _ = forward(layout, layout.values(known.platform), leg_lengths(known.platform, pose),
                       start)  # fmt: skip
    np.testing.assert_allclose(found.t, body.t, atol=1e-11 * known.drawing.size)
    np.testing.assert_allclose(found.R, body.R, atol=1e-10)


def test_sensitivities_are_derivatives_of_what_is_measured() -> None:
    rng = np.random.default_rng(0)
    n, turn = 4, lambda s=1.0: exp_rotation(rng.normal(size=3) * s)
    X = Rigid(np.stack([turn() for _ in range(n)]), rng.normal(size=(n, 3)))
    F, up = Rigid(turn(), rng.normal(size=3)), np.array([0.1, 0.2, 1])
    up = up / np.linalg.norm(up)
    cases = [
        (PoseSensor(X, (1.0, 1.0)), Frames(F, Rigid(turn(), rng.normal(size=3)))),
        (OrientationSensor(X.R, 1.0), Rotations(F, Rigid(turn(), np.zeros(3)))),
        (TargetSensor(rng.normal(size=(n, 3, 3)), 1.0), Targets(F, rng.normal(size=(3, 3)))),
        (DistanceSensor(rng.normal(size=(n, 2)), 1.0),
         Bars(3 * rng.normal(size=(2, 3)), rng.normal(size=(2, 3)))),
        (InclinometerSensor(rng.normal(size=(n, 2)), 1.0), Level(up, turn())),
    ]  # fmt: skip
    h = 1e-6
    for sensor, place in cases:
        by_pose, by_place = sensor.sensitivity(place, X)
        for i in range(6):
            step = np.tile(h * np.eye(6)[i], (n, 1))
            slope = sensor.difference((place, X.moved(step)), (place, X.moved(-step))) / (2 * h)
            np.testing.assert_allclose(by_pose[..., i], slope, atol=1e-7)
        for i in range(place.count):
            step = h * np.eye(place.count)[i]
            slope = sensor.difference((place.moved(step), X), (place.moved(-step), X)) / (2 * h)
            np.testing.assert_allclose(by_place[..., i], slope, atol=1e-7)

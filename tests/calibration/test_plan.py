"""Planned poses: within limits, better than random ones, in a sensible order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gough
from gough import GoughError, Platform
from gough.calibration.estimate import minimise
from gough.calibration.kinds import KINDS, Kind
from gough.calibration.prediction import Workspace

REFERENCE = Platform.load("reference")


def test_planned_poses_leave_less_error_than_random_ones() -> None:
    from calibration.machines import measure, options, truth

    plan = gough.plan_poses(REFERENCE, 20)
    known = truth("reference", 0)
    errors = []
    for poses in (plan.poses, known.poses(40, 1)):
        legs, seen = measure(known, poses)
        found = gough.calibrate(REFERENCE, legs, seen, **options(known))
        errors.append(found.predicted_error.position)
        assert isinstance(found.workspace, Workspace)
        assert minimise(found.problem, found.estimate.state).cost == pytest.approx(
            found.estimate.cost
        )
    assert errors[0] < errors[1]
    assert plan.error.position == pytest.approx(errors[0], rel=0.1)


def test_a_plan_keeps_to_the_limits_and_returns_home() -> None:
    machine = replace(REFERENCE, stroke=(560, 760))
    plan = gough.plan_poses(machine, 12, "camera", reference_every=5)
    assert np.all((plan.legs >= 560) & (plan.legs <= 760))
    assert np.all(machine.in_workspace(plan.poses))
    assert np.flatnonzero(plan.reference).tolist() == [0, 6, 12, 15]
    np.testing.assert_allclose(plan.poses.position[0], machine.home.position)
    again = gough.plan_poses(machine, 12, "camera", reference_every=5)
    np.testing.assert_array_equal(plan.legs, again.legs)
    travel = np.abs(np.diff(plan.legs, axis=0)).max(axis=1).sum()
    rng = np.random.default_rng(0)
    mixed = plan.legs[rng.permutation(len(plan.legs))]
    assert travel < np.abs(np.diff(mixed, axis=0)).max(axis=1).sum()


@pytest.mark.parametrize("kind", KINDS)
def test_every_instrument_can_be_planned_for(kind: Kind) -> None:
    plan = gough.plan_poses(REFERENCE, 8, kind=kind)
    assert 0 < np.nanmin([plan.error.position, plan.error.rotation]) < 5


def test_what_cannot_be_planned_is_said() -> None:
    with pytest.raises(GoughError, match="state sigma, leg_sigma and tolerance"):
        gough.plan_poses(Platform.load("nasa_msfc"), 10)
    with pytest.raises(GoughError, match="states none to plan poses in"):
        gough.plan_poses(replace(REFERENCE, workspace=None), 10)
    with pytest.raises(GoughError, match="count"):
        gough.plan_poses(REFERENCE, 0)

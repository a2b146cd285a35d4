"""One rule for the stroke and the workspace: everything that shows or judges them agrees."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import Status, home_mode, limit_rules
from gough.kernel import layout
from gough.kernel.constants import kernel_constants
from gough.kernel.jit import jit
from gough.kernel.pose_io import in_stroke
from gough.status import InverseStatus


@jit(cache=False)
def _in_stroke(constants, legs):
    return in_stroke(constants, legs, layout.FIRST)


@pytest.mark.parametrize("name", ["rubin_camera", "reachy_mini"])
@given(st.integers(0, 5), st.sampled_from([0, 1]), st.floats(-3, 3))
def test_the_compiled_rule_is_the_plain_one(name, leg, end, slacks):
    """Readings a few slacks from the end of a leg's stroke."""
    platform = replace(gough.Platform.load(name), gain=np.linspace(0.5, 2, 6), offset=0.001)
    if platform.stroke is None:
        platform = replace(platform, stroke=platform.home_legs[:, None] + [-0.3, 0.2])
    assert platform.stroke is not None
    slack = limit_rules.SLACK * (1.0 if platform.rotary is not None else platform.size)
    slack /= platform.gain[leg]
    legs = platform.home_legs.copy()
    legs[leg] = platform.stroke[leg, end] + slacks * slack
    plain = limit_rules.in_stroke(platform, legs)
    assert plain == _in_stroke(kernel_constants(platform), legs[None])
    if abs(abs(slacks) - 1) > 0.1:
        assert plain == (slacks < 1 if end else slacks > -1)


@pytest.mark.parametrize(("over", "inside"), [(5e-12, True), (1e-6, False)])
def test_everybody_agrees_on_a_reading_at_its_limit(over, inside):
    """A Rubin pose with a reading just over its stroke: solver, inverse, modes."""
    camera = gough.Platform.load("rubin_camera")
    assert camera.stroke is not None
    pose = gough.Pose(camera.home.position + np.array([1e-4, 2e-4, 5e-3]), camera.home.wxyz)
    legs = gough.leg_lengths(camera, pose)
    stroke = np.array(camera.stroke)
    leg = int(np.argmax(np.abs(legs)))
    end = int(legs[leg] > 0)
    stroke[leg, end] = legs[leg] - (over if end else -over)
    platform = replace(camera, stroke=stroke)
    found = gough.solve(platform, legs)
    assert found.status == (Status.CONVERGED if inside else Status.OUTSIDE_STROKE)
    many = gough.solve(platform, np.tile(legs, (2_000, 1)))
    assert np.all(many.status == found.status)
    back = home_mode.pose_status(platform, found.pose, legs)
    assert back == (InverseStatus.OK if inside else InverseStatus.OUTSIDE_STROKE)
    modes = gough.assembly_modes(platform, legs)
    nearest = int(np.argmin(modes.pose.distance(found.pose)[0]))
    assert gough.choose_mode(modes).passes["stroke"][nearest] == inside


def test_solve_and_inverse_have_one_precedence():
    """Outside both limits, both say that a reading is outside the stroke, which is worse."""
    platform = gough.Platform.load("reference")
    pose = gough.Pose(platform.home.position + np.array([0, 0, 60.0]))
    legs = gough.leg_lengths(platform, pose)
    platform = replace(platform, stroke=np.array([600.0, legs.min() - 1]))
    assert gough.solve(platform, legs, seed=pose).status == Status.OUTSIDE_STROKE
    status = home_mode.pose_status(platform, pose, legs)
    assert status == InverseStatus.OUTSIDE_STROKE
    nothing = home_mode.pose_status(platform, gough.Pose(np.full(3, np.nan)), legs)
    assert nothing == InverseStatus.INVALID_INPUT
    assert home_mode.pose_status(platform, pose, legs * np.nan) == InverseStatus.UNREACHABLE


def test_no_limits_no_verdict():
    bare = replace(gough.Platform.load("reference"), workspace=None)
    legs = np.array([[1.0] * 6, [np.nan] * 6])
    np.testing.assert_array_equal(limit_rules.in_stroke(bare, legs), [True, False])
    assert np.all(limit_rules.in_workspace(bare, gough.Pose(np.zeros((3, 3)))))

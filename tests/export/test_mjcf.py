"""Exported models in MuJoCo: in steady state they have the pose that gough finds for the legs."""

# MuJoCo ships no types.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import machines
import mujoco
import numpy as np
import pytest
import support
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from shell import run
from support import Floats

import gough
from gough import Platform, Pose
from gough.export.mjcf import to_mjcf
from gough.limit_rules import legs_in_stroke
from gough.units import LENGTHS, in_unit

NEAR = 1e-6  # of the size


class Model:
    """An exported machine, held at its keyframe."""

    def __init__(self, platform: Platform, gravity: bool = False) -> None:
        self.platform = in_unit(platform, "m") if platform.unit in LENGTHS else platform
        self.model = mujoco.MjModel.from_xml_string(to_mjcf(platform, gravity))
        self.data = mujoco.MjData(self.model)
        mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        mujoco.mj_forward(self.model, self.data)

    def go_to(self, pose: Pose, steps: int = 250) -> None:
        """Drive the platform there in a straight line, in half a second, and let it come to rest.

        A straight line of the readings may cross a singularity on the way.
        """
        for legs in gough.leg_lengths(self.platform, _straight(self.pose, pose, steps)):
            self.data.ctrl[:] = legs
            mujoco.mj_step(self.model, self.data)
        self.rest()

    def rest(self) -> None:
        """Step until nothing moves any more."""
        still = 1e-8 * self.platform.size
        for _ in range(100):
            mujoco.mj_step(self.model, self.data, nstep=100)
            if np.abs(self.data.qvel).max() < still:
                break
        mujoco.mj_forward(self.model, self.data)

    @property
    def readings(self) -> Floats:
        return self.data.sensordata[:6].copy()

    @property
    def pose(self) -> Pose:
        return Pose(self.data.sensordata[6:9], self.data.sensordata[9:13])


def _straight(start: Pose, end: Pose, steps: int) -> Pose:
    """Poses between two, the last of them `end`, with a position and a rotation in proportion."""
    share = np.linspace(0, 1, steps + 1)[1:, None]
    turned = start.as_scipy()
    whole = (end.as_scipy() * turned.inv()).as_rotvec()
    position = start.position + share * (end.position - start.position)
    return Pose.from_scipy(position, Rotation.from_rotvec(share * whole) * turned)


def poses(platform: Platform, count: int, seed: int = 0) -> Pose:
    """Poses of the workspace, within the stroke."""
    drawn = support.sample(platform, (50 * count,), seed)
    inside = legs_in_stroke(platform, gough.leg_lengths(platform, drawn)).all(axis=-1)
    return drawn[np.flatnonzero(inside)[:count]]


def assert_same(platform: Platform, found: Pose, expected: Pose) -> None:
    shift, turn = found.distance(expected)
    assert np.max(shift) <= NEAR * platform.size
    assert np.max(turn) <= 4 * NEAR


@pytest.mark.parametrize("name", Platform.catalog())
def test_the_steady_state_is_the_pose_that_gough_finds(name: str) -> None:
    model = Model(Platform.load(name))
    for expected in poses(model.platform, 2):
        legs = gough.leg_lengths(model.platform, expected)
        model.go_to(expected)
        np.testing.assert_allclose(model.readings, legs, atol=NEAR * model.platform.size)
        assert_same(model.platform, model.pose, gough.solve(model.platform, legs).pose)
        assert_same(model.platform, model.pose, expected)


@settings(max_examples=5)
@given(support.seeds, st.sampled_from(["telescopic", "length_change", "rotary"]))
def test_offset_gain_and_pivot_of_any_machine_are_in_the_model(seed: int, legs: str) -> None:
    platform = replace(machines.random_platform(seed, legs, sensors=True), unit="m")
    model = Model(platform)
    np.testing.assert_allclose(model.readings, platform.home_legs, rtol=1e-12)
    assert_same(platform, model.pose, platform.home)
    expected = poses(platform, 1, seed)[0]
    model.go_to(expected)
    assert_same(platform, model.pose, expected)


@pytest.mark.parametrize("name", ["reference", "reachy_mini"])
def test_with_weight_the_servos_sag_and_the_readings_still_give_the_pose(name: str) -> None:
    model = Model(Platform.load(name), gravity=True)
    model.rest()
    assert model.pose.position[2] < model.platform.home.position[2] - 1e-4 * model.platform.size
    assert_same(model.platform, model.pose, gough.solve(model.platform, model.readings).pose)


def test_the_stroke_bounds_the_controls() -> None:
    model = Model(Platform.load("rubin_camera"))
    np.testing.assert_array_equal(model.model.actuator_ctrlrange, model.platform.stroke)


def test_the_command_writes_a_file_once(tmp_path: Path) -> None:
    file = tmp_path / "machine.xml"
    command = f"gough export mjcf -p reference -o {file}"
    assert run(command) == (f"{file}\n", 0)
    mujoco.MjModel.from_xml_path(str(file))
    said, code = run(command)
    assert code == 2
    assert "exists already; pass --force" in said
    assert run(f"{command} --force") == (f"{file}\n", 0)

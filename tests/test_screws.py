"""Screws that turn with their legs: against LinuxCNC's formula, differences, and there and back."""

from __future__ import annotations

from dataclasses import replace

import machines
import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import Event, Platform, PlatformError, Pose, Screws, Status
from gough.export.c import c_files
from gough.export.mjcf import to_mjcf
from gough.units import scaled

# The default axes of LinuxCNC's genhexkins.h.
BASE_AXES = 0.707107 * np.array(
    [[1.0, 0, 1], [0, -1, 1], [-1, 0, 1], [-1, 0, 1], [0, 1, 1], [1, 0, 1]]
)
MOVING_AXES = np.array([
    [-1.0, 0, 0], [0.866025, 0.5, 0], [0.866025, 0.5, 0], [0.866025, -0.5, 0],
    [0.866025, -0.5, 0], [-1, 0, 0],
])  # fmt: skip


def screwed(platform: Platform, seed: int) -> Platform:
    """The machine with screws of different leads and axes in all directions across the legs."""
    rng = np.random.default_rng(seed)
    lead = 0.02 * platform.size * rng.uniform(0.5, 1, 6) * rng.choice([-1, 1], 6)
    rods = gough.joint_positions(platform, platform.home) - platform.base
    across = np.cross(rods, rng.normal(size=(6, 3)))
    axes = across / np.linalg.norm(across, axis=-1, keepdims=True) + rng.normal(0, 0.3, (6, 3))
    moving = (axes + rng.normal(0, 0.3, (6, 3))) @ platform.home.rotation
    stroke = (
        None
        if platform.stroke is None
        else platform.stroke + [-0.1, 0.1] * np.abs(platform.size / platform.gain)[:, None]
    )
    return replace(platform, screw=Screws(lead, axes, moving), stroke=stroke)


platforms = st.builds(
    lambda seed, legs, sensors: screwed(machines.random_platform(seed, legs, sensors), seed),
    support.seeds, st.sampled_from(["telescopic", "length_change"]), st.booleans(),
)  # fmt: skip


def genhexkins(platform: Platform, pose: Pose, lead: float) -> tuple[np.ndarray, np.ndarray]:
    """Strut lengths with LinuxCNC's correction, and the cosines of its angles, both (6,).

    As StrutLengthCorrection in src/emc/kinematics/genhexkins.c calculates it.
    """
    lengths, cosines = np.empty(6), np.empty(6)
    for i in range(6):
        strut = pose.apply(platform.moving[i]) - platform.base[i]
        length = np.sqrt(strut @ strut)
        unit = strut / length
        nb2 = np.cross(BASE_AXES[i], unit)
        nb3 = np.cross(unit, nb2)
        nb3 /= np.sqrt(nb3 @ nb3)
        na1 = pose.rotation @ MOVING_AXES[i]
        na2 = np.cross(na1, unit)
        na2 /= np.sqrt(na2 @ na2)
        lengths[i] = length + lead * np.arcsin(nb3 @ na2) / (2 * np.pi)
        cosines[i] = nb2 @ na2
    return lengths, cosines


def test_readings_of_its_default_machine_are_those_of_genhexkins() -> None:
    """Up to turns of 90 deg from where the arc sine turns back."""
    lead = 0.2
    platform = Platform.load("linuxcnc_genhex").with_workspace(1.5, 10)
    turning = replace(platform, screw=Screws(lead, BASE_AXES, MOVING_AXES))
    poses = turning.sample_poses(200, seed=2)
    found = gough.leg_lengths(turning, poses)
    sides = np.sign(genhexkins(platform, platform.home, lead)[1])
    compared = 0
    for i in range(200):
        expected, cosines = genhexkins(platform, poses[i], lead)
        same = sides * cosines > 1e-3
        compared += int(same.sum())
        np.testing.assert_allclose(found[i, same], expected[same], rtol=1e-12)
    assert compared > 800
    differs = np.abs(found - gough.leg_lengths(platform, poses))
    assert differs.max() > 0.1 * lead
    solved = gough.solve(turning, found)
    assert solved.usable.all()
    np.testing.assert_allclose(solved.pose.position, poses.position, atol=1e-10)


@support.at_most(20)
@given(platforms, support.seeds)
def test_the_jacobian_is_the_derivative(platform: Platform, seed: int) -> None:
    pose = support.sample(platform, (), seed)
    unit = np.repeat([platform.size, 1.0], 3)
    step = 1e-6
    twists = step * np.diag(unit)
    ahead, behind = (
        gough.leg_lengths(platform, support.moved(pose, sign * twists)) for sign in (1, -1)
    )
    found = gough.jacobian(platform, pose) * unit
    scale = platform.size / np.abs(platform.gain)
    error = np.abs((ahead - behind).T / (2 * step) - found) / scale[:, None]
    assert error.max() < 1e-8
    tool = platform.with_frames({
        "tool_in_platform": Pose([0, 0, platform.size], [1, 2, 3, 4]),
        "base_in_world": Pose(np.zeros(3), [4, 3, 2, 1]),
    })  # fmt: skip
    view = tool.frame("tool in world")
    seen = gough.jacobian(tool, view.of(pose), "tool in world") @ view.twist_matrix(pose)
    np.testing.assert_allclose(seen * unit / scale[:, None], found / scale[:, None], atol=1e-12)


@support.at_most(8)
@given(platforms, support.seeds)
def test_poses_come_back_from_their_readings(platform: Platform, seed: int) -> None:
    poses = support.sample(platform, (40,), seed)
    legs = gough.leg_lengths(platform, poses)
    turned = gough.leg_lengths(replace(platform, screw=None, stroke=None), poses)
    assert np.abs((legs - turned) * platform.gain).max() > 1e-5 * platform.size
    found = gough.solve(platform, legs, leg_noise=1e-3)
    assert set(np.unique(found.status)) <= {Status.CONVERGED, Status.OUTSIDE_STROKE}
    shift, turn = found.pose.distance(poses)
    assert np.max(shift) < 1e-11 * platform.size
    assert np.max(turn) < 1e-11
    assert np.max(found.residual) < 1e-12 * platform.size
    assert found.covariance is not None


@support.at_most(4)
@given(platforms, support.seeds)
def test_a_tracker_follows_to_rounding(platform: Platform, seed: int) -> None:
    ends = support.sample(platform, (2,), seed)
    share = np.linspace(0, 1, 20)[:, None]
    way = Pose(ends.position[0] + share * (ends.position[1] - ends.position[0]), ends.wxyz[0])
    legs = gough.leg_lengths(platform, way)
    tracker = gough.Tracker(platform, start=way[0])
    for i in range(20):
        pose = tracker.update(legs[i])
        assert tracker.event == Event.FOLLOWED
        shift, turn = pose.distance(way[i])
        assert max(shift / platform.size, turn) < 1e-11
    found = gough.solve(platform, legs, follow=True)
    assert found.usable.all()
    assert np.max(found.pose.distance(way)[0]) < 1e-11 * platform.size


def test_shapes_frames_units_and_bad_rows() -> None:
    platform = screwed(machines.random_platform(4, sensors=True), 4)
    poses = support.sample(platform, (2, 3))
    legs = gough.leg_lengths(platform, poses)
    found = gough.solve(platform, legs)
    assert found.status.shape == (2, 3)
    assert gough.solve(platform, legs[0, 0]).status == Status.CONVERGED
    assert gough.solve(platform, np.empty((0, 6))).status.shape == (0,)
    tool = platform.with_frames({"tool_in_platform": [0, 0, platform.size]})
    seen = gough.solve(tool, legs, frame="tool in base").pose
    expected = tool.frame("tool in base").of(poses)
    np.testing.assert_allclose(seen.position, expected.position, atol=1e-10 * platform.size)
    other = scaled(platform, 1000.0)
    again = gough.leg_lengths(other, Pose(1000 * poses.position, poses.wxyz))
    np.testing.assert_allclose(again, 1000 * legs, rtol=1e-12, atol=1e-9 * platform.size)
    legs[0, 1, 2], legs[1, 2] = np.nan, 1e3 * platform.size
    status = gough.solve(platform, legs).status
    assert status[0, 1] == Status.INVALID_INPUT
    assert status[1, 2] in (Status.UNREACHABLE, Status.INVALID_INPUT, Status.NOT_CONVERGED)
    assert np.sum(status == Status.CONVERGED) == 4


def test_the_stroke_is_that_of_readings() -> None:
    platform = screwed(machines.random_platform(2), 2)
    home = platform.home_legs
    tight = replace(platform, stroke=home[:, None] + 1e-5 * platform.size * np.array([-1, 1]))
    up = np.array([0, 0, 1e-3 * platform.size])
    lifted = Pose(platform.home.position + up, platform.home.wxyz)
    legs = np.stack([home, gough.leg_lengths(tight, lifted)])
    assert gough.solve(tight, legs).status.tolist() == [Status.CONVERGED, Status.OUTSIDE_STROKE]
    tracker = gough.Tracker(tight, start=tight.home)
    tracker.update(legs[1])
    assert tracker.status == Status.OUTSIDE_STROKE


def test_the_file_states_screws() -> None:
    from gough.platform_file import from_toml

    platform = screwed(machines.random_platform(1, "length_change"), 1)
    again = from_toml(platform.to_toml())
    assert again == platform
    np.testing.assert_array_equal(again.home_legs, platform.home_legs)
    np.testing.assert_allclose(platform.home_legs, 0, atol=1e-14 * platform.size)
    assert platform.digest != replace(platform, screw=None).digest


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("lead = 1", "screw.base_axis: missing"),
        ("lead = [1, 2]\nbase_axis = []\nmoving_axis = []", "screw.lead"),
        ("lead = 1\nbase_axis = [[0,0,1],[0,0,1],[0,0,0],[0,0,1],[0,0,1],[0,0,1]]\n"
         "moving_axis = []", r"screw.base_axis\[2\]: expected a direction"),
        ("lead = 1\npitch = 2", "screw.pitch: unknown field"),
    ],
)  # fmt: skip
def test_a_bad_table_is_named(text: str, reason: str) -> None:
    from gough.platform_file import from_toml

    with pytest.raises(PlatformError, match=reason):
        from_toml(f"{Platform.load('reference').to_toml()}\n[screw]\n{text}\n")


def test_motors_have_no_screws() -> None:
    with pytest.raises(PlatformError, match="screw: a platform with rotary legs"):
        replace(Platform.load("reachy_mini"), screw=Screws(1, BASE_AXES, MOVING_AXES))


@pytest.mark.parametrize(
    "call",
    [
        lambda p: gough.assembly_modes(p, p.home_legs),
        lambda p: gough.certify(p, p.home_legs, p.home),
        lambda p: gough.solve(p, p.home_legs, certify=True),
        lambda p: gough.solve(p, p.home_legs, limits=True),
        lambda p: gough.limits(p, p.home),
        lambda p: gough.reach(p, p.home),
        lambda p: gough.payload_forces(p, p.home, gough.Payload(1.0)),
        lambda p: gough.leg_accelerations(p, p.home, np.zeros(6), np.zeros(6)),
        lambda p: gough.plan_poses(p, 12),
        c_files,
        to_mjcf,
    ],
)
def test_what_does_not_know_such_screws_refuses(call) -> None:
    platform = screwed(machines.random_platform(3), 3)
    with pytest.raises(PlatformError, match="legs whose screws turn with them"):
        call(platform)

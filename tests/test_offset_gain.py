"""The platform fields `offset` and `gain`: honoured by everything that takes or gives readings."""

from __future__ import annotations

from dataclasses import replace

import machines
import mujoco_model
import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import Platform, PlatformError
from gough.platform_file import from_toml

KINDS = ["telescopic", "length_change", "rotary"]


def _plain(platform: Platform) -> Platform:
    return replace(platform, offset=0, gain=1, stroke=None)


@given(support.seeds, st.sampled_from(KINDS))
def test_ideal_reading_is_gain_times_reading_plus_offset(seed: int, kind: str) -> None:
    """The statement itself, against the same machine with ideal sensors."""
    platform = machines.random_platform(seed, kind, sensors=True)
    pose = support.sample(platform, (5,), seed)
    ideal = gough.leg_lengths(_plain(platform), pose)
    found = platform.gain * gough.leg_lengths(platform, pose) + platform.offset
    gap = found - ideal if kind != "rotary" else np.sin((found - ideal) / 2)
    unit = 1.0 if kind == "rotary" else platform.size
    np.testing.assert_allclose(gap / unit, 0, atol=1e-14)


@given(support.seeds)
def test_readings_are_mujocos_tendons_through_offset_and_gain(seed: int) -> None:
    platform = machines.random_platform(seed, "length_change", sensors=True)
    pose = support.sample(platform, (), seed)
    length, _ = mujoco_model.measure(platform, pose)
    home, _ = mujoco_model.measure(platform, platform.home)
    expected = (length - home - platform.offset) / platform.gain
    found = gough.leg_lengths(platform, pose)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * platform.size)


@given(support.seeds, st.sampled_from(KINDS), st.sampled_from(["home", "polynomial-3"]))
@support.at_most(15)
def test_inverse_then_forward_gives_the_pose_back(seed: int, kind: str, start: str) -> None:
    """In blocks (100 rows), alone (1 row) and from the tracker."""
    platform = machines.random_platform(seed, kind, sensors=True)
    pose = support.sample(platform, (100,), seed)
    legs = gough.leg_lengths(platform, pose)
    found = gough.solve(platform, legs, seed=start)
    assert np.all(found.usable)
    shift, turn = found.pose.distance(pose)
    assert np.max(shift) < 1e-10 * platform.size
    assert np.max(turn) < 1e-10
    alone = gough.solve(platform, legs[0], seed=start)
    tracker = gough.Tracker(platform, start=pose[0])
    for one in (alone.pose, tracker.update(legs[0])):
        support.assert_same_pose(one.inverse() @ pose[0], gough.Pose.identity(), 1e-9)


def test_stroke_limits_are_of_the_readings_as_they_come() -> None:
    plain = replace(Platform.load("reference"), stroke=(600, 700))
    shifted = replace(plain, offset=100.0, stroke=(500, 600))
    assert gough.solve(shifted, np.full(6, 599.0)).status.usable
    assert gough.solve(shifted, np.full(6, 601.0)).status == gough.Status.OUTSIDE_STROKE
    with pytest.raises(PlatformError, match=r"stroke\[0\]: forbids the home pose"):
        replace(shifted, offset=0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_every_mode_has_the_readings(kind: str) -> None:
    platform = machines.random_platform(3, kind, sensors=True)
    modes = gough.assembly_modes(platform, platform.home_legs)
    plain = gough.assembly_modes(_plain(platform), _plain(platform).home_legs)
    assert len(modes.pose) == len(plain.pose)
    assert np.all(modes.residual < 1e-9 * platform.size)
    passed = gough.choose_mode(modes).passed
    shift, _ = modes.pose[passed].distance(platform.home)
    assert np.min(shift) < 1e-9 * platform.size


@pytest.mark.parametrize("kind", KINDS)
def test_torch_agrees(kind: str) -> None:
    torch = pytest.importorskip("torch")
    import gough.learn
    from gough.learn.data import edge_lengths

    platform = machines.random_platform(5, kind, sensors=True)
    pose = support.sample(platform, (4,))
    legs = gough.leg_lengths(platform, pose)
    position, rotation = torch.tensor(pose.position.copy()), torch.tensor(pose.rotation)
    ours = gough.learn.leg_lengths(platform, position, rotation)
    np.testing.assert_allclose(ours, legs, rtol=1e-12, atol=1e-13 * platform.size)
    solved = gough.learn.solve(platform, torch.tensor(legs))
    np.testing.assert_allclose(solved.position, position, atol=1e-9 * platform.size)
    if kind != "rotary":
        lengths = np.linalg.norm(gough.kinematics.strut_vectors(platform, pose), axis=-1)
        np.testing.assert_allclose(edge_lengths(platform, legs), lengths)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("gain = 0", "gain[0]: expected a number other than 0, found 0.0"),
        ("gain = [1, 1, 1, nan, 1, 1]", "gain[3]: expected a finite number, found nan"),
        ("offset = [1, 2]", "offset: expected one number, or six for the six legs, got shape (2,)"),
        ("offset = 'home'", "offset: expected a number, found 'home'"),
    ],
)
def test_wrong_fields_are_named(line: str, message: str) -> None:
    text = Platform.load("reference").to_toml()
    with pytest.raises(PlatformError) as caught:
        from_toml(f"{line}\n{text}")
    assert message in str(caught.value)


def test_one_number_stands_for_six() -> None:
    text = Platform.load("reference").to_toml()
    platform = from_toml(f"offset = 2\ngain = 1.5\n{text}")
    assert platform.offset.tolist() == [2.0] * 6
    assert platform.gain.tolist() == [1.5] * 6
    assert "offset" not in text

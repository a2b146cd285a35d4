"""The universal network: what must not matter to it, and what it says of itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st
from machines import permuted, random_platform

import gough
from gough.seeds.base import find_seed
from gough.seeds.network import seal
from gough.seeds.taylor import HomeStruts, series
from gough.seeds.universal import ORDER, UniversalSeed
from gough.units import scaled

few = support.at_most(12)
seeds = st.integers(0, 10**6)
kinds = st.sampled_from(["telescopic", "length_change", "rotary"])


def changes(platform: gough.Platform, legs: np.ndarray) -> np.ndarray:
    """The network's answer before any Newton step: strut length changes by leg, (6, N)."""
    home = HomeStruts.of(platform, legs)
    terms = np.stack(series(home.base, home.joints, home.inverse, home.change, ORDER))
    found = UniversalSeed(platform)._corrected(home, terms)
    return np.moveaxis(found, 1, 0).reshape(6, -1)


def wide(platform: gough.Platform) -> np.ndarray:
    """Readings of poses far from home, (5, 6)."""
    far = platform.with_workspace(0.08 * platform.size, 20)
    legs = gough.leg_lengths(far, far.sample_poses(8, seed=3))
    return legs[np.isfinite(legs).all(-1)]


@few
@given(seeds, kinds)
def test_frames_of_base_and_platform(seed, kind):
    platform = random_platform(seed, kind)
    rng = np.random.default_rng(seed)
    a, b = (gough.Pose(rng.normal(size=3) * platform.size, rng.normal(size=4)) for _ in range(2))
    pivot = platform.pivot_point
    arms = platform.rotary
    if arms is not None:
        turn = a.rotation.T
        arms = replace(arms, axis_x=arms.axis_x @ turn, axis_y=arms.axis_y @ turn)
    # the pose with a pivot c stands for the motion x -> R (x - c) + c + t
    home = platform.home
    plain = gough.Pose(home.position + pivot - home.rotation @ pivot, home.wxyz)
    other = replace(
        platform,
        base=a.apply(platform.base),
        moving=b.apply(platform.moving),
        home=a @ plain @ b.inverse(),
        pivot=None,
        rotary=arms,
        workspace=None,
        stroke=None,
    )
    legs = wide(platform)
    np.testing.assert_allclose(changes(other, legs), changes(platform, legs), atol=1e-6)
    guess, far = find_seed(platform, "universal").guess(legs), UniversalSeed(other).guess(legs)
    for i in range(len(legs)):
        g, f = guess[i], far[i]
        true = gough.Pose(g.position + pivot - g.rotation @ pivot, g.wxyz)
        away, turned = (a @ true @ b.inverse()).distance(f)
        assert away < 1e-6 * platform.size
        assert turned < 1e-6


@few
@given(seeds, kinds, st.permutations(range(6)))
def test_numbering_of_the_legs(seed, kind, order):
    platform, order = random_platform(seed, kind), np.array(order)
    legs = wide(platform)
    other = permuted(platform, order)
    np.testing.assert_allclose(
        changes(other, legs[:, order]), changes(platform, legs)[order], atol=1e-6
    )
    away, turned = (
        UniversalSeed(other).guess(legs[:, order]).distance(UniversalSeed(platform).guess(legs))
    )
    assert away.max() < 1e-6 * platform.size
    assert turned.max() < 1e-6


@few
@given(seeds, kinds, st.sampled_from([1e-3, 1e3]))
def test_unit_of_length(seed, kind, unit):
    platform = random_platform(seed, kind)
    legs = wide(platform)
    longer = legs if kind == "rotary" else unit * legs
    other = scaled(platform, unit)
    np.testing.assert_allclose(changes(other, longer), changes(platform, legs), atol=1e-6)
    guess, far = UniversalSeed(platform).guess(legs), UniversalSeed(other).guess(longer)
    np.testing.assert_allclose(far.position / unit, guess.position, atol=1e-6 * platform.size)


@few
@given(seeds, kinds)
def test_mirrored_machines(seed, kind):
    platform, flip = random_platform(seed, kind), np.array([-1.0, 1, 1])
    mirror = lambda pose: gough.Pose(pose.position * flip, pose.wxyz * [1, 1, -1, -1])  # noqa: E731
    arms = platform.rotary
    if arms is not None:
        arms = replace(arms, axis_x=arms.axis_x * flip, axis_y=arms.axis_y * flip)
    other = replace(
        platform,
        base=platform.base * flip,
        moving=platform.moving * flip,
        home=mirror(platform.home),
        pivot=None if platform.pivot is None else platform.pivot * flip,
        rotary=arms,
        workspace=None,
    )
    legs = wide(platform)
    np.testing.assert_allclose(changes(other, legs), changes(platform, legs), atol=1e-6)
    away, turned = (
        UniversalSeed(other).guess(legs).distance(mirror(UniversalSeed(platform).guess(legs)))
    )
    assert away.max() < 1e-6 * platform.size
    assert turned.max() < 1e-6


@pytest.mark.parametrize("name", ["linuxcnc_genhex", "rubin_simulink"])
def test_ties_between_joints_do_no_harm(name):
    """Machines with coincident joints or symmetric tables: a tiny change is a tiny change."""
    platform = gough.Platform.load(name)
    legs = wide(platform)
    rng = np.random.default_rng(0)
    shaken = replace(platform, base=platform.base + 1e-9 * platform.size * rng.normal(size=(6, 3)))
    np.testing.assert_allclose(changes(shaken, legs), changes(platform, legs), atol=1e-6)


@pytest.mark.parametrize(
    ("name", "box"),
    [
        ("reference", (0.08, 30)),
        ("nasa_msfc", (0.08, 30)),
        ("matlab_stewart", (0.08, 30)),
        ("linuxcnc_genhex", (0.08, 30)),
        ("reachy_mini", (0.08, 15)),
        ("dietmaier", (0.04, 15)),
        ("rubin_camera", (0.05, 6)),
    ],
)
def test_errors_and_their_prediction(name, box):
    """Machines that no training saw; the mean error [share of the size], and 99 % below 3 x."""
    platform = gough.Platform.load(name)
    platform = platform.with_workspace(box[0] * platform.size, box[1])
    pose = platform.sample_poses(500, seed=1)
    pose = pose[gough.assembly_sign(platform, pose) > 0]
    guess = UniversalSeed(platform).guess_with_error(gough.leg_lengths(platform, pose))
    away, turned = guess.pose.distance(pose)
    assert away.mean() < 5e-5 * platform.size
    assert np.mean(away < 3 * guess.position_error) >= 0.99
    assert np.mean(turned < 3 * guess.rotation_error) >= 0.99
    # and not by being afraid of everything
    assert np.median(guess.position_error / away) < 3


def test_poses_beyond_a_singularity_are_exchanged_for_their_twins():
    """Far from what it was trained on the network's own answer can be in another assembly mode."""
    platform = gough.Platform.load("rubin_camera")
    platform = platform.with_workspace(0.08 * platform.size, 15)
    pose = platform.sample_poses(2000, seed=1)
    pose = pose[gough.assembly_sign(platform, pose) > 0]
    legs = gough.leg_lengths(platform, pose)
    alone = UniversalSeed(platform, polished=False).guess(legs)
    assert np.sum(gough.assembly_sign(platform, alone) < 0) > 5
    guess = UniversalSeed(platform).guess(legs)
    assert np.all(gough.assembly_sign(platform, guess) > 0)
    assert np.max(guess.distance(pose)[0]) < 0.01 * platform.size


def test_motors_cost_little_more():
    """Rotary legs: one reading of the machine for all rows, and its own for those that need it."""
    platform = gough.Platform.load("reachy_mini")
    platform = platform.with_workspace(0.08 * platform.size, 30)
    pose = platform.sample_poses(400, seed=2)
    legs = gough.leg_lengths(platform, pose)
    good = np.isfinite(legs).all(-1) & (gough.assembly_sign(platform, pose) > 0)
    seed, read = UniversalSeed(platform), []
    run = seed._run
    seed._run = lambda struts, terms: (read.append(len(struts.base)), run(struts, terms))[1]
    away = seed.guess(legs[good]).distance(pose[good])[0]
    assert read[0] == 1
    assert 0 < read[1] < 0.4 * len(away)
    assert away.mean() < 5e-6 * platform.size


def test_any_readings_give_a_finite_pose_and_say_how_far_it_may_be():
    platform = gough.Platform.load("reference")
    legs = platform.home_legs * np.array([[1.0], [0.1], [1e30], [1e300]])
    guess = UniversalSeed(platform).guess_with_error(legs)
    assert np.all(np.isfinite(guess.pose.position))
    assert guess.position_error[0] < 1e-9 * platform.size
    assert np.all(guess.position_error[1:] > 1e-3 * platform.size)
    assert len(UniversalSeed(platform).guess(np.zeros((0, 6)))) == 0


def test_a_network_tuned_for_another_platform_is_refused(tmp_path):
    reference, other = (gough.Platform.load(n) for n in ("reference", "nasa_msfc"))
    shipped = UniversalSeed(reference)
    assert shipped.facts["platform"] is None
    file = tmp_path / "network.onnx"
    content = _shipped_body()
    tuned = content.replace(b'"platform": null', b'"platform": "no"')
    file.write_bytes(seal(tuned))
    with pytest.raises(gough.GoughError, match="fine-tuned for platform"):
        UniversalSeed(other, tmp_path)
    file.write_bytes(content[:-9])
    with pytest.raises(gough.GoughError, match="truncated"):
        UniversalSeed(other, tmp_path)


def _shipped_body() -> bytes:
    from importlib import resources

    from gough.seeds.network import _unseal

    content = resources.files("gough").joinpath("weights", "universal.onnx").read_bytes()
    return _unseal(content, "universal")


def test_auto_takes_it_for_a_guess_alone():
    platform = gough.Platform.load("reference")
    assert gough.Solver(platform, max_iterations=0).seed.name == "universal"
    assert gough.Solver(platform).seed.name == "polynomial-3"
    assert gough.Solver(replace(platform, workspace=None)).seed.name == "home"

"""Home's assembly mode: one rule, in Python and compiled, and the statuses that come from it."""

import logging
from dataclasses import replace

import machines
import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import Platform, Pose, Status
from gough.home_mode import (
    ROTATION_STEP,
    SAME_TIP,
    TRANSLATION_STEP,
    in_home_mode,
    pose_status,
    reached_from,
    sure_workspace,
)
from gough.kernel import home_mode, layout
from gough.kernel.constants import kernel_constants, to_internal
from gough.kernel.jit import jit
from gough.kernel.pose_io import put_pose, put_reading
from gough.status import InverseStatus


@jit(cache=False)
def _reached_from(constants, legs, poses, start, buffer, work):
    """Numbers (N,) that are 1 where the compiled rule holds for internal poses (N, 7)."""
    found = np.zeros(len(poses))
    for n in range(len(poses)):
        put_reading(constants, legs, n, buffer, layout.FIRST, layout.SINGLE)
        put_pose(buffer, layout.FIRST, layout.SINGLE, poses, n)
        way = start[0, :3], start[0, 3:]
        found[n] = 1.0 if home_mode.reached_from(constants, buffer, way, work) else 0.0
    return found


def _around(platform: Platform, count: int, seed: int, width=0.4, angle=120.0) -> Pose:
    """Poses far in and out of any workspace that have readings."""
    wide = platform.with_workspace(width * platform.size, [[-angle, angle], [-80, 80], [-90, 90]])
    pose = wide.sample_poses(count, seed)
    return pose[np.all(np.isfinite(gough.leg_lengths(platform, pose)), axis=-1)]


@support.at_most(20)
@given(support.seeds, st.sampled_from(["telescopic", "length_change", "rotary"]))
def test_the_compiled_rule_is_the_plain_one(seed, legs) -> None:
    platform = machines.random_platform(seed, legs, sensors=True)
    pose = _around(platform, 60, seed)
    constants = kernel_constants(platform)
    plain = reached_from(platform, platform.home, pose)
    compiled = _reached_from(
        constants, gough.leg_lengths(platform, pose), to_internal(constants, pose),
        to_internal(constants, platform.home)[None], np.zeros(layout.COMPONENTS),
        np.zeros((4, 6, 6)),
    )  # fmt: skip
    clear = gough.singularity_distance(platform, pose) > 1e-9
    np.testing.assert_array_equal(plain[clear], compiled[clear])
    assert np.all(gough.assembly_sign(platform, pose[plain]) > 0)


def test_the_same_sign_is_not_enough() -> None:
    """Dietmaier's home has home's sign in several of its forty poses; few are near."""
    platform = replace(Platform.load("dietmaier"), workspace=None)
    modes = gough.assembly_modes(platform, platform.home_legs)
    same = modes.sign > 0
    ours = in_home_mode(platform, modes.pose)
    assert ours[0]
    assert 1 <= ours.sum() < same.sum()
    assert not np.any(ours & ~same)


@support.at_most(12)
@given(support.seeds, st.floats(0.3, 3.0))
def test_a_workspace_never_makes_answers_worse(seed, share) -> None:
    """With any box, stated or not, the same poses are usable."""
    platform = machines.random_platform(seed)
    free = replace(platform, workspace=None, stroke=None)
    pose = free.with_workspace(0.1 * free.size, 12.0).sample_poses(30, seed)
    stated = free.with_workspace(share * 0.05 * free.size, share * 6.0)
    legs = gough.leg_lengths(free, pose)
    without, within = gough.solve(free, legs, seed="home"), gough.solve(stated, legs)
    both = without.usable & within.usable
    assert np.all(within.usable | ~without.usable)
    assert np.all(without.pose.distance(within.pose)[0][both] < 1e-8 * free.size)
    inside = stated.in_workspace(pose)
    expected = np.where(inside, Status.CONVERGED, Status.OUTSIDE_WORKSPACE)
    np.testing.assert_array_equal(within.status[both], expected[both])
    true = without.pose.distance(pose)[0] < 1e-8 * free.size
    assert np.all(true == (within.pose.distance(pose)[0] < 1e-8 * free.size))
    assert true.mean() > 0.9


@pytest.mark.parametrize("name", ["reference", "nasa_msfc", "rubin_camera", "reachy_mini"])
def test_solve_and_inverse_say_the_same(name) -> None:
    """Status for status, far in and out of all limits."""
    platform = Platform.load(name)
    if platform.stroke is None:
        room = (0.4 if platform.rotary else 0.1 * platform.size) * np.array([-1, 1])
        platform = replace(platform, stroke=platform.home_legs[:, None] + room)
    near, far = platform.sample_poses(100), _around(platform, 400, seed=4, width=0.25, angle=100)
    pose = Pose(np.vstack([near.position, far.position]), np.vstack([near.wxyz, far.wxyz]))
    legs = gough.leg_lengths(platform, pose)
    solution = gough.solve(platform, legs)
    found = solution.usable | (solution.status == Status.OTHER_MODE)
    same = found & (solution.pose.distance(pose)[0] < 1e-8 * platform.size)
    inverse = pose_status(platform, pose, legs)
    clear = same & (solution.status != Status.NEAR_SINGULARITY)
    labels = [InverseStatus(int(s)).label for s in inverse[clear]]
    words = {"converged": "ok"}
    expected = [Status(int(s)).label for s in solution.status[clear]]
    assert labels == [words.get(word, word) for word in expected]
    usable = [InverseStatus(int(s)).usable for s in inverse[clear]]
    np.testing.assert_array_equal(usable, solution.usable[clear])
    assert len({*labels}) >= 3


def test_a_mirror_image_is_another_mode_in_every_batch_size() -> None:
    platform = Platform.load("reference")
    pose = platform.sample_poses(2_000, seed=1)
    w, x, y, z = pose.wxyz.T
    mirror = Pose(pose.position * [1, 1, -1], np.stack([w, -x, -y, z], axis=-1))
    legs = gough.leg_lengths(platform, pose)
    for some in (slice(3), slice(None)):
        found = gough.solve(platform, legs[some], seed=mirror[some])
        assert np.all(found.status == Status.OTHER_MODE)
        assert not found.usable.any()
        assert found.pose.distance(mirror[some])[0].max() < 1e-9


@pytest.mark.parametrize("legs", ["telescopic", "length_change"])
def test_blocks_of_rows_get_the_statuses_that_rows_get_alone(legs) -> None:
    """Where no workspace is stated, many rows are looked at side by side (`kernel.ways`)."""
    platform = replace(machines.random_platform(3, legs), workspace=None)
    readings = gough.leg_lengths(platform, _around(platform, 1_100, 5, width=0.25, angle=50))
    low, high = np.percentile(readings, [2, 98], axis=0)
    platform = replace(platform, stroke=np.stack([low, high], axis=-1))
    solver = gough.Solver(platform)
    many, few = solver(readings).status, [solver(half).status for half in np.split(readings, 2)]
    assert {Status.CONVERGED, Status.OUTSIDE_STROKE, Status.OTHER_MODE} <= set(many)
    np.testing.assert_array_equal(many, np.concatenate(few))


def test_a_seed_near_the_pose_says_that_the_machine_goes_there() -> None:
    """Poses of home's sign that the straight way from home does not reach."""
    platform = replace(Platform.load("reference"), workspace=None)
    pose = _around(platform, 4_000, seed=9, width=0.3, angle=170)
    hidden = (gough.assembly_sign(platform, pose) > 0) & ~in_home_mode(platform, pose)
    pose = pose[hidden & (gough.singularity_distance(platform, pose) > 0.05)]
    assert len(pose) > 10
    legs = gough.leg_lengths(platform, pose)
    assert np.all(gough.solve(platform, legs, seed=pose).status == Status.CONVERGED)


def test_points_of_the_way_are_near_enough(monkeypatch) -> None:
    """Far poses of home's sign beyond two singularities: fewer points see fewer of them."""
    platform = replace(Platform.load("reference"), workspace=None)
    pose = _around(platform, 3_000, seed=9, width=0.3, angle=170)
    seen = []
    for factor in (0.2, 1.0, 20.0):
        monkeypatch.setattr("gough.home_mode.TRANSLATION_STEP", factor * TRANSLATION_STEP)
        monkeypatch.setattr("gough.home_mode.ROTATION_STEP", factor * ROTATION_STEP)
        monkeypatch.setattr("gough.home_mode.MOST_POINTS", 320)
        seen.append(reached_from(platform, platform.home, pose).sum())
    assert seen[0] <= seen[1] < seen[2]
    assert seen[1] - seen[0] < 0.002 * len(pose)


@pytest.mark.parametrize("bend", [SAME_TIP / 10, SAME_TIP * 10])
def test_motors_on_their_other_branch_are_another_mode(bend) -> None:
    """An arm that is bent away from its rod by little: both branches give nearly one tip."""
    platform = replace(Platform.load("reachy_mini"), workspace=None)
    assert platform.rotary is not None
    constants = kernel_constants(platform)
    legs = platform.home_legs[None].copy()
    legs[0, 2] += bend * platform.size / platform.rotary.arm_length[2]
    home = to_internal(constants, platform.home)[None]
    work = np.zeros(layout.COMPONENTS), np.zeros((4, 6, 6))
    found = _reached_from(constants, legs, home, home, *work)
    assert found[0] == (bend < SAME_TIP)


def test_a_sure_workspace_holds_no_pose_of_another_sign() -> None:
    for seed in range(20):
        platform = replace(machines.general_platform(seed), workspace=None)
        box = sure_workspace(platform)
        if box is not None:
            poses = box.sample(platform.home, 3_000, seed=seed)
            assert np.mean(gough.assembly_sign(platform, poses) < 0) < 2e-3


# ---- a singular home ------------------------------------------------------------------


def _singular() -> Platform:
    """The reference platform turned by 90 deg about its normal (Fichter 1986)."""
    reference = Platform.load("reference")
    turn = Pose.from_euler(reference.home.position, [0, 0, np.pi / 2])
    return replace(reference, home=turn, workspace=None, name="singular")


def test_a_singular_home_is_said_at_load(tmp_path, caplog) -> None:
    _singular().save(tmp_path / "mine.toml")
    with caplog.at_level(logging.WARNING, "gough"):
        Platform.load(tmp_path / "mine.toml")
        assert "home pose is singular" in caplog.text
        caplog.clear()
        Platform.load("reference")
    assert not caplog.text


def test_beside_a_singular_home_the_modes_decide() -> None:
    """Either the right pose, or AMBIGUOUS; without the modes a third is wrong and CONVERGED."""
    platform = _singular()
    pose = platform.with_workspace(60, 20).sample_poses(40, seed=1)
    legs = gough.leg_lengths(platform, pose)
    found = gough.solve(platform, legs)
    true = found.pose.distance(pose)[0] < 1e-8 * platform.size
    assert not np.any(found.usable & ~true)
    assert Status.AMBIGUOUS in found.status
    given = gough.solve(platform, legs, seed=pose)
    assert np.all(given.usable)
    assert given.pose.distance(pose)[0].max() < 1e-6 * platform.size

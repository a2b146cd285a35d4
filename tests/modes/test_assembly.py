"""All poses of leg readings: complete, exact, repeatable, for every kind of leg."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import balls
import numpy as np
import pytest
from machines import ALL, TELESCOPIC, general_platform
from modes.poses import found, poses_of

import gough
from gough.kernel.paths import track_paths
from gough.modes import assembly
from gough.modes.frames import distances
from gough.modes.starts import find_start_system
from gough.status import ModesStatus


@pytest.fixture(scope="module")
def dietmaier() -> gough.AssemblyModes:
    platform = gough.Platform.load("dietmaier")
    return gough.assembly_modes(platform, platform.home_legs)


def test_dietmaier_has_forty_real_poses(dietmaier):
    assert len(dietmaier) == dietmaier.solutions == 40
    assert dietmaier.paths.tolist() == [40, 0, 0, 0]
    assert dietmaier.residual.max() <= 1e-12
    assert dietmaier.certified.all()


def test_dietmaiers_poses_are_proven_different(dietmaier):
    """Each pose is farther from every other than both can be from their solutions."""
    proof = dietmaier.certificate
    for k in range(40):
        shift, turn = dietmaier.pose[k].distance(dietmaier.pose)
        apart = np.maximum(shift, turn)
        apart[k] = np.inf
        assert np.all(apart > 1e3 * (proof.error[k] + proof.error))


def test_same_call_same_bits(dietmaier):
    platform = dietmaier.platform
    for _ in range(5):
        again = gough.assembly_modes(platform, platform.home_legs)
        assert np.array_equal(again.pose.position, dietmaier.pose.position)
        assert np.array_equal(again.pose.wxyz, dietmaier.pose.wxyz)


@pytest.mark.parametrize("name", ["reference", "reachy_mini"])
def test_bits_do_not_depend_on_workers_or_neighbours(name):
    platform = gough.Platform.load(name)
    legs = gough.leg_lengths(platform, poses_of(platform, 300))
    one = gough.assembly_modes(platform, legs, workers=1)
    three = gough.assembly_modes(platform, legs, workers=3)
    assert np.array_equal(one.pose.position, three.pose.position)
    for k in (0, 7, 131, 299):
        alone = gough.assembly_modes(platform, legs[k])
        assert np.array_equal(alone.pose.position, one[k].pose.position)
        assert np.array_equal(alone.pose.wxyz, one[k].pose.wxyz)


@pytest.mark.parametrize("name", ALL)
def test_truth_is_among_the_modes(name):
    platform = gough.Platform.load(name)
    truth = poses_of(platform, 200)
    modes = gough.assembly_modes(platform, gough.leg_lengths(platform, truth))
    assert found(modes, truth).all()
    assert np.all(modes.status == ModesStatus.COMPLETE)
    assert modes.certified.all()
    assert modes.residual.max() <= 1e-12 * platform.size


@pytest.mark.parametrize("name", [*TELESCOPIC, "rubin_simulink"])
def test_newton_from_random_starts_finds_nothing_more(name):
    from check_modes import check

    line = check(gough.Platform.load(name), poses=12, starts=300)
    _, poses, complete, truth, _, searches, unknown, _, _ = line
    assert (complete, truth, unknown) == (poses, poses, 0)
    assert searches > 1000


def test_random_platforms_have_forty_solutions():
    for seed in range(40):
        assert find_start_system(general_platform(seed)).count == 40


@pytest.mark.parametrize(
    ("seed", "count"),
    [
        (555730, 40),  # a path that takes the base joints there first is lost at 7e5 sizes
        (429466, 38),  # two solutions at 1e5 sizes, which count as at infinity
    ],
)
def test_solutions_that_pass_far_away_are_found_from_any_random_numbers(seed, count):
    platform = general_platform(seed)
    assert {find_start_system(platform, number).count for number in range(5, 25)} == {count}


@pytest.mark.parametrize(
    ("base", "moving", "planar", "count"),
    [
        (range(6), range(6), True, 40),
        (range(6), [0, 0, 1, 1, 2, 2], False, 16),
        ([0, 0, 1, 1, 2, 2], [0, 1, 1, 2, 2, 0], False, 16),
        (range(6), [0, 0, 1, 1, 2, 3], False, 32),
        (range(6), [0, 0, 0, 1, 1, 2], False, 8),
    ],
)
def test_special_platforms_have_fewer_solutions(base, moving, planar, count):
    """Counts from the literature: 6-3: 16 (Innocenti, Parenti-Castelli 1990), 6-4: 32."""
    assert find_start_system(general_platform(4, base, moving, planar)).count == count


@pytest.mark.parametrize(
    ("name", "count"), [("reference", 28), ("nasa_msfc", 28), ("linuxcnc_genhex", 16)]
)
def test_planar_machines_track_one_of_each_pair(name, count):
    start = find_start_system(gough.Platform.load(name))
    assert start.paired
    assert (start.count, len(start.poses)) == (count, count // 2)


def test_another_seed_finds_the_same_count():
    for name in ALL:
        platform = gough.Platform.load(name)
        assert find_start_system(platform, 11).count == find_start_system(platform, 12).count


def test_stored_start_system_is_reproduced_and_proven(capsys, monkeypatch):
    import start_system

    monkeypatch.setattr("sys.argv", ["start_system.py", "--check"])
    assert start_system.main() == 0
    said = capsys.readouterr().out
    assert "certified: 40" in said
    assert "same bits as stored" in said


def test_all_complex_ends_are_proven_in_ball_arithmetic():
    """Forty solutions of three platforms, real and complex, each proven, none twice."""
    for seed in range(3):
        platform = general_platform(seed)
        start = find_start_system(platform)
        base, squares = (
            start.frames.base(platform.base),
            start.frames.squares(platform.home_lengths),
        )
        poses = track_paths(start.poses, start.at, squares[None].astype(complex)).finite()
        assert len(poses) == 40
        for pose in poses:
            proof = balls.prove(base, start.frames.moving, squares, pose[3:], pose[:3], steps=2)
            assert proof is not None
            assert proof.error < 1e-12 * proof.radius
        gaps = distances(poses, poses) + np.eye(40)
        assert gaps.min() > 1e-4


@pytest.mark.parametrize("name", ["dietmaier", "matlab_stewart", "reachy_mini"])
def test_readings_that_fail_at_first_are_done_again(name, monkeypatch):
    """With steps of twenty radii many paths are lost; the answer must be the same."""
    platform = gough.Platform.load(name)
    legs = gough.leg_lengths(platform, poses_of(platform, 30))
    usual = gough.assembly_modes(platform, legs)
    again, redone = assembly.track_again, []
    monkeypatch.setattr(assembly, "SHARE", 20.0)
    monkeypatch.setattr(
        assembly, "track_again", lambda *args: redone.append(args[2]) or again(*args)
    )
    hasty = gough.assembly_modes(platform, legs)
    assert redone
    assert np.array_equal(hasty.row, usual.row)
    assert np.array_equal(hasty.status, usual.status)
    assert np.abs(hasty.pose.position - usual.pose.position).max() < 1e-8 * platform.size


def test_length_changes_and_pivot():
    """The Rubin hexapod's own test: lengths are changes, rotation about a far pivot."""
    platform = gough.Platform.load("rubin_simulink")
    assert platform.legs == "length_change"
    pose = poses_of(platform, 20)
    modes = gough.assembly_modes(platform, gough.leg_lengths(platform, pose))
    back = gough.leg_lengths(platform, modes.pose)
    assert np.abs(back - modes.readings).max() < 1e-12 * platform.size


def test_invalid_rows_are_answered_in_place():
    platform = gough.Platform.load("reference")
    legs = np.tile(platform.home_legs, (4, 1))
    legs[1, 2], legs[2, 0] = np.nan, -5.0
    modes = gough.assembly_modes(platform, legs)
    invalid, complete = ModesStatus.INVALID_INPUT, ModesStatus.COMPLETE
    assert modes.status.tolist() == [complete, invalid, invalid, complete]
    assert modes.counts.tolist() == [16, 0, 0, 16]
    assert len(modes) == 4
    assert [len(one) for one in modes] == [16, 0, 0, 16]


@pytest.mark.parametrize("name", ["reference", "reachy_mini"])
def test_all_batch_axes_are_answered(name):
    """Sets of a batch (2, 3) are those of its six rows, by number, by index and by iteration."""
    platform = gough.Platform.load(name)
    legs = gough.leg_lengths(platform, poses_of(platform, 6))
    flat = gough.assembly_modes(platform, legs)
    modes = gough.assembly_modes(platform, legs.reshape(2, 3, 6))
    assert np.array_equal(modes.row, flat.row)
    assert np.array_equal(modes.counts, flat.counts.reshape(2, 3))
    assert (len(modes), modes.status.shape, modes.paths.shape) == (2, (2, 3), (2, 3, 4))
    assert "of 6 sets" in repr(modes)
    nested = [one for half in modes for one in half]
    for one, other, single in zip(
        nested, flat, (modes[k // 3, k % 3] for k in range(6)), strict=True
    ):
        for part in (one, single):
            assert np.array_equal(part.pose.position, other.pose.position)
            assert np.array_equal(part.certificate.radius, other.certificate.radius)
            assert np.array_equal(part.residual, other.residual)
            assert (part.status, len(part), part.row.sum()) == (other.status, len(other), 0)
    last = modes[:, -1:]
    assert np.array_equal(last.legs, legs.reshape(2, 3, 6)[:, -1:])
    assert np.array_equal(last.pose.position[last.row == 1], flat[5].pose.position)
    choice = gough.choose_mode(modes, near=gough.Pose(np.zeros((2, 3, 3)), [1, 0, 0, 0]))
    assert choice.count.shape == (2, 3)
    assert len(choice.best) == 6


@pytest.mark.parametrize("length", [1e20, 1e60, 1e308])
def test_huge_readings_have_no_pose(length):
    platform = gough.Platform.load("reference")
    modes = gough.assembly_modes(platform, [[length, *platform.home_legs[1:]], platform.home_legs])
    assert modes.counts.tolist() == [0, 16]
    choice = gough.choose_mode(modes)
    assert choice.count.tolist() == [0, 1]


def test_unreachable_legs_have_no_pose_and_the_list_is_complete():
    platform = gough.Platform.load("reference")
    modes = gough.assembly_modes(platform, [655.5, 655.5, 655.5, 655.5, 655.5, 2000.0])
    assert len(modes) == 0
    assert modes.complete


def test_no_readings_at_all():
    platform = gough.Platform.load("reference")
    modes = gough.assembly_modes(platform, np.zeros((0, 6)))
    assert len(modes) == 0


def test_wrong_shape_names_what_was_expected():
    platform = gough.Platform.load("reference")
    with pytest.raises(gough.GoughError, match=r"legs: expected \(\.\.\., 6\)"):
        gough.assembly_modes(platform, [1.0, 2.0])


def test_every_status_has_a_sentence():
    for status in ModesStatus:
        assert status.text.endswith(".")


def test_start_system_is_part_of_the_package():
    import gough.modes

    assert (Path(gough.modes.__file__).parent / "start_system.npz").is_file()


def test_a_machine_that_is_too_badly_scaled_is_refused():
    camera = gough.Platform.load("rubin_camera")
    far = replace(camera, home=gough.Pose((1000.0, 0, 0)), stroke=None, workspace=None)
    with pytest.raises(gough.GoughError, match="no pose of 'rubin_camera' was found"):
        gough.assembly_modes(far, far.home_legs)

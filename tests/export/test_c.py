"""The exported C against the Python that it repeats."""

from __future__ import annotations

from dataclasses import replace

import machines
import numpy as np
import pytest
import support
from exported import Machine
from exported.drives import faulty, path, taken, tracked
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import Event, Platform, Pose, Status, Tracker
from gough.export.c import STATUSES
from gough.export.tables import MAX_STEPS
from gough.quaternion import product

KINDS = ("reference", "rubin_camera", "reachy_mini", "linuxcnc_genhex")
REALS = {"double": 1e-12, "float": 2e-6}  # error of a pose, as a share of the size
few = support.at_most(10)


def shift(platform: Platform, a: Pose, b: Pose) -> np.ndarray:
    """Distances of the positions, as a share of the size."""
    return a.distance(b)[0] / platform.size


@pytest.mark.parametrize("real", REALS)
@pytest.mark.parametrize("name", Platform.catalog())
def test_a_smooth_drive_is_followed_as_in_python(built, name: str, real) -> None:
    platform, machine = Platform.load(name), built(name, real)
    legs = gough.leg_lengths(platform, path(platform, 500, seed=1)).astype(machine.real)
    poses, events, statuses = tracked(Tracker(platform), legs.astype(float))
    rows = machine.track(legs)
    np.testing.assert_array_equal(rows.event, events)
    np.testing.assert_array_equal(rows.status, statuses)
    assert shift(platform, rows.pose, poses).max() <= REALS[real]
    assert rows.pose.distance(poses)[1].max() <= 4 * REALS[real]
    assert rows.steps[1:].max() <= 5


@support.at_most(6)
@given(st.sampled_from(KINDS), support.seeds)
def test_faults_have_the_events_of_python(built, name: str, seed: int) -> None:
    """Compare events to the letter; where other starts are involved, within 30 cycles."""
    platform = Platform.load(name)
    drive = path(platform, 400, seed, cycles=1000.0)
    legs, _ = faulty(platform, drive, seed)
    legs[300:] = gough.leg_lengths(platform, drive[::-1])[300:]  # lasting, then smooth
    poses, events, _ = tracked(Tracker(platform), legs)
    rows = built(name).track(legs)
    other = np.flatnonzero(rows.event != events)
    assert np.all(rows.next_start[other] > 0)
    assert not np.any(other > 370)
    assert shift(platform, rows.pose, poses)[-30:].max() <= 1e-12
    assert rows.steps.max() <= MAX_STEPS


@few
@given(st.sampled_from(KINDS), st.sampled_from(list(REALS)), support.seeds)
def test_solving_from_a_guess_is_as_in_python(built, name: str, real, seed: int) -> None:
    platform, machine = Platform.load(name), built(name, real)
    pose = support.sample(platform, (50,), seed)
    legs = gough.leg_lengths(platform, pose).astype(machine.real)
    twist = np.random.default_rng(seed).uniform(-1, 1, (50, 6)) * np.repeat(
        [0.02 * platform.size, 0.02], 3
    )
    guess = support.moved(pose, twist)
    expected = gough.solve(platform, legs.astype(float), seed=guess)
    rows = machine.solve(legs, guess)
    np.testing.assert_array_equal(rows.status, expected.status)
    assert shift(platform, rows.pose, expected.pose).max() <= REALS[real]
    assert rows.residual.max() <= REALS[real] * platform.size


@few
@given(st.sampled_from(KINDS), st.sampled_from(list(REALS)), support.seeds)
def test_inverse_jacobian_and_twist_are_those_of_python(built, name, real, seed: int) -> None:
    platform, machine = Platform.load(name), built(name, real)
    pose, allowed = support.sample(platform, (), seed), 50 * REALS[real]
    unit = 1.0 if platform.rotary else platform.size
    code, legs = machine.inverse(pose)
    assert code == 0
    np.testing.assert_allclose(legs / unit, gough.leg_lengths(platform, pose) / unit, atol=allowed)
    columns = np.repeat([platform.size, 1.0], 3) / unit
    J = gough.jacobian(platform, pose) * columns
    np.testing.assert_allclose(machine.jacobian(pose) * columns, J, atol=allowed * np.abs(J).max())
    twist = np.random.default_rng(seed).uniform(-1, 1, 6)
    rates = gough.leg_rates(platform, pose, twist * np.repeat([platform.size, 1.0], 3))
    status, found = machine.twist(pose, rates)
    assert status == Status.CONVERGED
    np.testing.assert_allclose(found / np.repeat([platform.size, 1.0], 3), twist, atol=allowed)


@pytest.mark.parametrize("legs", ["telescopic", "length_change", "rotary"])
@pytest.mark.parametrize("seed", [1])
def test_any_platform_is_followed(built, legs: str, seed: int) -> None:
    platform = machines.random_platform(seed, legs, sensors=True)
    readings = gough.leg_lengths(platform, path(platform, 300, seed))
    poses, events, statuses = tracked(Tracker(platform), readings)
    rows = built(platform).track(readings)
    np.testing.assert_array_equal(rows.event, events)
    np.testing.assert_array_equal(rows.status, statuses)
    assert shift(platform, rows.pose, poses).max() <= 1e-12
    code, found = built(platform).inverse(poses[-1])
    assert code == 0
    np.testing.assert_allclose(found, readings[-1], rtol=1e-9)
    J = gough.jacobian(platform, poses[-1])
    np.testing.assert_allclose(
        built(platform).jacobian(poses[-1]), J, rtol=1e-8, atol=1e-12 * np.abs(J).max()
    )


# ---- limits, codes and edges ----------------------------------------------------------


def test_codes_and_words_are_those_of_the_enums(built) -> None:
    machine = built("reference")
    text = lambda pointer: machine.ffi.string(pointer).decode()  # noqa: E731
    for status in STATUSES:
        assert text(machine.lib.machine_status_label(status)) == status.label
        assert bool(machine.lib.machine_usable(status)) == status.usable
    for event in Event:
        assert text(machine.lib.machine_event_label(event)) == event.label
    assert text(machine.lib.machine_status_label(99)) == "unknown"
    assert text(machine.lib.machine_version()) == gough.__version__
    assert text(machine.lib.machine_digest()) == Platform.load("reference").digest


def test_stroke_workspace_and_singularity_have_their_statuses(built) -> None:
    """From guesses at the poses themselves, in and out of every limit."""
    platform = Platform.load("nasa_msfc")
    wide = platform.with_workspace(0.1 * platform.size, 25.0).sample_poses(2000, seed=3)
    legs = gough.leg_lengths(platform, wide)
    expected = gough.solve(platform, legs, seed=wide)
    rows = built(platform).solve(legs, wide)
    np.testing.assert_array_equal(rows.status, expected.status)
    assert {Status.CONVERGED, Status.OUTSIDE_STROKE, Status.OUTSIDE_WORKSPACE} <= {*rows.status}


def test_near_a_singularity_the_status_says_so(built) -> None:
    """The reference platform turned about z by nearly 90 deg, where its legs are dependent."""
    platform = replace(Platform.load("reference"), workspace=None)
    angle = np.radians(np.linspace(60, 120, 601))
    turn = Pose.from_rotation_vector(np.zeros(3), angle[:, None] * [0, 0, 1])
    pose = Pose(platform.home.position, product(platform.home.wxyz, turn.wxyz))
    legs = gough.leg_lengths(platform, pose)
    expected = gough.solve(platform, legs, seed=pose)
    rows = built(platform).solve(legs, pose)
    clear = np.abs(gough.singularity_distance(platform, pose) - 1e-3) > 1e-6
    np.testing.assert_array_equal(rows.status[clear], np.asarray(expected.status)[clear])
    assert Status.NEAR_SINGULARITY in rows.status


@pytest.mark.parametrize("real", REALS)
def test_poses_on_the_faces_of_the_workspace_are_inside(built, real) -> None:
    for name in KINDS:
        platform, machine = Platform.load(name), built(name, real)
        box = platform.workspace
        assert box is not None
        corner = np.random.default_rng(2).integers(0, 2, (200, 6))
        low_high = np.concatenate([box.translation, np.radians(box.rotation_deg)])
        x = np.take_along_axis(low_high, corner.T, axis=1).T
        turn = Pose.from_euler(np.zeros(3), x[:, 3:])
        pose = Pose(platform.home.position + x[:, :3], product(platform.home.wxyz, turn.wxyz))
        legs = gough.leg_lengths(platform, pose)
        reached = np.all(np.isfinite(legs), axis=-1)
        rows = machine.solve(legs[reached], pose[reached])
        assert np.all(rows.status <= Status.NEAR_SINGULARITY)


def test_a_failed_solve_leaves_the_pose_alone(built) -> None:
    platform, machine = Platform.load("reference"), built("reference")
    guess = support.sample(platform, (3,))
    legs = np.array([np.full(6, np.nan), platform.home_legs * [1, 1, 1, 1, 1, 3], np.full(6, 1e9)])
    rows = machine.solve(legs, guess)
    assert rows.status[0] == Status.INVALID_INPUT
    assert np.all(np.isin(rows.status[1:], [Status.UNREACHABLE, Status.NOT_CONVERGED]))
    np.testing.assert_array_equal(rows.pose.position, guess.position)
    np.testing.assert_array_equal(rows.pose.wxyz, guess.wxyz)


def test_a_motor_that_cannot_reach_is_named(built) -> None:
    platform, machine = Platform.load("reachy_mini"), built("reachy_mini")
    aside = Pose(platform.home.position + np.array([0.06, 0.0, 0.03]))
    expected = gough.leg_lengths(platform, aside)
    code, legs = machine.inverse(aside)
    assert code == 1 + int(np.argmax(np.isnan(expected)))
    np.testing.assert_allclose(legs, expected, atol=1e-12)
    assert machine.twist(aside, np.ones(6))[0] == Status.UNREACHABLE
    status, twist = machine.twist(platform.home, [1, 1, np.nan, 1, 1, 1])
    assert status == Status.INVALID_INPUT
    assert np.all(np.isnan(twist))


def test_a_start_is_followed_from_the_first_reading(built) -> None:
    platform, machine = Platform.load("reference"), built("reference")
    drive = path(platform, 50, seed=4)
    rows = machine.track(gough.leg_lengths(platform, drive), start=drive[0])
    assert set(rows.event) == {Event.FOLLOWED}
    assert shift(platform, rows.pose, drive).max() <= 1e-12


@pytest.mark.parametrize("real", REALS)
def test_from_home_to_all_of_a_wide_workspace(built, real) -> None:
    """+-100 mm and +-60 deg on LinuxCNC's hexapod: the longest way that one call goes."""
    platform = Platform.load("linuxcnc_genhex").with_workspace(100 / 25.4, 60.0)
    pose = platform.sample_poses(8000, seed=5)
    pose = pose[gough.assembly_sign(platform, pose) > 0]
    rows = built(platform, real).solve(gough.leg_lengths(platform, pose), platform.home)
    true = shift(platform, rows.pose, pose) < (1e-9 if real == "double" else 1e-4)
    assert true.mean() >= 0.999
    assert not np.any(rows.status[~true] <= Status.OUTSIDE_WORKSPACE)
    assert rows.steps.max() <= MAX_STEPS


# ---- faults: poses called good that are not -------------------------------------------


def wrong(platform: Platform, machine: Machine, legs: np.ndarray, drive: Pose) -> int:
    """Cycles that give a new, usable pose which is not the machine's."""
    rows = machine.track(legs, start=drive[0])
    usable = taken(rows.event) & (rows.status <= Status.OUTSIDE_WORKSPACE)
    return int(np.sum(usable & ~(shift(platform, rows.pose, drive) < 1e-9)))


@pytest.fixture(params=KINDS)
def driven(request, built) -> tuple[Platform, Machine, Pose, np.ndarray]:
    platform = Platform.load(request.param)
    drive = path(platform, 400, seed=6)
    return platform, built(request.param), drive, gough.leg_lengths(platform, drive)


def test_dropouts_give_no_wrong_pose(driven) -> None:
    platform, machine, drive, legs = driven
    legs[100:120, 3] = np.nan
    legs[200:203] = np.inf
    assert wrong(platform, machine, legs, drive) == 0


def test_spikes_give_no_wrong_pose(driven) -> None:
    platform, machine, drive, legs = driven
    legs[50::25, 2] += 0.2 * (1.0 if platform.rotary else platform.size)
    assert wrong(platform, machine, legs, drive) == 0


def test_a_sensor_that_jumps_by_less_than_a_cycles_motion_cannot_be_told(driven) -> None:
    """Six readings always have a pose near by: what is within the limits is believed."""
    platform, machine, drive, legs = driven
    legs[50, 2] += 1e-4 * (1.0 if platform.rotary else platform.size)
    assert wrong(platform, machine, legs, drive) == 1


def test_a_stuck_sensor_is_followed_only_as_far_as_its_readings_have_a_pose(driven) -> None:
    """While stuck the readings are those of another pose, and nothing else; then all is well."""
    platform, machine, drive, legs = driven
    legs[100:110, 1] = legs[100, 1]
    rows = machine.track(legs, start=drive[0])
    good = taken(rows.event) & (rows.status <= Status.OUTSIDE_WORKSPACE)
    back = gough.leg_lengths(platform, rows.pose)
    scale = 1.0 if platform.rotary else platform.size
    assert np.abs(back - legs)[good].max() <= 1e-9 * scale
    assert shift(platform, rows.pose, drive)[120:].max() <= 1e-12


def test_exchanged_legs_give_no_wrong_pose(driven) -> None:
    platform, machine, drive, legs = driven
    unit = 1.0 if platform.rotary else platform.size
    legs[100:102] = legs[100:102][:, [1, 0, 2, 3, 4, 5]] + 0.1 * unit
    assert wrong(platform, machine, legs, drive) == 0


def test_a_lasting_jump_is_taken_once_three_readings_agree(driven) -> None:
    platform, machine, drive, _ = driven
    far = np.argmax(shift(platform, drive, drive[0]))
    jumped = Pose(
        np.concatenate([drive.position[:10], np.repeat(drive.position[far : far + 1], 10, 0)]),
        np.concatenate([drive.wxyz[:10], np.repeat(drive.wxyz[far : far + 1], 10, 0)]),
    )
    rows = machine.track(
        gough.leg_lengths(platform, jumped), start=drive[0], max_shift=1e-3 * platform.size,
        max_turn=0.005,
    )  # fmt: skip
    assert [*rows.event[9:15]] == [
        Event.FOLLOWED, Event.JUMPED, Event.JUMPED, Event.FOUND, Event.FOLLOWED, Event.FOLLOWED,
    ]  # fmt: skip
    assert shift(platform, rows.pose, jumped)[12:].max() <= 1e-12


def test_a_way_through_a_singularity_warns_before_readings_cannot_tell(built) -> None:
    """Beyond a singular pose two modes have the readings: the status has warned before."""
    platform = replace(Platform.load("reference"), workspace=None)
    angle = np.radians(np.linspace(0, 120, 1200))
    turn = Pose.from_rotation_vector(np.zeros(3), angle[:, None] * [0, 0, 1])
    drive = Pose(platform.home.position, product(platform.home.wxyz, turn.wxyz))
    legs = gough.leg_lengths(platform, drive)
    rows = built(platform).track(legs, start=drive[0])
    usable = taken(rows.event) & (rows.status <= Status.OUTSIDE_WORKSPACE)
    misses = np.abs(gough.leg_lengths(platform, rows.pose) - legs).max(axis=-1)
    assert misses[usable].max() <= 1e-9 * platform.size
    wrong = usable & (shift(platform, rows.pose, drive) > 1e-9)
    warned = np.flatnonzero(rows.status == Status.NEAR_SINGULARITY)
    assert len(warned)
    assert np.all(np.flatnonzero(wrong) >= warned[0])

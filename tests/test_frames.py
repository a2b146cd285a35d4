"""Poses of frames in frames: against SciPy's composition, and as they stand in files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import machines
import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation
from shell import run
from support import Floats

import gough
from gough import Frames, GoughError, InputError, Platform, PlatformError, Pose, quaternion
from gough.export.linuxcnc import in_unit
from gough.files import convert
from gough.files.trajectory import open_trajectory
from gough.platform_file import from_toml

ORDERS = st.permutations("xyz").map("".join)


def random_pose(rng: np.random.Generator, batch: tuple[int, ...] = ()) -> Pose:
    return Pose(rng.normal(size=(*batch, 3)), rng.normal(size=(*batch, 4)))


def rigid(pose: Pose) -> RigidTransform:
    return RigidTransform.from_components(pose.position, pose.as_scipy())


def machine(seed: int) -> tuple[Platform, dict[str, Pose]]:
    """A platform with six frames, in any order."""
    rng = np.random.default_rng(seed)
    names = ["base_in_world", "tool_in_platform", "work_in_world", "jig_in_work", "tip_in_tool"]
    names += ["room_in_jig"]
    rng.shuffle(names)
    poses = {name: random_pose(rng) for name in names}
    return machines.random_platform(seed).with_frames(poses), poses


@given(support.seeds)
def test_a_chain_is_that_of_scipy(seed: int) -> None:
    platform, poses = machine(seed)
    pose = random_pose(np.random.default_rng(seed + 1), (50,))
    frames = {name: rigid(p) for name, p in poses.items()}
    about = RigidTransform.from_translation(platform.pivot_point)
    hexapod = about * rigid(pose) * about.inv()
    room = frames["work_in_world"] * frames["jig_in_work"] * frames["room_in_jig"]
    tip = frames["tool_in_platform"] * frames["tip_in_tool"]
    expected = (room.inv() * frames["base_in_world"] * hexapod * tip).as_matrix()
    view = platform.frame("tip in room")
    scale = 1 + np.abs(expected).max()
    np.testing.assert_allclose(view.of(pose).matrix, expected, rtol=0, atol=1e-14 * scale)
    back = view.platform_pose(view.of(pose))
    shift, turn = back.distance(pose)
    assert np.max(shift) <= 1e-13 * scale
    assert np.max(turn) <= 1e-14


@given(support.seeds)
def test_the_twist_of_a_frame_is_the_derivative_of_its_pose(seed: int) -> None:
    platform, _ = machine(seed)
    view, pose = platform.frame("tip in room"), platform.home
    twist = np.random.default_rng(seed).normal(size=6) * np.repeat([platform.size, 1.0], 3)
    step = 1e-5
    ahead, behind = (view.of(support.moved(pose, sign * step * twist)) for sign in (1, -1))
    velocity = (ahead.position - behind.position) / (2 * step)
    spin = (ahead.as_scipy() * behind.as_scipy().inv()).as_rotvec() / (2 * step)
    found = view.twist_matrix(pose) @ twist
    scale = 1 + np.abs(found).max()
    np.testing.assert_allclose(found, np.concatenate([velocity, spin]), rtol=0, atol=1e-7 * scale)


def test_an_origin_at_a_point_is_a_tool_there() -> None:
    platform, point = Platform.load("reference"), np.array([10.0, -20.0, 120.0])
    poses = platform.sample_poses(20)
    moved = platform.with_origin_at(point)
    found = platform.with_frames({"tool_in_platform": point}).frame("tool in base").of(poses)
    legs = gough.leg_lengths(platform, poses)
    np.testing.assert_allclose(gough.leg_lengths(moved, found), legs, rtol=1e-14)


def test_frames_are_converted_to_another_unit_with_the_machine() -> None:
    platform = Platform.load("reference").with_frames({"tool_in_platform": [0, 0, 120]})
    metres = in_unit(platform, "m")
    found = metres.frame("tool in base").of(metres.home).position
    expected = platform.frame("tool in base").of(platform.home).position
    np.testing.assert_allclose(1000 * found, expected, rtol=1e-15)


def test_frames_and_a_moved_origin_are_not_mixed() -> None:
    platform = Platform.load("reference").with_frames({"tool_in_platform": [0, 0, 120]})
    with pytest.raises(PlatformError, match="frames: state the point as a frame"):
        platform.with_origin_at([0, 0, 120])


def test_without_frames_the_tool_is_the_platform_and_work_is_the_base() -> None:
    platform = Platform.load("rubin_camera")
    pose = platform.sample_poses(5)
    shift, turn = platform.frame("tool in work").of(pose).distance(Pose(pose.position, pose.wxyz))
    pivot_moves = np.linalg.norm(
        platform.pivot_point - pose.rotation @ platform.pivot_point, axis=-1
    )
    np.testing.assert_allclose(shift, pivot_moves, rtol=0, atol=1e-15)
    np.testing.assert_allclose(turn, 0, atol=1e-15)


# ---- solving --------------------------------------------------------------------------

MACHINE = Platform.load("rubin_camera").with_frames(
    {
        "base_in_world": Pose.from_euler([0.1, -0.2, 2.0], np.radians([1, -2, 30])),
        "tool_in_platform": Pose.from_euler([0.0, 0.01, -0.4], np.radians([180, 0, 5])),
        "work_in_world": [0.0, 0.3, 1.0],
    }
)
TOOL = "tool in work"


def test_solve_and_leg_lengths_speak_of_the_same_frame() -> None:
    poses = MACHINE.sample_poses(50)
    legs = gough.leg_lengths(MACHINE, poses)
    tool = MACHINE.frame(TOOL).of(poses)
    found = gough.solve(MACHINE, legs, frame=TOOL)
    assert found.frame == found[0].frame == TOOL
    shift, turn = found.pose.distance(tool)
    assert np.max(shift) <= 1e-12
    assert np.max(turn) <= 1e-12
    np.testing.assert_allclose(gough.leg_lengths(MACHINE, tool, TOOL), legs, atol=1e-14)


def test_a_pose_as_first_guess_is_one_of_the_frame() -> None:
    poses = MACHINE.sample_poses(5)
    legs = gough.leg_lengths(MACHINE, poses)
    guess = MACHINE.frame(TOOL).of(poses)
    found = gough.solve(MACHINE, legs, seed=guess, max_iterations=0, frame=TOOL)
    assert np.max(found.pose.distance(guess)[0]) <= 1e-14


def test_the_covariance_is_that_of_the_frame() -> None:
    pose = MACHINE.sample_poses(1)[0]
    legs = gough.leg_lengths(MACHINE, pose)
    found = gough.solve(MACHINE, legs, leg_noise=1e-6, frame=TOOL)
    noise = np.random.default_rng(0).normal(size=(20_000, 6)) * 1e-6
    cloud = gough.solve(MACHINE, legs + noise, frame=TOOL).pose
    turns = (cloud.as_scipy() * found.pose.as_scipy().inv()).as_rotvec()
    sample = np.cov(np.hstack([cloud.position, turns]).T)
    assert found.covariance is not None
    scale = np.sqrt(np.outer(np.diag(sample), np.diag(sample)))
    np.testing.assert_allclose(found.covariance / scale, sample / scale, atol=0.04)


def in_frame(seed: int) -> tuple[Platform, Pose, np.ndarray]:
    """A platform with frames, a pose of "tip in room", and twists about as large as the machine."""
    platform, poses = machine(seed)
    near = {n: Pose(0.2 * platform.size * p.position, p.wxyz) for n, p in poses.items()}
    platform = replace(platform, frames=Frames(near))
    pose = platform.frame("tip in room").of(support.sample(platform, (), seed))
    twists = np.random.default_rng(seed).uniform(-1, 1, (2, 6))
    return platform, pose, twists * np.repeat([platform.size, 1.0], 3)


@support.at_most(20)
@given(support.seeds)
def test_rates_and_accelerations_of_a_frame_are_the_derivatives_of_readings(seed: int) -> None:
    platform, pose, (twist, acceleration) = in_frame(seed)
    rates = gough.leg_rates(platform, pose, twist, "tip in room")
    second = gough.leg_accelerations(platform, pose, twist, acceleration, "tip in room")
    h = 3e-3
    at = [support.moved(pose, s * twist + s**2 / 2 * acceleration) for s in h * np.arange(-2, 3)]
    legs = np.array([gough.leg_lengths(platform, p, "tip in room") for p in at])
    scale = support.reading_scale(platform)
    first = np.array([1, -8, 0, 8, -1]) @ legs / (12 * h)
    np.testing.assert_allclose(rates, first, rtol=1e-6, atol=1e-6 * scale)
    twice = np.array([-1, 16, -30, 16, -1]) @ legs / (12 * h**2)
    np.testing.assert_allclose(second, twice, rtol=1e-4, atol=1e-4 * scale)


@support.at_most(20)
@given(support.seeds)
def test_forces_and_twists_of_a_frame_have_the_same_power(seed: int) -> None:
    platform, pose, (twist, load) = in_frame(seed)
    load = load / platform.size * np.repeat([1.0, platform.size**2], 3)
    frame = "tip in room"
    rates = gough.leg_rates(platform, pose, twist, frame)
    forces = gough.leg_forces(platform, pose, load, frame)
    power = np.abs(forces) @ np.abs(rates)
    assert abs(forces @ rates - load @ twist) <= 1e-9 * power
    units = np.repeat([1.0, platform.size], 3)
    back = gough.wrench(platform, pose, forces, frame) / units
    np.testing.assert_allclose(back, load / units, rtol=1e-7, atol=1e-9)
    again = gough.twist(platform, pose, rates, frame) / units[::-1]
    np.testing.assert_allclose(again, twist / units[::-1], rtol=1e-7, atol=1e-9)


@support.at_most(20)
@given(support.seeds)
def test_what_the_jacobian_gives_is_carried_by_the_twists_of_the_frame(seed: int) -> None:
    platform, pose, _ = in_frame(seed)
    view, frame = platform.frame("tip in room"), "tip in room"
    own, M = view.platform_pose(pose), view.twist_matrix(view.platform_pose(pose))
    inverse = np.linalg.inv(M)
    unit = np.repeat([1.0, platform.size], 3)
    pairs = [
        (gough.stiffness(platform, pose, 1.0, frame), unit,
         inverse.T @ gough.stiffness(platform, own, 1.0) @ inverse),
        (gough.pose_covariance(platform, pose, 1.0, frame), 1 / unit,
         M @ gough.pose_covariance(platform, own, 1.0) @ M.T),
    ]  # fmt: skip
    for found, unit, expected in pairs:
        scale = np.outer(1 / unit, 1 / unit)
        most = np.max(np.abs(expected * scale))
        np.testing.assert_allclose(found * scale, expected * scale, rtol=0, atol=1e-10 * most)


@support.at_most(5)
@given(support.seeds)
def test_reach_moves_along_and_about_the_axes_of_the_frame(seed: int) -> None:
    limits = gough.MachineLimits(base_joint_cone=25, leg_radius=8, clearance=2)
    rng = np.random.default_rng(seed)
    frames = {"tool_in_platform": Pose([10, -20, 90], rng.normal(size=4)),
              "work_in_world": Pose([100, 50, 700], rng.normal(size=4))}  # fmt: skip
    platform = replace(Platform.load("reference").with_workspace(60, 20), limits=limits)
    platform = platform.with_frames(frames)
    pose = platform.frame(TOOL).of(platform.sample_poses(1, seed)[0])
    np.testing.assert_array_equal(
        gough.limits(platform, pose, frame=TOOL).margin,
        gough.limits(platform, platform.frame(TOOL).platform_pose(pose)).margin,
    )
    found, inside = (
        gough.reach(platform, pose, frame=TOOL),
        gough.limits(platform, pose, frame=TOOL),
    )
    if not inside.ok:
        return
    for axis in range(6):
        for way, sign in enumerate((-1, 1)):
            distance = found.distance[axis, way]
            steps = np.append(np.linspace(0, 1 - 1e-9, 50) * distance, distance * (1 + 1e-6) + 1e-7)
            twists = np.zeros((51, 6))
            twists[:, axis] = sign * steps
            ok = gough.limits(platform, support.moved(pose, twists), frame=TOOL).ok
            assert ok[:-1].all()
            assert not ok[-1] or not found.limit[axis, way]


def test_a_tracker_returns_poses_and_twists_of_the_frame() -> None:
    view, home = MACHINE.frame(TOOL), MACHINE.home
    path = Pose(home.position + np.linspace(0, 1e-3, 5)[:, None] * [1, -2, 3], home.wxyz)
    legs = gough.leg_lengths(MACHINE, path)
    tracker = gough.Tracker(MACHINE, start=view.of(home), frame=TOOL)
    own = gough.Tracker(MACHINE, start=home)
    assert tracker.frame == TOOL
    kept = tracker.pose
    for row in legs:
        support.assert_same_pose(tracker.update(row), view.of(own.update(row)), 1e-12)
        assert tracker.pose is kept
    carried = view.twist_matrix(own.pose) @ own.twist
    np.testing.assert_allclose(tracker.twist, carried, atol=1e-9)
    rates = gough.leg_rates(MACHINE, own.pose, [1e-3, 2e-3, 0, 0, 0, 0.01])
    for one in (tracker, own):
        one.update(legs[-1], rates)
    carried = view.twist_matrix(own.pose) @ own.twist
    np.testing.assert_allclose(tracker.twist, carried, atol=1e-12)
    found = gough.solve(MACHINE, legs, follow=True, frame=TOOL, limits=True, leg_noise=1e-6)
    plain = gough.solve(MACHINE, legs, follow=True, limits=True, leg_noise=1e-6)
    assert found.frame == TOOL
    support.assert_same_pose(found.pose, view.of(plain.pose), 1e-12)
    assert found.limits is not None
    assert plain.limits is not None
    np.testing.assert_array_equal(found.limits.margin, plain.limits.margin)


def test_modes_are_those_of_the_frame() -> None:
    reference = Platform.load("reference").with_frames(
        {"tool_in_platform": [0, 0, 90], "work_in_world": Pose.from_euler([0, 0, 600], [0.1, 0, 0])}
    )
    modes = gough.assembly_modes(reference, reference.home_legs, frame=TOOL)
    support.assert_same_pose(modes.pose, reference.frame(TOOL).of(modes.platform_pose), 1e-12)
    assert modes.frame == TOOL
    assert modes.residual.max() < 1e-11
    home = reference.frame(TOOL).of(reference.home)
    choice = gough.choose_mode(modes, near=home, max_shift=1.0)
    assert choice.count == 1
    support.assert_same_pose(modes.pose[choice.best][0], home, 1e-9)
    with pytest.raises(GoughError, match="did you mean 'tool'"):
        gough.assembly_modes(reference, reference.home_legs, frame="tol in work")


def test_parquet_states_the_frame_of_its_poses(tmp_path: Path) -> None:
    legs = gough.leg_lengths(MACHINE, MACHINE.sample_poses(20))
    MACHINE.save(tmp_path / "machine.toml")
    files = [str(tmp_path / name) for name in ("legs.csv", "poses.parquet", "back.csv")]
    header = ",".join(f"leg_{i}" for i in range(1, 7))
    np.savetxt(files[0], legs, delimiter=",", header=header, comments="", fmt="%.17g")
    convert.solve_file(files[0], files[1], MACHINE, frame=TOOL)
    convert.inverse_file(files[1], files[2], MACHINE)  # by the frame that the file states
    back = np.loadtxt(files[2], delimiter=",", skiprows=1, usecols=range(6))
    np.testing.assert_allclose(back, legs, atol=1e-12)
    with pytest.raises(InputError, match="are those of 'tool in work', not of 'tool in base'"):
        convert.inverse_file(files[1], None, MACHINE, frame="tool in base")
    other = MACHINE.with_frames({"tool_in_platform": [0, 0, 1]})
    with pytest.raises(InputError, match=r"states other \[frames\] now"):
        convert.inverse_file(files[1], None, other)
    with open_trajectory(files[1], MACHINE) as file:
        read = np.concatenate([file.solve(rows).legs for rows in file.blocks()])
    np.testing.assert_allclose(read, legs, atol=1e-12)


def test_the_commands_take_a_frame(tmp_path: Path) -> None:
    file = tmp_path / "machine.toml"
    MACHINE.save(file)
    said, code = run(f"gough solve 0 0 0 0 0 0 -p {file} --frame 'tool in work'")
    assert code == 0
    assert "poses of tool in work" in said
    said, code = run(f"gough solve 0 0 0 0 0 0 -p {file} --frame 'tol in work'")
    assert code == 2
    assert "did you mean 'tool'? frames that move with the platform are platform, tool" in said


# ---- files ----------------------------------------------------------------------------


@given(support.seeds)
def test_frames_survive_a_file(seed: int) -> None:
    platform, _ = machine(seed)
    again = from_toml(platform.to_toml())
    assert again == platform
    assert again.digest == platform.digest
    assert again.frames is not None
    assert list(again.frames.poses) == list(platform.frames.poses)  # pyright: ignore


@given(ORDERS, st.booleans(), support.seeds)
def test_angles_about_any_axes_are_those_of_scipy(order: str, turning: bool, seed: int) -> None:
    order = order.upper() if turning else order
    angles = np.random.default_rng(seed).uniform(-3, 3, (10, 3))
    found: Floats = quaternion.to_matrix(quaternion.from_axes(angles, order))
    np.testing.assert_allclose(
        found, Rotation.from_euler(order, angles).as_matrix(), atol=4e-16 * 4
    )


def test_a_file_may_state_angles_and_their_order() -> None:
    text = Platform.load("reference").to_toml()
    pose = '{position = [0, 0, 120], euler_deg = [90, 0, 30], order = "zyx"}'
    text += f"[frames]\ntool_in_platform = {pose}\n"
    frames = from_toml(text).frames
    assert frames is not None
    expected = Rotation.from_euler("zyx", [90, 0, 30], degrees=True).as_matrix()
    np.testing.assert_allclose(frames.moving["tool"].rotation, expected, atol=1e-15)


def test_a_platform_without_frames_keeps_its_digest() -> None:
    platform = Platform.load("reference")
    assert "frames" not in platform.to_dict()
    assert platform.with_frames({"tool_in_platform": [0, 0, 1]}).digest != platform.digest


@pytest.mark.parametrize(
    ("frames", "said"),
    [
        ({"tool": [0, 0, 1]}, "frames.tool: expected a name such as tool_in_platform"),
        ({"tool_in_platfrm": [0, 0, 1]}, "hangs on neither base nor platform"),
        ({"world_in_platform": [0, 0, 1]}, "hangs on both base and platform"),
        ({"a_in_base": [0, 0, 1], "a_in_world": [0, 0, 1]}, "follows from the other frames"),
        ({"tool_in_platform": [0, 0]}, "frames.tool_in_platform: expected 3 numbers"),
        ({"tool_in_platform": [0, 0, np.nan]}, "frames.tool_in_platform"),
        ({"tool_in_platform": Pose.identity((2,))}, "expected one pose"),
    ],
)
def test_wrong_frames_are_refused_by_name(frames: dict, said: str) -> None:
    with pytest.raises(PlatformError, match=said):
        Frames(frames)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("tool_in_platform = [0, 0, 1]", "expected a pose such as"),
        ("tool_in_platform = {positon = [0, 0, 1]}", "positon: unknown field; did you mean"),
        ("tool_in_platform = {wxyz = [1, 0, 0, 0]}", "tool_in_platform.position: missing"),
        ("tool_in_platform = {position = [0, 0, 1], order = 'xyz'}", "order: states the axes"),
        (
            "tool_in_platform = {position = [0, 0, 1], euler_deg = [1, 2, 3], order = 'xYz'}",
            "tool_in_platform.order: expected three axes",
        ),
    ],
)
def test_wrong_frames_of_a_file_are_refused_by_field(line: str, said: str) -> None:
    with pytest.raises(PlatformError, match=said):
        from_toml(f"{Platform.load('reference').to_toml()}[frames]\n{line}\n")


@pytest.mark.parametrize("name", ["tool", "tol in work", "work in tool", "tool in platform", ""])
def test_a_name_that_no_frame_has_lists_those_there_are(name: str) -> None:
    with pytest.raises(GoughError, match=r"expected a name such as 'tool in work'.* frames that"):
        Platform.load("reference").frame(name)

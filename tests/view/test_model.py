"""The state behind the page: sliders move each other through the library, and never to nonsense."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gough
from gough import Platform, Pose
from gough.pose import pose_values
from gough.skeleton import outside_stroke
from gough.units import scaled
from gough.view import meshes
from gough.view.beyond import beyond_limits, leg_factor
from gough.view.follow import BLOCKED, REFUSED, follow, has_pose, step_solver
from gough.view.model import UNCHANGED, Answer, Model
from gough.view.reach_bars import reach_html
from gough.view.requests import Pace
from gough.view.sliders import leg_ranges, pose_ranges

CATALOG = Platform.catalog()


@pytest.fixture(params=CATALOG)
def platform(request: pytest.FixtureRequest) -> Platform:
    return Platform.load(request.param)


def assert_near(a: Pose, b: Pose, size: float, tolerance: float = 1e-9) -> None:
    shift, turn = a.distance(b)
    assert shift <= tolerance * size
    assert turn <= tolerance


# ---- one set of sliders moves the other ------------------------------------------------


def test_it_starts_at_home(platform):
    model = Model(platform)
    assert model.pose is platform.home
    assert np.array_equal(model.legs, platform.home_legs)
    assert model.answer.reached
    assert model.singularity_share == 1.0


def test_pose_sliders_move_the_legs_and_leg_sliders_bring_the_pose(platform):
    pose = platform.sample_poses(5, seed=3)[2]
    legs = gough.leg_lengths(platform, pose)
    model = Model(platform)
    model.ask_numbers(dict(enumerate(pose_values(pose, "deg"))))
    np.testing.assert_allclose(model.legs, legs, rtol=0, atol=1e-12 * platform.size)
    assert (model.answer.how, model.answer.iterations) == ("inverse kinematics", 0)

    model.home()
    model.ask_legs(dict(enumerate(legs)))
    assert model.answer.reached, model.answer.text
    assert_near(model.pose, pose, platform.size)
    assert model.answer.how == "forward kinematics"
    assert model.answer.residual <= 1e-12 * platform.size
    assert model.answer.iterations > 0
    assert model.answer.seconds > 0
    assert np.array_equal(model.asked, model.legs)


def test_a_slider_changes_its_own_number_only():
    model = Model(Platform.load("reference"))
    model.ask_numbers({2: 610.0})
    model.ask_numbers({3: 5.0})
    assert model.numbers.tolist() == [0, 0, 610, 5, 0, 0]
    before = model.legs.copy()
    model.ask_legs({4: before[4] + 3})
    assert np.array_equal(np.delete(model.legs, 4), np.delete(before, 4))
    assert model.legs[4] == before[4] + 3


def test_angles_stay_as_they_were_asked_for_where_they_are_not_unique():
    model = Model(Platform.load("reference"))
    model.ask_numbers({4: 90.0})
    model.ask_numbers({5: 10.0})
    assert model.numbers.tolist() == [0, 0, 600, 0, 90, 10]


def test_there_and_back_ends_where_it_began(platform):
    model = Model(platform)
    reach = 0.1 * platform.size if platform.legs != "rotary" else 0.3
    for step in np.concatenate([np.linspace(0, reach, 9), np.linspace(reach, 0, 5)]):
        model.ask_legs({2: platform.home_legs[2] + step})
    assert model.answer.reached
    assert_near(model.pose, platform.home, platform.size)


def test_the_unit_of_length_changes_nothing():
    metres = Platform.load("rubin_camera")
    far = scaled(metres, 1e3, "mm")
    small, large = Model(metres), Model(far)
    for factor, model in ((1.0, small), (1e3, large)):
        model.ask_legs({0: 0.01 * factor, 3: -0.008 * factor})
    assert small.answer.text == large.answer.text
    assert_near(Pose(1e3 * small.pose.position, small.pose.wxyz), large.pose, far.size)
    assert small.singularity_share == pytest.approx(large.singularity_share, abs=1e-9)


# ---- staying in the assembly mode ------------------------------------------------------


def test_a_long_step_ends_where_many_short_ones_do():
    """Newton's method alone goes to another mode for some of these."""
    platform = Platform.load("reference").with_workspace(100, 60)
    targets = gough.leg_lengths(platform, platform.sample_poses(60, seed=5)[:40])
    solver = step_solver(platform)
    jumps = arrivals = 0
    for target in targets:
        found = follow(solver, platform.home, platform.home_legs, target)
        alone = gough.solve(platform, target, seed=platform.home, restarts=0)
        if found.pose is None:
            assert found.text == BLOCKED
            jumps += has_pose(alone.status)
            continue
        arrivals += 1
        legs, pose = platform.home_legs, platform.home
        for share in np.linspace(0, 1, 41)[1:]:
            way = platform.home_legs + share * (target - platform.home_legs)
            step = follow(solver, pose, legs, way)
            assert step.pose is not None
            pose, legs = step.pose, way
        assert_near(found.pose, pose, platform.size, 1e-7)
        assert gough.assembly_sign(platform, pose) == 1
    assert arrivals > 20
    assert jumps > 0, "no start here tells following from solving; draw others"


def test_a_picked_mode_keeps_the_legs_and_is_followed_on():
    platform = Platform.load("reference")
    model = Model(platform)
    modes = gough.assembly_modes(platform, model.legs)
    other = int(np.argmax(modes.sign < 0))
    model.pick(modes.pose[other], float(modes.residual[other]))
    assert model.answer.reached
    assert np.array_equal(model.legs, platform.home_legs)
    assert gough.assembly_sign(platform, model.pose) == -1
    model.ask_legs({0: platform.home_legs[0] + 2.0})
    assert model.answer.reached
    assert gough.assembly_sign(platform, model.pose) == -1
    shift, turn = model.pose.distance(modes.pose[other])
    assert shift < 0.05 * platform.size
    assert turn < 0.1


def test_every_mode_of_a_rotary_machine_can_be_picked_and_left():
    platform = Platform.load("reachy_mini")
    modes = gough.assembly_modes(platform, platform.home_legs)
    assert len(modes) > 1
    for i in range(len(modes)):
        model = Model(platform)
        model.pick(modes.pose[i], 0.0)
        assert np.array_equal(model.legs, platform.home_legs)
        model.ask_legs({1: platform.home_legs[1] + 0.01})
        assert model.answer.reached, model.answer.text
        assert model.pose.distance(modes.pose[i])[1] < 0.2


# ---- what cannot be reached ------------------------------------------------------------


def test_impossible_legs_leave_the_picture_and_say_why(platform):
    model = Model(platform)
    pose, legs = platform.sample_poses(5, seed=3)[1], None
    model.ask_pose(pose)
    pose, legs = model.pose, model.legs
    far = legs[2] + (2.0 if platform.legs == "rotary" else 3 * platform.size)
    model.ask_legs({2: far})
    assert not model.answer.reached
    assert model.pose is pose
    assert np.array_equal(model.legs, legs)
    assert model.answer.text.endswith(UNCHANGED)
    assert model.answer.text.startswith((REFUSED["unreachable"], BLOCKED))
    # the leg sliders show the request, all else the picture
    assert model.asked[2] == far
    np.testing.assert_array_equal(model.numbers, pose_values(pose, "deg"))
    # and dragging back leads on from the picture
    model.ask_legs({2: float(legs[2])})
    assert model.answer.reached
    assert_near(model.pose, pose, platform.size)


def test_a_pose_beyond_the_motors_names_them():
    platform = Platform.load("reachy_mini")
    model = Model(platform)
    model.ask_numbers({2: 0.4})
    assert not model.answer.reached
    assert model.pose is platform.home
    assert "too short for this pose: motor 1, 2, 3, 4, 5, 6" in model.answer.text
    assert model.numbers[2] == 0.4
    model.undo()
    np.testing.assert_array_equal(model.numbers, pose_values(platform.home, "deg"))


def test_a_leg_without_length_is_no_picture():
    platform = Platform([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [2, 5, 0], [2, -1, 0]],
                        [[0, 0, 0], [3, 0, 0], [3, 3, 0], [0, 3, 0], [2, 4, 0], [2, -2, 0]],
                        home=(0, 0, 5))  # fmt: skip
    model = Model(platform)
    model.ask_pose(Pose((0.0, 0.0, 0.0)))
    assert not model.answer.reached
    assert "Leg 1 would have no length" in model.answer.text
    assert model.pose is platform.home


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_readings_that_are_none_move_nothing(bad):
    model = Model(Platform.load("reference"))
    model.ask_legs({0: bad})
    assert not model.answer.reached
    assert model.answer.text.startswith(REFUSED["invalid_input"])
    assert model.pose is model.platform.home


def test_a_row_without_a_pose_leaves_the_last_one():
    platform = Platform.load("reference")
    model = Model(platform)
    nothing = Pose([np.nan] * 3, [np.nan] * 4)
    model.show(nothing, np.full(6, np.nan), Answer(False, "no", "file"))
    assert model.pose is platform.home
    assert np.isfinite(model.numbers).all()
    assert model.answer.text == "no"


def test_the_meter_falls_towards_a_singularity():
    model = Model(Platform.load("reference"))
    shares = []
    for turn in (0.0, 45.0, 80.0):  # turned by 90 deg, a regular hexapod is singular (Fichter)
        model.ask_numbers({5: turn})
        shares.append(model.singularity_share)
    assert shares[0] > shares[1] > shares[2]
    assert shares[2] < 0.3


# ---- colours and sliders ---------------------------------------------------------------


def test_colours_tell_where_legs_stand_in_their_stroke():
    platform = Platform.load("rubin_camera")
    assert platform.stroke is not None
    low, high = platform.stroke[0]
    legs = np.array([low, (low + high) / 2, high, low - 1e-4, high + 1e-4, 0.0])
    paint = [tuple(row) for row in meshes.leg_colors(platform, legs)]
    wanted = [*meshes.RAMP, meshes.OUT, meshes.OUT, meshes.GREEN]
    assert paint == [meshes.rgb(name) for name in wanted]
    assert outside_stroke(platform, legs).tolist() == [False] * 3 + [True] * 2 + [False]


def test_without_a_stroke_legs_are_grey_and_none_is_out():
    platform = Platform.load("reference")
    assert (meshes.leg_colors(platform, platform.home_legs) == meshes.rgb(meshes.GREY)).all()
    assert not outside_stroke(platform, np.full(6, 1e9)).any()


def test_sliders_hold_home_stroke_and_workspace(platform):
    legs, factor = leg_ranges(platform), leg_factor(platform)
    for one, home in zip(legs, factor * platform.home_legs, strict=True):
        assert one.low < home < one.high
    if platform.stroke is not None:
        for one, (low, high) in zip(legs, factor * platform.stroke, strict=True):
            assert one.low < low < high < one.high
    poses = pose_values(platform.sample_poses(200, seed=1), "deg")
    for i, one in enumerate(pose_ranges(platform)):
        if i < 3 or platform.home.wxyz[0] == 1:  # angles of a turned home are not the box's
            assert one.low <= poses[:, i].min()
            assert poses[:, i].max() <= one.high
        steps = (one.high - one.low) * 10.0**one.decimals
        assert 1000 <= steps <= 100_000


def test_a_slider_grows_to_hold_a_value():
    one = pose_ranges(Platform.load("reference"))[2]
    low, high = one.low, one.high
    assert not one.reach(high)
    assert one.reach(-600.0)
    assert one.low < -600 < low < high == one.high


# ---- limits and undo -------------------------------------------------------------------


def test_a_pose_beyond_its_limits_is_shown_and_the_limits_are_named():
    model = Model(Platform.load("rubin_camera"))
    assert model.answer.text == "Within stroke and workspace."
    model.ask_legs({4: 0.0145})
    assert model.answer.reached
    assert model.answer.text.startswith("Shown beyond its limits: leg 5 above its stroke by ")
    assert not model.beyond.ok
    assert Model(Platform.load("dietmaier")).answer.text == "Within workspace."


def test_undo_goes_back_move_by_move():
    model = Model(Platform.load("reference"))
    for height in (610.0, 620.0):
        model.remember()
        model.ask_numbers({2: height})
    model.remember()
    model.ask_legs({0: 1e5})
    assert not model.answer.reached
    model.undo()  # the sliders
    assert model.answer.reached
    assert model.numbers[2] == 620
    model.undo()
    assert model.numbers[2] == 610
    model.undo()
    assert model.pose is model.platform.home
    model.undo()
    assert model.pose is model.platform.home


def limited(**given) -> Platform:
    """The reference platform with other limits."""
    plain = replace(Platform.load("reference"), workspace=None, stroke=None)
    return replace(plain, limits=gough.MachineLimits(**given))


def test_legs_that_touch_are_named_and_red():
    """Legs whose axes are nearly as near as their radii allow at home touch after a rotation."""
    gaps = gough.leg_gaps(Platform.load("reference"), Platform.load("reference").home)
    model = Model(limited(leg_radius=0.49 * gaps.min(), clearance=0.0))
    assert model.answer.text.startswith("Within")
    model.ask_numbers({3: 20.0, 5: 60.0})
    found = gough.limits(model.platform, model.pose)
    assert "clearance" in found.limit
    a, b = found.limit.split(":")[0].removeprefix("legs ").split(" and ")
    assert f"legs {a} and {b} touch" in model.answer.text
    np.testing.assert_array_equal(model.beyond.near, found.legs)
    assert model.beyond.label(int(a) - 1) == "too near"
    assert not model.beyond.ok


def test_each_limit_that_is_exceeded_is_named():
    load = gough.Payload(30.0, (0, 0, 80))
    platform = limited(base_joint_cone=2, moving_joint_cone=2, leg_force=(40, 70), payload=load)
    model = Model(platform)
    model.ask_numbers({0: 60.0, 3: 10.0})
    found = gough.limits(platform, model.pose)
    np.testing.assert_array_equal(model.beyond.legs, found.legs)
    for text in ("base joint", "platform joint", "beyond their cone by", "beyond the leg force"):
        assert text in model.answer.text


@pytest.mark.parametrize("seed", range(3))
def test_what_is_beyond_a_limit_is_what_limits_says(seed):
    load = gough.Payload(30.0, (0, 0, 80))
    platform = limited(base_joint_cone=8, moving_joint_cone=12, leg_radius=20, clearance=30,
                       leg_force=(-20, 150), payload=load)  # fmt: skip
    poses = platform.with_workspace(100, 30).sample_poses(30, seed)
    found = gough.limits(platform, poses)
    for i in range(30):
        seen = beyond_limits(platform, poses[i], gough.leg_lengths(platform, poses[i]))
        np.testing.assert_array_equal(seen.legs, found.legs[i])


def test_the_page_of_a_frame_shows_and_takes_its_poses():
    frames = {
        "tool_in_platform": [0, 0, 90],
        "work_in_world": gough.Pose.from_euler([0, 50, 600], [0, 0, 1]),
    }
    platform = limited(leg_radius=5).with_frames(frames)
    model = Model(platform, frame="tool in work")
    view = platform.frame("tool in work")
    model.ask_numbers({0: model.numbers[0] + 3.0, 4: 5.0})
    shown = view.of(model.pose)
    np.testing.assert_allclose(model.numbers[:3], shown.position, atol=1e-9)
    np.testing.assert_allclose(model.numbers[3:], np.degrees(shown.euler), atol=1e-9)
    legs = gough.leg_lengths(platform, shown, "tool in work")
    np.testing.assert_allclose(model.legs, legs, atol=1e-9)
    expected = gough.reach(platform, shown, frame="tool in work")
    np.testing.assert_array_equal(model.reach(model.pose).distance, expected.distance)
    html = reach_html(expected, np.ones(6), 2)
    assert html.count("<i>") == 12
    assert str(expected.limit[0, 0]) in html


def test_work_is_done_at_most_once_in_its_period():
    pace = Pace(1.0)
    assert pace.wait(5.0) is None
    pace.ask()
    assert pace.start(5.0)
    assert not pace.start(5.0)
    pace.ask()
    assert pace.wait(5.25) == 0.75
    assert not pace.start(5.25)
    assert pace.start(6.0)

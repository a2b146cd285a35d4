"""What stands in a picture of a pose is where the library says it is."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from matplotlib.colors import to_hex
from mpl_toolkits.mplot3d import Axes3D

import gough
from gough.kinematics import equivalent_struts, joint_positions
from gough.plot import PoseStyle, draw_pose, new_figure, pose_axes, pose_figure
from gough.plot.pose import GHOST
from gough.plot.style import VERMILION, shown_readings

MACHINES = gough.Platform.catalog()


def a_pose(platform: gough.Platform) -> gough.Pose:
    return platform.sample_poses(1, seed=4)[0]


def draw(platform: gough.Platform, pose: gough.Pose, **options) -> tuple[Axes3D, dict]:
    axes = pose_axes(new_figure(4, 4), platform, [pose])
    return axes, draw_pose(axes, platform, pose, **options)


def points(line) -> np.ndarray:
    return np.stack(line.get_data_3d(), axis=-1).astype(float)


@pytest.mark.parametrize("name", MACHINES)
def test_legs_run_from_strut_start_to_plate_and_are_as_long_as_the_readings_say(name):
    platform = gough.Platform.load(name)
    pose = a_pose(platform)
    _, drawn = draw(platform, pose)
    ends = np.array([points(line) for line in drawn["legs"]])
    base, lengths = equivalent_struts(platform, gough.leg_lengths(platform, pose))
    np.testing.assert_allclose(ends[:, 0], base, atol=1e-12 * platform.size)
    np.testing.assert_allclose(
        ends[:, 1], joint_positions(platform, pose), atol=1e-12 * platform.size
    )
    found = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    np.testing.assert_allclose(found, lengths, rtol=1e-9)


def test_motor_arms_have_the_arms_length_and_start_at_the_motors():
    platform = gough.Platform.load("reachy_mini")
    _, drawn = draw(platform, a_pose(platform))
    ends = np.array([points(line) for line in drawn["arms"]])
    np.testing.assert_allclose(ends[:, 0], platform.base, atol=1e-15)
    assert platform.rotary is not None
    np.testing.assert_allclose(
        np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), platform.rotary.arm_length, rtol=1e-12
    )


@pytest.mark.parametrize("name", MACHINES)
def test_the_plate_is_a_closed_outline_through_all_six_joints(name):
    platform = gough.Platform.load(name)
    pose = a_pose(platform)
    _, drawn = draw(platform, pose)
    outline = points(drawn["plate"])
    assert outline.shape == (7, 3)
    np.testing.assert_array_equal(outline[0], outline[-1])
    joints = joint_positions(platform, pose)
    assert {tuple(p) for p in outline} == {tuple(p) for p in joints}


@pytest.mark.parametrize("name", MACHINES)
def test_axes_are_to_scale_hold_everything_and_name_their_unit(name):
    platform = gough.Platform.load(name)
    pose = a_pose(platform)
    axes, drawn = draw(platform, pose)
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    aspect = np.asarray(axes._box_aspect)  # pyright: ignore[reportAttributeAccessIssue]
    spans = np.diff(limits)[:, 0]
    np.testing.assert_allclose(spans / spans[0], aspect / aspect[0])
    for line in (*drawn["legs"], drawn["plate"], drawn["base"]):
        assert np.all(points(line) >= limits[:, 0] - 1e-12)
        assert np.all(points(line) <= limits[:, 1] + 1e-12)
    unit = platform.unit or "unit"
    labels = axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel()
    assert labels == (f"x [{unit}]", f"y [{unit}]", f"z [{unit}]")


def test_legs_outside_their_stroke_are_dashed_vermilion_and_crossed():
    platform = gough.Platform.load("nasa_msfc")
    pose = gough.Pose.from_euler((30.0, -10.0, 141.0), np.radians([5.0, 3.0, -4.0]))
    readings = gough.leg_lengths(platform, pose)
    assert platform.stroke is not None
    outside = (readings < platform.stroke[:, 0]) | (readings > platform.stroke[:, 1])
    assert 0 < outside.sum() < 6
    axes, drawn = draw(platform, pose)
    dashed = np.array([line.get_linestyle() == "--" for line in drawn["legs"]])
    vermilion = np.array([to_hex(line.get_color()) == VERMILION.lower() for line in drawn["legs"]])
    np.testing.assert_array_equal(dashed, outside)
    np.testing.assert_array_equal(vermilion, outside)
    crosses = [line for line in axes.get_lines() if line.get_marker() == "X"]
    assert len(crosses) == outside.sum()


def test_legs_within_their_stroke_are_lighter_the_longer_they_are():
    platform = gough.Platform.load("nasa_msfc")
    pose = gough.Pose.from_euler((12.0, -6.0, 118.0), np.radians([7.0, -8.0, 6.0]))
    _, drawn = draw(platform, pose)
    light = [np.dot(line.get_color()[:3], (0.3, 0.6, 0.1)) for line in drawn["legs"]]
    readings = gough.leg_lengths(platform, pose)
    assert np.argsort(light).tolist() == np.argsort(readings).tolist()


def test_motors_that_cannot_reach_are_dotted():
    platform = gough.Platform.load("reachy_mini")
    pose = gough.Pose.from_euler((0.01, 0.01, 0.19), np.radians([45.0, 3.0, -4.0]))
    short = np.isnan(gough.leg_lengths(platform, pose))
    assert 0 < short.sum() < 6
    _, drawn = draw(platform, pose)
    assert [line.get_linestyle() == ":" for line in drawn["legs"]] == short.tolist()


def test_a_second_pose_is_drawn_into_the_same_axes():
    platform = gough.Platform.load("reference")
    poses = platform.sample_poses(2, seed=1)
    axes = pose_axes(new_figure(4, 4), platform, [poses[0], poses[1]])
    draw_pose(axes, platform, poses[0], style=PoseStyle(label="solved"))
    drawn = draw_pose(axes, platform, poses[1], style=GHOST)
    assert set(drawn) == {"plate"}
    assert drawn["plate"].get_linestyle() == "--"
    assert [t for t in axes.get_legend_handles_labels()[1] if not t.startswith("_")] == ["solved"]


@pytest.mark.parametrize("name", MACHINES)
def test_the_scales_beside_show_the_readings(name):
    platform = gough.Platform.load(name)
    pose = a_pose(platform)
    figure = pose_figure(platform, pose, ghost=platform.home)
    scales = figure.axes[1]
    markers = [line for line in scales.get_lines() if line.get_marker() in ("o", "X")]
    shown = [np.asarray(line.get_xdata(), dtype=float)[0] for line in markers]
    expected = shown_readings(platform, gough.leg_lengths(platform, pose))
    np.testing.assert_allclose(shown, expected, rtol=1e-12)
    unit = "deg" if platform.legs == "rotary" else platform.unit or "unit"
    assert scales.get_xlabel().endswith(f"[{unit}]")
    assert platform.name in figure.get_suptitle()


def test_what_cannot_be_drawn_is_an_error():
    platform = gough.Platform.load("reference")
    with pytest.raises(gough.GoughError, match=r"one pose, found batch axes \(3,\)"):
        pose_figure(platform, platform.sample_poses(3))
    nothing = gough.solve(platform, [float("nan")] * 6).pose
    with pytest.raises(gough.GoughError, match="holds NaN"):
        pose_figure(platform, nothing)

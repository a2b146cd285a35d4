"""A slice's numbers are those of the library, and its lines lie where they should."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from matplotlib.contour import QuadContourSet

import gough
from gough.plot import WorkspaceSlice, new_figure, workspace_figure, workspace_slice
from gough.plot.slices import COORDINATES
from gough.plot.style import VERMILION
from gough.plot.workspace import _regions, draw_slice

MACHINES = gough.Platform.catalog()


def pose_at(cut: WorkspaceSlice, u: float, v: float) -> gough.Pose:
    values = {**cut.fixed, cut.axes[0]: u, cut.axes[1]: v}
    numbers = np.array([values[name] for name in COORDINATES])
    return gough.Pose.from_euler(numbers[:3], np.radians(numbers[3:]))


def zero_lines(cut: WorkspaceSlice, color: str) -> np.ndarray:
    """The points (M, 2) of the line at zero that is drawn in a colour."""
    axes = new_figure(4, 4).add_subplot()
    draw_slice(axes, cut)
    wanted = [
        c for c in axes.collections
        if isinstance(c, QuadContourSet) and list(c.levels) == [0.0]
        and np.allclose(c.get_edgecolor()[0], _rgba(color))
    ]  # fmt: skip
    return np.concatenate([p.vertices for c in wanted for p in c.get_paths()])


def _rgba(color: str):
    from matplotlib.colors import to_rgba

    return to_rgba(color)


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("axes", [("x", "z"), ("ry", "rz"), ("rx", "y")])
def test_every_number_of_a_slice_is_the_librarys(name, axes):
    platform = gough.Platform.load(name)
    cut = workspace_slice(platform, axes, resolution=7)
    for i, j in ((0, 0), (2, 5), (6, 1), (3, 3)):
        pose = pose_at(cut, cut.u[j], cut.v[i])
        np.testing.assert_allclose(
            cut.distance[i, j], gough.singularity_distance(platform, pose), atol=1e-14
        )
        sign = gough.assembly_sign(platform, pose)
        np.testing.assert_allclose(cut.signed[i, j], sign * cut.distance[i, j], atol=1e-14)
        if platform.stroke is not None:
            low, high = platform.stroke.T
            readings = gough.leg_lengths(platform, pose)
            inside = np.all((readings >= low) & (readings <= high))
            assert bool(np.all(cut.margin[i, j] >= 0)) == inside


def test_the_singularity_line_is_drawn_where_the_sign_changes():
    platform = gough.Platform.load("reachy_mini")
    cut = workspace_slice(platform, ("rx", "ry"), resolution=121)
    line = zero_lines(cut, VERMILION)
    step = cut.u[1] - cut.u[0], cut.v[1] - cut.v[0]
    seen = 0
    for u, v in line[::5]:
        around = [
            gough.assembly_sign(platform, pose_at(cut, u + a * step[0], v + b * step[1]))
            for a in (-1, 0, 1) for b in (-1, 0, 1)
        ]  # fmt: skip
        known = [s for s in around if np.isfinite(s)]
        assert min(known) < 0 < max(known)
        assert gough.singularity_distance(platform, pose_at(cut, u, v)) < 0.03
        seen += 1
    assert seen > 3


def test_the_edge_of_the_stroke_is_drawn_where_a_leg_is_at_its_end():
    platform = gough.Platform.load("nasa_msfc")
    cut = workspace_slice(platform, ("x", "z"), resolution=121)
    figure = workspace_figure(cut)
    thick = [
        c for c in figure.axes[0].collections
        if isinstance(c, QuadContourSet) and list(c.levels) == [0.0]
        and np.ravel(c.get_linewidth())[0] == 2.0
    ]  # fmt: skip
    assert len(thick) == 1
    assert platform.stroke is not None
    low, high = platform.stroke.T
    for u, v in np.concatenate([p.vertices for p in thick[0].get_paths()])[::7]:
        readings = gough.leg_lengths(platform, pose_at(cut, u, v))
        margin = np.minimum(readings - low, high - readings).min()
        assert abs(margin) < 0.01 * (high - low).min()


@pytest.mark.parametrize("name", MACHINES)
def test_a_figure_for_every_machine_with_units_on_its_axes(name):
    platform = gough.Platform.load(name)
    figure = workspace_figure(workspace_slice(platform, ("x", "rz"), resolution=25))
    axes, bar = figure.axes
    assert axes.get_xlabel() == f"x [{platform.unit or 'unit'}]"
    assert axes.get_ylabel() == "rz [deg]"
    assert "0 is singular" in bar.get_ylabel()


def test_values_spans_and_resolution_are_taken():
    platform = gough.Platform.load("reference")
    cut = workspace_slice(
        platform, ("z", "ry"), at={"x": 20.0, "rx": -5.0}, span=(500, 700, -30, 30), resolution=5
    )
    assert cut.fixed == {"x": 20.0, "y": 0.0, "rx": -5.0, "rz": 0.0}
    np.testing.assert_allclose(cut.u, [500, 550, 600, 650, 700])
    np.testing.assert_allclose(cut.v, [-30, -15, 0, 15, 30])
    assert cut.distance.shape == (5, 5)


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("axis", COORDINATES)
def test_a_slice_holds_home_and_the_stated_workspace(name, axis):
    platform = gough.Platform.load(name)
    other = "x" if axis != "x" else "y"
    cut = workspace_slice(platform, (axis, other), resolution=2)
    home = dict(zip(COORDINATES, [*platform.home.position, *np.degrees(platform.home.euler)],
                    strict=True))  # fmt: skip
    assert cut.u[0] < home[axis] < cut.u[-1]
    if name != "dietmaier":  # whose home is turned: its workspace is no box in these coordinates
        assert platform.workspace is not None
        edges = [*platform.workspace.translation, *platform.workspace.rotation_deg]
        low, high = edges[COORDINATES.index(axis)]
        assert cut.u[0] < home[axis] + low
        assert cut.u[-1] > home[axis] + high


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"axes": ("x", "x")}, "two different"),
        ({"axes": ("x", "yaw")}, "no coordinate 'yaw'"),
        ({"axes": ("x", "y"), "at": {"x": 1.0}}, "axis of the slice"),
        ({"axes": ("x", "y"), "at": {"z": np.nan}}, "finite"),
        ({"axes": ("x", "y"), "span": (1, 0, 0, 1)}, "lowest below highest"),
        ({"axes": ("x", "y"), "resolution": 1}, "2 or more"),
    ],
)
def test_wrong_slices_are_explained(options, words):
    with pytest.raises(gough.GoughError, match=words):
        workspace_slice(gough.Platform.load("reference"), **options)


def limited() -> gough.Platform:
    """The reference platform with limits of each kind and a tool."""
    limits = gough.MachineLimits(
        base_joint_cone=12, leg_radius=20, clearance=20, leg_force=(-50, 400), leg_speed=100,
        payload=gough.Payload(30, (0, 0, 80)),
    )  # fmt: skip
    return replace(gough.Platform.load("reference"), limits=limits).with_frames(
        {"tool_in_platform": [0, 0, 90], "work_in_base": [0, 0, 500]}
    )


@pytest.mark.parametrize("frame", [None, "tool in work"])
def test_quantities_are_those_of_the_library(frame):
    platform = limited()

    def of(name: str) -> Callable[[gough.Pose, gough.Pose], float]:
        return {
            "margin": lambda own, _: gough.limits(platform, own).tightest,
            "force": lambda own, _: np.abs(gough.payload_forces(platform, own)).max(),
            "stiffness": lambda _, p: gough.softest_stiffness(platform, p, 1.0, frame),
            "speed": lambda _, p: gough.top_speeds(platform, p, 100.0, frame)[0],
            "error": lambda _, p: np.sqrt(np.linalg.eigvalsh(
                gough.pose_covariance(platform, p, 1.0, frame)[:3, :3])[-1]),
        }[name]  # fmt: skip

    for name in ("margin", "force", "stiffness", "speed", "error"):
        cut = workspace_slice(platform, ("x", "ry"), resolution=5, quantity=name, frame=frame)
        pose = pose_at(cut, cut.u[3], cut.v[1])
        own = platform.frame(frame).platform_pose(pose) if frame else pose
        np.testing.assert_allclose(cut.values[1, 3], of(name)(own, pose), rtol=1e-9)
        np.testing.assert_allclose(
            cut.distance[1, 3], gough.singularity_distance(platform, own), atol=1e-12
        )


def test_the_limit_that_ends_a_slice_is_hatched_and_named():
    platform = limited()
    cut = workspace_slice(platform, ("x", "y"), span=(-300, 300, -300, 300), resolution=41)
    regions = _regions(cut.limits, np.minimum.reduce(list(cut.limits.values())))
    assert "base joint" in regions
    kinds = ("stroke", "base joint", "platform joint", "clearance", "leg force")
    for i, j in ((0, 0), (20, 35), (40, 3)):
        pose = pose_at(cut, cut.u[j], cut.v[i])
        found = gough.limits(platform, pose)
        shares = {k: s for k, s in zip(found.names, found.share, strict=True) if k in kinds}
        worst = min(shares, key=lambda k: shares[k])
        if shares[worst] < 0 and worst != "stroke":
            assert regions[worst][i, j] < 0
    figure = workspace_figure(cut)
    texts = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert "edge of all limits" in texts
    assert "beyond the limit: base joint" in texts


def test_an_unknown_quantity_lists_those_there_are_and_forces_need_a_payload():
    platform = gough.Platform.load("reference")
    with pytest.raises(gough.GoughError, match="did you mean 'margin'"):
        workspace_slice(platform, quantity="margn", resolution=3)
    with pytest.raises(gough.GoughError, match="payload"):
        workspace_slice(platform, quantity="force", resolution=3)

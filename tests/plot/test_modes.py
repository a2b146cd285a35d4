"""The figure of all assembly modes."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("matplotlib")

import gough
from gough.kinematics import joint_positions
from gough.plot import modes_figure
from gough.plot.modes import FEW

PLATFORMS = ("dietmaier", "nasa_msfc", "reachy_mini", "rubin_camera")


@pytest.mark.parametrize("name", PLATFORMS)
def test_every_mode_is_drawn_where_it_is(name):
    platform = gough.Platform.load(name)
    modes = gough.assembly_modes(platform, platform.home_legs)
    figure = modes_figure(modes)
    few = len(modes) <= FEW
    front, above, *panels = [None, None, *figure.axes] if few else figure.axes
    joints = joint_positions(platform, modes.pose)
    for axes, (a, b) in () if few else ((front, (0, 2)), (above, (0, 1))):
        plates = [np.asarray(line.get_xydata()) for line in axes.get_lines()[: len(joints)]]
        for drawn, true in zip(plates, joints, strict=True):
            assert {tuple(p) for p in drawn} == {tuple(p) for p in true[:, [a, b]]}
        unit = platform.unit or "unit"
        assert axes.get_xlabel() == f"x [{unit}]"
        assert axes.get_ylabel() == f"{'xyz'[b]} [{unit}]"
    numbers = [text.get_text() for axes in panels for text in axes.texts]
    assert numbers == [str(k + 1) for k in range(len(joints))]
    order = np.argsort(gough.choose_mode(modes).rank)
    dashed = [axes.get_lines()[-1].get_linestyle() == "--" for axes in panels if axes.lines]
    assert dashed == (modes.sign[order] < 0).tolist()
    titles = [axes.get_title() for axes in panels]
    assert all(("deg" in title) == few for title in titles[: len(joints)])
    assert f"{len(joints)} poses" in figure.get_suptitle()


def test_readings_without_a_pose_give_a_figure_that_says_so():
    platform = gough.Platform.load("reference")
    modes = gough.assembly_modes(platform, platform.home_legs + np.array([0, 0, 0, 0, 0, 900]))
    assert len(modes) == 0
    assert "0 poses" in modes_figure(modes).get_suptitle()


def test_several_sets_of_readings_are_refused():
    platform = gough.Platform.load("reference")
    modes = gough.assembly_modes(platform, np.tile(platform.home_legs, (2, 1)))
    with pytest.raises(gough.GoughError, match=r"one set of readings, found 2"):
        modes_figure(modes)

"""Files of pictures: whole, repeatable, and in one look."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

pytest.importorskip("matplotlib")

import matplotlib as mpl

import gough
from gough.plot import modes_figure, new_figure, pose_figure, save, workspace_figure
from gough.plot import workspace_slice as cut
from gough.plot.style import CURVES, ENDINGS

PROGRAM = """
import sys, gough, gough.plot as p
platform = gough.Platform.load("nasa_msfc")
p.save(p.pose_figure(platform, platform.home), sys.argv[1])
assert "matplotlib.pyplot" not in sys.modules
"""


def figures(platform: gough.Platform) -> list:
    modes = gough.assembly_modes(platform, platform.home_legs)
    return [
        pose_figure(platform, platform.home),
        workspace_figure(cut(platform, resolution=15)),
        modes_figure(modes),
    ]


def test_the_same_figure_gives_the_same_bytes(tmp_path):
    platform = gough.Platform.load("nasa_msfc")
    for i, pair in enumerate(zip(figures(platform), figures(platform), strict=True)):
        for ending in ENDINGS if i == 0 else [".svg"]:
            paths = [tmp_path / f"{side}{ending}" for side in "ab"]
            for figure, path in zip(pair, paths, strict=True):
                save(figure, path)
            first, second = (path.read_bytes() for path in paths)
            assert first == second
            assert len(first) > 5000


@pytest.mark.process
def test_another_process_and_another_matplotlibrc_give_the_same_bytes_without_pyplot(tmp_path):
    (tmp_path / "matplotlibrc").write_text(
        "font.size: 20\nsvg.hashsalt: other\naxes.facecolor: red\n"
    )
    plain = {k: v for k, v in os.environ.items() if k != "MATPLOTLIBRC"}
    for name, environment in (
        ("a.svg", plain | {"PYTHONHASHSEED": "1"}),
        ("b.svg", plain | {"PYTHONHASHSEED": "2", "MATPLOTLIBRC": str(tmp_path)}),
    ):
        subprocess.run(
            [sys.executable, "-c", PROGRAM, str(tmp_path / name)], check=True, env=environment
        )
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert b"<dc:date>" not in (tmp_path / "a.svg").read_bytes()


def test_drawing_leaves_matplotlibs_settings_alone(tmp_path):
    before = dict(mpl.rcParams)
    platform = gough.Platform.load("reference")
    save(pose_figure(platform, platform.home), tmp_path / "a.png")
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize("name", ["a.jpg", "a", "a.svgz"])
def test_other_endings_are_refused(tmp_path, name):
    with pytest.raises(gough.GoughError, match=r"must end in \.svg, \.png or \.pdf"):
        save(new_figure(1, 1), tmp_path / name)
    assert os.listdir(tmp_path) == []


def test_a_picture_that_fails_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "a.svg"
    path.write_text("old")
    figure = new_figure(1, 1)

    def broken(file, **_):
        file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(figure, "savefig", broken)
    with pytest.raises(gough.GoughError, match="disk is full"):
        save(figure, path)
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.svg"]


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(gough.GoughError, match="there is no folder"):
        save(new_figure(1, 1), tmp_path / "no" / "a.svg")


def test_curves_differ_in_line_style_as_well_as_in_colour():
    assert len({color for color, _ in CURVES}) == len(CURVES)
    assert len({str(line) for _, line in CURVES}) == len(CURVES)

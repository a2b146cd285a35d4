"""gough plot as a user types it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")

import gough
from gough.commands.plot import FIGURES

EXAMPLE = Path(__file__).parents[2] / "examples" / "rubin_camera_legs.csv"
SIX = ("20", "-10", "610", "5", "3", "-4")


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_each_figure_gets_a_name_that_is_said(gough_command):
    gough_command("solve", EXAMPLE, "-p", "rubin_camera", "-o", "solved.csv")
    for figure, arguments in {
        "pose": (), "modes": (), "workspace": ("--resolution", "9"),
        "trajectory": (EXAMPLE,), "errors": ("solved.csv",),
    }.items():  # fmt: skip
        code, out, err = gough_command("plot", figure, *arguments, "-p", "rubin_camera")
        name = f"rubin_camera_{figure}.svg"
        assert (code, err) == (0, "")
        assert out.startswith(f"{name}: written, ")
        assert Path(name).read_text().startswith("<?xml")


def test_a_name_that_was_not_asked_for_replaces_nothing(gough_command):
    Path("reference_pose.svg").write_text("mine")
    code, _, err = gough_command("plot", "pose", "-p", "reference")
    assert code == 2
    assert "is there already; pass -o reference_pose.svg to replace it" in err
    assert Path("reference_pose.svg").read_text() == "mine"
    assert gough_command("plot", "pose", "-p", "reference", "-o", "reference_pose.svg")[0] == 0
    assert Path("reference_pose.svg").read_text() != "mine"


@pytest.mark.parametrize("ending", ["svg", "png", "pdf"])
def test_a_pose_in_three_ways_is_one_picture(gough_command, ending):
    platform = gough.Platform.load("reference")
    numbers = np.array([float(v) for v in SIX])
    legs = gough.leg_lengths(platform, gough.Pose.from_euler(numbers[:3], np.radians(numbers[3:])))
    Path("poses.csv").write_text("x,y,z,rx_deg,ry_deg,rz_deg\n0,0,600,0,0,0\n" + ",".join(SIX))
    as_legs = tuple(map(repr, map(float, legs)))
    for k, given in enumerate((("--pose", *SIX), as_legs, ("poses.csv", "--row", 2))):
        out = f"{k}.{ending}"
        code, _, err = gough_command("plot", "pose", *given, "-p", "reference", "-o", out)
        assert (code, err) == (0, "")
    first, _, third = (Path(f"{k}.{ending}").read_bytes() for k in range(3))
    assert first == third


def test_legs_are_solved_and_their_status_said(gough_command):
    legs = ("652.1", "660.3", "655.0", "648.8", "671.2", "639.9")
    code, out, _ = gough_command("plot", "pose", *legs, "-p", "reference")
    assert code == 0
    assert out.startswith("converged: The pose has these leg readings")


def test_modes_and_workspace_take_their_options(gough_command):
    legs = ("652.1", "660.3", "655.0", "648.8", "671.2", "639.9")
    assert gough_command("plot", "modes", *legs, "-p", "reference", "-o", "a.svg")[0] == 0
    code, _, err = gough_command(
        "plot", "workspace", "-p", "reference", "--axes", "x", "rz", "--y", "-20", "--rx", "5",
        "--span", "-50", "50", "-30", "30", "--resolution", "9", "-o", "b.svg",
    )  # fmt: skip
    assert (code, err) == (0, "")


def test_errors_of_several_files(gough_command):
    for seed in ("home", "polynomial"):
        gough_command("solve", EXAMPLE, "-p", "rubin_camera", "--seed", seed, "-o", f"{seed}.csv")
    code, out, err = gough_command(
        "plot", "errors", "home.csv", "polynomial.csv", "-p", "rubin_camera", "--truth", "home.csv"
    )
    assert (code, err) == (0, "")
    assert "rubin_camera_errors.svg: written" in out


def test_a_log_is_read_with_the_options_of_solve(gough_command):
    platform = gough.Platform.load("reference")
    legs = gough.leg_lengths(platform, platform.sample_poses(5)) / 10
    np.savetxt("log.csv", legs, delimiter=",", header="a,b,c,d,e,f", comments="")
    arguments = ("trajectory", "log.csv", "-p", "reference", "--columns", "a,b,c,d,e,f")
    assert gough_command("plot", *arguments)[0] == 2  # they are in centimetres
    assert gough_command("plot", *arguments, "--unit", "cm")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["pose", "-p", "refrence"], "did you mean 'reference'"),
        (["pose", "1", "2", "3", "-p", "reference"], "found 3"),
        (["pose", "1", "2", "3", "4", "5", "six", "-p", "reference"], "six"),
        (["pose", "--pose", *["1"] * 5, "nan", "-p", "reference"], "row 1 has no pose"),
        (["pose", *SIX, "--pose", *SIX, "-p", "reference"], "not both"),
        (["pose", *["nan"] * 6, "-p", "reference"], "row 1 has no pose: invalid_input"),
        (["pose", str(EXAMPLE), "--row", "5000", "-p", "rubin_camera"], "rows are 1 to 1000"),
        (["pose", "-p", "reference", "-o", "a.jpg"], "must end in .svg, .png or .pdf"),
        (["pose", "-p", "reference", "-o", "no/a.svg"], "there is no folder"),
        (["pose", "-p", "reference", "-o", "."], "must end in"),
        (["modes", "1", "2", "-p", "reference"], "expected six readings"),
        (["modes", "--row", "2", "-p", "reference"], "rows are 1 to 1"),
        (["modes", "no.csv", "-p", "reference"], "no.csv: cannot be read"),
        (["workspace", "-p", "reference", "--axes", "x", "x"], "two different"),
        (["workspace", "-p", "reference", "--x", "1"], "axis of the slice"),
        (["trajectory", "no.csv", "-p", "reference"], "no.csv: cannot be read"),
        (["trajectory", str(EXAMPLE), "-p", "rubin_camera", "--time", "tme"], "mean 'time'"),
        (["errors", "-p", "reference"], "FILE"),
        (["errors", str(EXAMPLE), "-p", "rubin_camera"], "no column residual"),
    ],
)
def test_mistakes_are_one_line_and_leave_no_file(gough_command, arguments, words):
    code, _, err = gough_command("plot", *arguments)
    assert code == 2
    assert len(err.splitlines()) == 1
    assert words in err
    assert list(Path().iterdir()) == []


@pytest.mark.process
def test_help_fits_80_columns_and_loads_no_heavy_library():
    program = (
        "import sys, gough.cli\n"
        f"for figure in [[], *([name] for name in {tuple(FIGURES)!r})]:\n"
        "    try: gough.cli.main(['plot', *figure, '--help'])\n"
        "    except SystemExit: pass\n"
        "    heavy = {'matplotlib', 'numpy', 'pyarrow', 'numba'} & set(sys.modules)\n"
        "    assert not heavy, (figure, heavy)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=False, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) <= 80
    for figure in ("", *FIGURES):
        assert f"usage: gough plot {figure}".strip() in done.stdout


def test_without_matplotlib_the_extra_is_named(gough_command, monkeypatch):
    for name in [n for n in sys.modules if n.startswith(("matplotlib", "gough.plot"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    code, _, err = gough_command("plot", "pose", "-p", "reference")
    assert code == 2
    assert "pip install 'gough[plot]'" in err

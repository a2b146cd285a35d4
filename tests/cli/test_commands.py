"""What a user types and sees."""

from __future__ import annotations

import logging
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pyarrow.csv as pacsv
import pyarrow.parquet as pq
import pytest

import gough as library
from gough.columns import LEGS
from gough.commands import COMMANDS
from gough.units import scaled

from .conftest import EXAMPLE, process


def test_solving_the_example_without_a_file_prints_poses_and_a_summary(gough):
    code, out, err = gough("solve", EXAMPLE, "-p", "rubin_camera", "--head", 3)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].replace(" [m]", "").split() == [*"xyz", "rx_deg", "ry_deg", "rz_deg", "status"]
    assert [line.split()[-1] for line in lines[2:5]] == ["converged"] * 3
    assert lines[2].split()[:3] == ["0.0000065", "0.0005751", "-0.0000168"]
    assert re.match(r"1,000 rows in .* s \(.* rows/s\)", lines[5])
    # a line more where this was the run that compiled the solver
    assert sum(line.startswith("converged  1,000  100.0 %") for line in lines[8:10]) == 1
    assert "The pose has these leg readings" in out
    assert max(map(len, lines)) <= 80


def test_there_and_back_through_files(gough, tmp_path):
    poses, legs = tmp_path / "poses.parquet", tmp_path / "legs.csv"
    code, out, _ = gough("solve", EXAMPLE, "-p", "rubin_camera", "-o", poses, "--keep", "time")
    assert code == 0
    assert "written to" in out
    assert gough("inverse", poses, "-p", "rubin_camera", "-o", legs, "--keep", "time").code == 0
    before, after = pacsv.read_csv(EXAMPLE), pacsv.read_csv(legs)
    for name in before.column_names:
        np.testing.assert_allclose(after[name].to_numpy(), before[name].to_numpy(), atol=1e-12)


def test_inverse_prints_legs(gough, tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("x,y,z,rx_deg,ry_deg,rz_deg\n0,0,0,0,0,0\n0,0,0.001,0,0,nope\n0,0,,0,0,0\n")
    code, out, err = gough("inverse", path, "-p", "rubin_camera", "--keep-bad-rows")
    assert code == 1
    assert out.splitlines()[0].split() == [*LEGS, "status"]
    assert out.splitlines()[2].split()[:2] == ["0.0000000", "0.0000000"]
    assert err.splitlines()[0] == (
        f"{path}: line 3: column rz_deg: found 'nope', expected a number"
    )


def test_exit_code_1_if_some_rows_failed_unless_allowed(gough, tmp_path):
    path, out = tmp_path / "legs.csv", tmp_path / "poses.csv"
    path.write_text(EXAMPLE.read_text() + "2000,0,0,,0,0,0\n" * 9)
    arguments = ("solve", path, "-p", "rubin_camera", "-o", out)
    code, text, err = gough(*arguments)
    assert code == 1
    assert re.search(r"^invalid_input +9 +0.9 %", text, re.MULTILINE)
    assert re.search(r"^converged +1,000 +99.1 %", text, re.MULTILINE)
    assert err.splitlines()[0].startswith(f"{path}: line 1002: leg_3 is empty")
    assert err.splitlines()[-1] == f"{path}: and 4 more invalid rows"
    assert len(out.read_text().splitlines()) == 1010
    assert gough(*arguments, "--allow-failures").code == 0


def test_angles_and_leg_noise(gough, tmp_path):
    out = tmp_path / "poses.csv"
    arguments = ("solve", EXAMPLE, "-p", "rubin_camera", "-o", out)
    assert gough(*arguments, "--angles", "deg", "--leg-noise", "1e-6").code == 0
    assert out.read_text().splitlines()[0] == (
        "x,y,z,rx_deg,ry_deg,rz_deg,status,residual,iterations,"
        "std_x,std_y,std_z,std_rx_deg,std_ry_deg,std_rz_deg"
    )


def test_solver_options_reach_the_solver(gough, tmp_path):
    out = tmp_path / "poses.csv"
    arguments = ("solve", EXAMPLE, "-p", "rubin_camera", "-o", out)
    code, text, _ = gough(*arguments, "--seed", "home", "--max-iterations", 0)
    assert code == 1
    assert "not_converged" in text
    code, _, err = gough(*arguments, "--seed", "nonsense")
    assert code == 2
    assert "nonsense" in err
    assert gough(*arguments, "--tolerance", "-1").code == 2


def test_platforms_are_listed(gough):
    code, out, _ = gough("platforms")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()[2:]] == library.Platform.catalog()
    assert max(map(len, out.splitlines())) <= 80


@pytest.mark.parametrize("name", library.Platform.catalog())
def test_a_platform_is_printed_as_toml_to_copy(gough, tmp_path, name):
    code, out, err = gough("platforms", name)
    assert (code, err) == (0, "")
    assert out.startswith("#")  # with the catalog's comments
    path = tmp_path / "mine.toml"
    path.write_text(out)
    assert library.Platform.load(path) == library.Platform.load(name)
    assert gough("platforms", path).code == 0


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], *([c, "--help"] for c in COMMANDS)])
def test_help_names_what_there_is_and_fits_80_columns(gough, arguments):
    code, out, err = gough(*arguments)
    assert (code, err) == (0, "")
    assert out.startswith("usage: gough")
    assert max(map(len, out.splitlines())) <= 80
    if len(arguments) == 1:
        assert all(name in out for name in COMMANDS)


@pytest.mark.process
@pytest.mark.parametrize("arguments", [[], ["solve", "--help"]])
def test_help_loads_no_heavy_library(arguments):
    program = (
        "import sys, gough.cli\n"
        f"try: gough.cli.main({arguments})\n"
        "except SystemExit: pass\n"
        "heavy = {'numba', 'pyarrow', 'numpy', 'torch', 'scipy', 'pandas'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_no_command_leaves_its_handler_of_notes(gough):
    log = logging.getLogger("gough")
    before = list(log.handlers)
    assert gough("solve", "--no-such-option").code == 2
    assert gough("platforms").code == 0
    assert log.handlers == before


def test_version(gough):
    assert gough("--version") == (0, f"gough {library.__version__}\n", "")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "usage: gough COMMAND"),
        (["slove"], "did you mean 'solve'"),
        (["solve"], "--platform"),
        (["solve", "x.csv"], "--platform"),
        (["solve", "x.csv", "-p", "reference", "--angels", "deg"], "--angles"),
        (["solve", "x.csv", "-p", "reference", "--angles", "grad"], "grad"),
        (["solve", "x.csv", "-p", "reference", "--block-rows", "0"], "block_rows"),
        (["solve", str(EXAMPLE), "-p", "rubin_camera", "--head", "-3"], "head: expected 0 or more"),
        (
            ["solve", str(EXAMPLE), "-p", "rubin_camera", "--block-rows", "9" * 20],
            "block_rows: expected 1 to 1,000,000,000, found 1e+20",
        ),
        (
            ["solve", str(EXAMPLE), "-p", "rubin_camera", "--columns", "1:1000000000"],
            "columns: expected six different columns, found (1, 2, 3, 4, 5, 6, 7)",
        ),
        (["solve", str(EXAMPLE), "-p", "rubin_camera", "--columns", "1" * 5000], "columns"),
        (["solve", str(EXAMPLE), "-p", "rubin_camera", "--seed", "polynomial-" + "1" * 5000], "e"),
        (["solve", "x.csv", "-p", "referense"], "did you mean 'reference'"),
        (["solve", "x.doc", "-p", "reference"], "must end in .csv or .parquet"),
        (["solve", "none.csv", "-p", "reference"], "none.csv: cannot be read: No such file"),
        (["solve", ".", "-p", "reference"], ".: many files are written to a folder"),
        (["platforms", "rubin"], "the catalog has"),
    ],
)
def test_bad_usage_is_short_and_exits_with_2(gough, arguments, words):
    code, out, err = gough(*arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert "Traceback" not in err
    assert len(err.splitlines()) <= 24  # a screen


@pytest.mark.parametrize("where", ["input", "output"])
def test_paths_that_cannot_be_used_are_one_line_errors(gough, tmp_path, where):
    (tmp_path / "folder.csv").mkdir()
    bad = [tmp_path / "folder.csv", tmp_path / "none" / "x.csv", tmp_path / "x.xlsx"]
    for path in bad:
        legs, out = (path, tmp_path / "o.csv") if where == "input" else (EXAMPLE, path)
        code, text, err = gough("solve", legs, "-p", "rubin_camera", "-o", out)
        assert (code, text, len(err.splitlines())) == (2, "", 1)
        assert err.startswith(f"gough solve: error: {path}: ")


def test_statuses_are_whole_at_80_columns(gough, tmp_path):
    """A machine whose positions take many digits: fewer are shown, the status never is cut."""
    reference = library.Platform.load("reference")
    large = scaled(replace(reference, stroke=(500, 700)), 1e5, "um")
    large.save(tmp_path / "large.toml")
    rows = np.array([np.full(6, 655.0), np.full(6, 695.0), np.full(6, 760.0)]) * 1e5
    text = "\n".join(",".join(f"{v}" for v in row) for row in rows)
    (tmp_path / "legs.csv").write_text(",".join(LEGS) + "\n" + text + "\n")
    done = gough("solve", tmp_path / "legs.csv", "-p", tmp_path / "large.toml")
    lines = done.out.splitlines()
    assert [line.split()[-1] for line in lines[2:5]] == [
        "converged", "converged", "outside_stroke",
    ]  # fmt: skip
    assert max(map(len, lines)) <= 80
    wide = replace(large, workspace=large.with_workspace(1e5, 1).workspace, stroke=None)
    wide.save(tmp_path / "large.toml")
    lines = gough("solve", tmp_path / "legs.csv", "-p", tmp_path / "large.toml").out.splitlines()
    assert lines[4].split()[-1] == "outside_workspace"
    assert max(map(len, lines)) <= 80


@pytest.mark.process
def test_names_with_spaces_and_standard_streams(tmp_path):
    path = tmp_path / "my legs.csv"
    path.write_text(EXAMPLE.read_text())
    result = process("solve", "my legs.csv", "-p", "rubin_camera", "-o", "-", cwd=tmp_path)
    assert result.code == 0
    assert len(result.out.splitlines()) == 1001
    assert "1,000 rows" in result.err
    piped = process(
        "inverse", "-", "-p", "rubin_camera", "-o", "legs out.parquet", input=result.out,
        cwd=tmp_path,
    )  # fmt: skip
    assert piped.code == 0
    assert pq.read_metadata(tmp_path / "legs out.parquet").num_rows == 1000


def test_poses_too_far_to_calculate_with_have_no_readings_and_no_warning(gough, tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("x,y,z,rx,ry,rz\n1e308,-1e308,1e308,0,0,0\n0,0,1e200,0,0,0\n")
    code, out, err = gough("inverse", path, "-p", "reference")
    assert (code, err) == (1, "")
    assert "unreachable" in out


def test_control_characters_of_files_do_not_reach_the_terminal(gough, tmp_path):
    machine, log = tmp_path / "red.toml", tmp_path / "legs.csv"
    text = library.Platform.load("reference").to_toml()
    for field in ("name", "unit"):
        machine.write_text(
            re.sub(rf"^{field} = .*", rf'{field} = "\\u001b[31mred"', text, flags=re.M)
        )
        code, _, err = gough("platforms", machine)
        assert code == 2
        assert f"{field}: holds control characters" in err
        assert "\x1b" not in err
    log.write_text(",".join(f"\x1b[31m_{k}" for k in range(6)) + "\n1,2,3,4,5,6\n")
    code, _, err = gough("solve", log, "-p", "reference")
    assert (code, len(err.splitlines())) == (2, 1)
    assert "\x1b" not in err


def test_warmup_compiles_everything_and_names_the_folder(gough, monkeypatch):
    """With one job in place of all; the real ones run all compiled functions."""
    from gough import compiling
    from gough.commands import warmup
    from gough.kernel import jit, rows

    assert rows.settle_rows in jit._kept
    assert {"few rows", "many rows", "tracker", "assembly modes"} <= set(warmup._jobs())

    @jit.jit(cache=False)
    def twice(x):
        return 2.0 * x

    monkeypatch.setattr(warmup, "_jobs", lambda: {"doubling": lambda machine: twice(machine.size)})
    monkeypatch.setattr(jit, "_lost", [])
    heard = []
    with compiling.announced(heard.append):
        assert "doubling: compiled in" in gough("warmup").out
    assert heard == ["twice"]
    again = gough("warmup").out
    assert "doubling: there already" in again
    assert "kept in /" in again
    monkeypatch.setattr(jit, "_lost", ["twice"])
    code, _, err = gough("warmup")
    assert code == 2
    assert "cannot be kept (twice)" in err
    assert "set NUMBA_CACHE_DIR to a folder" in err


def test_compiling_is_not_counted_as_solving(monkeypatch):
    from gough import compiling
    from gough.files import report as module

    now, spent = [50.0], [7.0]
    monkeypatch.setattr(module.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(compiling, "seconds", lambda: spent[0])
    report = module.Report(tuple(library.Status))
    now[0], spent[0] = 153.0, 107.0  # 103 s later, 100 of them spent on compiling
    report.add(library.Pose(np.zeros((1, 3))), np.ones((1, 6)), np.zeros(1, np.uint8), np.zeros(1))
    assert (report.seconds, report.compiling) == (3.0, 100.0)

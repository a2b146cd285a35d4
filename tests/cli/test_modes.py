"""gough modes: table, file and figure."""

from __future__ import annotations

import numpy as np
import pytest

import gough
from gough.commands.modes import run


def test_dietmaier_prints_forty_certified_rows(capsys, tmp_path):
    assert run((), platform="dietmaier", out=str(tmp_path / "modes.csv")) == 0
    said = capsys.readouterr().out
    assert "40 real poses, 40 certified" in said
    lines = (tmp_path / "modes.csv").read_text().splitlines()
    assert len(lines) == 41
    assert sum(",true," in line for line in lines) == 40


def test_parquet_of_many_readings_gives_the_poses_back(tmp_path, capsys):
    import pyarrow as pa
    from pyarrow import parquet

    platform = gough.Platform.load("reference")
    legs = gough.leg_lengths(platform, platform.sample_poses(5))
    columns = {f"leg_{i + 1}": legs[:, i] for i in range(6)}
    parquet.write_table(pa.table(columns), tmp_path / "legs.parquet")
    out = tmp_path / "modes.parquet"
    assert run((str(tmp_path / "legs.parquet"),), platform="reference", out=str(out)) == 0
    table = parquet.read_table(out).to_pydict()
    position = np.stack([table[k] for k in "xyz"], axis=-1)
    pose = gough.Pose(position, np.stack([table[k] for k in ("qw", "qx", "qy", "qz")], axis=-1))
    assert np.abs(gough.leg_lengths(platform, pose) - legs[np.array(table["row"]) - 1]).max() < 1e-9
    assert "5 sets of readings" in capsys.readouterr().out


def test_figure_is_written(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "modes.png"
    assert run((), platform="linuxcnc_genhex", plot=str(picture)) == 0
    assert picture.stat().st_size > 20_000


@pytest.mark.parametrize("legs", [("1", "2"), ("1", "2", "3", "4", "5", "six"), ("no.csv",)])
def test_bad_legs_are_explained(legs):
    with pytest.raises(gough.GoughError, match=r"LEGS|no\.csv"):
        run(legs, platform="reference")


def test_invalid_readings_give_exit_code_1(capsys):
    assert run(("nan", "1", "1", "1", "1", "1"), platform="reference") == 1
    assert "correct the row" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("name", gough.Platform.catalog())
def test_the_table_fits_80_columns(capsys, monkeypatch, name):
    monkeypatch.setenv("COLUMNS", "80")
    assert run((), platform=name) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].endswith("your machine.")
    assert lines[1].split() == [*["pose", "x", "y", "z"], "rx_deg", "ry_deg", "rz_deg", "radius",
                                "fails"]  # fmt: skip
    assert "\N{HORIZONTAL ELLIPSIS}" not in "".join(lines)


def test_the_answer_comes_first(capsys):
    legs = ("655", "655", "655", "655", "655", "660")
    assert run(legs, platform="reference") == 0
    said = capsys.readouterr().out
    assert said.startswith("1 of 16 poses fits your machine.\n")
    assert "no other pose with these readings lies within this distance" in " ".join(said.split())


@pytest.mark.parametrize("length", ["1e20", "1e308"])
def test_huge_readings_have_no_pose_and_no_traceback(capsys, length):
    run((length, "1", "1", "1", "1", "1"), platform="reference")
    assert capsys.readouterr().out.startswith("No pose was found for these readings.")


def test_the_file_goes_to_standard_output_and_the_table_beside_it(capfdbinary):
    assert run((), platform="reference", out="-") == 0
    out, err = capfdbinary.readouterr()
    assert out.splitlines()[0].startswith(b"row,pose,x,y,z,qw,qx,qy,qz,status,residual,")
    assert b"real poses" in err


def test_bad_files_name_the_line(tmp_path):
    path = tmp_path / "legs.csv"
    path.write_text("leg_1,leg_2,leg_3,leg_4,leg_5,leg_6\n1,2,3,4,5,six\n")
    with pytest.raises(gough.InputError, match="line 2: column leg_6: found 'six'"):
        run((str(path),), platform="reference")

"""Limits of a machine, as `gough solve` shows and writes them."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gough import MachineLimits, Platform, Pose, leg_lengths


@pytest.fixture
def crowded(tmp_path: Path) -> tuple[Path, Path]:
    """A platform whose legs are thick, and readings of home and of a pose where two touch."""
    platform = replace(Platform.load("reference"), limits=MachineLimits(leg_radius=50, clearance=1))
    mine, log = tmp_path / "mine.toml", tmp_path / "legs.csv"
    platform.save(mine)
    poses = Pose.from_euler([0, 0, 590], np.radians([[0, 0, 0], [0, 25, -25]]))
    rows = [",".join(map(str, row)) for row in leg_lengths(platform, poses)]
    log.write_text("\n".join([",".join(f"leg_{i}" for i in range(1, 7)), *rows]) + "\n")
    return mine, log


def test_solve_names_the_legs_that_touch(gough, crowded) -> None:
    mine, log = crowded
    result = gough("solve", log, "-p", mine, "-o", log.with_name("poses.csv"))
    assert result.code == 0  # the poses are the machine's; whether it should be there is said
    written = log.with_name("poses.csv").read_text().splitlines()
    assert written[0].endswith("status,residual,iterations,margin,limit")
    assert float(written[1].split(",")[-2]) > 0 > float(written[2].split(",")[-2])
    assert re.search(r",legs \d and \d: clearance$", written[2])
    assert "limits: 1 rows beyond one; -2." in result.out
    shown = gough("solve", log, "-p", mine, "--json")
    limits = json.loads(shown.out)["limits"]
    assert limits["rows_beyond"] == 1
    assert "clearance" in json.loads(shown.out)["first_rows"][1]["limit"]
    assert "clearance" in gough("solve", log, "-p", mine).out


def test_limits_are_columns_on_request_only_where_the_file_states_none(gough, crowded) -> None:
    _, log = crowded
    assert "margin" not in gough("solve", log, "-p", "reference").out
    assert "workspace" in gough("solve", log, "-p", "reference", "--limits").out

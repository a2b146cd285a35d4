"""The table of docs/tolerances.md is that of the code, and each tolerance takes effect."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import reduce
from importlib import import_module
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

import gough
from gough import GoughError, Platform, PlatformError, Pose
from gough.checks import LARGEST
from gough.modes.choose import BRANCH_SLACK
from gough.platform_checks import COINCIDENT, FARTHEST
from gough.pose import ROTATION, UNIT_LENGTH
from gough.rotary import RIGHT_ANGLE

ROOT = Path(__file__).parents[1]
CELLS = r"^\| ([-+\d.e]+) \|[^|]*\|[^|]*\| `gough\.([\w.]+)` \| `([\w/.]+)::(\w+)` \|$"
ROWS = re.findall(CELLS, (ROOT / "docs" / "tolerances.md").read_text("utf-8"), re.MULTILINE)
REFERENCE = Platform.load("reference")


def test_every_row_is_read() -> None:
    text = (ROOT / "docs" / "tolerances.md").read_text("utf-8")
    assert len(ROWS) == text.count("\n| ") - 1 >= 10


@pytest.mark.parametrize(("value", "name", "file", "test"), ROWS)
def test_the_table_is_that_of_the_code(value: str, name: str, file: str, test: str) -> None:
    parts = name.split(".")
    depth = next(i for i, part in enumerate(parts) if not part.islower())
    module = import_module(".".join(["gough", *parts[:depth]]))
    assert reduce(getattr, parts[depth:], module) == float(value)
    assert f"def {test}(" in (ROOT / file).read_text("utf-8")


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_joints_closer_than_the_tolerance_are_one_point(scale: float) -> None:
    def machine(gap: float) -> Platform:
        base, moving = scale * REFERENCE.base, scale * REFERENCE.moving
        for joints in (base, moving):
            joints[1] = joints[0] + [gap * scale * REFERENCE.size, 0, 0]
        return Platform(base, moving, home=scale * REFERENCE.home.position)

    machine(3 * COINCIDENT)
    with pytest.raises(PlatformError, match="share both joints"):
        machine(COINCIDENT / 3)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("field", ["base", "moving", "pivot", "home"])
def test_machines_too_far_from_the_origin_are_refused(field: str, scale: float) -> None:
    def machine(sizes: float) -> Platform:
        far = np.array([0, sizes * scale * REFERENCE.size, 0])
        parts = {
            "base": scale * REFERENCE.base,
            "moving": scale * REFERENCE.moving,
            "pivot": np.zeros(3),
            "home": scale * REFERENCE.home.position,
        }
        moved = {"base": ("base", "home"), "home": ("base", "home"), "moving": ("moving", "home")}
        for name in moved.get(field, ("pivot",)):
            sign = -1 if (field, name) == ("moving", "home") else 1
            parts[name] = parts[name] + sign * far
        return Platform(parts["base"], parts["moving"], parts["home"], pivot=parts["pivot"])

    machine(FARTHEST / 2)
    with pytest.raises(PlatformError, match="leaves too few digits"):
        machine(2 * FARTHEST)


def test_arm_axes_may_be_off_by_the_tolerance_only() -> None:
    arms = Platform.load("reachy_mini").rotary
    assert arms is not None
    replace(arms, axis_x=arms.axis_x * (1 + RIGHT_ANGLE / 3))
    with pytest.raises(PlatformError, match="right angles"):
        replace(arms, axis_x=arms.axis_x * (1 + 3 * RIGHT_ANGLE))


def test_matrices_may_be_off_by_the_tolerance_only() -> None:
    Pose.from_rotation(np.zeros(3), np.eye(3) * (1 + ROTATION / 3))
    with pytest.raises(GoughError, match="scale factor"):
        Pose.from_rotation(np.zeros(3), np.eye(3) * (1 + 3 * ROTATION))


def test_quaternions_of_tables_may_be_off_by_the_tolerance_only() -> None:
    lengths = 1 + UNIT_LENGTH * np.array([0.5, 1.5])
    columns = {name: [0.0, 0.0] for name in ("x", "y", "z", "qx", "qy", "qz")}
    pose = Pose.from_frame(pa.table(columns | {"qw": lengths}))
    assert np.isnan(pose.wxyz[:, 0]).tolist() == [False, True]


@pytest.mark.parametrize("axis", range(3))
def test_numbers_beyond_the_largest_are_refused(axis: int) -> None:
    base = REFERENCE.base.copy()
    base[2, axis] = 2 * LARGEST
    with pytest.raises(PlatformError, match=rf"base\[2\]\[{axis}\]: expected a number below"):
        Platform(base, REFERENCE.moving, home=(0, 0, 600))


def test_readings_of_modes_agree_to_the_tolerance() -> None:
    """A mode passes the filter of the arms' branch while its angles are the given ones."""
    platform = Platform.load("reachy_mini")
    modes = gough.assembly_modes(platform, platform.home_legs)
    passes = []
    for gap in (BRANCH_SLACK / 3, 3 * BRANCH_SLACK):
        off = replace(modes, legs=modes.legs + gap)
        passes.append(int(gough.choose_mode(off).passes["branch"].sum()))
    assert passes[0] > 0
    assert passes[1] == 0

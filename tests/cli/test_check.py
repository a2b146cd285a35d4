"""gough check: machines and logs with one mistake each, named with its evidence."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import machines
import numpy as np
import pytest

from gough import Platform, Pose, leg_lengths
from gough.examination.log import check_log
from gough.examination.machine import check, leg_steps
from gough.files.rows import Reading
from gough.home_mode import sure_workspace


def ring(diameter: float, degrees: list[float]) -> np.ndarray:
    angle = np.radians(degrees)
    x, y = diameter / 2 * np.cos(angle), diameter / 2 * np.sin(angle)
    return np.stack([x, y, np.zeros(6)], axis=-1)


def table(**changes) -> Platform:
    """The machine of the tutorial."""
    base = ring(600, [-10, 10, 110, 130, 230, 250])
    moving = ring(400, [-52, 52, 68, 172, 188, 292])
    platform = Platform(
        base, moving, (0, 0, 517), unit="mm", stroke=(480, 630), name="table"
    ).with_workspace(40, 10)
    return replace(platform, **changes)


def mistakes(platform: Platform) -> str:
    return " ".join(remark.text for remark in check(platform).remarks if remark.mistake)


def test_a_good_machine_has_no_mistakes() -> None:
    found = check(table())
    assert found.ok
    assert (found.poses, found.fitting) == (16, 1)
    assert 0.9 < found.within < 1
    assert found.nearest < 0.56  # the least of 10,000 samples
    assert np.all(found.used[:, 0] < 500)
    limits = {axis: names for axis, _, names in found.reach_rows()}
    assert all("stroke" in name for name in limits["z"])
    steps = found.steps
    assert steps is not None
    assert steps.step == 10
    np.testing.assert_allclose(steps.rise[0].round(1), [5.2, 0.4, -0.4, -0.6, 0.3, 5.2])
    assert np.degrees(steps.turn[0]).round(1) == -1.3


@pytest.mark.parametrize("name", Platform.catalog())
def test_machines_of_the_catalog_have_no_mistakes(name) -> None:
    assert mistakes(Platform.load(name)) == ""


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"moving": np.roll(table().moving, 1, axis=0), "stroke": None}, "counted from P2 on"),
        ({"moving": table().moving * [1, -1, 1], "stroke": None}, "left-handed"),
        ({"unit": "m"}, "in mm it would be 0.719 m"),
        ({"workspace": table().with_workspace(40, 60).workspace}, "reach"),
        ({"workspace": table().with_workspace(0.04, 89).workspace, "stroke": None}, "crosses"),
        ({"home": Pose.from_euler([0, 0, 517], [0, 0, np.pi / 2]), "stroke": None}, "singular"),
    ],
)
def test_a_mistake_is_named(changes, text) -> None:
    assert text in mistakes(table(**changes))


def test_motors_have_arms_and_rods_of_their_own() -> None:
    platform = replace(machines.random_platform(3, "rotary", sensors=True), unit="")
    assert platform.rotary is not None
    assert len(set(platform.rotary.arm_length.tolist())) == 6
    found = check(platform)
    assert found.ok
    assert found.steps is not None
    assert leg_steps(platform) is not None


@pytest.mark.parametrize(
    ("base", "stroke", "text"),
    [
        (1200, (480, 630), "diameters for radii"),
        (600, (0.48, 0.63), "m for mm"),
        (600, (-75, 75), 'legs = "length_change"'),
    ],
)
def test_a_refused_file_is_told_how_it_would_be_accepted(gough, tmp_path, base, stroke, text):
    platform = table(stroke=None)
    path = tmp_path / "mine.toml"
    scaled = replace(
        platform, base=platform.base * base / 600, moving=platform.moving * base / 600, stroke=None
    )
    scaled.save(path)
    path.write_text(f"stroke = [{stroke[0]}, {stroke[1]}]\n" + path.read_text())
    done = gough("check", path)
    assert done.code == 1
    assert "forbids the home pose" in done.out
    assert text in done.out.replace("\n", " ")


def readings(platform: Platform, count: int = 60) -> np.ndarray:
    legs = leg_lengths(platform, platform.sample_poses(count, seed=5))
    assert platform.stroke is not None
    low, high = platform.stroke.T
    return legs[np.all((legs > low) & (legs < high), axis=-1)]


def log_of(path: Path, legs: np.ndarray, head: str = "L1,L2,L3,L4,L5,L6") -> str:
    rows = [",".join(f"{value:.6f}" for value in row) for row in legs]
    path.write_text("\n".join([head, *rows]) + "\n")
    return str(path)


def test_a_log_is_understood_and_judged(gough, tmp_path) -> None:
    mine = tmp_path / "mine.toml"
    table().save(mine)
    legs = readings(table())
    good = log_of(tmp_path / "good.csv", legs)
    assert gough("check", mine, good).code == 0
    inches = log_of(
        tmp_path / "inches.csv", legs / 25.4, "A1 (in),A2 (in),A3 (in),A4 (in),A5 (in),A6 (in)"
    )
    done = gough("check", mine, inches, "--json")
    assert done.code == 0
    facts = json.loads(done.out)
    assert facts["log"]["columns"][0] == "A1 (in)"
    np.testing.assert_allclose(facts["log"]["factor"], 25.4)
    assert facts["log"]["statuses"] == {"converged": len(legs)}
    text = gough("check", mine, good, "--plot", tmp_path / "home.svg").out
    assert max(map(len, text.splitlines())) <= 80
    assert (tmp_path / "home.svg").exists()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda legs: legs / 25.4, "--unit in"),
        (lambda legs: legs - 480, "--offset=480,480,480,480,480,480"),
        (lambda legs: legs - table().home_legs, "--offset=555"),
        (lambda legs: legs[:, [0, 2, 1, 3, 4, 5]], "1 3 2 4 5 6"),
        (lambda legs: legs + 160, "all six readings are above the stroke"),
    ],
)
def test_a_mistake_in_a_log_is_guessed(tmp_path, change, text) -> None:
    path = log_of(tmp_path / "log.csv", change(readings(table())))
    found = check_log(path, table(), Reading(keep_bad_rows=True))
    assert not found.ok
    assert text in " ".join(remark.text for remark in found.remarks)


def test_columns_of_unknown_names_are_listed_and_can_be_given(gough, tmp_path) -> None:
    """Below a preamble: the names are those above the first numbers."""
    mine, log = tmp_path / "mine.toml", tmp_path / "log.csv"
    table().save(mine)
    rows = "\n".join(";".join(f"{v:.4f}" for v in row) for row in readings(table())[:9])
    log.write_text("Logger 7;rev 2\n" + ";".join(f"Foo {k}" for k in "abcdef") + "\n" + rows)
    done = gough("check", mine, log)
    assert done.code == 2
    assert "found Foo a, Foo b" in done.err.replace("\n", " ")
    assert gough("check", mine, log, "--columns", "1:6").code == 0


def test_degrees_of_motors_are_noticed_and_stated_in_the_file(gough, tmp_path) -> None:
    reachy = Platform.load("reachy_mini")
    legs = leg_lengths(reachy, reachy.sample_poses(40, seed=1))
    path = log_of(tmp_path / "motors.csv", np.degrees(legs))
    found = check_log(path, reachy, Reading(keep_bad_rows=True))
    assert "--angle-unit deg" in found.remarks[0].text
    mine = tmp_path / "mine.toml"
    reachy.save(mine)
    stroke = np.degrees(reachy.home_legs)[:, None] + [-60, 60]
    rows = ",".join(f"[{low},{high}]" for low, high in stroke)
    text = f'angle_unit = "deg"\nstroke = [{rows}]\n' + mine.read_text()
    mine.write_text(text + '\n[readings]\nangle_unit = "deg"\n')
    loaded = Platform.load(mine).stroke
    assert loaded is not None
    np.testing.assert_allclose(np.degrees(loaded), stroke)
    assert gough("check", mine, path).code == 0
    mine.write_text(text.replace('"deg"', '"grad"'))
    assert "angle_unit: expected 'deg' or 'rad'" in gough("check", mine).err
    assert sure_workspace(reachy) is not None

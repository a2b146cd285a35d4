"""Platforms found in models: exported ones come back, others are found or refused with a reason."""

from __future__ import annotations

import importlib.util
import re
from dataclasses import replace
from pathlib import Path

import machines
import numpy as np
import pytest
import support
from shell import run

import gough
from gough import GoughError, Platform, Pose
from gough.export.mjcf import to_mjcf
from gough.export.sdf import to_sdf
from gough.importers.legs import find_platform
from gough.importers.mjcf import read_mjcf
from gough.importers.sdf import read_sdf
from gough.units import LENGTHS, in_unit

KINDS = ["telescopic", "length_change", "rotary"]


def found(text: str, folder: Path, form: str = "mjcf") -> tuple[Platform, list[str]]:
    file = folder / f"model.{form}"
    file.write_text(text)
    return find_platform(read_mjcf(file) if form == "mjcf" else read_sdf(file))


def assert_same(platform: Platform, expected: Platform) -> None:
    """Equal joints, home and readings, to 1e-12 of the size."""
    near = 1e-12 * expected.size
    for name in ("base", "moving", "pivot_point"):
        np.testing.assert_allclose(getattr(platform, name), getattr(expected, name), atol=near)
    np.testing.assert_allclose(np.array(platform.home.distance(expected.home)), 0, atol=near)
    poses = support.sample(expected, (20,))
    legs = gough.leg_lengths(expected, poses)
    scale = 1e-12 * np.max(np.abs(1 / expected.gain)) * support.reading_scale(expected)
    np.testing.assert_allclose(gough.leg_lengths(platform, poses), legs, atol=10 * scale)
    if expected.stroke is not None:
        assert platform.stroke is not None
        np.testing.assert_allclose(platform.stroke, expected.stroke, atol=10 * scale)


@pytest.mark.parametrize("name", Platform.catalog())
def test_an_exported_model_of_mujoco_comes_back(name: str, tmp_path: Path) -> None:
    platform = Platform.load(name)
    metres = in_unit(platform, "m") if platform.unit in LENGTHS else platform
    again, notes = found(to_mjcf(platform), tmp_path)
    assert_same(again, metres)
    assert (again.legs, again.name) == (platform.legs, platform.name)
    np.testing.assert_allclose(again.offset, metres.offset, atol=1e-12 * metres.size)
    assert "Legs 1 to 6: leg1, leg2, leg3, leg4, leg5, leg6." in notes


@pytest.mark.parametrize("legs", KINDS)
def test_offset_gain_pivot_and_stroke_come_back(legs: str, tmp_path: Path) -> None:
    platform = replace(machines.random_platform(5, legs, sensors=True), unit="m")
    assert_same(found(to_mjcf(platform), tmp_path)[0], platform)


@pytest.mark.parametrize("legs", KINDS)
def test_an_exported_sdf_comes_back_with_readings_from_home(legs: str, tmp_path: Path) -> None:
    platform = replace(machines.random_platform(6, legs), unit="m", pivot=None, stroke=None)
    again, _ = found(to_sdf(platform), tmp_path, "sdf")
    poses = support.sample(platform, (20,))
    change = gough.leg_lengths(platform, poses) - platform.home_legs
    scale = 1e-12 * support.reading_scale(platform)
    np.testing.assert_allclose(gough.leg_lengths(again, poses), change, atol=10 * scale)
    assert again.legs == ("rotary" if legs == "rotary" else "length_change")


def test_a_base_that_is_free_is_the_body_listed_first(tmp_path: Path) -> None:
    text = to_sdf(Platform.load("reference")).replace('type="fixed"', 'type="ball"')
    text = text.replace('<link name="base">', '<link name="base"><pose>1 2 3 0 0 1</pose>')
    text = re.sub(r'(<link name="(?!base)[^>]*>\s*<pose)>', r'\1 relative_to="base">', text)
    platform, notes = found(text, tmp_path, "sdf")
    metres = in_unit(Platform.load("reference"), "m")
    assert any(note.startswith("Base: base. Platform: platform") for note in notes)
    np.testing.assert_allclose(platform.base, metres.base, atol=1e-12)


def test_balls_motors_and_tendons_will_do(tmp_path: Path) -> None:
    """Legs of another make: ball joints at the base, loops between sites, force motors."""
    platform = in_unit(Platform.load("reference"), "m")
    expected = replace(machines.with_some_workspace(platform), stroke=None)
    text = to_mjcf(expected)
    twice = '<joint type="hinge" axis="1.0 0.0 0.0" />'
    assert text.count(twice) == 6
    text = text.replace(twice, '<joint type="ball" />')
    text = text.replace('<joint type="hinge" axis="0.0 1.0 0.0" />', "")
    text = text[: text.index("<keyframe>")] + "</mujoco>"
    ball_legs, notes = found(text, tmp_path)
    assert_same(ball_legs, expected)
    assert "Home: the configuration of the file." in notes

    sites = "".join(f'<site name="b{i}" pos="{x} {y} {z}"/>' for i, (x, y, z)
                    in enumerate(expected.base))  # fmt: skip
    tops = "".join(f'<site name="p{i}" pos="{x} {y} {z}"/>' for i, (x, y, z)
                   in enumerate(expected.moving))  # fmt: skip
    x, y, z = expected.home.position
    legs = "".join(f'<spatial name="leg{i}"><site site="b{i}"/><site site="p{i}"/></spatial>'
                   for i in range(6))  # fmt: skip
    tendons, _ = found(
        f'<mujoco><worldbody>{sites}<body pos="{x} {y} {z}"><freejoint/><geom size="0.1"/>{tops}'
        f"</body></worldbody><tendon>{legs}</tendon></mujoco>",
        tmp_path,
    )
    assert_same(tendons, expected)


def test_the_makers_model_of_reachy_mini_is_the_machine_of_the_catalog() -> None:
    """A model that nobody here wrote, from the package reachy_mini, where it is installed."""
    spec = importlib.util.find_spec("reachy_mini")
    if spec is None or not spec.submodule_search_locations:
        pytest.skip("reachy_mini is not installed")
    folder = Path(spec.submodule_search_locations[0])
    file = folder / "descriptions/reachy_mini/mjcf/reachy_mini.xml"
    platform, notes = find_platform(read_mjcf(file))
    catalog = Platform.load("reachy_mini")
    assert "Legs 1 to 6: stewart_1, stewart_2, stewart_3, stewart_4, stewart_5, stewart_6." in notes
    to_base, to_platform = (
        _motion(getattr(catalog, part), getattr(platform, part)) for part in ("base", "moving")
    )
    poses = catalog.sample_poses(100)
    legs = gough.leg_lengths(platform, to_base @ poses @ to_platform.inverse())
    np.testing.assert_allclose(legs, gough.leg_lengths(catalog, poses), atol=1e-5)


def _motion(points: np.ndarray, moved: np.ndarray) -> Pose:
    """The motion that carries points onto others."""
    centres = points.mean(axis=0), moved.mean(axis=0)
    u, _, v = np.linalg.svd((points - centres[0]).T @ (moved - centres[1]))
    flip = np.diag([1, 1, np.sign(np.linalg.det(v.T @ u.T))])
    rotation = v.T @ flip @ u.T
    return Pose.from_rotation(centres[1] - rotation @ centres[0], rotation)


# ---- refusals -------------------------------------------------------------------------

MJCF = to_mjcf(Platform.load("reference"))
SDF = to_sdf(Platform.load("reference"))


@pytest.mark.parametrize(
    ("text", "form", "reason"),
    [
        (re.sub('<connect body1="leg3_rod"[^>]*>', '<connect site1="zero" site2="pose"/>', MJCF),
         "mjcf", "loops are open by 0"),
        ('<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>',
         "mjcf", "no two bodies are joined by six legs"),
        ("<mujoco><nonsense/></mujoco>", "mjcf", "MuJoCo refuses it"),
        (re.sub('gear="[^"]*"', 'gear="0"', MJCF, count=1), "mjcf", "actuator leg1: its gear is 0"),
        (SDF.replace("<child>leg4_rod</child>", "<child>leg4_rot</child>"), "sdf",
         "no frame 'leg4_rot'"),
        (SDF.replace('name="leg4_platform" type="ball"', 'name="leg4_platform" type="screw"'),
         "sdf", "joint leg4_platform: type 'screw'; expected one of revolute"),
        (SDF.replace('name="leg4_platform" type="ball"', 'name="leg4_platform" type="fixed"'),
         "sdf", "the slide leg4 is fixed to the platform"),
        (SDF.replace('name="leg4_platform" type="ball"', 'name="leg4_platform" type="prismatic"'),
         "sdf", "expected one <axis>, found 0"),
        (SDF.replace('name="leg1_cylinder_joint" type="universal"',
                     'name="leg1_cylinder_joint" type="fixed"'), "sdf", "is fixed to the base"),
        (SDF.replace("<upper>1e+16</upper>", "<upper>far</upper>", 1), "sdf",
         "expected numbers, found 'far'"),
        ("<!DOCTYPE x><sdf/>", "sdf", "declares entities"),
        ("<sdf version='1.7'><model name='a'/></sdf>", "sdf", "expected an <sdf> with one model"),
        ("<sdf", "sdf", "not valid XML"),
    ],
)  # fmt: skip
def test_what_is_no_hexapod_is_refused_with_the_reason(
    text: str, form: str, reason: str, tmp_path: Path
) -> None:
    with pytest.raises(GoughError, match=reason):
        found(text, tmp_path, form)


def test_a_slide_that_does_not_point_along_the_leg_is_refused(tmp_path: Path) -> None:
    slide = SDF.index('<joint name="leg2" type="prismatic">')
    tilted = SDF[:slide] + SDF[slide:].replace("<xyz>0.0 0.0 1.0</xyz>", "<xyz>0 0.1 1</xyz>", 1)
    with pytest.raises(GoughError, match=r"leg2 points 5\.7 deg away"):
        found(tilted, tmp_path, "sdf")


# ---- command --------------------------------------------------------------------------


def test_the_command_writes_the_platform_with_what_was_assumed(tmp_path: Path) -> None:
    model, file = tmp_path / "model.xml", tmp_path / "machine.toml"
    model.write_text(to_mjcf(Platform.load("rubin_camera")))
    said, code = run(f"gough import mjcf {model} -o {file}")
    assert code == 0
    assert "Legs 1 to 6: leg1" in said
    assert file.read_text().startswith("# Found in model.xml.\n# Lengths: metres")
    assert_same(Platform.load(file), Platform.load("rubin_camera"))
    assert "pass --force" in run(f"gough import mjcf {model} -o {file}")[0]
    said, code = run(f"gough import sdf {tmp_path / 'none.sdf'} -o {file} --force")
    assert code == 2
    assert "none.sdf: cannot be read" in said

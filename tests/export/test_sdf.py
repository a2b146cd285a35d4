"""Exported SDF: as libsdformat checks it, with every link where the legs have it."""

from __future__ import annotations

import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import machines
import numpy as np
import pytest
from shell import run

import gough
from gough import Platform, Pose
from gough.export.mechanism import inertia, mechanism
from gough.export.sdf import to_sdf

CHECK = """
#include <iostream>
#include <sdf/sdf.hh>
int main(int count, char **names)
{
  auto config = sdf::ParserConfig::GlobalConfig();
  config.SetWarningsPolicy(sdf::EnforcementPolicy::ERR);
  config.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::ERR);
  int found = 0;
  for (int i = 1; i < count; i++) {
    sdf::Root root;
    for (auto &error : root.Load(names[i], config)) {
      std::cout << names[i] << ": " << error << std::endl;
      found++;
    }
  }
  return found > 0;
}
"""
Checker = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def check(tmp_path_factory: pytest.TempPathFactory) -> Checker:
    """Loads files with libsdformat, which is what Gazebo does; any warning is an error."""
    if not (shutil.which("g++") and shutil.which("pkg-config")):
        pytest.skip("g++ or pkg-config is not installed")
    find = ["pkg-config", "--cflags", "--libs", "sdformat12"]
    found = subprocess.run(find, capture_output=True, text=True, check=False)
    if found.returncode:
        pytest.skip("libsdformat-dev is not installed")
    folder = tmp_path_factory.mktemp("check")
    (folder / "check.cc").write_text(CHECK)
    command = ["g++", "-O0", "check.cc", *found.stdout.split(), "-o", "check"]
    subprocess.run(command, cwd=folder, check=True)
    return lambda *files: subprocess.run(
        [folder / "check", *files], capture_output=True, text=True, check=False
    )


@pytest.mark.process
def test_libsdformat_loads_every_machine(check: Checker, tmp_path: Path) -> None:
    files = []
    for name in Platform.catalog():
        files.append(tmp_path / f"{name}.sdf")
        files[-1].write_text(to_sdf(Platform.load(name)))
    done = check(*files)
    assert (done.stdout, done.returncode) == ("", 0)
    wrong = files[0].read_text().replace("<mass>", "<weight>").replace("</mass>", "</weight>")
    files[0].write_text(wrong)
    assert check(files[0]).returncode == 1


def numbers(element: ET.Element, path: str) -> np.ndarray:
    return np.array(element.findtext(path, "0 0 0 0 0 0").split(), float)


@pytest.mark.parametrize("legs", ["telescopic", "length_change", "rotary"])
def test_the_loops_are_closed_and_the_strokes_count_from_home(legs: str) -> None:
    platform = replace(machines.random_platform(3, legs, sensors=True), unit="m")
    model = ET.fromstring(to_sdf(platform)).find("model")
    assert model is not None
    placed: dict[str, Pose] = {}
    for link in model.findall("link"):
        pose, values = link.find("pose"), numbers(link, "pose")
        parent = "" if pose is None else pose.get("relative_to", "")
        place = Pose.from_rpy(values[:3], values[3:])
        placed[link.get("name", "")] = placed[parent] @ place if parent else place
    for leg, (rod, in_rod, _) in enumerate(mechanism(platform).loops):
        joint = model.find(f"joint[@name='leg{leg + 1}_platform']")
        assert joint is not None
        assert joint.findtext("parent") == rod
        point = placed["platform"].apply(numbers(joint, "pose")[:3])
        tip = gough.joint_positions(platform, platform.home)[leg]
        np.testing.assert_allclose(point, tip, atol=1e-12 * platform.size)
        np.testing.assert_allclose(placed[rod].apply(in_rod), tip, atol=1e-12 * platform.size)
        ends = [float(model.findtext(f"joint[@name='leg{leg + 1}']/axis/limit/{end}", ""))
                for end in ("lower", "upper")]  # fmt: skip
        assert platform.stroke is not None
        away = platform.gain[leg] * (platform.stroke[leg] - platform.home_legs[leg])
        np.testing.assert_allclose(ends, np.sort(away), rtol=1e-12)


def test_the_inertia_is_that_of_mujoco() -> None:
    import mujoco

    from gough.export.mjcf import to_mjcf

    platform = Platform.load("reference")
    model = mujoco.MjModel.from_xml_string(  # pyright: ignore[reportAttributeAccessIssue]
        to_mjcf(platform).replace('type="capsule"', 'type="cylinder"')
    )
    for body in mechanism(platform).bodies:
        mass, centre, tensor = inertia(body.bars)
        theirs = model.body(body.name)
        np.testing.assert_allclose(mass, theirs.mass[0], rtol=1e-12)
        np.testing.assert_allclose(centre, theirs.ipos, atol=1e-12)
        found = np.sort(np.linalg.eigvalsh(tensor))
        np.testing.assert_allclose(found, np.sort(theirs.inertia), rtol=1e-9)


def test_urdf_is_refused_with_what_to_use() -> None:
    said, code = run("gough export urdf -p reference -o x.urdf")
    assert code == 2
    assert "export mjcf" in said
    assert "one parent" in said


def test_the_command_writes_a_file_once(tmp_path: Path) -> None:
    file = tmp_path / "model.sdf"
    assert run(f"gough export sdf -p reference -o {file}") == (f"{file}\n", 0)
    assert ET.parse(file).getroot().tag == "sdf"
    assert run(f"gough export sdf -p reference -o {file}")[1] == 2

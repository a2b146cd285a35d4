"""The LinuxCNC component: called through a stub, and in LinuxCNC itself where it is installed.

The stub stands for LinuxCNC's types. Where `halcompile` and `halrun` are installed, the component
is compiled by the one and loaded by the other, in user space.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import cffi
import exported
import numpy as np
import pytest
import support
from exported import run
from hypothesis import given

import gough
from gough import GoughError, Platform, Pose, Status
from gough.export.linuxcnc import linuxcnc_files
from gough.units import in_unit

HERE = Path(exported.__file__).parent
MODULES = Path("/usr/lib/linuxcnc/modules")
KINDS = ("linuxcnc_genhex", "reachy_mini", "rubin_camera")


class Stub:
    """A component's functions, on arrays."""

    def __init__(self, library: Path) -> None:
        self.ffi = cffi.FFI()
        self.ffi.cdef(
            "int stub_forward(const double *, double *, double, double *);"
            "int stub_inverse(const double *, double *, double);"
        )
        self.lib: Any = self.ffi.dlopen(str(library))

    def forward(self, joints, guess, tool: float = 0.0):
        """Return value, world coordinates [unit, deg], pins."""
        world, pins = np.array(guess, float), np.zeros(5)
        code = self.lib.stub_forward(self._at(joints), self._at(world), tool, self._at(pins))
        return code, world, pins

    def inverse(self, world, tool: float = 0.0):
        """Return value, joints."""
        joints = np.full(6, np.nan)
        return self.lib.stub_inverse(self._at(world), self._at(joints), tool), joints

    def _at(self, array) -> Any:
        values: Any = np.ascontiguousarray(array, float)
        return self.ffi.from_buffer("double[]", values)


@pytest.fixture(scope="module")
def stubs(tmp_path_factory) -> dict[str, Stub]:
    if not shutil.which("gcc"):
        pytest.skip("gcc is not installed")
    made = {}
    for name in KINDS:
        folder = tmp_path_factory.mktemp(name)
        text = linuxcnc_files(Platform.load(name), "machine")["machinekins.comp"]
        code = re.sub(r"#include <(rtapi_math|kinematics)\.h>\n", "", text.split("\n;;\n", 1)[1])
        (folder / "kins.c").write_text(code)
        run(["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-fPIC", "-shared",
             f'-DKINS="{folder / "kins.c"}"', HERE / "kins_stub.c", "-lm",
             "-o", folder / "kins.so"])  # fmt: skip
        made[name] = Stub(folder / "kins.so")
    return made


def world(pose: Pose) -> np.ndarray:
    """Positions, and roll, pitch, yaw [deg], as LinuxCNC has them, (..., 6)."""
    return np.concatenate([pose.position, np.degrees(pose.rpy)], axis=-1)


def joints_of(platform: Platform, pose: Pose) -> np.ndarray:
    legs = gough.leg_lengths(platform, pose)
    return np.degrees(legs) if platform.rotary else legs


@support.at_most(20)
@given(support.seeds)
def test_both_ways_are_goughs_in_millimetres_and_rpy_degrees(stubs, seed: int) -> None:
    for name in KINDS:
        platform = in_unit(Platform.load(name), "mm")
        pose, near = support.sample(platform, (2,), seed)
        code, joints = stubs[name].inverse(world(pose))
        assert code == 0
        np.testing.assert_allclose(joints, joints_of(platform, pose), rtol=1e-12, atol=1e-9)
        code, found, pins = stubs[name].forward(joints, world(near))
        assert code == 0
        np.testing.assert_allclose(found, world(pose), atol=1e-8)
        assert pins[2] <= Status.NEAR_SINGULARITY
        assert 0 < pins[0] <= pins[1] <= 45


def test_tool_offset_is_that_of_genhexkins(stubs) -> None:
    """Its two equations: joints of base and platform both move by the offset along z."""
    platform = in_unit(Platform.load("linuxcnc_genhex"), "mm")
    offset = np.array([0.0, 0.0, 40.0])
    tooled = replace(
        platform, base=platform.base + offset, moving=platform.moving + offset, workspace=None
    )
    pose = support.sample(platform, ())
    code, joints = stubs["linuxcnc_genhex"].inverse(world(pose), tool=40.0)
    np.testing.assert_allclose(joints, gough.leg_lengths(tooled, pose), rtol=1e-13)
    code, found, _ = stubs["linuxcnc_genhex"].forward(joints, world(platform.home), tool=40.0)
    assert code == 0
    np.testing.assert_allclose(found, world(pose), atol=1e-9)


def test_angles_go_on_past_half_a_turn_and_at_the_pole(stubs) -> None:
    stub = stubs["linuxcnc_genhex"]
    platform = in_unit(Platform.load("linuxcnc_genhex"), "mm")
    pose = support.sample(platform, ())
    turns = world(pose) + np.array([0, 0, 0, 360, 0, -720])
    _, joints = stub.inverse(turns)
    code, found, _ = stub.forward(joints, turns + 0.1)
    assert code == 0
    np.testing.assert_allclose(found, turns, atol=1e-8)


def test_a_failure_leaves_the_pose_alone_and_says_so(stubs) -> None:
    guess = world(in_unit(Platform.load("linuxcnc_genhex"), "mm").home)
    for joints, status in ((np.full(6, np.nan), 6), ([700, 700, 700, 700, 700, 3000.0], None)):
        code, found, pins = stubs["linuxcnc_genhex"].forward(joints, guess)
        assert code == -1
        np.testing.assert_array_equal(found, guess)
        assert pins[3] == 1
        assert status is None or pins[2] == status


def test_a_pose_outside_the_workspace_is_no_failure(stubs) -> None:
    """LinuxCNC has limits of its own; the box must not stop the position display."""
    platform = in_unit(Platform.load("linuxcnc_genhex"), "mm")
    outside = Pose.from_rpy((0, 0, 758), np.radians([0, 30, 0]))
    code, found, pins = stubs["linuxcnc_genhex"].forward(
        gough.leg_lengths(platform, outside), world(platform.home)
    )
    assert (code, pins[3]) == (0, 0)
    np.testing.assert_allclose(found, world(outside), atol=1e-8)


def test_a_unit_that_cannot_be_converted_is_an_error() -> None:
    platform = replace(Platform.load("reference"), unit="cubit")
    with pytest.raises(GoughError, match="cannot convert 'cubit' to mm; the platform file must"):
        linuxcnc_files(platform)


def test_units_are_converted_whole() -> None:
    for name in KINDS:
        platform = Platform.load(name)
        other = in_unit(in_unit(platform, "inch"), platform.unit)
        pose = support.sample(platform, (5,))
        np.testing.assert_allclose(
            gough.leg_lengths(other, pose),
            gough.leg_lengths(platform, pose),
            rtol=1e-12,
            atol=1e-12,
        )
        assert np.all(other.in_workspace(pose))


@pytest.mark.process
def test_in_linuxcnc_itself(tmp_path: Path) -> None:
    """halcompile compiles it, halrun loads it: joints in, pose out, through HAL pins."""
    if not shutil.which("halcompile") or not shutil.which("halrun"):
        pytest.skip("LinuxCNC (linuxcnc-uspace-dev) is not installed")
    if not os.access(MODULES, os.W_OK):
        pytest.skip(f"{MODULES} cannot be written: halrun loads components from there alone")
    platform = in_unit(Platform.load("linuxcnc_genhex"), "mm")
    pose = support.sample(platform, (), 3)
    name = f"gough_test_{os.getpid()}"
    files = linuxcnc_files(Platform.load("linuxcnc_genhex"), name)
    files["kins_probe.comp"] = (HERE / "kins_probe.comp").read_text()
    installed = []
    try:
        for file, text in files.items():
            (tmp_path / file).write_text(text)
            subprocess.run(["halcompile", "--compile", file], cwd=tmp_path, check=True)
            module = file.replace(".comp", ".so")
            installed.append(shutil.copy(tmp_path / module, MODULES / module))
        pins = halrun(tmp_path, f"{name}kins", gough.leg_lengths(platform, pose), platform.home)
    finally:
        for path in installed:
            Path(path).unlink()
    prefix = f"{name}kins".replace("_", "-")
    assert pins["kins-probe.forward"] == pins["kins-probe.inverse"] == 0
    assert pins[f"{prefix}.fwd-kins-fail"] == pins[f"{prefix}.status"] == 0
    assert 0 < pins[f"{prefix}.last-iterations"] <= 45
    found = [pins[f"kins-probe.found-{k}"] for k in range(6)]
    np.testing.assert_allclose(found, world(pose), atol=1e-3)  # `show pin` prints seven digits
    lengths = [pins[f"kins-probe.length-{k}"] for k in range(6)]
    np.testing.assert_allclose(lengths, platform.home_legs, rtol=1e-6)


def halrun(folder: Path, module: str, joints: np.ndarray, guess: Pose) -> dict[str, float]:
    """All pins after some cycles with these joints and this guess."""
    lines = [f"loadrt {module}", "loadrt kins_probe", "loadrt threads name1=fast period1=1000000"]
    lines += [f"setp kins-probe.joint-{i} {value!r}" for i, value in enumerate(map(float, joints))]
    lines += [f"setp kins-probe.world-{i} {v!r}" for i, v in enumerate(world(guess).tolist())]
    lines += ["addf kins-probe.call fast", "start", "loadusr -w sleep 0.2", "show pin"]
    (folder / "test.hal").write_text("\n".join(lines) + "\n")
    with tempfile.TemporaryDirectory() as shared:
        Path(shared).chmod(0o777)  # rtapi_app makes its socket there, as another user
        environment = os.environ | {"RTAPI_FIFO_PATH": f"{shared}/fifo"}
        if os.getuid() == 0:  # it will not run as root
            environment["RTAPI_UID"] = "65534"
        done = subprocess.run(
            ["halrun", "-f", "test.hal"], cwd=folder, env=environment, text=True, timeout=60,
            capture_output=True,
        )  # fmt: skip
    rows = re.findall(r"^\s+\d+\s+\w+\s+(?:IN|OUT|I/O)\s+(\S+)\s+(\S+)", done.stdout, re.MULTILINE)
    assert rows, done.stdout + done.stderr
    read = {"TRUE": "1", "FALSE": "0"}
    return {name: float(int(v, 16) if "0x" in v else str(read.get(v, v))) for v, name in rows}

"""The files as a user gets them: no compiler warns, they pass their own test, and refuse."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import exported
import machines
import pytest
from exported import WARNINGS, run, write

import gough
from gough import GoughError, Platform
from gough.export.c import c_files
from gough.export.folder import write_folder
from gough.export.template import as_prefix, comment_text

# all kinds of leg, both kinds of number
KINDS = {"reference": "double", "rubin_camera": "float", "reachy_mini": "double"}
CPLUSPLUS = {"gcc": "g++", "clang": "clang++"}
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-c", "-o", "/dev/null")
ARM = {
    "double": ("-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard", "-mthumb"),
    "float": ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-mthumb"),
}


def need(*programs: str) -> None:
    for program in programs:
        if not shutil.which(program):
            pytest.skip(f"{program} is not installed")


@pytest.mark.process
@pytest.mark.parametrize("compiler", CPLUSPLUS)
@pytest.mark.parametrize(("name", "real"), KINDS.items())
def test_no_compiler_warns(tmp_path: Path, name: str, real, compiler: str) -> None:
    need(compiler, CPLUSPLUS[compiler])
    write(Platform.load(name), tmp_path, real)
    for source in sorted(tmp_path.glob("*.c")):
        run([compiler, "-std=c99", "-O2", *STRICT, source])
        run([CPLUSPLUS[compiler], "-x", "c++", "-std=c++17", "-O2", *STRICT, source])


@pytest.mark.process
@pytest.mark.parametrize(("name", "real"), [("reachy_mini", "double"), ("rubin_camera", "float")])
def test_what_is_written_builds_and_passes_its_own_test(tmp_path: Path, name: str, real) -> None:
    need("cmake", "ctest", "gcc")
    files = c_files(Platform.load(name), real=real)
    write_folder(tmp_path / "new" / name, files)
    run(["cmake", "-S", tmp_path / "new" / name, "-B", tmp_path / "build"])
    run(["cmake", "--build", tmp_path / "build"])
    assert "100% tests passed" in run(["ctest", "--test-dir", tmp_path / "build"])
    readings = re.search(r'echo "(.*)"', files["README.md"])
    assert readings
    lines = f"{readings[1]}\nno reading\n1,2,nan,4,5,6\n"
    done = subprocess.run(
        [tmp_path / "build" / f"{name}_example"], input=lines, text=True,
        capture_output=True, check=True,
    )  # fmt: skip
    head, first, second = done.stdout.splitlines()
    assert head == "x,y,z,qw,qx,qy,qz,event,status,steps"
    assert first.split(",")[-3:-1] == ["found", "converged"]
    assert second.split(",")[-3:] == ["held", "invalid_input", "0"]
    assert done.stderr == "skipped, expected six numbers: no reading\n"


@pytest.mark.process
def test_the_written_test_fails_for_another_machine(tmp_path: Path) -> None:
    need("gcc")
    write(Platform.load("reference"), tmp_path)
    source = (tmp_path / "machine.c").read_text()
    (tmp_path / "machine.c").write_text(
        source.replace("#define PER_SIZE 0", "#define PER_SIZE 1e-6+0")
    )
    program = tmp_path / "test"
    run(["gcc", tmp_path / "machine.c", tmp_path / "machine_test.c", "-o", program, "-lm"])
    done = subprocess.run([program], capture_output=True, text=True)
    assert done.returncode == 1
    assert "another pose" in done.stdout


def test_fast_math_is_refused(tmp_path: Path) -> None:
    need("gcc")
    write(Platform.load("reference"), tmp_path)
    with pytest.raises(RuntimeError, match="compile it without -ffast-math"):
        run(["gcc", "-ffast-math", "-c", tmp_path / "machine.c", "-o", "/dev/null"])


@pytest.mark.process
@pytest.mark.parametrize(("name", "real"), [("reference", "float"), ("reachy_mini", "double")])
def test_hostile_readings_are_survived(tmp_path: Path, name: str, real) -> None:
    """NaN, infinity, denormal and huge, under the sanitizers: no pose called good is wrong."""
    need("gcc")
    write(Platform.load(name), tmp_path, real)
    said = run([exported.hostile(tmp_path), "5000"])
    assert re.match(r"5000 readings, [1-9]\d+ poses called good, 0 of them wrong, 0 calls", said)


@pytest.mark.process
@pytest.mark.parametrize("real", ARM)
@pytest.mark.parametrize("name", ["reference", "reachy_mini"])
def test_code_and_stack_fit_a_cortex_m(tmp_path: Path, name: str, real) -> None:
    need("arm-none-eabi-gcc", "arm-none-eabi-size")
    write(Platform.load(name), tmp_path, real)
    code, stack = exported.footprint(tmp_path, ARM[real])
    assert code <= 9216
    assert stack <= {"double": 2048, "float": 1024}[real]


# ---- names and folders ----------------------------------------------------------------


def test_files_name_version_digest_and_licence() -> None:
    platform = Platform.load("rubin_camera")
    files = c_files(platform)
    assert sorted(files) == [
        "CMakeLists.txt", "README.md", "rubin_camera.c", "rubin_camera.h", "rubin_camera_example.c",
        "rubin_camera_test.c",
    ]  # fmt: skip
    for name, text in files.items():
        assert gough.__version__ in text
        assert re.findall(r"hexapod_|HEXAPOD_|@\w+@", text) == []
        if name.endswith((".c", ".h")):
            assert platform.digest in text
            assert "MIT No Attribution" in text


@pytest.mark.parametrize(
    ("name", "prefix"),
    [
        ("reachy_mini", "reachy_mini"), ("Stage No. 3", "stage_no_3"), ("6-axis", "hexapod_6_axis"),
        ("", "hexapod"), ("math", "math_hexapod"), ("Прибор", "hexapod"), ("_x", "x"),
    ],
)  # fmt: skip
def test_a_prefix_is_made_from_any_name(name: str, prefix: str) -> None:
    assert as_prefix(name) == prefix


@pytest.mark.parametrize(
    ("prefix", "said"),
    [("2nd", "expected a C name"), ("a-b", "expected a C name"), ("", "expected a C name"),
     ("math", "is taken by"), ("Test", "is taken by")],
)  # fmt: skip
def test_a_prefix_that_is_no_name_is_an_error(prefix: str, said: str) -> None:
    with pytest.raises(GoughError, match=said):
        c_files(Platform.load("reference"), prefix)


def test_a_name_in_a_comment_is_one_line_of_plain_characters() -> None:
    hostile = 'a */\n#error "\\ ??/ @x@\x00'
    assert comment_text(hostile) == "a _/_#error __ __/ _x__"


@pytest.mark.process
def test_hostile_names_stay_in_their_comments(tmp_path: Path) -> None:
    need("gcc")
    name = 'a */ int x; " #error \\ ??/ @digest@'
    platform = replace(machines.random_platform(3), name=name, unit='*/"')
    write(platform, tmp_path)
    run(["gcc", *WARNINGS, "-c", tmp_path / "machine.c", "-o", "/dev/null"])
    program = tmp_path / "test"
    run(
        [
            "gcc",
            *WARNINGS,
            tmp_path / "machine.c",
            tmp_path / "machine_test.c",
            "-o",
            program,
            "-lm",
        ]
    )
    assert " 0 failures" in run([program])


def test_files_are_not_replaced_unless_forced(tmp_path: Path) -> None:
    write_folder(tmp_path, {"a.c": "1", "b.c": "1"})
    with pytest.raises(GoughError, match=r"has b\.c already; pass --force to replace them"):
        write_folder(tmp_path, {"b.c": "2", "c.c": "2"})
    assert not (tmp_path / "c.c").exists()
    write_folder(tmp_path, {"b.c": "2"}, force=True)
    assert (tmp_path / "b.c").read_text() == "2"
    with pytest.raises(GoughError, match="cannot be made"):
        write_folder(tmp_path / "a.c" / "folder", {"x": ""})

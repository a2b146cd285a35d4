"""The exported C beside the Python tracker: events, digits, times, sizes, hostile readings.

    python benchmarks/controller.py            # some ten minutes; needs gcc
    python benchmarks/controller.py --quick    # a hundredth of the readings

Says which compiler each number is of. Clang and arm-none-eabi-gcc are used where installed. Keep
the machine otherwise idle for the times.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import cffi
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))
import exported
from exported import Rows, build, drives
from solver import processor

import gough
from gough import Platform, Pose, Status, Tracker
from gough.export.tables import MAX_STEPS

ARM = {
    "Cortex-M7, double": ("double", "-mcpu=cortex-m7", "-mfpu=fpv5-d16"),
    "Cortex-M4, float": ("float", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"),
}
GENHEX = Path("/usr/lib/linuxcnc/modules/genhexkins.so")


def main() -> None:
    parser = argparse.ArgumentParser(description="The exported C beside the Python tracker.")
    parser.add_argument("--quick", action="store_true", help="a hundredth of the readings")
    count = 10_000 if parser.parse_args().quick else 1_000_000
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print(f"{processor()}; {version('gcc')}\n")
        speed_table(folder, min(count // 10, 20_000))
        home_table(folder, count // 10)
        size_table(folder)
        hostile_table(folder, count)
        event_table(folder, count)


def version(compiler: str) -> str:
    """The first line that a compiler says of itself."""
    return exported.run([compiler, "--version"]).splitlines()[0]


# ---- events and digits ----------------------------------------------------------------


def event_table(folder: Path, count: int) -> None:
    """Half of `count` readings clean, half with faults, on every machine of the catalog.

    A tenth of them for float.
    """
    print(f"| {count:,} readings, half of them with faults | the same event as in Python "
          "| another, as other starts are tried later | then equal again, cycles after the fault "
          "| another without that reason | position error / size, double; float "
          "| rotation error, rad, double; float |")  # fmt: skip
    print("|---|---|---|---|---|---|---|")
    for name in Platform.catalog():
        platform = Platform.load(name)
        same, longest, unexplained, *double = compare(platform, count // 2, folder, "double")
        *_, shift, turn = compare(platform, count // 20, folder, "float")
        other = f"{count - same:,} | {longest}" if count - same else "none |"
        print(f"| {name} | {same:,} | {other} | {unexplained} | {double[0]:.1e}; {shift:.1e} | "
              f"{double[1]:.1e}; {turn:.1e} |", flush=True)  # fmt: skip


def compare(platform: Platform, half: int, folder: Path, real) -> tuple:
    """Cycles with equal events, longest disagreement, those that no start explains, errors."""
    machine = build(platform, folder / f"{platform.name}_{real}", real=real)
    path = drives.path(platform, half, seed=1)
    wrong, bad = drives.faulty(platform, path, seed=2)
    legs = np.concatenate([gough.leg_lengths(platform, path), wrong])
    bad = np.concatenate([np.zeros(half, bool), bad])
    legs = legs.astype(machine.real).astype(float)
    poses, events, _ = drives.tracked(Tracker(platform), legs)
    rows = machine.track(legs)
    shift, turn = rows.pose.distance(poses)
    same = rows.event == events
    agree = same & (shift <= 1e-5 * platform.size)
    longest, unexplained = disagreements(agree, bad, rows)
    return (int(same.sum()), longest, unexplained, (shift[agree] / platform.size).max(),
            turn[agree].max())  # fmt: skip


def disagreements(agree: np.ndarray, bad: np.ndarray, rows: Rows) -> tuple[int, int]:
    """Most good readings in a run of cycles that differ; how many runs involve no other start."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], agree, [True]]).astype(int)))
    runs = list(zip(edges[::2], edges[1::2], strict=True))
    unexplained = sum(not np.any(rows.next_start[max(a - 1, 0) : b] > 0) for a, b in runs)
    return max((int(np.sum(~bad[a:b])) for a, b in runs), default=0), unexplained


# ---- times ----------------------------------------------------------------------------


def speed_table(folder: Path, count: int) -> None:
    """One warm cycle: shortest of nine runs of each, and the Python tracker's."""
    print("| one cycle of the tracker | median | 99.9th percentile | longest |")
    print("|---|---|---|---|")
    for name in ("reference", "rubin_camera", "reachy_mini"):
        platform = Platform.load(name)
        path = drives.path(platform, count, seed=3)
        legs = gough.leg_lengths(platform, path)
        times = {"Python": python_times(platform, legs)}
        for compiler in exported.compilers():
            for real in ("double", "float"):
                at = folder / f"{name}_{compiler}_{real}"
                machine = build(platform, at, real=real, compiler=compiler)
                times[f"{compiler} -O3, {real}"] = machine.times(legs, path[0])
        for label, each in times.items():
            middle, tail, most = np.percentile(each, [50, 99.9, 100]) / 1e3
            print(f"| {name}, {label} | {middle:.2f} us | {tail:.2f} us | {most:.2f} us |",
                  flush=True)  # fmt: skip
    print()


def python_times(platform: Platform, legs: np.ndarray) -> np.ndarray:
    """Time of each cycle of the Python tracker [ns], the first hundred left out."""
    tracker, times = Tracker(platform), np.empty(len(legs))
    for i, row in enumerate(legs):
        begin = time.perf_counter_ns()
        tracker.update(row)
        times[i] = time.perf_counter_ns() - begin
    return times[100:]


# ---- from far away --------------------------------------------------------------------


def home_table(folder: Path, count: int) -> None:
    """LinuxCNC's hexapod from home, over a workspace wider than any machine's."""
    platform = Platform.load("linuxcnc_genhex").with_workspace(100 / 25.4, 60.0)
    pose = platform.sample_poses(count, seed=5)
    pose = pose[gough.assembly_sign(platform, pose) > 0]
    legs = gough.leg_lengths(platform, pose)
    print(f"| linuxcnc_genhex, +-100 mm, +-60 deg, {len(pose):,} poses with home's sign of det J, "
          "from home | true pose | another, called usable | another, called so | none "
          "| steps, mean and most | mean time |")  # fmt: skip
    print("|---|---|---|---|---|---|---|")
    for real, near in (("double", 1e-9), ("float", 1e-4)):
        machine = build(platform, folder / f"home_{real}", real=real)
        begin = time.perf_counter()
        rows = machine.solve(legs, platform.home)
        seconds = time.perf_counter() - begin
        true = rows.pose.distance(pose)[0] < near * platform.size
        home_row(f"exported C, {real}", true, rows.status, rows.steps, seconds)
        assert rows.steps.max() <= MAX_STEPS
    if GENHEX.exists():
        found, codes, seconds = genhexkins(folder, legs, platform.home)
        true = found.distance(pose)[0] < 1e-6 * platform.size  # it stops at 1e-9 in
        home_row("LinuxCNC's genhexkins", true, np.where(codes < 0, 5, 0), None, seconds)
    else:
        print("LinuxCNC (linuxcnc-uspace) is not installed: no row for genhexkins")
    print()


def home_row(name: str, true, status, steps, seconds: float) -> None:
    usable = status <= Status.OUTSIDE_WORKSPACE
    failed = ~usable & (status != Status.OTHER_MODE)
    true = true & ~failed
    shares = [true, ~true & usable, ~true & ~usable & ~failed, failed]
    cells = " | ".join(f"{np.mean(share):.3%}" for share in shares)
    taken = "" if steps is None else f"{steps.mean():.2f}, {steps.max()}"
    each = seconds / len(true) * 1e6
    print(f"| {name} | {cells} | {taken} | {each:.2f} us |", flush=True)


def genhexkins(folder: Path, legs: np.ndarray, home: Pose) -> tuple:
    """Poses, codes and time [s] of LinuxCNC's own module."""
    library = folder / "genhex.so"
    source = Path(exported.__file__).parent / "genhex.c"
    exported.run(["gcc", "-O2", "-fPIC", "-shared", f'-DMODULE="{GENHEX}"', source, "-o", library])
    ffi = cffi.FFI()
    ffi.cdef("int genhex_load(void); void genhex_all(int, const double *, double *, int *);")
    lib: Any = ffi.dlopen(str(library), ffi.RTLD_NOW | ffi.RTLD_GLOBAL)
    assert lib.genhex_load() == 0
    start = np.concatenate([home.position, np.degrees(home.rpy)])
    world, joints = np.tile(start, (len(legs), 1)), np.ascontiguousarray(legs)
    codes = np.zeros(len(legs), np.int32)
    begin = time.perf_counter()
    lib.genhex_all(
        len(legs), ffi.from_buffer("double[]", joints), ffi.from_buffer("double[]", world),
        ffi.from_buffer("int[]", codes),
    )  # fmt: skip
    seconds = time.perf_counter() - begin
    return Pose.from_rpy(world[:, :3], np.radians(world[:, 3:])), codes, seconds


# ---- sizes ----------------------------------------------------------------------------


def size_table(folder: Path) -> None:
    """Code and stack on two microcontrollers."""
    if not shutil.which("arm-none-eabi-gcc"):
        print("arm-none-eabi-gcc is not installed: no sizes\n")
        return
    print(f"{version('arm-none-eabi-gcc')}\n")
    print("| machine | code, -O2 | code, -Os | stack, -O2 |")
    print("|---|---|---|---|")
    for label, (real, *flags) in ARM.items():
        flags += ["-mfloat-abi=hard", "-mthumb"]
        for name in ("reference", "rubin_camera", "reachy_mini"):
            at = folder / f"arm_{name}_{real}"
            exported.write(Platform.load(name), at, real)
            code, stack = exported.footprint(at, flags)
            small, _ = exported.footprint(at, flags, "-Os")
            print(f"| {label}, {name} | {code:,} B | {small:,} B | {stack:,} B |", flush=True)
    print()


# ---- hostile readings -----------------------------------------------------------------


def hostile_table(folder: Path, count: int) -> None:
    """Readings that no machine gives, under the address and undefined-behaviour sanitizers."""
    print("| gcc -fsanitize=address,undefined | said |")
    print("|---|---|")
    for name in ("reference", "rubin_camera", "reachy_mini"):
        for real in ("double", "float"):
            at = folder / f"hostile_{name}_{real}"
            exported.write(Platform.load(name), at, real)
            said = exported.run([exported.hostile(at), str(count)]).strip()
            print(f"| {name}, {real} | {said} |", flush=True)
    print()


if __name__ == "__main__":
    main()

"""An exported machine compiled and called from Python: for tests and benchmarks/controller.py."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cffi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough import Platform, Pose
from gough.export.c import c_files
from gough.export.precision import RealName

HERE = Path(__file__).parent
WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror")
DECLARATIONS = """
typedef struct {{ {real} position[3], wxyz[4]; }} pose;
typedef struct {{ pose pose; {real} residual; int event, status, steps, next_start; }} result;
typedef struct {{ {real} residual; int steps; }} info;
void track_all(int, const {real} *, const pose *, const {real} *, int, result *);
void solve_all(int, const {real} *, const pose *, int, result *);
void time_cycles(int, int, const {real} *, const pose *, const {real} *, int, double *);
int machine_inverse(const pose *, {real} *);
void machine_jacobian(const pose *, {real} *);
int machine_twist(const pose *, const {real} *, {real} *);
int machine_usable(int);
const char *machine_status_label(int);
const char *machine_event_label(int);
const char *machine_version(void);
const char *machine_digest(void);
"""


@dataclass(frozen=True)
class Rows:
    """Results of many calls, one entry a row."""

    pose: Pose  # (N,)
    event: NDArray[np.int32]
    status: NDArray[np.int32]
    steps: NDArray[np.int32]
    residual: NDArray[np.float64]  # [platform unit]
    next_start: NDArray[np.int32]  # of the tracker: above 0 while it searches from other starts


class Machine:
    """The C of one platform, in this process."""

    def __init__(self, library: Path, real: RealName) -> None:
        self.ffi = cffi.FFI()
        self.ffi.cdef(DECLARATIONS.format(real=real))
        self.lib: Any = self.ffi.dlopen(str(library))
        self.real = np.dtype(np.float64 if real == "double" else np.float32)
        ints = [(name, np.int32) for name in ("event", "status", "steps", "next_start")]
        self._result = np.dtype(
            [("position", self.real, 3), ("wxyz", self.real, 4), ("residual", self.real), *ints],
            align=True,
        )
        assert self._result.itemsize == self.ffi.sizeof("result")

    def track(
        self,
        legs: ArrayLike,
        start: Pose | None = None,
        max_shift: float = 0,
        max_turn: float = 0,
        confirm: int = 0,
    ) -> Rows:
        """A tracker's cycles with readings (N, 6)."""
        rows, results = self._rows(legs)
        self.lib.track_all(
            len(rows), self._pointer(rows), self._pose(start),
            self._pointer(np.array([max_shift, max_turn], self.real)), confirm,
            self.ffi.from_buffer("result[]", results),
        )  # fmt: skip
        return self._as_rows(results)

    def solve(self, legs: ArrayLike, guess: Pose) -> Rows:
        """Readings (N, 6) solved one by one from a guess, or from one each."""
        rows, results = self._rows(legs)
        guesses = self._pack(guess)
        self.lib.solve_all(
            len(rows), self._pointer(rows), self.ffi.from_buffer("pose[]", guesses), len(guesses),
            self.ffi.from_buffer("result[]", results),
        )  # fmt: skip
        return self._as_rows(results)

    def times(self, legs: ArrayLike, start: Pose, repeats: int = 9) -> NDArray[np.float64]:
        """Shortest time of each cycle [ns] out of `repeats`."""
        rows, _ = self._rows(legs)
        out = np.empty(len(rows))
        self.lib.time_cycles(
            len(rows), repeats, self._pointer(rows), self._pose(start),
            self._pointer(np.zeros(2, self.real)), 0, self.ffi.from_buffer("double[]", out),
        )  # fmt: skip
        return out

    def inverse(self, pose: Pose) -> tuple[int, NDArray]:
        """Return value, and readings (6,), NaN where they were left alone."""
        legs = np.full(6, np.nan, self.real)
        return self.lib.machine_inverse(self._pose(pose), self._pointer(legs)), legs

    def jacobian(self, pose: Pose) -> NDArray:
        """The Jacobian (6, 6)."""
        J = np.empty(36, self.real)
        self.lib.machine_jacobian(self._pose(pose), self._pointer(J))
        return J.reshape(6, 6)

    def twist(self, pose: Pose, leg_rates: ArrayLike) -> tuple[int, NDArray]:
        """Status and twist (6,), NaN where it was left alone."""
        rates, twist = np.array(leg_rates, self.real), np.full(6, np.nan, self.real)
        status = self.lib.machine_twist(
            self._pose(pose), self._pointer(rates), self._pointer(twist)
        )
        return status, twist

    def _rows(self, legs: ArrayLike) -> tuple[NDArray, NDArray]:
        rows = np.ascontiguousarray(legs, self.real)
        return rows, np.zeros(len(rows), self._result)

    def _as_rows(self, results: NDArray) -> Rows:
        position, wxyz = (results[name].astype(float) for name in ("position", "wxyz"))
        return Rows(
            Pose.trusted(position, wxyz), results["event"], results["status"], results["steps"],
            results["residual"].astype(float), results["next_start"],
        )  # fmt: skip

    def _pack(self, pose: Pose) -> NDArray:
        packed = np.concatenate([pose.position, pose.wxyz], axis=-1).reshape(-1, 7)
        return np.ascontiguousarray(packed, self.real)

    def _pose(self, pose: Pose | None) -> Any:
        if pose is None:
            return self.ffi.NULL
        kept = self.ffi.new("pose *")
        self.ffi.buffer(kept)[:] = self._pack(pose).tobytes()
        return kept

    def _pointer(self, array: NDArray) -> Any:
        return self.ffi.from_buffer("double[]" if array.itemsize == 8 else "float[]", array)


def compilers() -> list[str]:
    """Those of gcc and clang that are installed."""
    return [name for name in ("gcc", "clang") if shutil.which(name)]


def build(
    platform: Platform,
    folder: Path,
    *,
    real: RealName = "double",
    compiler: str = "gcc",
    flags: Sequence[str] = ("-O3",),
) -> Machine:
    """Export a platform to a folder, compile it with the loops beside it, and load it."""
    write(platform, folder, real)
    library = folder / "machine.so"
    sources = [folder / "machine.c", HERE / "loops.c"]
    run([compiler, *flags, *WARNINGS, "-fPIC", "-shared", f"-I{folder}", *sources, "-lm",
         "-o", library])  # fmt: skip
    return Machine(library, real)


def write(platform: Platform, folder: Path, real: RealName = "double") -> None:
    """Export a platform to a folder with the prefix `machine`."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in c_files(platform, "machine", real).items():
        (folder / name).write_text(text, "utf-8")


def hostile(folder: Path) -> Path:
    """Compile `hostile.c` with a machine that was written to `folder`, under the sanitizers."""
    program = folder / "hostile"
    run(["gcc", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", f"-I{folder}",
         HERE / "hostile.c", "-o", program, "-lm"])  # fmt: skip
    return program


def footprint(folder: Path, flags: Sequence[str], level: str = "-O2") -> tuple[int, int]:
    """Code and deepest stack [bytes] of an exported machine on a Cortex-M.

    Code is the section .text. The stack is the deepest chain of calls of `machine_update`,
    `machine_solve` and `machine_twist`, by gcc's call graph, without sqrt, sin and cos.
    """
    made = folder / "arm.o"
    run(["arm-none-eabi-gcc", "-std=c99", level, *flags, "-fcallgraph-info=su", "-c",
         folder / "machine.c", "-o", made])  # fmt: skip
    sections = run(["arm-none-eabi-size", "-A", made])
    code = sum(int(size) for size in re.findall(r"^\.text\S*\s+(\d+)", sections, re.MULTILINE))
    graph = (folder / "arm.ci").read_text()
    frames = {
        name: int(size)
        for name, size in re.findall(r'node: \{ title: "([^"]+)" label: ".*?\\n(\d+) bytes', graph)
    }
    calls = re.findall(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', graph)

    def depth(name: str) -> int:
        below = [depth(target) for source, target in calls if source == name]
        return frames.get(name, 0) + max(below, default=0)

    return code, max(depth(name) for name in frames)


def run(command: Sequence[str | Path]) -> str:
    """Run a command; its output.

    Raises:
        RuntimeError: it failed; the text is what it printed.
    """
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{command[0]} returned {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout

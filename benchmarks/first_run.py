"""Times of the first answer and of the second: whole processes, caches empty and filled.

    python benchmarks/first_run.py

Keep the machine otherwise idle. "CPU" is what the process itself used, which a busy machine
changes less than the clock. The bars: 5 s for a first answer, 0.8 s for a second.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import gough

CACHES = ("NUMBA_CACHE_DIR", "GOUGH_CACHE_DIR", "XDG_CACHE_HOME")
TRACKER = (
    "import gough; p = gough.Platform.load({machine!r});"
    "gough.Tracker(p, start=p.home).update(p.home_legs)"
)


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print("| job, whole process | first, s | its CPU, s | second, s | its CPU, s |")
        print("|---|---|---|---|---|")
        for what, arguments in jobs(folder).items():
            environment = os.environ | {
                variable: str(folder / what.replace(" ", "_") / variable) for variable in CACHES
            }
            first = run([sys.executable, *arguments], environment)
            again = [run([sys.executable, *arguments], environment) for _ in range(3)]
            cells = " | ".join(f"{x:.2f}" for x in (*first, *min(again)))
            print(f"| {what} | {cells} |", flush=True)


def jobs(folder: Path) -> dict[str, list[str]]:
    """Arguments of Python for each job; writes the files that they read."""
    machine = gough.Platform.load("reference")
    legs = gough.leg_lengths(machine, machine.sample_poses(1_000, seed=1))
    bad = legs.copy()
    bad[500, 5] += 400
    good_file, bad_file = (write(folder / name, x) for name, x in (("good", legs), ("bad", bad)))
    own = folder / "own.toml"
    (machine.with_workspace(40, 20)).save(own)
    solve = ["-m", "gough.cli", "solve", "--allow-failures", "-o", str(folder / "out.csv")]
    return {
        "solve 1,000 rows": [*solve, good_file, "-p", "reference"],
        "solve 1,000 rows, own machine": [*solve, good_file, "-p", str(own)],
        "solve with an unreachable row": [*solve, bad_file, "-p", "reference"],
        "tracker, first update": ["-c", TRACKER.format(machine="reference")],
        "tracker, own machine": ["-c", TRACKER.format(machine=str(own))],
        "modes": ["-m", "gough.cli", "modes", *(f"{x:.3f}" for x in legs[0]), "-p", "reference"],
    }


def write(path: Path, legs: np.ndarray) -> str:
    """Write readings as CSV; return the file's name."""
    head = ",".join(f"leg_{i}" for i in range(1, 7))
    path = path.with_suffix(".csv")
    np.savetxt(path, legs, delimiter=",", header=head, comments="")
    return str(path)


def run(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Run a command; return its time by the clock and its CPU time [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.perf_counter()
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    seconds = time.perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: {done.stderr}")
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, used


if __name__ == "__main__":
    main()

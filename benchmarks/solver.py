"""Speed of the solver beside that of NumPy and SciPy, in one run.

    python benchmarks/solver.py             # about two minutes
    python benchmarks/solver.py --memory    # also a file of 20 million rows (3 GB of disk)

Reference platform, the paper's workspace, residual to 1e-12 of the platform's size. Keep the
machine otherwise idle. Ratios carry over to other machines, absolute times do not.
"""

from __future__ import annotations

import argparse
import platform as host
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np

import gough
from gough.kernel.threads import cores

POSES = 1_000_000
GOAL = 1e-12


def main() -> None:
    parser = argparse.ArgumentParser(description="How fast the solver is.")
    parser.add_argument("--memory", action="store_true", help="also solve 20 million rows")
    parser.add_argument("--memory-only", action="store_true", help="nothing but that")
    options = parser.parse_args()
    machine = gough.Platform.load("reference")
    if options.memory_only:
        memory_table(machine)
        return
    pose = machine.sample_poses(POSES, seed=11)
    legs = gough.leg_lengths(machine, pose)
    print(f"{processor()}, {cores()} cores, Python {host.python_version()}, NumPy {np.__version__}")
    print()
    bulk = bulk_table(machine, pose, legs)
    others_table(machine, pose, legs, bulk)
    single_table(machine, pose, legs)
    command_table(machine, legs)
    if options.memory:
        memory_table(machine)


def processor() -> str:
    """The processor's name, as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(x.split(":", 1)[1].strip() for x in lines if x.startswith("model name"))
    except (OSError, StopIteration):
        return host.processor() or host.machine()


def best(work, repeats: int = 5) -> float:
    """Shortest of several times [s], after one run to compile and to fit."""
    work()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def bulk_table(machine: gough.Platform, pose: gough.Pose, legs: np.ndarray) -> float:
    """Rows a second by seed and threads; the seconds of the polynomial on all cores."""
    print(f"| batch of {POSES:,} | 1 thread, poses/s | {cores()} threads, poses/s | steps, mean "
          "| worst residual / size | true pose |")  # fmt: skip
    print("|---|---|---|---|---|---|")
    answer = 0.0
    for seed, certify in (
        ("home", False), ("polynomial-2", False), ("polynomial", False), ("polynomial-5", False),
        ("polynomial", True),
    ):  # fmt: skip
        run = partial(gough.solve, machine, legs, seed=seed, certify=certify)
        one, all_cores = (best(partial(run, workers=n)) for n in (1, cores()))
        solution = run()
        true = solution.pose.distance(pose)[0] < 1e-9 * machine.size
        worst = solution.residual.max() / machine.size
        name = f"{seed}, certify=True" if certify else seed
        print(f"| seed {name} | {POSES / one:,.0f} | {POSES / all_cores:,.0f} | "
              f"{solution.iterations.mean():.2f} | {worst:.1e} | {true.mean():.4%} |")  # fmt: skip
        answer = all_cores if name == "polynomial" else answer
    print()
    return answer


def others_table(machine: gough.Platform, pose: gough.Pose, legs: np.ndarray, bulk: float) -> None:
    """SciPy pose by pose, and Newton written with batched NumPy, both from home."""
    ours = bulk / POSES
    few, many = 500, 50_000
    scipy = best(lambda: scipy_root(machine, legs[:few]), 2) / few
    numpy = best(lambda: numpy_newton(machine, legs[:many]), 2) / many
    for name, result in (
        ("scipy", scipy_root(machine, legs[:few])),
        ("numpy", numpy_newton(machine, legs[:few])),
    ):
        wrong = result.distance(pose[:few])[0].max() / machine.size
        assert wrong < 1e-9, f"{name} did not solve its poses: {wrong}"
    print("| the same poses with | time per pose | times as long |")
    print("|---|---|---|")
    print(f"| gough.solve, polynomial seed, {cores()} threads | {ours * 1e9:.0f} ns | 1 |")
    print(f"| NumPy Newton, batched `linalg.solve`, from home | {numpy * 1e6:.2f} us | "
          f"{numpy / ours:,.0f} |")  # fmt: skip
    print(f"| SciPy `root` (hybr) with our Jacobian, from home, pose by pose | "
          f"{scipy * 1e6:.0f} us | {scipy / ours:,.0f} |")  # fmt: skip
    print()


def scipy_root(machine: gough.Platform, legs: np.ndarray) -> gough.Pose:
    """One call of `scipy.optimize.root` a row, unknowns position and Euler angles."""
    from scipy.optimize import root

    p, b = machine.moving, machine.base

    def equations(x, lengths):
        ca, cb, cc = np.cos(x[3:])
        sa, sb, sc = np.sin(x[3:])
        Rx = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
        Ry = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
        Rz = np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]])
        arms = p @ (Rx @ Ry @ Rz).T
        struts = arms + x[:3] - b
        found = np.sqrt(np.sum(struts**2, axis=1))
        n = struts / found[:, None]
        twist = np.hstack([n, np.cross(arms, n)])
        # angular velocity of each Euler angle's rate, base coordinates
        axes = np.stack([[1.0, 0, 0], Rx[:, 1], (Rx @ Ry)[:, 2]], axis=1)
        return found - lengths, np.hstack([twist[:, :3], twist[:, 3:] @ axes])

    start = np.concatenate([machine.home.position, np.zeros(3)])
    x = np.array([root(equations, start, args=(row,), jac=True, tol=1e-13).x for row in legs])
    return gough.Pose.from_euler(x[:, :3], x[:, 3:])


def numpy_newton(machine: gough.Platform, legs: np.ndarray) -> gough.Pose:
    """Newton on all rows at once, in the way one writes it with NumPy."""
    rotation = np.broadcast_to(machine.home.rotation, (len(legs), 3, 3))
    position = np.broadcast_to(machine.home.position, (len(legs), 3))
    for _ in range(20):
        arms = machine.moving @ np.swapaxes(rotation, 1, 2)
        struts = arms + position[:, None] - machine.base
        lengths = np.sqrt(np.sum(struts**2, axis=-1))
        error = legs - lengths
        if np.abs(error).max() <= GOAL * machine.size:
            break
        n = struts / lengths[..., None]
        J = np.concatenate([n, np.cross(arms, n)], axis=-1)
        step = np.linalg.solve(J, error[..., None])[..., 0]
        turn = gough.Pose.from_rotation_vector(np.zeros(3), step[:, 3:]).rotation
        position, rotation = position + step[:, :3], turn @ rotation
    return gough.Pose.from_rotation(position, rotation)


def single_table(machine: gough.Platform, pose: gough.Pose, legs: np.ndarray) -> None:
    """One reading at a time."""
    cycles = 20_000
    phase = np.linspace(0, 60, cycles)[:, None]
    path = gough.Pose.from_euler(
        machine.home.position + 40 * np.sin(phase * [1, 1.3, 0.7]),
        0.4 * np.sin(phase * [0.9, 1.1, 1.7]),
    )
    readings = gough.leg_lengths(machine, path)
    tracker = gough.Tracker(machine)
    update = clock(tracker.update, readings)
    assert tracker.pose.distance(path[-1])[0] < 1e-9 * machine.size
    solve = clock(lambda row: gough.solve(machine, row), legs[:5_000])
    print("| one reading at a time | median | 99.9th percentile |")
    print("|---|---|---|")
    for name, times in (("`Tracker.update`", update), ("`gough.solve` of one row", solve)):
        middle, tail = np.percentile(times, [50, 99.9]) / 1e3
        print(f"| {name} | {middle:.1f} us | {tail:.1f} us |")
    print()


def clock(call, rows: np.ndarray) -> np.ndarray:
    """Time of each call [ns], the first hundred left out."""
    times = np.empty(len(rows))
    for i, row in enumerate(rows):
        begin = time.perf_counter_ns()
        call(row)
        times[i] = time.perf_counter_ns() - begin
    return times[100:]


def command_table(machine: gough.Platform, legs: np.ndarray) -> None:
    """Start-up, as a user at a shell feels it: the middle of five runs."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "legs.csv"), Path(folder, "poses.csv")
        head = ",".join(f"leg_{i}" for i in range(1, 7))
        np.savetxt(source, legs[:1000], delimiter=",", header=head, comments="")
        runs = {
            "`python -c pass`": [sys.executable, "-c", "pass"],
            "`import gough`": [sys.executable, "-c", "import gough"],
            "`gough --help`": [sys.executable, "-m", "gough.cli", "--help"],
            "`gough solve`, 1,000 rows, second run": [
                sys.executable, "-m", "gough.cli", "solve", str(source), "-p", "reference",
                "-o", str(target),
            ],
        }  # fmt: skip
        print("| command | seconds |")
        print("|---|---|")
        for name, command in runs.items():
            print(f"| {name} | {command_time(command):.2f} |")
        print()


def command_time(command: list[str]) -> float:
    times = []
    for _ in range(6):
        begin = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.perf_counter() - begin)
    return float(np.median(times[1:]))


def memory_table(machine: gough.Platform) -> None:
    """Peak memory of `gough solve` on 20 million rows."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows, block = 20_000_000, 1_000_000
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "legs.parquet"), Path(folder, "poses.parquet")
        schema = pa.schema([(f"leg_{i}", pa.float64()) for i in range(1, 7)])
        with pq.ParquetWriter(source, schema) as writer:
            for i in range(rows // block):
                legs = gough.leg_lengths(machine, machine.sample_poses(block, seed=i))
                writer.write_table(pa.table(list(legs.T.copy()), schema=schema))
        print(f"| {rows:,} rows, Parquet to Parquet | peak memory | time | rows/s |")
        print("|---|---|---|---|")
        for seed in ("disgnet", "polynomial"):
            command = [sys.executable, "-m", "gough.cli", "solve", str(source), "-p", "reference",
                       "-o", str(target), "--seed", seed]  # fmt: skip
            begin = time.perf_counter()
            peak = peak_memory(command)
            seconds = time.perf_counter() - begin
            print(f"| seed {seed} | {peak / 1e9:.2f} GB | {seconds:.0f} s | "
                  f"{rows / seconds:,.0f} |")  # fmt: skip
        print()


def peak_memory(command: list[str]) -> int:
    """Run a command; the largest resident memory it had [bytes], looked at ten times a second.

    Not from getrusage, which counts this process's memory to its children.
    """
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    peak = 0
    while process.poll() is None:
        try:
            status = Path(f"/proc/{process.pid}/status").read_text()
            peak = max(peak, *(int(x.split()[1]) for x in status.splitlines() if "VmHWM" in x), 0)
        except OSError:
            pass  # it has just ended
        time.sleep(0.1)
    assert process.returncode == 0
    return 1024 * peak


if __name__ == "__main__":
    main()

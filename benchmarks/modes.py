"""Print every figure of docs/modes.md.

    python benchmarks/modes.py              all, some minutes
    python benchmarks/modes.py --quick      fewer repetitions, for a look

Run it on a quiet machine; all times are of one thread unless it says otherwise.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable

import numpy as np

import gough
from gough.kernel.threads import cores
from gough.modes.starts import find_start_system, start_system

MACHINES = (
    "dietmaier", "reference", "matlab_stewart", "nasa_msfc", "linuxcnc_genhex", "rubin_camera",
    "reachy_mini",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="Figures of docs/modes.md.")
    parser.add_argument("--quick", action="store_true", help="fewer repetitions")
    scale = 10 if parser.parse_args().quick else 1
    dietmaier(100 // scale)
    general(4000 // scale)
    special()
    times(2000 // scale)
    trajectory(10_000 // scale)
    certificates(1_000_000 // scale)


def dietmaier(repeats: int) -> None:
    platform = gough.Platform.load("dietmaier")
    modes = gough.assembly_modes(platform, platform.home_legs)
    proof = modes.certificate
    same = sum(
        np.array_equal(again.pose.position, modes.pose.position)
        and np.array_equal(again.pose.wxyz, modes.pose.wxyz)
        for again in (gough.assembly_modes(platform, platform.home_legs) for _ in range(repeats))
    )
    heading("Dietmaier's platform and legs (leg 1 is the unit)")
    print(f"real poses {len(modes)}, certified {proof.certified.sum()}")
    print(f"largest residual {modes.residual.max():.1e}, error bound {proof.error.max():.1e}")
    print(f"radii of uniqueness {proof.radius.min():.1e} to {proof.radius.max():.1e}")
    print(f"repeated runs with the same bits {same} of {repeats}")


def general(count: int) -> None:
    heading(f"{count} general platforms: joints from a normal distribution")
    solutions, seconds = [], []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        joints = rng.normal(size=(2, 6, 3))
        platform = gough.Platform(joints[0], joints[1], gough.Pose([0, 0, 2]))
        began = time.perf_counter()
        solutions.append(find_start_system(platform).count)
        seconds.append(time.perf_counter() - began)
    for number, machines in sorted(Counter(solutions).items(), reverse=True):
        print(f"with {number} complex solutions nearer than 2e4 sizes {machines}")
    print(f"start system of a platform: median {1e3 * np.median(seconds):.1f} ms")


def special() -> None:
    heading("complex solutions of special platforms (random joints, some shared)")
    rng = np.random.default_rng(0)
    joints = rng.normal(size=(2, 6, 3))
    for name, base, moving in (
        ("6-6", range(6), range(6)),
        ("6-5", range(6), [0, 0, 1, 2, 3, 4]),
        ("6-4", range(6), [0, 0, 1, 1, 2, 3]),
        ("6-3", range(6), [0, 0, 1, 1, 2, 2]),
        ("3-3, an octahedron", [0, 0, 1, 1, 2, 2], [0, 1, 1, 2, 2, 0]),
        ("three legs meet, two meet", range(6), [0, 0, 0, 1, 1, 2]),
    ):
        home = gough.Pose([0, 0, 2])
        platform = gough.Platform(joints[0][list(base)], joints[1][list(moving)], home)
        print(f"{name:28} {find_start_system(platform).count}")
    for name in MACHINES:
        start = start_system(gough.Platform.load(name))
        print(f"{name:28} {start.count}, paths tracked {len(start.poses)}")


def times(count: int) -> None:
    available = cores()
    heading(f"time per set of readings, {count} sets from the workspace")
    print(f"{'machine':16} solutions  one call  in a batch  {available} threads   real poses")
    for name in MACHINES:
        print(machine_times(gough.Platform.load(name), count))


def machine_times(platform: gough.Platform, count: int) -> str:
    legs = gough.leg_lengths(platform, some_poses(platform, count))
    modes = gough.assembly_modes(platform, legs)
    alone = [clock(lambda row=row: gough.assembly_modes(platform, row)) for row in legs[:200]]
    one = clock(lambda: gough.assembly_modes(platform, legs, workers=1)) / len(legs)
    many = clock(lambda: gough.assembly_modes(platform, legs)) / len(legs)
    numbers, how_often = np.unique(modes.counts, return_counts=True)
    seen = ", ".join(f"{n}: {k}" for n, k in zip(numbers, how_often, strict=True))
    return (
        f"{platform.name:16} {modes.solutions:9}  {1e3 * np.median(alone):5.2f} ms  "
        f"{1e3 * one:7.3f} ms  {1e3 * many:6.3f} ms   {seen}"
    )


def trajectory(count: int) -> None:
    heading(f"a trajectory of {count} readings of the reference machine, all modes of each")
    platform = gough.Platform.load("reference")
    s = np.linspace(0, 20, count)[:, None]
    translation = 40 * np.sin(s * [1.0, 1.3, 0.7])
    rotation = np.radians(20) * np.sin(s * [0.9, 1.1, 1.7] + 1)
    truth = gough.Pose.from_rotation_vector(platform.home.position + translation, rotation)
    legs = gough.leg_lengths(platform, truth)
    seconds = clock(lambda: gough.assembly_modes(platform, legs, workers=1))
    modes = gough.assembly_modes(platform, legs)
    distance, angle = modes.pose.distance(truth[modes.row])
    close = (distance < 1e-7 * platform.size) & (angle < 1e-7)
    hit = np.bincount(modes.row[close], minlength=count)
    print(f"{1e3 * seconds / count:.3f} ms per reading, {len(modes.row)} poses")
    print(f"complete {modes.complete.sum()}, truth among them {np.sum(hit > 0)}")
    print(f"certified {modes.certified.mean():.5%} of all poses")


def certificates(count: int) -> None:
    heading(f"certificates of {count} poses from the reference workspace")
    platform = gough.Platform.load("reference")
    pose = platform.sample_poses(count, 3)
    legs = gough.leg_lengths(platform, pose)
    proof = gough.certify(platform, legs, pose)
    seconds = min(clock(lambda: gough.certify(platform, legs, pose)) for _ in range(5))
    print(f"{1e9 * seconds / count:.0f} ns per pose, certified {proof.certified.mean():.5%}")
    low, median = np.percentile(proof.radius, [0, 50])
    print(f"radius of uniqueness [mm]: smallest {low:.2f}, median {median:.2f}")
    seconds = min(clock(lambda: gough.solve(platform, legs)) for _ in range(3))
    print(f"gough.solve: {1e9 * seconds / count:.0f} ns per pose, all threads")


def some_poses(platform: gough.Platform, count: int) -> gough.Pose:
    if platform.workspace is not None:
        return platform.sample_poses(count, 1)
    rng = np.random.default_rng(1)
    shift = rng.normal(size=(count, 3)) * platform.size * 0.05
    return gough.Pose(
        platform.home.position + shift, platform.home.wxyz + 0.1 * rng.normal(size=(count, 4))
    )


def clock(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def heading(text: str) -> None:
    print(f"\n{text}\n{'-' * len(text)}")


if __name__ == "__main__":
    main()

"""Look for assembly modes that `assembly_modes` misses, by damped Newton from random poses.

    python tools/check_modes.py                      1000 poses, 6000 starts each: minutes
    python tools/check_modes.py --poses 20 --starts 600

For every pose of each machine, thousands of Newton searches start at random; every pose that one
of them finds must be in the answer, and so must the pose that the readings came from.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import gough
from gough.kernel.ends import leg_equations, move
from gough.kernel.jit import jit
from gough.kernel.linear import pivoted_solve
from gough.kinematics import equivalent_struts
from gough.modes.frames import Frames, Problem

MACHINES = ("linuxcnc_genhex", "matlab_stewart", "nasa_msfc", "reference", "dietmaier")
STEPS = 60
MATCH = 1e-5  # normalised distance of poses that are the same


@jit(cache=False)
def search(moving, base, squares, poses, known, hit):
    """Searches from (S, 7) starts. Counts those that end at each of the known poses (M, 7).

    Returns:
        The number that end at a pose, and of these the number at one that is not known.
    """
    a, system, x, step = np.empty((6, 6)), np.empty((6, 6)), np.empty(6), np.empty(6)
    found, unknown = 0, 0
    for k in range(poses.shape[0]):
        left = 1.0
        for _ in range(STEPS):
            left = leg_equations(moving, base, squares, poses[k], a, x)
            if left < 1e-13 or pivoted_solve(a, x, system, step) == 0.0:
                break
            length = np.sqrt(np.sum(step * step))
            if length > 0.4:  # a rotation of some 20 degrees at most
                step *= 0.4 / length
            move(poses[k], step)
        if not left < 1e-12:
            continue
        found += 1
        best, nearest = 1e300, -1
        for m in range(known.shape[0]):
            dot = abs(np.sum(poses[k, 3:] * known[m, 3:]))
            away = np.max(np.abs(poses[k, :3] - known[m, :3])) + 2 * np.sqrt(max(0.0, 1 - dot))
            if away < best:
                best, nearest = away, m
        if best < MATCH:
            hit[nearest] += 1
        else:
            unknown += 1
    return found, unknown


def main() -> None:
    """Parse the options and print a line for each machine."""
    parser = argparse.ArgumentParser(description="Look for missing assembly modes.")
    parser.add_argument("--poses", type=int, default=1000)
    parser.add_argument("--starts", type=int, default=6000)
    parser.add_argument("--machines", nargs="+", default=list(MACHINES))
    options = parser.parse_args()
    print("machine, poses, complete, truth among them, modes, searches that found a pose,")
    print("  of which not in the answer, modes that no search found, seconds")
    for name in options.machines:
        print(*check(gough.Platform.load(name), options.poses, options.starts), flush=True)


def check(platform: gough.Platform, poses: int, starts: int) -> tuple:
    """One line of the table."""
    began = time.perf_counter()
    rng = np.random.default_rng(1)
    truth = wide_poses(platform, poses, rng)
    legs = gough.leg_lengths(platform, truth)
    modes = gough.assembly_modes(platform, legs)
    translation, rotation = modes.pose.distance(truth[modes.row])
    hit = np.zeros(poses, dtype=bool)
    hit[modes.row[(translation < 1e-6 * platform.size) & (rotation < 1e-6)]] = True
    frames = Frames.of(platform)
    problem = Problem.of(frames, *equivalent_struts(platform, legs))
    found, unknown, unseen = 0, 0, 0
    for k in range(poses):
        base, squares = np.ascontiguousarray(problem.base[k]), problem.squares[k]
        q = rng.normal(size=(starts, 4))
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        t = rng.normal(size=(starts, 3)) * np.sqrt(squares.mean()) * 0.7
        known = frames.normalise(modes[k].pose)
        hits = np.zeros(len(known), dtype=np.int64)
        begin = np.concatenate([t, q], axis=1)
        n, bad = search(frames.moving, base, squares, begin, known, hits)
        found, unknown, unseen = found + n, unknown + bad, unseen + int(np.sum(hits == 0))
    seconds = round(time.perf_counter() - began, 1)
    return (
        platform.name, poses, int(modes.complete.sum()), int(hit.sum()), len(modes.row), found,
        unknown, unseen, seconds,
    )  # fmt: skip


def wide_poses(platform: gough.Platform, count: int, rng: np.random.Generator) -> gough.Pose:
    """Poses far about home: a fifth of the machine's size, rotations up to some 60 degrees."""
    translation = rng.uniform(-0.15, 0.15, size=(count, 3)) * platform.size
    rotation = rng.uniform(-0.7, 0.7, size=(count, 3))
    return gough.Pose.from_rotation_vector(translation, rotation) @ platform.home


if __name__ == "__main__":
    main()

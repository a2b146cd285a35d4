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
from gough.kernel.jit import jit
from gough.kinematics import equivalent_struts
from gough.modes.finish import legs_at, solve6, turn_and_shift
from gough.modes.frames import Frames

MACHINES = ("linuxcnc_genhex", "matlab_stewart", "nasa_msfc", "reference", "dietmaier")
STEPS = 60
MATCH = 1e-5  # normalised distance of poses that are the same


@jit(cache=False)
def search(p, base, squares, e, t, known_e, known_t, hit):
    """Searches from (S, 4), (S, 3). Counts those that end at each known pose.

    Returns:
        How many end at a pose, and at one that is not known.
    """
    a, x, trial = np.empty((6, 6)), np.empty(6), np.empty(6)
    found, unknown = 0, 0
    for k in range(e.shape[0]):
        left = 1.0
        for _ in range(STEPS):
            left = legs_at(p, base, squares, e[k], t[k], a, x)
            if left < 1e-13:
                break
            trial[:] = x
            if not solve6(a, trial):
                break
            length = np.sqrt(np.sum(trial * trial))
            if length > 0.4:  # a turn of some 20 degrees at most
                trial *= 0.4 / length
            turn_and_shift(e[k], t[k], trial)
        if not left < 1e-12:
            continue
        found += 1
        best, nearest = 1e300, -1
        for m in range(known_e.shape[0]):
            dot = abs(np.sum(e[k] * known_e[m]))
            away = np.max(np.abs(t[k] - known_t[m])) + 2 * np.sqrt(max(0.0, 1 - dot))
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
    shift, turn = modes.pose.distance(truth[modes.row])
    hit = np.zeros(poses, dtype=bool)
    hit[modes.row[(shift < 1e-6 * platform.size) & (turn < 1e-6)]] = True
    frames = Frames.of(platform)
    joints, lengths = equivalent_struts(platform, legs)
    base, squares = np.ascontiguousarray(frames.base(joints)), frames.squares(lengths)
    found, unknown, unseen = 0, 0, 0
    for k in range(poses):
        e, t = frames.normal(modes[k].pose)
        q = rng.normal(size=(starts, 4))
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        u = rng.normal(size=(starts, 3)) * np.sqrt(squares[k].mean()) * 0.7
        hits = np.zeros(len(e), dtype=np.int64)
        n, bad = search(frames.moving, base[k], squares[k], q, u, e, t, hits)
        found, unknown, unseen = found + n, unknown + bad, unseen + int(np.sum(hits == 0))
    seconds = round(time.perf_counter() - began, 1)
    return (
        platform.name, poses, int(modes.complete.sum()), int(hit.sum()), len(modes.row), found,
        unknown, unseen, seconds,
    )  # fmt: skip


def wide_poses(platform: gough.Platform, count: int, rng: np.random.Generator) -> gough.Pose:
    """Poses far about home: a fifth of the machine's size, turns up to some 60 degrees."""
    home = platform.home
    shift = rng.uniform(-0.15, 0.15, size=(count, 3)) * platform.size
    return gough.Pose.from_rotation_vector(shift, rng.uniform(-0.7, 0.7, size=(count, 3))) @ (
        gough.Pose(home.position, home.wxyz)
    )


if __name__ == "__main__":
    main()

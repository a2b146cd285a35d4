"""Steady states of exported MuJoCo models beside the poses that gough finds for their legs.

    python benchmarks/simulators.py [--poses 1000]

For each machine of the catalog, poses drawn from its workspace and within its stroke are commanded
as leg readings, one after the other; each is held until nothing moves.
"""

# tests/export is found at run time
# pyright: reportMissingImports=false

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

import gough
from gough import Platform

sys.path[:0] = [str(Path(__file__).resolve().parent.parent / "tests" / p) for p in ("", "export")]
from test_mjcf import Model, poses  # noqa: E402


def main() -> None:
    """Print one line for each machine."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--poses", type=int, default=1000)
    count = parser.parse_args().poses
    print("machine          poses  largest error: share of the size  [deg]  s simulated  s")
    for name in Platform.catalog():
        model = Model(Platform.load(name))
        chosen = poses(model.platform, count, seed=1)
        solved = gough.solve(model.platform, gough.leg_lengths(model.platform, chosen)).pose
        started, errors = time.perf_counter(), []
        for pose, expected in zip(chosen, solved, strict=True):
            model.go_to(pose)
            shift, turn = model.pose.distance(expected)
            errors.append((shift / model.platform.size, np.degrees(turn)))
        shift, turn = np.max(errors, axis=0)
        took = time.perf_counter() - started
        row = f"{name:16} {len(errors):5} {shift:29.1e} {turn:11.0e} {model.data.time:9.0f}"
        print(f"{row} {took:5.0f}", flush=True)


if __name__ == "__main__":
    main()

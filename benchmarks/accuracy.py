"""Shares of right answers of the solver: every catalog machine, and wide workspaces. Fixed seeds.

python benchmarks/accuracy.py           # about a minute
"""

from __future__ import annotations

import numpy as np

import gough
from gough import Status

ROWS = 200_000


def main() -> None:
    round_trips()
    wide_workspace()


def round_trips() -> None:
    """Pose -> legs -> pose over the stated workspace of each machine."""
    print(f"| {ROWS:,} poses of its workspace | worst shift / size | worst turn, rad "
          "| worst residual / size | statuses |")  # fmt: skip
    print("|---|---|---|---|---|")
    for name in gough.Platform.catalog():
        machine = gough.Platform.load(name)
        pose = machine.sample_poses(ROWS, seed=21)
        solution = gough.solve(machine, gough.leg_lengths(machine, pose))
        shift, turn = solution.pose.distance(pose)
        found = ", ".join(f"{s.label} {n:,}" for s, n in solution.counts().items())
        print(f"| {name} | {shift.max() / machine.size:.1e} | {turn.max():.1e} | "
              f"{solution.residual.max() / machine.size:.1e} | {found} |")  # fmt: skip
    print()


def wide_workspace() -> None:
    """Reference platform, +-100 mm, +-60 deg, poses on home's side of the singularities."""
    machine = gough.Platform.load("reference").with_workspace(100, 60)
    pose = machine.sample_poses(ROWS, seed=22)
    pose = pose[gough.assembly_sign(machine, pose) > 0]
    legs = gough.leg_lengths(machine, pose)
    print(f"| +-100 mm, +-60 deg, {len(pose):,} poses | true pose | another pose, called usable "
          "| another pose, called so | no pose found |")  # fmt: skip
    print("|---|---|---|---|---|")
    for restarts in (0, 24):
        for seed in ("home", "polynomial-2", "polynomial", "polynomial-5", "polynomial-7"):
            solution = gough.solve(machine, legs, seed=seed, restarts=restarts)
            true = solution.pose.distance(pose)[0] < 1e-6 * machine.size
            other = solution.status == Status.OTHER_MODE
            lost = np.isin(solution.status, [Status.UNREACHABLE, Status.NOT_CONVERGED])
            shares = (true, ~true & solution.usable, ~true & other, lost)
            cells = " | ".join(f"{np.mean(share):.3%}" for share in shares)
            print(f"| {seed}, {restarts} restarts | {cells} |")
    print()


if __name__ == "__main__":
    main()

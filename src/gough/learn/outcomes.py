"""Newton's method from many first guesses at once, to see where each of them ends.

This is a yardstick, not the solver: it takes the guess as it is and has no second try.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from gough.checks import Array
from gough.kinematics import assembly_sign, equivalent_struts
from gough.learn.kinematics import quaternion_to_matrix
from gough.learn.se3 import rotation_exp
from gough.platform import Platform
from gough.pose import Pose

STEPS = 60
CHUNK = 50_000
CONVERGED = 1e-12  # largest leg error of a converged row, of the platform's size
SAME = 1e-5  # poses closer than this, of the platform's size or in rad, are the same


@dataclass(frozen=True)
class Outcome:
    """Where the rows ended: `true`, `other` and `unconverged` add up to `count`.

    Attributes:
        true: at the true pose.
        other: at another pose with the same readings.
        twins: those of `other` whose pose is in the workspace too, with det J of home's sign:
            the readings alone cannot tell which of the two was meant.
        unconverged: nowhere within 60 steps.
    """

    count: int
    true: int
    other: int
    twins: int
    unconverged: int

    @property
    def share(self) -> float:
        """Share of rows that ended at the true pose."""
        return self.true / self.count


def outcome(platform: Platform, guess: Pose, truth: Pose, legs: Array) -> Outcome:
    """Refine guesses (N,) for readings (N, 6) and compare with the true poses (N,)."""
    true = other = twins = 0
    for start in range(0, len(legs), CHUNK):
        part = slice(start, start + CHUNK)
        pose, converged = refine(platform, guess[part], legs[part])
        same = same_pose(platform, pose, truth[part])
        true += int(np.sum(converged & same))
        elsewhere = pose[converged & ~same]
        other += len(elsewhere)
        admissible = platform.in_workspace(elsewhere) & (assembly_sign(platform, elsewhere) > 0)
        twins += int(np.sum(admissible))
    return Outcome(len(legs), true, other, twins, len(legs) - true - other)


def same_pose(platform: Platform, a: Pose, b: Pose) -> NDArray[np.bool_]:
    """Which poses (N,) are the same but for rounding, magnified near singularities."""
    away, angle = a.distance(b)
    return (away <= SAME * platform.size) & (angle <= SAME)


@torch.no_grad()
def refine(platform: Platform, guess: Pose, legs: Array) -> tuple[Pose, NDArray[np.bool_]]:
    """Newton steps from guesses (N,): poses, and which rows (N,) converged within 60 steps.

    A step moves by (v, w): t + v and exp(w) R. Its rows are n_i . v + (R p_i x n_i) . w.
    """
    base, lengths = (torch.tensor(x) for x in equivalent_struts(platform, legs))
    arms0 = torch.tensor(platform.moving - platform.pivot_point)
    t = torch.tensor(guess.position)
    R = quaternion_to_matrix(torch.tensor(guess.wxyz))
    left = torch.arange(len(t))
    converged = torch.zeros(len(t), dtype=torch.bool)
    pivot = torch.tensor(platform.pivot_point)
    for _ in range(STEPS):
        arms = arms0 @ R[left].mT
        struts = arms + (t[left] + pivot)[:, None] - base[left]
        now = torch.linalg.vector_norm(struts, dim=-1)
        error = now - lengths[left]
        done = error.abs().amax(-1) <= CONVERGED * platform.size
        converged[left[done]] = True
        todo = ~done & error.isfinite().all(-1)
        if not todo.any():
            break
        left, arms, error = left[todo], arms[todo], error[todo]
        n = struts[todo] / now[todo, :, None]
        J = torch.cat([n, torch.linalg.cross(arms, n)], dim=-1)  # (N, 6, 6)
        step = torch.linalg.solve_ex(J, -error)[0]
        t[left] += step[:, :3]
        R[left] = rotation_exp(step[:, 3:]) @ R[left]
    finite = t.isfinite().all(-1) & R.isfinite().all(-1).all(-1)
    t[~finite], R[~finite] = 0, torch.eye(3, dtype=R.dtype)
    return Pose.from_rotation(t.numpy(), R.numpy()), (converged & finite).numpy()

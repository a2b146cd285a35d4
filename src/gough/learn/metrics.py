"""Accuracy of first guesses: the paper's three errors, and where Newton's method ends from them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import GoughError
from gough.kinematics import assembly_sign, leg_lengths
from gough.learn.kinematics import TorchPlatform, rotation_exp
from gough.platform import Platform
from gough.pose import Pose

THRESHOLDS = (0.5, 1.0, 1.5, 2.0, 3.0)  # [platform unit] and [deg]
CHUNK = 50_000  # rows computed at a time, to limit memory
STEPS = 60
CONVERGED = 1e-12  # largest strut length error of a converged row [platform size]
SAME = 1e-5  # distance below which two poses are the same [platform size] and [rad]


@dataclass(frozen=True)
class Metrics:
    """Errors over a set of poses, in float64.

    Attributes:
        count: number of poses.
        trans_mean, trans_median, trans_worst: |t - t*| [platform unit]; the mean is E-trans.
        rot_frobenius: mean of |log(R R*^T)|_F [deg], the paper's E-rot: sqrt(2) times the angle.
        rot_mean, rot_median, rot_worst: angle of R R*^T [deg].
        ik_mean, ik_median: |legs(T) - legs*|_2 [unit of the readings]; the mean is E-ik.
        trans_within, rot_within: share of poses below 0.5, 1, 1.5, 2, 3 [platform unit] and [deg].
    """

    count: int
    trans_mean: float
    trans_median: float
    trans_worst: float
    rot_frobenius: float
    rot_mean: float
    rot_median: float
    rot_worst: float
    ik_mean: float
    ik_median: float
    trans_within: tuple[float, ...]
    rot_within: tuple[float, ...]

    def as_dict(self) -> dict:
        """Plain numbers and lists."""
        return asdict(self)


def measure(platform: Platform, guess: Pose, truth: Pose, legs: Array | None = None) -> Metrics:
    """Compare guesses (N,) with the true poses (N,): equations 22 to 24 of the DisGNet paper.

    Args:
        platform: the machine.
        guess: guessed poses.
        truth: true poses.
        legs: true readings (N, 6); computed from `truth` if not given.

    Raises:
        GoughError: no poses, or different numbers of them.
    """
    if guess.batch != truth.batch or len(truth.batch) != 1 or not len(truth):
        raise GoughError(f"guess, truth: expected as many poses, got {guess.batch}, {truth.batch}")
    length, angle = guess.distance(truth)
    degrees = np.degrees(angle)
    ik = ik_errors(platform, guess, leg_lengths(platform, truth) if legs is None else legs)
    return Metrics(
        count=len(truth),
        trans_mean=float(length.mean()),
        trans_median=float(np.median(length)),
        trans_worst=float(length.max()),
        rot_frobenius=float(np.sqrt(2) * degrees.mean()),
        rot_mean=float(degrees.mean()),
        rot_median=float(np.median(degrees)),
        rot_worst=float(degrees.max()),
        ik_mean=float(ik.mean()),
        ik_median=float(np.median(ik)),
        trans_within=tuple(float(np.mean(length < t)) for t in THRESHOLDS),
        rot_within=tuple(float(np.mean(degrees < t)) for t in THRESHOLDS),
    )


def ik_errors(platform: Platform, guess: Pose, legs: Array) -> Array:
    """|legs(guess) - legs|_2, (N,) [unit of the readings]."""
    parts = [slice(i, i + CHUNK) for i in range(0, len(legs), CHUNK)]
    return np.concatenate(
        [np.linalg.norm(leg_lengths(platform, guess[p]) - legs[p], axis=-1) for p in parts]
    )


# ---- Newton's method from the guesses -----------------------------------------------------


@dataclass(frozen=True)
class NewtonCounts:
    """Numbers of rows by where plain Newton's method ends.

    This is a yardstick, not the solver: it starts from the guess and has no second try.
    `true`, `other` and `unconverged` add up to `count`.

    Attributes:
        true: at the true pose.
        other: at another pose with the same readings.
        twins: those of `other` whose pose is in the workspace too, with det J of home's sign:
            the readings alone cannot distinguish the two.
        unconverged: not converged within 60 steps.
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


def count_newton_ends(platform: Platform, guess: Pose, truth: Pose, legs: Array) -> NewtonCounts:
    """Run Newton's method from guesses (N,) for readings (N, 6); compare with true poses (N,)."""
    true = other = twins = 0
    for start in range(0, len(legs), CHUNK):
        part = slice(start, start + CHUNK)
        pose, converged = plain_newton(platform, guess[part], legs[part])
        same = same_pose(platform, pose, truth[part])
        true += int(np.sum(converged & same))
        elsewhere = pose[converged & ~same]
        other += len(elsewhere)
        admissible = platform.in_workspace(elsewhere) & (assembly_sign(platform, elsewhere) > 0)
        twins += int(np.sum(admissible))
    return NewtonCounts(len(legs), true, other, twins, len(legs) - true - other)


def same_pose(platform: Platform, a: Pose, b: Pose) -> NDArray[np.bool_]:
    """Rows (N,) where two poses are equal except for rounding, magnified near singularities."""
    length, angle = a.distance(b)
    return (length <= SAME * platform.size) & (angle <= SAME)


@torch.no_grad()
def plain_newton(platform: Platform, guess: Pose, legs: Array) -> tuple[Pose, NDArray[np.bool_]]:
    """Take Newton steps from guesses (N,): poses, NaN unless converged, and which (N,) converged.

    A step with the twist (v, w) leads to t + v and exp(w) R.
    """
    machine = TorchPlatform(platform)
    ends, lengths = machine.equivalent_struts(torch.tensor(legs))
    t, R = torch.tensor(guess.position), torch.tensor(guess.rotation)
    active = torch.arange(len(t))
    converged = torch.zeros(len(t), dtype=torch.bool)
    for _ in range(STEPS):
        error, J = machine.strut_errors(t[active], R[active], ends[active], lengths[active])
        done = error.abs().amax(-1) <= CONVERGED * platform.size
        converged[active[done]] = True
        more = ~done & error.isfinite().all(-1)
        active = active[more]
        if not len(active):
            break
        step = torch.linalg.solve_ex(J[more], -error[more])[0]
        t[active] += step[:, :3]
        R[active] = rotation_exp(step[:, 3:]) @ R[active]
    t[~converged], R[~converged] = torch.nan, torch.nan
    return Pose.from_rotation(t.numpy(), R.numpy()), converged.numpy()


def median_time(work: Callable[[], object], repeats: int) -> float:
    """Median time of several runs, after one to warm up [s]."""
    work()
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return float(np.median(times))

"""How good first guesses are: the paper's three errors, medians, shares, and the worst."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.kinematics import leg_lengths
from gough.platform import Platform
from gough.pose import Pose

THRESHOLDS = (0.5, 1.0, 1.5, 2.0, 3.0)  # [platform unit] and [deg]
CHUNK = 100_000


@dataclass(frozen=True)
class Metrics:
    """Errors over a set of poses, in float64.

    Attributes:
        count: number of poses.
        trans_mean, trans_median, trans_worst: |t - t*| [platform unit]; the mean is E-trans.
        rot_frobenius: mean of |log(R R*^T)|_F [deg], the paper's E-rot: sqrt(2) times the angle.
        rot_mean, rot_median, rot_worst: angle of R R*^T [deg].
        ik_mean, ik_median: |legs(T) - legs*|_2 [reading's unit]; the mean is E-ik.
        trans_within, rot_within: share of poses below 0.5, 1, 1.5, 2, 3 [unit] and [deg].
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
    """Compare guesses (N,) with the true poses (N,).

    Args:
        legs: true readings (N, 6); computed from `truth` if not given.

    Raises:
        GoughError: no poses, or different numbers of them.
    """
    if guess.batch != truth.batch or len(truth.batch) != 1 or not len(truth):
        raise GoughError(f"guess, truth: expected as many poses, got {guess.batch}, {truth.batch}")
    away, angle = guess.distance(truth)
    turned = np.degrees(angle)
    ik = ik_errors(platform, guess, leg_lengths(platform, truth) if legs is None else legs)
    return Metrics(
        count=len(truth),
        trans_mean=float(away.mean()),
        trans_median=float(np.median(away)),
        trans_worst=float(away.max()),
        rot_frobenius=float(np.sqrt(2) * turned.mean()),
        rot_mean=float(turned.mean()),
        rot_median=float(np.median(turned)),
        rot_worst=float(turned.max()),
        ik_mean=float(ik.mean()),
        ik_median=float(np.median(ik)),
        trans_within=tuple(float(np.mean(away < t)) for t in THRESHOLDS),
        rot_within=tuple(float(np.mean(turned < t)) for t in THRESHOLDS),
    )


def ik_errors(platform: Platform, guess: Pose, legs: Array) -> Array:
    """|legs(guess) - legs|_2, (N,) [reading's unit], a chunk at a time to spare memory."""
    parts = [slice(i, i + CHUNK) for i in range(0, len(legs), CHUNK)]
    return np.concatenate(
        [np.linalg.norm(leg_lengths(platform, guess[p]) - legs[p], axis=-1) for p in parts]
    )

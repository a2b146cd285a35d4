"""The benchmark for methods of others: one test set, by seed and checksum, and one score.

    from gough.paper.benchmark import benchmark, score

    print(score(my_method, benchmark()))

A method is a function from readings (N, 6) to poses. See docs/join.md.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.learn.evaluate import held_out
from gough.learn.metrics import Metrics, NewtonCounts, count_newton_ends, measure
from gough.paper.markdown import number, percent
from gough.paper.study import with_workspace_of
from gough.platform import Platform
from gough.pose import Pose

POSES = 100_000
GRAIN = 1e-6  # resolution of the checksum [platform size] and [rad]
CHECKSUMS = {
    "paper": "107c138fada4a09d960b08bf20118075a1155e5911fe44b4d26d3894fbe2f17b",
    "wide": "01f100e037e87341e49964aa2bb2a5559bc08e882f5e74d73aa25f4e5c7088c7",
}  # of the reference platform's test sets


@dataclass(frozen=True, eq=False)
class Benchmark:
    """Held-out poses of the reference platform.

    Attributes:
        name: "paper" (+-50 mm, +-30 deg) or "wide" (+-100 mm, +-60 deg, only poses that are
            reached without crossing a singularity).
        truth: poses, batch (100000,).
        legs: readings (100000, 6) [mm].
    """

    name: str
    platform: Platform
    truth: Pose
    legs: Array

    @property
    def checksum(self) -> str:
        """SHA-256 of positions, rotations and readings, as whole multiples of a millionth.

        Of the platform's size for lengths, of one for quaternions. Thus it is the same on all
        machines, although their sines may differ in the last bit.
        """
        grain = GRAIN * self.platform.size
        parts = (self.truth.position / grain, self.truth.wxyz / GRAIN, self.legs / grain)
        numbers = np.concatenate([np.rint(p) for p in parts], axis=1)
        return hashlib.sha256(numbers.astype("<i8").tobytes()).hexdigest()


@dataclass(frozen=True)
class Score:
    """Results of a method.

    Attributes:
        name: of the method.
        answered: rows with a finite pose; errors are taken over all rows, with the home pose for
            a row without an answer.
        metrics: errors of the poses as they are.
        newton: where Newton's method ends that starts from them.
        seconds: time of the one call for all rows [s].
    """

    name: str
    answered: int
    metrics: Metrics
    newton: NewtonCounts
    seconds: float

    def __str__(self) -> str:
        m = self.metrics
        return "\n".join([
            f"{self.name}, {m.count:,} poses, {self.answered:,} answered",
            f"E-trans  {number(m.trans_mean)} mm, median {number(m.trans_median)}, "
            f"worst {number(m.trans_worst)}, below 1 mm {percent(m.trans_within[1], 2)} %",
            f"E-rot    {number(m.rot_mean)} deg, median {number(m.rot_median)}, "
            f"worst {number(m.rot_worst)}, below 1 deg {percent(m.rot_within[1], 2)} %",
            f"E-ik     {number(m.ik_mean)} mm",
            f"Newton from there: true pose {percent(self.newton.share, 3)} %, another "
            f"{self.newton.other}, no end {self.newton.unconverged}",
        ])  # fmt: skip


def benchmark(name: str = "paper") -> Benchmark:
    """Make the test set "paper" or "wide", the same everywhere, as its checksum proves.

    Raises:
        GoughError: no such set, or this machine makes other numbers than it should.
    """
    if name not in CHECKSUMS:
        raise GoughError(f"test set: expected one of {', '.join(CHECKSUMS)}, got {name!r}")
    wide = name == "wide"
    platform = with_workspace_of(Platform.load("reference"), "wide" if wide else "full")
    out = Benchmark(name, platform, *held_out(platform, POSES, same_assembly=wide))
    if out.checksum != CHECKSUMS[name]:
        raise GoughError(
            f"test set {name!r}: has checksum {out.checksum[:12]} here and should have "
            f"{CHECKSUMS[name][:12]}; results would not be comparable. Please report it with the "
            "versions of gough and NumPy"
        )
    return out


def score(method: Callable[[Array], Any], test: Benchmark, name: str | None = None) -> Score:
    """Measure a method's errors over a test set, and where Newton's method ends from its poses.

    Args:
        method: from readings (N, 6) [mm] to a Pose (N,), to matrices (N, 4, 4), or to a pair of
            positions (N, 3) and quaternions (N, 4), scalar first. NaN: no answer.
        test: the test set.
        name: name of the score; the function's name unless given.

    Raises:
        GoughError: an answer of another shape.
    """
    began = time.perf_counter()
    answer = method(test.legs.copy())
    seconds = time.perf_counter() - began
    matrices = _matrices(answer, len(test.legs))
    answered = np.isfinite(matrices).all(axis=(1, 2))
    matrices[~answered] = test.platform.home.matrix
    pose = Pose.from_matrix(matrices)
    return Score(
        name or getattr(method, "__name__", "method"), int(answered.sum()),
        measure(test.platform, pose, test.truth, test.legs),
        count_newton_ends(test.platform, pose, test.truth, test.legs), seconds,
    )  # fmt: skip


def _matrices(answer: Any, count: int) -> Array:
    """Poses as matrices (count, 4, 4), NaN where there is no answer."""
    if isinstance(answer, Pose):
        answer = answer.matrix
    if isinstance(answer, tuple) and len(answer) == 2:
        position, wxyz = (np.array(part, dtype=float) for part in answer)
        if position.shape != (count, 3) or wxyz.shape != (count, 4):
            raise GoughError(
                f"method: expected positions ({count}, 3) and quaternions ({count}, 4), got "
                f"{position.shape} and {wxyz.shape}"
            )
        answer = _from_quaternions(position, wxyz)
    matrices = np.array(answer, dtype=float)
    if matrices.shape != (count, 4, 4):
        raise GoughError(
            f"method: expected a Pose, matrices ({count}, 4, 4) or a pair of positions and "
            f"quaternions, got {matrices.shape}"
        )
    return matrices


def _from_quaternions(position: Array, wxyz: Array) -> Array:
    norms = np.linalg.norm(wxyz, axis=1)
    good = np.isfinite(position).all(axis=1) & np.isfinite(norms) & (norms > 0)
    out = np.full((len(position), 4, 4), np.nan)
    out[good] = Pose(position[good], wxyz[good]).matrix
    return out

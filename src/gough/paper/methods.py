"""Two-stage methods: a first guess and what refines it, all in one shape."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gough.checks import Array
from gough.fk.solve import solve
from gough.learn.newton import batched_newton
from gough.learn.outcomes import same_pose
from gough.paper.cpu_newton import Refined, cpu_newton, scipy_root
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.base import Seed

REPEATS = 3
F_MAX = 20  # inner iterations of the paper's method
Refine = Callable[[Pose, Array, float], Refined]


@dataclass(frozen=True)
class Method:
    """A first guess and a second stage.

    Attributes:
        run: poses from readings (N, 6) and gamma.
        counts: what its iterations are: summed over "samples", or "sweeps" of the whole batch.
    """

    name: str
    run: Callable[[Array, float], Refined]
    counts: str = "samples"

    @classmethod
    def of(cls, seed: Seed, refine: Refine, name: str, counts: str = "samples") -> Method:
        """A seed, then what refines its guesses."""
        return cls(
            f"{seed.name} + {name}",
            lambda legs, gamma: refine(seed.guess(legs), legs, gamma),
            counts,
        )


def timed(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Seconds: the middle of several runs, after one to warm up."""
    work()
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return float(np.median(times))


def sequential(platform: Platform, seed: Seed) -> Method:
    """One sample at a time, LAPACK's pseudo-inverse: the paper's CPU-NR."""

    def refine(guess: Pose, legs: Array, gamma: float) -> Refined:
        return cpu_newton(platform, guess, legs, gamma=gamma)

    return Method.of(seed, refine, "CPU-NR")


def batched(platform: Platform, seed: Seed, f_max: int = F_MAX, scaled: bool = False) -> Method:
    """The paper's GPU-friendly method, here on the CPU; `scaled` is not the paper's."""

    def refine(guess: Pose, legs: Array, gamma: float) -> Refined:
        end = batched_newton(platform, guess, legs, gamma=gamma, f_max=f_max, scaled=scaled)
        return Refined(end.pose, end.converged, end.singular, end.iterations)

    name = "batched NR" + (" scaled" if scaled else "")
    name += f", f_max = {f_max}" if f_max != F_MAX else ""
    return Method.of(seed, refine, name, "sweeps")


def scipy(platform: Platform, seed: Seed) -> Method:
    """SciPy's `root`, one sample at a time."""

    def refine(guess: Pose, legs: Array, gamma: float) -> Refined:
        return scipy_root(platform, guess, legs, gamma=gamma)

    return Method.of(seed, refine, "SciPy root")


def ours(platform: Platform, seed: Seed) -> Method:
    """This package's solver, always to rounding, with its further tries."""

    def run(legs: Array, gamma: float) -> Refined:
        end = solve(platform, legs, seed=seed)
        return Refined(end.pose, end.usable, np.zeros(len(legs), bool), end.iterations.astype(int))

    return Method(f"{seed.name} + gough.solve", run)


@dataclass(frozen=True)
class Outcome:
    """What became of W readings.

    Attributes:
        singular, imprecise: N_1 and N_2 of the paper's success rate.
        wrong: converged, but at another pose than the true one: the paper counts these as solved.
        iterations: summed over samples, or sweeps.
    """

    count: int
    singular: int
    imprecise: int
    wrong: int
    iterations: int

    @classmethod
    def of(cls, platform: Platform, method: Method, end: Refined, truth: Pose) -> Outcome:
        """From the ends and the true poses (W,)."""
        true = same_pose(platform, end.pose, truth)
        total = end.iterations.max if method.counts == "sweeps" else end.iterations.sum
        return cls(
            len(truth),
            int(np.sum(end.singular)),
            int(np.sum(~end.converged & ~end.singular)),
            int(np.sum(end.converged & ~true)),
            int(total(initial=0)),
        )

    @property
    def success(self) -> float:
        """The paper's success rate, (1 - (N_1 + N_2) / W)."""
        return 1 - (self.singular + self.imprecise) / self.count

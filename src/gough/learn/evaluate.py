"""First guesses side by side, over held-out poses: `gough evaluate`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.fk.solve import solve
from gough.learn.data import DatasetSpec, dataset
from gough.learn.forms import Difference, difference
from gough.learn.metrics import (
    Metrics,
    NewtonCounts,
    count_newton_ends,
    measure,
    median_time,
    same_pose,
)
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds import polynomial
from gough.seeds.base import Seed, find_seed
from gough.seeds.network import find_network, shipped_names

if TYPE_CHECKING:
    from gough.learn.config import TrainConfig

HELD_OUT = 20_240_314  # seed of the test poses, which no training uses
DEGREES = (3, 5, 7)


@dataclass(frozen=True)
class Row:
    """Results of one first guess.

    Attributes:
        name: as it was given.
        parameters: numbers stored; None for home and Taylor series.
        seconds: time of the training; None for a first guess in closed form.
        seed: random seed of the training; None likewise.
        per_thousand: time of 1,000 guesses in one call on this machine [s].
        metrics: errors of the guesses.
        newton: where plain Newton ends, with no second try.
        wrong: rows that `gough.solve` from this guess, with all its tries, does not end at the
            true pose.
        forms: distances between the forms of a network that has several; else None.
    """

    name: str
    parameters: int | None
    seconds: float | None
    seed: int | None
    per_thousand: float
    metrics: Metrics
    newton: NewtonCounts
    wrong: int
    forms: Difference | None


def default_names(platform: Platform) -> list[str]:
    """Home, Taylor series, polynomials, and the networks that come for this platform."""
    fitted = [f"polynomial-{d}" for d in DEGREES]
    return ["home", "taylor-2", *fitted, "universal", *shipped_names(platform)]


def held_out(platform: Platform, count: int, same_assembly: bool) -> tuple[Pose, Array]:
    """The test poses (count,) and their readings (count, 6)."""
    return dataset(platform, DatasetSpec(count, HELD_OUT, same_assembly))


def evaluate(platform: Platform, names: Sequence[str], *, poses: int = 100_000,
             same_assembly: bool = False) -> list[Row]:  # fmt: skip
    """Measure the errors of first guesses, and where Newton's method ends from them.

    Args:
        platform: the machine.
        names: "home", "taylor-2", "polynomial-3" (any degree to 7), "universal", a network that
            comes with the package, the folder of a run or a .onnx file.
        poses: number of held-out poses.
        same_assembly: use only poses with det J of home's sign.

    Raises:
        GoughError: a name that is none of these.

    Example:
        >>> rows = evaluate(platform, ["polynomial-5", "runs/mine"], poses=10_000)
        >>> rows[1].metrics.trans_mean
    """
    truth, legs = held_out(platform, poses, same_assembly)
    return [_row(platform, name, truth, legs) for name in names]


def _row(platform: Platform, name: str, truth: Pose, legs: Array) -> Row:
    seed, parameters, seconds, number = _open(platform, name)
    guess = seed.guess(legs)
    solved = solve(platform, legs, seed=seed).pose
    some = legs[np.arange(1000) % len(legs)]
    return Row(
        name, parameters, seconds, number, median_time(lambda: seed.guess(some), 7),
        measure(platform, guess, truth, legs), count_newton_ends(platform, guess, truth, legs),
        int(np.sum(~same_pose(platform, solved, truth))), difference(platform, name, guess, legs),
    )  # fmt: skip


def _open(platform: Platform, name: str) -> tuple[Seed, int | None, float | None, int | None]:
    """The first guess of a name; its parameters, training time [s] and random seed."""
    if name == "home" or name.startswith("taylor-"):
        return find_seed(platform, name), None, None, None
    if name.startswith("polynomial-"):
        degree = name.removeprefix("polynomial-")
        if not degree.isdigit():
            raise GoughError(f"{name}: expected a degree, such as polynomial-5")
        return find_seed(platform, name), 6 * polynomial.count(int(degree)), None, None
    network = find_network(platform, name)
    record = network.facts["record"]
    return network, network.facts["parameters"], training_time(record), record["seed"]


def training_time(record: dict) -> float:
    """Time of a run and of those before it, whose weights it started from [s]."""
    before = record.get("started_from")
    return record["seconds"] + (training_time(before) if before else 0.0)


def train_peers(platform: Platform, folder: Path, budget: str, *, seed: int = 0,
                threads: int | None = None) -> list[str]:  # fmt: skip
    """Train every network for the same processor time by the default recipe; return the folders.

    Runs that the folder holds already are finished, not repeated.
    """
    from gough.learn.config import PRESETS, Kind, ModelConfig
    from gough.learn.run_folder import CONFIG, NETWORK
    from gough.learn.train import train

    out = []
    for kind in get_args(Kind):
        config: TrainConfig = replace(PRESETS["default"], model=ModelConfig(kind))
        config = config.with_run(budget=budget, clock="processor", seed=seed, threads=threads)
        run = folder / kind
        if not (run / NETWORK).exists():
            train(platform, config, run, resume=(run / CONFIG).exists())
        out.append(str(run))
    return out

"""First guesses side by side, over held-out poses: `gough evaluate`."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.fk.solve import solve
from gough.learn.data import DatasetSpec, dataset
from gough.learn.metrics import Metrics, NewtonCounts, count_newton_ends, measure, same_pose
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds import polynomial
from gough.seeds.base import Seed, find_seed
from gough.seeds.network import NetworkSeed, find_network, shipped_names

if TYPE_CHECKING:
    from gough.learn.config import TrainConfig

HELD_OUT = 20_240_314  # seed of the test poses, which no training uses
DEGREES = (3, 5, 7)
EPOCH = 400_000  # samples, the paper's training set


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
    """

    name: str
    parameters: int | None
    seconds: float | None
    seed: int | None
    per_thousand: float
    metrics: Metrics
    newton: NewtonCounts
    wrong: int


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
        int(np.sum(~same_pose(platform, solved, truth))),
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


def median_time(work: Callable[[], object], repeats: int) -> float:
    """Median time of several runs, after one to warm up [s]."""
    work()
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return float(np.median(times))


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


# ---- speed of DisGNet ---------------------------------------------------------------------


@dataclass(frozen=True)
class Timing:
    """Times of one batch: its first guesses, and a training step from samples to SOAP [s]."""

    run: float
    train: float


@dataclass(frozen=True)
class Speed:
    """Times of DisGNet on this machine: `gough evaluate --speed`.

    Attributes:
        batch: samples in a batch.
        threads: PyTorch's threads.
        forms: times of the evaluations "dense", "structured" and "tables"; tables are for training
            only.
        guesses: by shipped network, time of 1,000 first guesses by onnxruntime [s].
        stages: the same with Newton's method.
    """

    batch: int
    threads: int
    forms: dict[str, Timing]
    guesses: dict[str, float]
    stages: dict[str, float]

    def lines(self) -> list[str]:
        """The figures as text, at most 80 columns wide."""
        out = [f"DisGNet, {self.batch} samples, PyTorch with {self.threads} threads"]
        out.append("form          run ms   train ms   times dense    epoch of 400,000")
        dense = self.forms["dense"]
        for name, t in self.forms.items():
            times = f"{dense.run / t.run:.1f}, {dense.train / t.train:.1f}"
            epoch = f"{t.train * EPOCH / self.batch:.1f} s"
            out.append(
                f"{name:<10} {1e3 * t.run:9.2f} {1e3 * t.train:10.2f} {times:>13} {epoch:>19}"
            )
        for name, guess in self.guesses.items():
            both = f"{1e3 * guess:.2f} ms, with Newton {1e3 * self.stages[name]:.2f} ms"
            out.append(f"1,000 poses, {name}: guess {both}")
        return out


def measure_speed(platform: Platform, batch: int = 1000, repeats: int = 5) -> Speed:
    """Time DisGNet's forms and the shipped networks: medians of `repeats`, after one to warm up.

    The weights of the timed forms are random.
    """
    import torch

    options: dict[str, dict] = {
        "dense": {"form": "dense"},
        "structured": {"table": 0},
        "tables": {},
    }
    forms = {name: _time(platform, batch, repeats, given) for name, given in options.items()}
    legs = dataset(platform, DatasetSpec(1000, 1))[1]
    guesses, stages = {}, {}
    for name in shipped_names(platform):
        seed = NetworkSeed.shipped(platform, name)
        guesses[name] = median_time(lambda seed=seed: seed.guess(legs), repeats)
        stages[name] = median_time(lambda seed=seed: solve(platform, legs, seed=seed), repeats)
    return Speed(batch, torch.get_num_threads(), forms, guesses, stages)


def _time(platform: Platform, batch: int, repeats: int, options: dict) -> Timing:
    import torch

    from gough.learn.loss import default_beta, training_loss
    from gough.learn.models import Scaling, build
    from gough.learn.optim import SOAP
    from gough.learn.sampling import Stream

    torch.manual_seed(0)
    model = build("disgnet", platform, Scaling.of(platform), **options)
    stream = Stream(platform)
    optimiser = SOAP(model.parameters(), lr=1e-3)
    beta = default_beta(platform)
    legs = stream.batch(batch, 0).legs

    @torch.no_grad()
    def run() -> None:
        model(legs)

    def step() -> None:
        samples = stream.batch(batch, 0)
        optimiser.zero_grad()
        training_loss(model, samples.legs, samples, beta).backward()
        optimiser.step()

    model.eval()
    guessing = median_time(run, repeats)
    model.train()
    return Timing(guessing, median_time(step, repeats))

"""The forms of DisGNet: how far apart they are, and their speed (`gough evaluate --speed`)."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gough.checks import Array
from gough.fk.solve import solve
from gough.learn.data import DatasetSpec, dataset
from gough.learn.metrics import median_time
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.network import NetworkSeed, shipped_names, shipped_weights

EPOCH = 400_000  # samples, the paper's training set
MOST = 100_000  # poses that the forms are compared over
CHUNK = 500


@dataclass(frozen=True)
class Difference:
    """Distances between guesses of one network's forms [platform unit].

    Attributes:
        count: poses.
        tables_mean, tables_worst: of the tables that it was trained by, from the exact form.
        file_mean, file_worst: of what its file evaluates, from the exact form.
    """

    count: int
    tables_mean: float
    tables_worst: float
    file_mean: float
    file_worst: float

    def text(self, name: str, unit: str) -> str:
        """The distances in a sentence."""
        tables = f"{self.tables_mean:.2g} {unit} (worst {self.tables_worst:.2g})"
        file = f"{self.file_mean:.2g} {unit} (worst {self.file_worst:.2g})"
        return (
            f"{name}: over {self.count:,} poses its tables, which trained it, are {tables} from "
            f"the exact network, and its file {file}."
        )


def difference(platform: Platform, name: str, guess: Pose, legs: Array) -> Difference | None:
    """Compare the forms of a network; None for one that has one form only, or no weights here.

    Args:
        platform: the machine.
        name: folder of a run, or a network that comes with the package.
        guess: what the network's file guesses, (N,).
        legs: readings (N, 6); at most the first 100,000 are used.
    """
    weights = _weights(platform, name)
    if weights is None:
        return None
    import torch

    from gough.learn.config import TrainConfig
    from gough.learn.models import Scaling, build
    from gough.learn.run_folder import load_tensors, load_weights

    tensors, facts = load_tensors(weights)
    config = TrainConfig.from_json(json.dumps(facts["config"]))
    scaling = Scaling.of(platform, config.data.same_assembly)
    model = build(facts["kind"], platform, scaling, **config.model.options)
    if not getattr(model, "table", 0):
        return None
    load_weights(weights, model, tensors)
    model.cast(getattr(torch, config.run.dtype))
    given = torch.tensor(legs[:MOST])
    found = {}
    with torch.no_grad():
        for training in (False, True):
            model.train(training)
            parts = [model(part)[0] for part in given.split(CHUNK)]
            found[training] = platform.home.position + torch.cat(parts).numpy()
    exact = found[False]
    tables, file = (
        np.linalg.norm(p - exact, axis=1) for p in (found[True], guess.position[: len(exact)])
    )
    return Difference(
        len(exact), float(tables.mean()), float(tables.max()), float(file.mean()), float(file.max())
    )


def _weights(platform: Platform, name: str) -> Path | None:
    """The file of a network's weights, where there is one."""
    from gough.learn.run_folder import WEIGHTS

    folder = Path(name)
    path = folder / WEIGHTS if folder.is_dir() else shipped_weights(platform, name)
    return path if path is not None and path.exists() else None


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

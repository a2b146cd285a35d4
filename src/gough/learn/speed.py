"""How fast DisGNet is, to run and to train, in its several forms: `gough evaluate --speed`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import torch

from gough.fk.solve import solve
from gough.kinematics import leg_lengths
from gough.learn.loss import default_beta, training_loss
from gough.learn.models import Scaling, build
from gough.learn.optim import SOAP
from gough.learn.sampling import Stream
from gough.platform import Platform
from gough.seeds.network import NetworkSeed, shipped_names

EPOCH = 400_000


@dataclass(frozen=True)
class Timing:
    """Seconds for one batch: a first guess, and a training step (samples to SOAP)."""

    run: float
    train: float


@dataclass(frozen=True)
class Speed:
    """DisGNet on this machine.

    Attributes:
        batch, threads: samples in a batch, PyTorch's threads.
        dense, structured, tables: the three evaluations; tables are for training only.
        guesses, stages: by shipped network, seconds for 1000 first guesses by onnxruntime, and
            for these and Newton's method together.
    """

    batch: int
    threads: int
    dense: Timing
    structured: Timing
    tables: Timing
    guesses: dict[str, float]
    stages: dict[str, float]

    def lines(self) -> list[str]:
        """The figures as text."""
        out = [f"DisGNet, {self.batch} samples, PyTorch with {self.threads} threads"]
        for name in ("dense", "structured", "tables"):
            t: Timing = getattr(self, name)
            faster = f"{self.dense.run / t.run:7.1f} {self.dense.train / t.train:7.1f} times dense"
            epoch = f"epoch of {EPOCH:,}: {t.train * EPOCH / self.batch:.1f} s"
            both = f"run {1e3 * t.run:9.2f} ms  train {1e3 * t.train:9.2f} ms"
            out.append(f"{name:<11} {both} {faster}  {epoch}")
        for name, guess in self.guesses.items():
            whole = 1e3 * self.stages[name]
            out.append(
                f"1000 poses, {name}: guess {1e3 * guess:.2f} ms, with Newton {whole:.2f} ms"
            )
        return out


def measure_speed(platform: Platform, batch: int = 1000, repeats: int = 5) -> Speed:
    """Medians of `repeats`, after one to warm up; the network's weights are random."""
    forms = {"dense": {"form": "dense"}, "structured": {"table": 0}, "tables": {}}
    timings = {name: _time(platform, batch, repeats, options) for name, options in forms.items()}
    legs = leg_lengths(platform, platform.sample_poses(1000, seed=1))
    guesses, stages = {}, {}
    for name in shipped_names(platform):
        seed = NetworkSeed.shipped(platform, name)
        guesses[name] = _median(lambda seed=seed: seed.guess(legs), repeats)
        stages[name] = _median(lambda seed=seed: solve(platform, legs, seed=seed), repeats)
    return Speed(batch, torch.get_num_threads(), **timings, guesses=guesses, stages=stages)


def _time(platform: Platform, batch: int, repeats: int, options: dict) -> Timing:
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
    guessing = _median(run, repeats)
    model.train()
    return Timing(guessing, _median(step, repeats))


def _median(function: Callable[[], object], repeats: int) -> float:
    function()
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        function()
        times.append(time.perf_counter() - began)
    return sorted(times)[len(times) // 2]

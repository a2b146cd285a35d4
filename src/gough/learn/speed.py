"""How fast DisGNet's two evaluations are, to run and to train: `gough evaluate --speed`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import torch

from gough.learn.loss import default_beta, training_loss
from gough.learn.models import Scaling, build
from gough.learn.optim import SOAP
from gough.learn.sampling import Stream
from gough.platform import Platform

EPOCH = 400_000


@dataclass(frozen=True)
class Speed:
    """Seconds per batch, on this machine with `threads` threads.

    Attributes:
        run, run_dense: first guesses of one batch, structured and dense.
        train, train_dense: one training step (samples, loss, gradients, SOAP) on one batch.
        epoch: 400,000 samples of training, structured.
    """

    batch: int
    threads: int
    run: float
    run_dense: float
    train: float
    train_dense: float

    @property
    def epoch(self) -> float:
        return self.train * EPOCH / self.batch

    def lines(self) -> list[str]:
        """The figures as text."""
        return [
            f"DisGNet, {self.batch} samples, {self.threads} threads, PyTorch",
            f"run    structured {1e3 * self.run:9.2f} ms   dense {1e3 * self.run_dense:9.2f} ms   "
            f"{self.run_dense / self.run:5.1f} times faster",
            f"train  structured {1e3 * self.train:9.2f} ms   dense {1e3 * self.train_dense:9.2f} ms"
            f"   {self.train_dense / self.train:5.1f} times faster",
            f"epoch of {EPOCH:,} samples, structured: {self.epoch:.1f} s",
        ]


def measure_speed(platform: Platform, batch: int = 1000, repeats: int = 5) -> Speed:
    """Time DisGNet of random weights; medians of `repeats`, after one to warm up."""
    times = {}
    for form in ("structured", "dense"):
        torch.manual_seed(0)
        model = build("disgnet", platform, Scaling.of(platform), form=form)
        stream = Stream(platform)
        optimiser = SOAP(model.parameters(), lr=1e-3)
        beta = default_beta(platform)

        def run(model=model, stream=stream) -> None:
            with torch.no_grad():
                model(stream.batch(batch, 0).legs)

        def step(model=model, stream=stream, optimiser=optimiser, beta=beta) -> None:
            samples = stream.batch(batch, 0)
            optimiser.zero_grad()
            training_loss(model, samples.legs, samples, beta).backward()
            optimiser.step()

        times[form] = _median(run, repeats), _median(step, repeats)
    (run_s, train_s), (run_d, train_d) = times["structured"], times["dense"]
    return Speed(batch, torch.get_num_threads(), run_s, run_d, train_s, train_d)


def _median(function: Callable[[], None], repeats: int) -> float:
    function()
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        function()
        times.append(time.perf_counter() - began)
    return sorted(times)[len(times) // 2]

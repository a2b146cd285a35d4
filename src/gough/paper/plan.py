"""What is trained and on what, and for how many steps: equal time made repeatable.

Every network gets the same budget of processor time on one thread. A run that stops by the clock
cannot be repeated, so the budget becomes a number of steps first: each network's step is timed on
this machine, and the numbers are kept in `plan.json`. A run by steps gives the same bits again.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import torch

from gough.errors import GoughError
from gough.learn.checkpoint import write_whole
from gough.learn.config import DataConfig, ModelConfig, RunConfig, TrainConfig
from gough.learn.models import MODELS
from gough.learn.train import Trainer
from gough.platform import Platform

WIDE = (100.0, 60.0)  # the wide workspace of the reference platform: +-mm, +-deg
WIDE_OF_SIZE = 1 / 8  # the same for another platform: shifts, of its size
SETS = {"full": 1.0, "90": 0.9, "80": 0.8, "wide": 1.0}  # share of the training rows
BATCH = 500
MEASUREMENTS = 60  # points of a training curve
WARM = 30  # steps before the timing


@dataclass(frozen=True)
class Plan:
    """Sizes of the experiments.

    Attributes:
        budget: seconds of processor time that each network may take, on one thread.
        rows: of the full training set, the first of `gough dataset --seed 0`.
        seed: of training data and of the weights at the start.
        steps: what the budget comes to for each network, by a timing on one machine.
    """

    budget: float
    rows: int
    seed: int
    steps: dict[str, int]

    def config(self, name: str, kind: str) -> TrainConfig:
        """The training of one network on one of the SETS: the default recipe, fixed rows."""
        rows = round(SETS[name] * self.rows)
        return TrainConfig(
            model=ModelConfig(kind),  # pyright: ignore[reportArgumentType]
            data=DataConfig(BATCH, samples=rows, same_assembly=name == "wide"),
            run=RunConfig(
                steps=self.steps[kind], seed=self.seed, clock="processor", threads=1,
                device="cpu", log_every=self.budget / MEASUREMENTS, checkpoint_every=60.0,
            ),
        )  # fmt: skip

    def to_json(self) -> str:
        """As the text of `plan.json`."""
        return json.dumps(asdict(self), indent=2) + "\n"

    @classmethod
    def load(cls, path: Path) -> Plan:
        """From a file `plan.json`.

        Raises:
            GoughError: it is missing, or no such file.
        """
        try:
            return cls(**json.loads(path.read_text()))
        except OSError as error:
            raise GoughError(f"{path}: cannot be read: {error.strerror}") from None
        except (json.JSONDecodeError, TypeError) as error:
            raise GoughError(f"{path}: not a plan of gough paper: {error}") from None

    def save(self, path: Path) -> None:
        """Write `plan.json`."""
        write_whole(path, self.to_json().encode())


def machine_of(platform: Platform, name: str) -> Platform:
    """The platform with the workspace of one of the SETS."""
    if name != "wide":
        return platform
    shift = WIDE[0] if platform.name == "reference" else WIDE_OF_SIZE * platform.size
    return platform.with_workspace(shift, WIDE[1])


def timed_plan(platform: Platform, budget: float, rows: int, seed: int, folder: Path) -> Plan:
    """Time a step of every network here, and say how many fit into the budget."""
    measured = min(10.0, budget / 10)
    one = Plan(budget, 20 * BATCH, seed, dict.fromkeys(MODELS, 1))
    steps = {}
    for kind in MODELS:
        trainer = Trainer(platform, one.config("full", kind), folder)
        for _ in range(WARM):
            trainer.learn(0.0)
        began, count = time.process_time(), 0
        while time.process_time() - began < measured:
            trainer.learn(0.0)
            count += 1
        steps[kind] = max(1, int(budget * count / (time.process_time() - began)))
    return Plan(budget, rows, seed, steps)


def set_threads(count: int) -> None:
    """Threads of PyTorch in this process."""
    torch.set_num_threads(count)

"""What is trained and on what, and for how many steps: equal time made repeatable.

Every network gets the same budget of processor time on one thread. A run that stops by the clock
cannot be repeated, so the budget becomes a number of steps first: each network's step is timed on
this machine, and the numbers are kept in `plan.json`. A run by steps gives the same bits again.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from gough.errors import GoughError
from gough.learn.config import DataConfig, ModelConfig, RunConfig, TrainConfig
from gough.learn.models import MODELS
from gough.learn.train import Trainer
from gough.platform import Platform
from gough.whole_file import write_whole

WIDE = (100.0, 60.0)  # the wide workspace of the reference platform: +-mm, +-deg
WIDE_OF_SIZE = 1 / 8  # the same for another platform: shifts, of its size
SETS = {"full": 1.0, "90": 0.9, "80": 0.8, "wide": 1.0}  # share of the training rows
BATCH = 500
MEASUREMENTS = 60  # points of a training curve
WARM = 15  # steps before the timing


@dataclass(frozen=True)
class Plan:
    """Sizes of the experiments.

    Attributes:
        budget: seconds of processor time that each network may take, on one thread.
        rows: of the full training set, the first of `gough dataset --seed 0`.
        test: held-out poses that errors are taken over.
        solved: of these, how many the two-stage methods solve (W in the paper).
        sizes: first, last and step of the numbers of samples that are timed.
        seed: of training data and of the weights at the start.
        platform: digest of the platform.
        steps: what the budget comes to for each network, by a timing on one machine.
    """

    budget: float = 300.0
    rows: int = 400_000
    test: int = 100_000
    solved: int = 1000
    sizes: tuple[int, int, int] = (10, 1000, 10)
    seed: int = 0
    platform: str = ""
    steps: dict[str, int] = field(default_factory=dict)

    def config(self, name: str, kind: str) -> TrainConfig:
        """The training of one network on one of the SETS: the default recipe, fixed rows."""
        return TrainConfig(
            model=ModelConfig(kind),  # pyright: ignore[reportArgumentType]
            data=DataConfig(BATCH, samples=self.rows_of(name), same_assembly=name == "wide"),
            run=RunConfig(
                steps=self.steps[kind], seed=self.seed, clock="processor", threads=1,
                device="cpu", log_every=self.budget / MEASUREMENTS, checkpoint_every=60.0,
            ),
        )  # fmt: skip

    def rows_of(self, name: str) -> int:
        """Training rows of one of the SETS."""
        return round(SETS[name] * self.rows)

    def timed(self, platform: Platform, folder: Path) -> Plan:
        """With `steps`: a step of every network is timed here."""
        measured = min(10.0, self.budget / 10)
        one = replace(self, rows=20 * BATCH, steps=dict.fromkeys(MODELS, 1))
        steps = {}
        for kind in MODELS:
            trainer = Trainer(platform, one.config("full", kind), folder)
            for _ in range(WARM):
                trainer.learn(0.0)
            began, count = time.process_time(), 0
            while time.process_time() - began < measured or not count:
                trainer.learn(0.0)
                count += 1
            steps[kind] = max(1, int(self.budget * count / (time.process_time() - began)))
        return replace(self, steps=steps, platform=platform.digest)

    def save(self, path: Path) -> None:
        """Write `plan.json`."""
        write_whole(path, (json.dumps(asdict(self), indent=2) + "\n").encode())

    @classmethod
    def load(cls, path: Path) -> Plan:
        """From a file `plan.json`.

        Raises:
            GoughError: it is missing, or no such file.
        """
        try:
            facts = json.loads(path.read_text())
            return cls(**facts | {"sizes": tuple(facts["sizes"])})
        except OSError as error:
            raise GoughError(f"{path}: cannot be read: {error.strerror}") from None
        except (json.JSONDecodeError, TypeError, KeyError) as error:
            raise GoughError(f"{path}: not a plan of gough paper: {error}") from None


FULL = Plan()
QUICK = Plan(budget=1.0, rows=20_000, test=2_000, solved=100, sizes=(10, 100, 10))


def machine_of(platform: Platform, name: str) -> Platform:
    """The platform with the workspace of one of the SETS."""
    if name != "wide":
        return platform
    shift = WIDE[0] if platform.name == "reference" else WIDE_OF_SIZE * platform.size
    return platform.with_workspace(shift, WIDE[1])

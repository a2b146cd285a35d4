"""One study: a folder with its plan, networks and results.

Every network gets the same budget of processor time on one thread. A run that stops by the clock
cannot be repeated, so the budget becomes a number of steps first: each network's step is timed on
this machine, and the numbers are kept in `plan.json`. A run by steps gives the same bits again.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, get_args

import torch

from gough.checks import Array
from gough.errors import GoughError
from gough.learn.config import DataConfig, Kind, ModelConfig, RunConfig, TrainConfig
from gough.learn.evaluate import DEGREES, held_out
from gough.learn.run_folder import CONFIG, METRICS, NETWORK, environment
from gough.learn.train import Trainer, train
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.network import NetworkSeed
from gough.whole_file import write_whole

PLAN, SUMS = "plan.json", "networks.json"
KINDS: tuple[Kind, ...] = get_args(Kind)
WIDE = (100.0, 60.0)  # the wide workspace of the reference platform: +-mm, +-deg
WIDE_OF_SIZE = 1 / 8  # translation of another platform's wide workspace [platform size]
SETS = {"full": 1.0, "90": 0.9, "80": 0.8, "wide": 1.0}  # share of the training rows
BATCH = 500
MEASUREMENTS = 60  # points of a training curve
WARM = 15  # steps before the timing


@dataclass(frozen=True)
class Plan:
    """Sizes of the experiments.

    Attributes:
        budget: processor time of each network, on one thread [s].
        rows: size of the full training set, the first rows of `gough dataset --seed 0`.
        test: number of held-out poses that errors are taken over.
        solved: number of these that the two-stage methods solve (W in the paper).
        sizes: first, last and step of the numbers of samples that are timed.
        others: networks that are trained on the other sets than the full one too.
        degrees: of the polynomials.
        seed: seed of training data and of the weights at the start.
        platform: digest of the platform.
        steps: number of steps of each network that the budget allows, by a timing on one machine.
    """

    budget: float = 300.0
    rows: int = 400_000
    test: int = 100_000
    solved: int = 1000
    sizes: tuple[int, int, int] = (10, 1000, 10)
    others: tuple[Kind, ...] = KINDS
    degrees: tuple[int, ...] = DEGREES
    seed: int = 0
    platform: str = ""
    steps: dict[str, int] = field(default_factory=dict)

    def config(self, name: str, kind: Kind) -> TrainConfig:
        """Training of one network on one of the SETS: the default recipe, fixed rows."""
        return TrainConfig(
            model=ModelConfig(kind),
            data=DataConfig(BATCH, samples=self.rows_of(name), same_assembly=name == "wide"),
            run=RunConfig(
                steps=self.steps[kind], seed=self.seed, clock="processor", threads=1,
                device="cpu", log_every=self.budget / MEASUREMENTS, checkpoint_every=60.0,
            ),
        )  # fmt: skip

    def rows_of(self, name: str) -> int:
        """Number of training rows of one of the SETS."""
        return round(SETS[name] * self.rows)

    def timed(self, platform: Platform, folder: Path) -> Plan:
        """Fill in `steps` by timing a step of every network on this machine."""
        measured = min(10.0, self.budget / 10)
        one = replace(self, rows=20 * BATCH, steps=dict.fromkeys(KINDS, 1))
        steps = {}
        for kind in KINDS:
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
        _write_json(path, asdict(self))

    @classmethod
    def load(cls, path: Path) -> Plan:
        """Read a file `plan.json`.

        Raises:
            GoughError: it is missing, or is no plan.
        """
        try:
            facts = json.loads(path.read_text())
            lists = {k: tuple(v) for k, v in facts.items() if isinstance(v, list)}
            return cls(**facts | lists)
        except OSError as error:
            raise GoughError(f"{path}: cannot be read: {error.strerror}") from None
        except (json.JSONDecodeError, TypeError, KeyError) as error:
            raise GoughError(f"{path}: not a plan of gough paper: {error}") from None


FULL = Plan()
QUICK = Plan(budget=1.0, rows=20_000, test=2_000, solved=100, sizes=(10, 100, 10),
             others=("disgnet", "wise-mlp"), degrees=(3, 5))  # fmt: skip


def with_workspace_of(platform: Platform, name: str) -> Platform:
    """The platform with the workspace of one of the SETS."""
    if name != "wide":
        return platform
    length = WIDE[0] if platform.name == "reference" else WIDE_OF_SIZE * platform.size
    return platform.with_workspace(length, WIDE[1])


@dataclass(frozen=True)
class Study:
    """Files of a study, in `folder` unless stated:

    plan.json               sizes, budget, steps
    runs/SET/NETWORK/       trainings (not needed once the networks are there)
    SET/NAME.onnx           networks with their records, in the folder `networks`;
                            full/NAME.csv: errors during the training
    networks.json           sizes and SHA-256 sums of these
    results/STAGE.json      numbers of a table or figure, and how they were made
    figures/*.svg
    index.md, report.html   the report

    Attributes:
        platform: the machine.
        plan: sizes.
        folder: of the study.
        networks: folder of the networks.
    """

    platform: Platform
    plan: Plan
    folder: Path
    networks: Path

    # ---- networks ---------------------------------------------------------------------

    def kinds(self, name: str) -> list[Kind]:
        """The networks of one of the SETS, of those that the plan states steps for."""
        wanted = KINDS if name == "full" else self.plan.others
        return [kind for kind in wanted if kind in self.plan.steps]

    def train(self, sets: Iterable[str] = tuple(SETS), *, show: bool = True) -> None:
        """Train the networks of the SETS that are missing; a run that was stopped goes on."""
        for name in sets:
            for kind in self.kinds(name):
                target = self.network_path(name, kind)
                if target.exists():
                    continue
                run = self.folder / "runs" / name / kind
                if not (run / NETWORK).exists():
                    platform = with_workspace_of(self.platform, name)
                    resume = (run / CONFIG).exists()
                    train(platform, self.plan.config(name, kind), run, resume=resume, show=show)
                target.parent.mkdir(parents=True, exist_ok=True)
                write_whole(target, (run / NETWORK).read_bytes())
                if name == "full":
                    write_whole(self.curve_path(kind), (run / METRICS).read_bytes())
        _write_json(self.folder / SUMS, self.sums())

    def network_path(self, name: str, kind: str) -> Path:
        """File of the network that one training gave."""
        return self.networks / name / f"{kind}.onnx"

    def curve_path(self, kind: str) -> Path:
        """File of a network's errors during its training on the full set."""
        return self.network_path("full", kind).with_suffix(".csv")

    def sums(self) -> dict[str, dict]:
        """Size [bytes] and SHA-256 of each network that is there, by its path."""
        paths = [self.network_path(name, kind) for name in SETS for kind in self.kinds(name)]
        contents = {p: p.read_bytes() for p in paths if p.exists()}
        return {
            p.relative_to(self.networks).as_posix(): {
                "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest(),
            }
            for p, content in contents.items()
        }  # fmt: skip

    def known_sums(self) -> dict[str, dict]:
        """Sizes and sums that `networks.json` states; none where there is no such file."""
        path = self.folder / SUMS
        return json.loads(path.read_text()) if path.exists() else {}

    def check_networks(self) -> None:
        """Compare the networks with `networks.json`.

        Raises:
            GoughError: a file is not the one that the study's results were made with.
        """
        known = self.known_sums()
        for name, found in self.sums().items():
            if name in known and known[name] != found:
                raise GoughError(
                    f"{self.networks / name}: is not the network of this study: its SHA-256 begins "
                    f"with {found['sha256'][:12]}, that in {self.folder / SUMS} with "
                    f"{known[name]['sha256'][:12]}; name the right folder with --networks"
                )

    def network(self, name: str, kind: str) -> NetworkSeed:
        """Open a network.

        Raises:
            GoughError: not trained yet.
        """
        path = self.network_path(name, kind)
        if not path.exists():
            raise GoughError(
                f"{path}: there is no such network; run: gough paper --stage train, or name the "
                "folder that holds the networks with --networks"
            )
        return NetworkSeed(with_workspace_of(self.platform, name), path)

    def test_set(
        self, first: int | None = None, name: str = "full", same_assembly: bool = False
    ) -> tuple[Pose, Array]:
        """The `first` of the held-out poses (test,) and readings (test, 6), or all of them."""
        platform = with_workspace_of(self.platform, name)
        truth, legs = held_out(platform, self.plan.test, same_assembly)
        return truth[:first], legs[:first]

    # ---- results ----------------------------------------------------------------------

    def save(self, stage: str, data: dict, command: str) -> None:
        """Write the result of a stage, with the command and the machine that made it."""
        made = {"command": command, **environment(torch.device("cpu"))}
        path = self.result_path(stage)
        path.parent.mkdir(parents=True, exist_ok=True)
        _write_json(path, {"made": made, **data}, indent=1)

    def result(self, stage: str) -> dict[str, Any]:
        """Read the result of a stage.

        Raises:
            GoughError: it has not been run.
        """
        path = self.result_path(stage)
        try:
            return json.loads(path.read_text())
        except FileNotFoundError:
            raise GoughError(f"{path}: missing; run: gough paper --stage {stage}") from None
        except json.JSONDecodeError as error:
            raise GoughError(f"{path}: not a result: {error}") from None

    def result_path(self, stage: str) -> Path:
        """File of the result of a stage."""
        return self.folder / "results" / f"{stage}.json"


def _write_json(path: Path, data: dict, indent: int = 2) -> None:
    write_whole(path, (json.dumps(data, indent=indent) + "\n").encode())

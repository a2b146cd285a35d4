"""One study: a folder with its plan, networks and results."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from gough.checks import Array
from gough.errors import GoughError
from gough.learn.environment import environment
from gough.learn.evaluate import held_out
from gough.learn.export import NETWORK
from gough.learn.models import MODELS
from gough.learn.train import train
from gough.paper.plan import SETS, Plan, machine_of
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.network import NetworkSeed
from gough.whole_file import write_whole

PLAN, METRICS = "plan.json", "metrics.csv"


@dataclass(frozen=True)
class Study:
    """The folder of a study:

    plan.json               sizes, budget, steps
    runs/SET/NETWORK/       trainings (not needed once `networks` is there)
    networks/SET/NAME.onnx  what they gave, with their records; NAME.csv: their curves
    results/STAGE.json      numbers of a table or figure, and how they were made
    figures/*.svg
    index.md, report.html   the report
    """

    platform: Platform
    plan: Plan
    folder: Path

    # ---- networks ---------------------------------------------------------------------

    def train(self, sets: Iterable[str] = tuple(SETS), *, show: bool = True) -> None:
        """Train whatever of the SETS is not trained yet; a run that was stopped goes on."""
        for name in sets:
            for kind in MODELS:
                target = self.network_path(name, kind)
                if target.exists():
                    continue
                run = self.run_folder(name, kind)
                if not (run / NETWORK).exists():
                    platform, config = machine_of(self.platform, name), self.plan.config(name, kind)
                    train(platform, config, run, resume=(run / "config.json").exists(), show=show)
                target.parent.mkdir(parents=True, exist_ok=True)
                write_whole(target, (run / NETWORK).read_bytes())
                if name == "full":
                    write_whole(self.curve_path(kind), (run / METRICS).read_bytes())

    def run_folder(self, name: str, kind: str) -> Path:
        """Of one training."""
        return self.folder / "runs" / name / kind

    def network_path(self, name: str, kind: str) -> Path:
        """The network that one training gave."""
        return self.folder / "networks" / name / f"{kind}.onnx"

    def curve_path(self, kind: str) -> Path:
        """Errors while a network trained on the full set."""
        return self.network_path("full", kind).with_suffix(".csv")

    def network(self, name: str, kind: str) -> NetworkSeed:
        """The same, ready to guess.

        Raises:
            GoughError: not trained yet.
        """
        path = self.network_path(name, kind)
        if not path.exists():
            raise GoughError(f"{path}: not trained yet; run: gough paper --stage train")
        return NetworkSeed(machine_of(self.platform, name), path)

    def test_set(
        self, first: int | None = None, name: str = "full", same_assembly: bool = False
    ) -> tuple[Pose, Array]:
        """The `first` of the held-out poses (test,) and readings (test, 6), or all of them."""
        truth, legs = held_out(machine_of(self.platform, name), self.plan.test, same_assembly)
        return truth[:first], legs[:first]

    # ---- results ----------------------------------------------------------------------

    def save(self, stage: str, data: dict, command: str) -> None:
        """Keep what a stage found, with what made it."""
        made = {"command": command, **environment(torch.device("cpu"))}
        path = self.result_path(stage)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, (json.dumps({"made": made, **data}, indent=1) + "\n").encode())

    def result(self, stage: str) -> dict[str, Any]:
        """What a stage found.

        Raises:
            GoughError: it has not been run.
        """
        try:
            return json.loads(self.result_path(stage).read_text())
        except FileNotFoundError:
            raise GoughError(
                f"{self.result_path(stage)}: missing; run: gough paper --stage {stage}"
            ) from None
        except json.JSONDecodeError as error:
            raise GoughError(f"{self.result_path(stage)}: not a result: {error}") from None

    def result_path(self, stage: str) -> Path:
        """Where the numbers of a stage stand."""
        return self.folder / "results" / f"{stage}.json"

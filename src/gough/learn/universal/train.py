"""Train the universal network on random machines, or fine-tune it for one: one resumable loop.

    python -m gough.learn.universal.train runs/universal

trains the network that gough ships; options follow, `--help` lists them. The run's folder holds

    config.json              the settings (UniversalConfig)
    environment.json         versions, machine, git commit
    metrics.csv              measurements while it ran
    checkpoint.safetensors   to go on from, after `kill -9` too
    weights.safetensors      the result, with its training record
    network.onnx             the same for solving, without torch

Step k draws its machines and poses from the run's seed and k alone, so a run of a given number of
steps repeats bit for bit, however often it was stopped.
"""

from __future__ import annotations

import csv
import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Protocol

import torch
from torch import Tensor
from tyro.conf import Positional

from gough.errors import GoughError
from gough.learn.config import OptimiserConfig, RunConfig
from gough.learn.optim import SOAP, Clock, learning_rate
from gough.learn.run_folder import environment, load_state, save_state
from gough.learn.universal.export import export
from gough.learn.universal.machines import Draw, Machines, Poses
from gough.learn.universal.network import Universal
from gough.platform import Platform
from gough.seeds.taylor import series
from gough.seeds.universal import ORDER
from gough.whole_file import write_whole

CHECKPOINT, CONFIG, METRICS = "checkpoint.safetensors", "config.json", "metrics.csv"
STRIDE = 2**32  # between the seeds of two runs' samples
TEST_MACHINES = 200
BOXES = {"narrow": (0.08, 30.0), "wide": (0.15, 60.0)}  # share of the size, [deg]
COLUMNS = ("step", "seconds", "lr", "loss", *(f"{name}_error" for name in BOXES))

RECIPE = OptimiserConfig(lr=4e-3, warmup=100)
ONE_CORE = RunConfig(budget="20m", clock="processor", threads=1, checkpoint_every=60.0)


@dataclass(frozen=True)
class UniversalConfig:
    """Settings of a run on random machines."""

    network: dict[str, int] = field(default_factory=dict)
    """Options of `Universal`: width, layers, code, rounds."""
    machines: int = 64
    """Machines per step."""
    rows: int = 32
    """Poses of each machine."""
    odd: float = 0.15
    """Share of machines with joints anywhere in a box."""
    beta: float = 0.3
    """Weight of the rotation error [rad] beside the translation error [share of the size]."""
    floor: float = 1e-4
    """Mean error of a machine below which it counts less."""
    optimiser: OptimiserConfig = RECIPE
    run: RunConfig = ONE_CORE

    def total_steps(self) -> int | None:
        """Steps of the run, None under a budget."""
        return self.run.steps

    @classmethod
    def from_json(cls, text: str) -> UniversalConfig:
        """Read the text of `config.json`.

        Raises:
            GoughError: not such a text.
        """
        try:
            facts = json.loads(text)
            parts = {"optimiser": OptimiserConfig, "run": RunConfig}
            return cls(**facts | {name: kind(**facts[name]) for name, kind in parts.items()})
        except (json.JSONDecodeError, KeyError, TypeError) as error:
            raise GoughError(f"config.json: not a training configuration: {error}") from None


SHIPPED = {"width": 32, "layers": 3, "code": 48, "rounds": 2}
DEFAULT = UniversalConfig(network=SHIPPED)


class Samples(Protocol):
    """Machines and poses to train on: random ones, or those of one platform."""

    @property
    def platform(self) -> Platform | None:
        """The platform that the result is for; none: any."""
        ...

    def batch(self, key: int) -> tuple[Machines, Poses]:
        """Samples of a step, the same for the same key; negative keys are for tests."""
        ...


@dataclass(frozen=True)
class RandomMachines:
    """Random machines, and poses of each; the tests are in a narrow and a wide box."""

    config: UniversalConfig
    platform: None = None

    def batch(self, key: int) -> tuple[Machines, Poses]:
        draw = Draw(self.config.run.seed * STRIDE + key if key >= 0 else key)
        count, rows = self.config.machines, self.config.rows
        if key >= 0:
            machines = draw.machines(count, self.config.odd)
            return machines, draw.poses(machines, rows)
        machines = draw.machines(TEST_MACHINES, self.config.odd)
        return machines, draw.poses(machines, rows, tuple(BOXES.values())[-1 - key])


class Trainer:
    """The state of a run.

    Args:
        samples: what it learns from.
        start: the network to start from; a new one unless given.
    """

    def __init__(self, config: UniversalConfig, folder: Path, samples: Samples,
                 start: Universal | None = None) -> None:  # fmt: skip
        if config.run.threads is not None:
            torch.set_num_threads(config.run.threads)
        self.config, self.folder, self.samples = config, folder, samples
        torch.manual_seed(config.run.seed)
        self.model = Universal(**config.network) if start is None else start.train()
        self.optimiser = SOAP(self.model.parameters(), lr=config.optimiser.lr)
        self.clock, self.step = Clock(config), 0
        self.test = {name: samples.batch(-1 - i) for i, name in enumerate(BOXES)}

    def fit(self) -> None:
        """Train to the end, from the last checkpoint if there is one, and export."""
        if (self.folder / CHECKPOINT).exists():
            self._load()
        metrics = _Metrics(self.folder / METRICS, self.step)
        facts = json.dumps(environment(torch.device("cpu")), indent=2) + "\n"
        write_whole(self.folder / "environment.json", facts.encode())
        logged = saved = self.clock.elapsed
        if not self.step:
            metrics.add(self.measure(float("nan"), 0.0))
        self.clock.tick()
        while (progress := self.clock.progress(self.step)) < 1:
            loss = self.learn(progress)
            self.clock.tick()
            if self.clock.elapsed - logged >= self.config.run.log_every:
                logged = self.clock.elapsed
                metrics.add(self.measure(loss, progress))
            if self.clock.elapsed - saved >= self.config.run.checkpoint_every:
                saved = self.clock.elapsed
                self.save()
        self.save()
        metrics.add(self.measure(float("nan"), 1.0))
        export(self.model, self.config.network, self.record(), self.folder, self.samples.platform)

    def learn(self, progress: float) -> float:
        """One step; the loss before it."""
        rate = learning_rate(self.config.optimiser, self.step, progress)
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        machines, poses = self.samples.batch(self.step)
        translation, rotation = pose_errors(self.model, machines, poses)
        errors = translation + self.config.beta * rotation
        if self.samples.platform is not None:  # one machine, also where each row stands for one
            errors, poses = errors.view(1, -1), replace(poses, regular=poses.regular.view(1, -1))
        loss = machine_loss(errors, poses.regular, self.config.floor)
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.model.parameters(), 1.0)
        self.optimiser.step()
        self.step += 1
        return float(loss.detach())

    # ---- measured, kept ---------------------------------------------------------------

    @torch.no_grad()
    def measure(self, loss: float, progress: float) -> dict[str, float]:
        """Median over held-out machines of their mean translation error, and how the run goes."""
        row = {
            "step": self.step,
            "seconds": self.clock.elapsed,
            "lr": learning_rate(self.config.optimiser, self.step, progress),
            "loss": loss,
        }
        for name, (machines, poses) in self.test.items():
            error, _ = pose_errors(self.model, machines, poses)
            means = mean_by_machine(error, poses.regular)
            row[f"{name}_error"] = float(
                means.median() if self.samples.platform is None else means.mean()
            )
        return row

    def record(self) -> dict:
        """Facts about the run that go with its weights."""
        return {
            "seconds": round(self.clock.elapsed, 1),
            "clock": self.config.run.clock,
            "steps": self.step,
            "samples": self.step * self.config.machines * self.config.rows,
            "seed": self.config.run.seed,
            "config": asdict(self.config),
            "environment": environment(torch.device("cpu")),
            "test": self.measure(0.0, 1.0),
        }

    def save(self) -> None:
        """Write the checkpoint."""
        facts = {"step": self.step, "elapsed": self.clock.elapsed}
        save_state(self.folder / CHECKPOINT, self.model, {}, self.optimiser, facts)

    def _load(self) -> None:
        facts = load_state(self.folder / CHECKPOINT, self.model, {}, self.optimiser)
        self.step, self.clock.elapsed = facts["step"], facts["elapsed"]


def pose_errors(model: Universal, machines: Machines, poses: Poses) -> tuple[Tensor, Tensor]:
    """Errors of the network's guesses, (M, N): translation [share of the size], rotation [rad]."""
    terms = series(machines.base, machines.joints, machines.inverse, poses.change, ORDER)
    changes = model(machines.base, machines.joints, machines.inverse, torch.stack(terms))
    x = (machines.inverse @ changes).mT  # (M, N, 6)
    away = torch.linalg.vector_norm(x[..., :3] - poses.translation, dim=-1)
    turned = torch.linalg.matrix_norm(cayley(x[..., 3:]) - poses.rotation) / 2**0.5
    return away, turned


def cayley(w: Tensor) -> Tensor:
    """Rotation matrices (..., 3, 3) with Gibbs vectors w / 2: see `gough.seeds.taylor`."""
    x, y, z = w.unbind(-1)
    none = torch.zeros_like(x)
    cross = torch.stack([none, -z, y, z, none, -x, -y, x, none], dim=-1).unflatten(-1, (3, 3))
    factor = 1 + w.square().sum(-1)[..., None, None] / 4
    return torch.eye(3, dtype=w.dtype) + (cross + cross @ cross / 2) / factor


def mean_by_machine(errors: Tensor, regular: Tensor) -> Tensor:
    """Mean over the poses with home's sign of det J, (M, N) to (M,)."""
    return (errors * regular).sum(1) / regular.sum(1).clamp(min=1)


def machine_loss(errors: Tensor, regular: Tensor, floor: float) -> Tensor:
    """Mean over machines of the logarithm of their mean error.

    The logarithm lets no machine rule the loss, near-singular ones with their large errors least;
    the mean within a machine keeps its worst poses in view, from which Newton's method may fail.
    """
    return torch.log(floor + mean_by_machine(errors, regular)).mean()


class _Metrics:
    """`metrics.csv`, one line per measurement; a resumed run goes on after its checkpoint."""

    def __init__(self, path: Path, last_step: int) -> None:
        self.path = path
        rows = []
        if path.exists():
            with path.open(newline="") as file:
                rows = [r for r in csv.DictReader(file) if float(r["step"] or "inf") <= last_step]
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore")
            writer.writeheader()
            writer.writerows(rows)

    def add(self, row: dict[str, float]) -> None:
        """Append one line."""
        with self.path.open("a", newline="") as file:
            csv.writer(file).writerow([f"{row[c]:.6g}" for c in COLUMNS])


def train(folder: Positional[Path], config: UniversalConfig = DEFAULT, *, resume: bool = False,
          budget: str | None = None) -> None:  # fmt: skip
    """Train the universal network on random machines.

    Args:
        folder: of the run; must not hold another one unless `resume`.
        config: the settings of a new run.
        resume: go on from the folder's checkpoint, with the folder's own settings.
        budget: processor time in all, such as 30m; the settings' unless given.

    Raises:
        GoughError: the folder holds a run already, or none to resume.
    """
    config = prepare(folder, config, resume, budget)
    Trainer(config, folder, RandomMachines(config)).fit()


def prepare(folder: Path, config: UniversalConfig, resume: bool, budget: str | None
            ) -> UniversalConfig:  # fmt: skip
    """Make the folder of a run, or check that it holds one; the settings to use.

    Raises:
        GoughError: the folder holds a run already, or none to resume.
    """
    file = folder / CONFIG
    if resume:
        if not file.exists():
            raise GoughError(f"{folder}: holds no run to resume")
        config = UniversalConfig.from_json(file.read_text())
    elif file.exists():
        raise GoughError(f"{folder}: holds a run already; resume it, or name another folder")
    if budget is not None:
        config = replace(config, run=replace(config.run, budget=budget, steps=None))
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(file, (json.dumps(asdict(config), indent=2) + "\n").encode())
    return config


if __name__ == "__main__":
    import tyro

    tyro.cli(train)

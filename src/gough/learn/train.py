"""Training a first guess: one loop, for every network, on one device or several.

A run has a folder:

    config.json           what it was told (TrainConfig)
    environment.json      versions, machine, git commit
    platform.toml         for which platform
    metrics.csv           measurements while it ran; TensorBoard's events stand beside it
    checkpoint.safetensors   to go on from, after `kill -9` too
    weights.safetensors   the result, with its training record
    network.onnx          the same for solving, without torch

Several processes, say four:  torchrun --nproc-per-node 4 -m gough.learn.train runs/mine
(the folder of a run that `gough train --prepare` has made).
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from gough import quaternion
from gough.errors import GoughError
from gough.learn.checkpoint import load_state, load_tensors, save_state
from gough.learn.config import TrainConfig
from gough.learn.data import DatasetSpec, dataset
from gough.learn.distributed import Team
from gough.learn.environment import environment
from gough.learn.export import WEIGHTS, export_run
from gough.learn.kinematics import quaternion_to_matrix
from gough.learn.logs import Bar, MetricsFile, TensorBoard
from gough.learn.loss import default_beta, training_loss
from gough.learn.metrics import THRESHOLDS
from gough.learn.models import PoseNetwork, Scaling, build
from gough.learn.optim import SOAP
from gough.learn.sampling import Batch, Stream
from gough.learn.schedule import Clock, learning_rate
from gough.platform import Platform
from gough.whole_file import write_whole

CHECKPOINT, START = "checkpoint.safetensors", "start.safetensors"
TRAIN, TEST, ORDER = 0, 2, 3  # what a stream's samples are for


def train(platform: Platform, config: TrainConfig, folder: str | Path, *, resume: bool = False,
          start: str | Path | None = None, show: bool = True) -> Path:  # fmt: skip
    """Train a first guess; its folder.

    Args:
        folder: of the run; made here, and must not hold another run unless `resume`.
        resume: go on from the folder's checkpoint, with the folder's own configuration.
        start: another run's folder, whose weights are the first of this one.
        show: a progress bar on stderr.

    Raises:
        GoughError: the folder holds a run already, or none to resume.
    """
    folder = Path(folder)
    if not resume:
        prepare(platform, config, folder, start)
    elif not (folder / "config.json").exists():
        raise GoughError(f"{folder}: holds no run to resume; train without --resume to start one")
    return run(folder, show=show)


def prepare(platform: Platform, config: TrainConfig, folder: Path,
            start: str | Path | None = None) -> None:  # fmt: skip
    """Make a run's folder, ready to `run`.

    Raises:
        GoughError: it holds a run already, or `start` holds no weights.
    """
    weights = None if start is None else Path(start) / WEIGHTS
    if weights is not None:
        load_tensors(weights)
    if (folder / "config.json").exists():
        raise GoughError(f"{folder}: holds a run already; resume it, or name another folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GoughError(f"{folder}: cannot be made: {error.strerror}") from None
    if weights is not None:
        write_whole(folder / START, weights.read_bytes())
    platform.save(folder / "platform.toml")
    write_whole(folder / "config.json", config.to_json().encode())


def run(folder: Path, *, show: bool = True) -> Path:
    """Start or go on with the run of a folder, to its end."""
    config = TrainConfig.from_json((folder / "config.json").read_text())
    platform = Platform.load(folder / "platform.toml")
    trainer = Trainer(platform, config, folder)
    trainer.team.join(trainer.device)
    try:
        trainer.fit(show and trainer.team.rank == 0)
    finally:
        trainer.team.leave()
    return folder


class Trainer:
    """The state of a run, and what happens in a step."""

    def __init__(self, platform: Platform, config: TrainConfig, folder: Path) -> None:
        if config.run.threads is not None:
            torch.set_num_threads(config.run.threads)
        self.platform, self.config, self.folder = platform, config, folder
        self.team = Team()
        self.device = _device(config.run.device, self.team.local)
        self.shards = _shards(config, self.team)
        self.beta = default_beta(platform) if config.loss.beta is None else config.loss.beta
        torch.manual_seed(config.run.seed)
        scaling = Scaling.of(platform, config.data.same_assembly)
        self.model = build(config.model.kind, platform, scaling, **config.model.options)
        self.model.to(self.device)
        self.model.cast(getattr(torch, config.run.dtype))
        self.optimiser = _optimiser(config, self.model)
        self.average = self._weights() if config.optimiser.average else {}
        self.stream = Stream(platform, same_assembly=config.data.same_assembly, device=self.device)
        seed = config.run.seed
        self.test = self.stream.batch(config.data.test, seed, TEST)
        self.fixed = None
        if config.data.samples is not None:
            self.fixed = training_rows(platform, config).to(self.device)
        self.clock = Clock(config)
        self.step = 0

    # ---- the loop ---------------------------------------------------------------------

    def fit(self, show: bool) -> None:
        """Train to the end from the last checkpoint, if there is one; export."""
        if (self.folder / CHECKPOINT).exists():
            self._load()
        elif (self.folder / START).exists():
            self._start()
        first = self.team.rank == 0
        bar = Bar(self.platform.unit, show)
        metrics = MetricsFile(self.folder / "metrics.csv", self.step) if first else None
        board = TensorBoard(self.folder) if first else None
        if first:
            text = json.dumps(environment(self.device), indent=2) + "\n"
            write_whole(self.folder / "environment.json", text.encode())
        logged = saved = self.clock.elapsed
        progress = self._progress()
        self.clock.tick()
        while progress < 1:
            loss = self.learn(progress)
            self.clock.tick()
            progress = self._progress()
            if not first:
                continue
            if self.clock.elapsed - logged >= self.config.run.log_every or progress >= 1:
                logged = self.clock.elapsed
                row = self.measure(float(loss), progress)
                assert metrics is not None
                assert board is not None
                metrics.add(row)
                board.add(row)
                bar.update(progress, row, self.clock.remaining(self.step))
            if self.clock.elapsed - saved >= self.config.run.checkpoint_every or progress >= 1:
                saved = self.clock.elapsed
                self.save()
        bar.close()
        if board is not None:
            board.close()
        if first:
            self.use_average()
            export_run(self.model, self.config, self.record(), self.folder)

    def learn(self, progress: float) -> Tensor:
        """One step; the loss before it, averaged over the processes."""
        self.model.train()
        for group in self.optimiser.param_groups:
            group["lr"] = learning_rate(self.config.optimiser, self.step, progress)
        batch = self.samples(self.step)
        loss = training_loss(self.model, batch.legs, batch, self.beta)
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        self.team.average_gradients(self.model)
        self.optimiser.step()
        self.step += 1
        decay = self.config.optimiser.average
        if decay:
            values = [p.detach() for p in self.model.parameters()]
            for kept, value in zip(self.average.values(), values, strict=True):
                kept.lerp_(value, 1 - decay)
        return self.team.mean(loss.detach())

    def samples(self, step: int) -> Batch:
        """This process's samples of a step: every size-th shard, from its rank on."""
        config, seed = self.config.data, self.config.run.seed
        if self.fixed is None:
            mine = range(self.team.rank, self.shards, self.team.size)
            count = config.batch // self.shards
            return Batch.join([self.stream.batch(count, seed, TRAIN, step, i) for i in mine])
        steps = len(self.fixed) // config.batch
        epoch, within = divmod(step, steps)
        order = np.random.default_rng([seed, ORDER, epoch]).permutation(len(self.fixed))
        rows = order[within * config.batch : (within + 1) * config.batch]
        return self.fixed[torch.as_tensor(rows[self.team.rank :: self.team.size])]

    # ---- measured, kept ---------------------------------------------------------------

    @torch.no_grad()
    def measure(self, loss: float, progress: float) -> dict[str, float]:
        """Errors on the test samples, and how the run goes."""
        kept = self._weights() if self.average else None
        self.use_average()
        self.model.eval()
        shift, turn = self.model(self.test.legs)
        cosine = ((turn.mT @ self.test.turn).diagonal(dim1=-2, dim2=-1).sum(-1) - 1) / 2
        sine = torch.linalg.vector_norm((turn - self.test.turn).flatten(1), dim=-1) / 8**0.5
        angle = torch.where(cosine > 0, 2 * sine.clamp(max=1).asin(), cosine.clamp(-1, 1).acos())
        away = torch.linalg.vector_norm(shift - self.test.shift, dim=-1)
        turned = angle.rad2deg()
        ik = self.stream.platform.legs(shift, turn) - self.test.legs
        if kept is not None:
            self._set_weights(kept)
        samples = self.step * self.config.data.batch
        return {
            "step": self.step,
            "seconds": self.clock.elapsed,
            "samples": samples,
            "samples_per_second": samples / max(self.clock.elapsed, 1e-9),
            "lr": learning_rate(self.config.optimiser, self.step, progress),
            "loss": loss,
            "trans": float(away.mean()),
            "rot_deg": float(turned.mean()),
            "ik": float(torch.linalg.vector_norm(ik, dim=-1).mean()),
            **{f"trans_below_{t:g}": float((away < t).double().mean()) for t in THRESHOLDS},
            **{f"rot_below_{t:g}": float((turned < t).double().mean()) for t in THRESHOLDS},
        }

    def record(self) -> dict:
        """What is said about the run wherever its weights go."""
        return {
            "seconds": round(self.clock.elapsed, 1),
            "clock": self.config.run.clock,
            "steps": self.step,
            "samples": self.step * self.config.data.batch,
            "seed": self.config.run.seed,
            "processes": self.team.size,
            "started_from": self._before(),
            "environment": environment(self.device),
            "test": self.measure(float("nan"), 1.0) | {"loss": None},
        }

    def _before(self) -> dict | None:
        """The record of the run whose weights this one started from."""
        if not (self.folder / START).exists():
            return None
        return load_tensors(self.folder / START)[1]["record"]

    def save(self) -> None:
        """Write the checkpoint."""
        facts = {"step": self.step, "elapsed": self.clock.elapsed}
        save_state(self.folder / CHECKPOINT, self.model, self.average, self.optimiser, facts)

    def _load(self) -> None:
        facts = load_state(self.folder / CHECKPOINT, self.model, self.average, self.optimiser)
        self.step, self.clock.elapsed = facts["step"], facts["elapsed"]

    def _start(self) -> None:
        try:
            self.model.load_state_dict(load_tensors(self.folder / START)[0])
        except RuntimeError as error:
            raise GoughError(f"{self.folder / START}: of another network: {error}") from None
        if self.average:
            self.average = self._weights()

    def use_average(self) -> None:
        """Make the averaged weights, if there are any, the model's own."""
        if self.average:
            self._set_weights(self.average)

    def _weights(self) -> dict[str, Tensor]:
        return {n: p.detach().clone() for n, p in self.model.named_parameters()}

    @torch.no_grad()
    def _set_weights(self, weights: dict[str, Tensor]) -> None:
        for name, p in self.model.named_parameters():
            p.copy_(weights[name])

    def _progress(self) -> float:
        return self.team.agree(self.clock.progress(self.step), self.device)


def training_rows(platform: Platform, config: TrainConfig) -> Batch:
    """The first `data.samples` rows of the data set that `gough dataset` writes for this seed."""
    spec = DatasetSpec(config.data.samples or 0, config.run.seed, config.data.same_assembly)
    pose, legs = dataset(platform, spec)
    turn = quaternion.product(platform.home.inverse().wxyz, pose.wxyz)
    shift = pose.position - platform.home.position
    return Batch(torch.tensor(legs), torch.tensor(shift), quaternion_to_matrix(torch.tensor(turn)))


def _optimiser(config: TrainConfig, model: PoseNetwork) -> torch.optim.Optimizer:
    told = config.optimiser
    if told.kind == "soap":
        return SOAP(model.parameters(), lr=told.lr, weight_decay=told.weight_decay)
    kind = torch.optim.AdamW if told.kind == "adamw" else torch.optim.Adam
    return kind(model.parameters(), lr=told.lr, weight_decay=told.weight_decay)


def _device(name: str, local: int) -> torch.device:
    if name == "auto":
        name = f"cuda:{local}" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (RuntimeError, AssertionError) as error:
        raise GoughError(f"run.device: {name!r} cannot be used here: {error}") from None
    return device


def _shards(config: TrainConfig, team: Team) -> int:
    """Parts of a step's samples, the same number for every process."""
    shards = -(-config.run.shards // team.size) * team.size
    if config.data.batch % shards:
        raise GoughError(
            f"data.batch: {config.data.batch} samples cannot be shared by {shards} shards "
            f"({team.size} processes); choose a multiple of {shards}"
        )
    return shards


if __name__ == "__main__":
    run(Path(sys.argv[1]))

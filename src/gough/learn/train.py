"""Training of a first guess: one loop for every network, on one device or several.

`gough.learn.run_folder` lists the files of a run. Several processes, say four, share the samples of
each step and average their gradients:

    gough train -p my.toml -o runs/mine --prepare
    torchrun --nproc-per-node 4 -m gough.learn.train runs/mine
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import roma
import torch
from torch import Tensor

from gough.errors import GoughError
from gough.learn import run_folder as files
from gough.learn.config import TrainConfig
from gough.learn.data import DatasetSpec
from gough.learn.export import export_run
from gough.learn.loss import default_beta, training_loss
from gough.learn.metrics import THRESHOLDS
from gough.learn.models import Scaling, build
from gough.learn.optim import Clock, learning_rate, make_optimiser
from gough.learn.processes import Processes, find_device, shard_count
from gough.learn.run_folder import Log, environment, load_tensors
from gough.learn.sampling import Batch, Stream, fixed_batch
from gough.platform import Platform
from gough.whole_file import write_whole

TRAIN, TEST, ORDER = 0, 2, 3  # keys of the streams of samples


class TrainingStopped(Exception):  # noqa: N818 - a request, not an error
    """A run that was stopped on request, after its checkpoint was written.

    Attributes:
        step: steps done.
        progress: share of the run that is done.
        remaining: estimated time left [s].
    """

    def __init__(self, step: int, progress: float, remaining: float) -> None:
        super().__init__(f"stopped after {step} steps")
        self.step, self.progress, self.remaining = step, progress, remaining


def train(platform: Platform, config: TrainConfig, folder: str | Path, *, resume: bool = False,
          start: str | Path | None = None, show: bool = True,
          stop: Callable[[], bool] = bool) -> Path:  # fmt: skip
    """Train a first guess and return its folder.

    Args:
        platform: the machine; it must state a workspace.
        config: all settings.
        folder: folder of the run; it is made here, and must not hold another run unless `resume`.
        resume: go on from the folder's checkpoint, with the folder's own configuration.
        start: folder of another run, whose weights are the first of this one.
        show: draw a progress bar on standard error.
        stop: asked after each step; True writes a checkpoint and ends the run there.

    Raises:
        GoughError: the folder holds a run already, or none to resume.
        TrainingStopped: `stop` returned True.

    Example:
        >>> train(platform, PRESETS["default"].with_run(budget="2m"), "runs/mine")
    """
    folder = Path(folder)
    if not resume:
        prepare(platform, config, folder, start)
    elif not (folder / files.CONFIG).exists():
        raise GoughError(f"{folder}: holds no run to resume; train without --resume to start one")
    return run(folder, show=show, stop=stop)


def prepare(platform: Platform, config: TrainConfig, folder: Path,
            start: str | Path | None = None) -> None:  # fmt: skip
    """Make a run's folder, ready to `run`.

    Raises:
        GoughError: it holds a run already, or `start` holds no weights.
    """
    weights = None if start is None else Path(start) / files.WEIGHTS
    if weights is not None:
        load_tensors(weights)
    if (folder / files.CONFIG).exists():
        raise GoughError(f"{folder}: holds a run already; resume it, or name another folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GoughError(f"{folder}: cannot be made: {error.strerror}") from None
    if weights is not None:
        write_whole(folder / files.START, weights.read_bytes())
    platform.save(folder / files.PLATFORM)
    write_whole(folder / files.CONFIG, config.to_json().encode())


def run(folder: Path, *, show: bool = True, stop: Callable[[], bool] = bool) -> Path:
    """Start or continue the run of a prepared folder, to its end."""
    config = TrainConfig.from_json((folder / files.CONFIG).read_text())
    trainer = Trainer(Platform.load(folder / files.PLATFORM), config, folder)
    with trainer.processes.joined(trainer.device):
        trainer.fit(show and trainer.processes.rank == 0, stop)
    return folder


class Trainer:
    """State of a run, and the work of a step."""

    def __init__(self, platform: Platform, config: TrainConfig, folder: Path) -> None:
        if config.run.threads is not None:
            torch.set_num_threads(config.run.threads)
        self.platform, self.config, self.folder = platform, config, folder
        self.processes = Processes()
        self.device = find_device(config.run.device, self.processes.local_rank)
        self.shards = shard_count(config, self.processes.count)
        self.beta = default_beta(platform) if config.loss.beta is None else config.loss.beta
        data, seed = config.data, config.run.seed
        torch.manual_seed(seed)
        scaling = Scaling.of(platform, data.same_assembly)
        self.model = build(config.model.kind, platform, scaling, **config.model.options)
        self.model.to(self.device)
        self.model.cast(getattr(torch, config.run.dtype))
        self.optimiser = make_optimiser(config.optimiser, self.model)
        self.average = self._weights() if config.optimiser.average else {}
        self.stream = Stream(platform, same_assembly=data.same_assembly, device=self.device)
        self.test = self.stream.batch(data.test, seed, TEST)
        self.fixed = None
        if data.samples is not None:
            spec = DatasetSpec(data.samples, seed, data.same_assembly)
            self.fixed = fixed_batch(platform, spec).to(self.device)
        self.clock = Clock(config)
        self.step = 0

    # ---- the loop ---------------------------------------------------------------------

    def fit(self, show: bool, stop: Callable[[], bool] = bool) -> None:
        """Train to the end, from the last checkpoint if there is one, and export.

        Raises:
            TrainingStopped: `stop` returned True.
        """
        if (self.folder / files.CHECKPOINT).exists():
            self._load()
        elif (self.folder / files.START).exists():
            self._start()
        first = self.processes.rank == 0
        if not first:
            self._steps(None, stop)
            return
        text = json.dumps(environment(self.device), indent=2) + "\n"
        write_whole(self.folder / files.ENVIRONMENT, text.encode())
        log = Log(self.folder, self.step, self.platform.unit, show)
        try:
            self._steps(log, stop)
        finally:
            log.close()
        self.use_average()
        export_run(self.model, self.config, self.record(), self.folder)

    def _steps(self, log: Log | None, stop: Callable[[], bool]) -> None:
        """All steps that are left; the process with a log measures and writes checkpoints."""
        logged = saved = self.clock.elapsed
        progress = self._progress()
        self.clock.tick()
        while progress < 1:
            loss = self.learn(progress)
            self.clock.tick()
            progress = self._progress()
            if log is None:
                continue
            elapsed, end = self.clock.elapsed, progress >= 1
            if elapsed - logged >= self.config.run.log_every or end:
                logged = elapsed
                remaining = self.clock.remaining(self.step)
                log.add(self.measure(float(loss), progress), progress, remaining)
            stopped = stop() and not end
            if elapsed - saved >= self.config.run.checkpoint_every or end or stopped:
                saved = elapsed
                self.save()
            if stopped:
                raise TrainingStopped(self.step, progress, self.clock.remaining(self.step))

    def learn(self, progress: float) -> Tensor:
        """Take one step and return the loss before it, averaged over the processes."""
        self.model.train()
        for group in self.optimiser.param_groups:
            group["lr"] = learning_rate(self.config.optimiser, self.step, progress)
        batch = self.samples(self.step)
        loss = training_loss(self.model, batch.legs, batch, self.beta)
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        loss = loss.detach()
        grads = [p.grad for p in self.model.parameters() if p.grad is not None]
        self.processes.average([loss, *grads])
        self.optimiser.step()
        self.step += 1
        decay = self.config.optimiser.average
        if decay:
            values = [p.detach() for p in self.model.parameters()]
            for kept, value in zip(self.average.values(), values, strict=True):
                kept.lerp_(value, 1 - decay)
        return loss

    def samples(self, step: int) -> Batch:
        """Draw this process's samples of a step: every count-th shard, from its rank on."""
        data, seed = self.config.data, self.config.run.seed
        rank, processes = self.processes.rank, self.processes.count
        if self.fixed is None:
            count = data.batch // self.shards
            shards = range(rank, self.shards, processes)
            return Batch.join([self.stream.batch(count, seed, TRAIN, step, i) for i in shards])
        epoch, within = divmod(step, len(self.fixed) // data.batch)
        order = np.random.default_rng([seed, ORDER, epoch]).permutation(len(self.fixed))
        rows = order[within * data.batch : (within + 1) * data.batch]
        return self.fixed[torch.as_tensor(rows[rank::processes])]

    # ---- measurements and checkpoints -------------------------------------------------

    @torch.no_grad()
    def measure(self, loss: float, progress: float) -> dict[str, float]:
        """Errors on the test samples, and the state of the run, by the names of `COLUMNS`."""
        kept = self._weights() if self.average else None
        self.use_average()
        self.model.eval()
        translation, rotation = self.model(self.test.legs)
        length = torch.linalg.vector_norm(translation - self.test.translation, dim=-1)
        degrees = roma.rotmat_geodesic_distance(rotation, self.test.rotation).rad2deg()
        machine = self.stream.platform
        ik = machine.leg_lengths(*machine.from_home(translation, rotation)) - self.test.legs
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
            "trans": float(length.mean()),
            "rot_deg": float(degrees.mean()),
            "ik": float(torch.linalg.vector_norm(ik, dim=-1).mean()),
            **{f"trans_below_{t:g}": float((length < t).double().mean()) for t in THRESHOLDS},
            **{f"rot_below_{t:g}": float((degrees < t).double().mean()) for t in THRESHOLDS},
        }

    def record(self) -> dict:
        """The training record that the run's weights carry."""
        start = self.folder / files.START
        return {
            "seconds": round(self.clock.elapsed, 1),
            "clock": self.config.run.clock,
            "steps": self.step,
            "samples": self.step * self.config.data.batch,
            "seed": self.config.run.seed,
            "processes": self.processes.count,
            "started_from": load_tensors(start)[1]["record"] if start.exists() else None,
            "environment": environment(self.device),
            "test": self.measure(float("nan"), 1.0) | {"loss": None},
        }

    def save(self) -> None:
        """Write the checkpoint."""
        facts = {"step": self.step, "elapsed": self.clock.elapsed}
        path = self.folder / files.CHECKPOINT
        files.save_state(path, self.model, self.average, self.optimiser, facts)

    def _load(self) -> None:
        path = self.folder / files.CHECKPOINT
        facts = files.load_state(path, self.model, self.average, self.optimiser)
        self.step, self.clock.elapsed = facts["step"], facts["elapsed"]

    def _start(self) -> None:
        path = self.folder / files.START
        files.load_weights(path, self.model, load_tensors(path)[0])
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
        return self.processes.of_first(self.clock.progress(self.step), self.device)


if __name__ == "__main__":
    run(Path(sys.argv[1]))

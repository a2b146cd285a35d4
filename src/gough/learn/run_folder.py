"""The folder of a training run: checkpoints, measurements, environment, progress bar.

    config.json             the settings (TrainConfig)
    environment.json        versions, machine, git commit
    platform.toml           the platform
    metrics.csv             measurements during the run; TensorBoard's events stand beside it
    checkpoint.safetensors  state to go on from, after `kill -9` too
    weights.safetensors     the result, with its training record
    network.onnx            the same for solving, without PyTorch

Files appear whole or not at all, and none is a pickle.
"""

from __future__ import annotations

import csv
import json
import os
import platform
import subprocess
from pathlib import Path

import numpy
import torch
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn
from torch.optim import Optimizer

import gough
from gough.errors import GoughError
from gough.learn.metrics import THRESHOLDS
from gough.whole_file import write_whole

CONFIG, PLATFORM, ENVIRONMENT = "config.json", "platform.toml", "environment.json"
METRICS, CHECKPOINT, START = "metrics.csv", "checkpoint.safetensors", "start.safetensors"
WEIGHTS, NETWORK = "weights.safetensors", "network.onnx"
COLUMNS = (
    "step",
    "seconds",
    "samples",
    "samples_per_second",
    "lr",
    "loss",
    "trans",
    "rot_deg",
    "ik",
    *(f"trans_below_{t:g}" for t in THRESHOLDS),
    *(f"rot_below_{t:g}" for t in THRESHOLDS),
)


# ---- tensors ------------------------------------------------------------------------------


def save_tensors(path: Path, tensors: dict[str, Tensor], facts: dict) -> None:
    """Write tensors by name, and facts that JSON can hold, as one safetensors file."""
    plain = {name: t.detach().cpu().contiguous() for name, t in tensors.items()}
    write_whole(path, save(plain, {"gough": json.dumps(facts)}))


def load_tensors(path: Path) -> tuple[dict[str, Tensor], dict]:
    """Read the tensors and facts that `save_tensors` wrote.

    Raises:
        GoughError: the file is missing, not whole, or of another kind.
    """
    try:
        with safe_open(path, framework="pt") as file:
            facts = dict(json.loads((file.metadata() or {})["gough"]))
            return {name: file.get_tensor(name) for name in file.keys()}, facts  # noqa: SIM118
    except FileNotFoundError:
        raise GoughError(f"{path}: no such file") from None
    except (SafetensorError, OSError, KeyError, TypeError, ValueError) as error:
        raise GoughError(f"{path}: truncated, corrupt, or not written by gough: {error}") from None


def save_state(path: Path, model: nn.Module, average: dict[str, Tensor], optimiser: Optimizer,
               facts: dict) -> None:  # fmt: skip
    """Write a checkpoint: weights, their average, the optimiser's tensors and numbers, facts."""
    tensors = {f"model/{k}": v for k, v in model.state_dict().items()}
    tensors |= {f"average/{k}": v for k, v in average.items()}
    numbers: dict[str, dict] = {}
    for index, entries in optimiser.state_dict()["state"].items():
        for key, value in entries.items():
            if isinstance(value, Tensor):
                tensors[f"optimiser/{index}/{key}"] = value
            else:
                numbers.setdefault(str(index), {})[key] = value
    save_tensors(path, tensors, facts | {"numbers": numbers})


def load_state(path: Path, model: nn.Module, average: dict[str, Tensor],
               optimiser: Optimizer) -> dict:  # fmt: skip
    """Fill model, average and optimiser from a checkpoint and return its facts.

    Raises:
        GoughError: not a checkpoint, or the checkpoint of another network.
    """
    tensors, facts = load_tensors(path)
    parts: dict[str, dict[str, Tensor]] = {"model": {}, "average": {}, "optimiser": {}}
    try:
        for name, tensor in tensors.items():
            part, _, key = name.partition("/")
            parts[part][key] = tensor
        load_weights(path, model, parts["model"])
        for key, value in average.items():
            value.copy_(parts["average"][key])
        state: dict[int, dict] = {int(i): dict(n) for i, n in facts["numbers"].items()}
        for name, tensor in parts["optimiser"].items():
            index, _, key = name.partition("/")
            state.setdefault(int(index), {})[key] = tensor
        groups = optimiser.state_dict()["param_groups"]
        with torch.no_grad():
            optimiser.load_state_dict({"state": state, "param_groups": groups})
    except (AttributeError, KeyError, RuntimeError, TypeError, ValueError) as error:
        if isinstance(error, GoughError):
            raise
        raise GoughError(f"{path}: not a checkpoint of this run: {_one_line(error)}") from None
    return facts


def load_weights(path: Path, model: nn.Module, weights: dict[str, Tensor]) -> None:
    """Fill a model with weights that were read from `path`.

    Raises:
        GoughError: the weights are of another network.
    """
    try:
        model.load_state_dict(weights)
    except RuntimeError as error:
        raise GoughError(f"{path}: of another network: {_one_line(error)}") from None


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


# ---- measurements -------------------------------------------------------------------------


class Log:
    """Measurements of a run: a line of `metrics.csv`, TensorBoard's events, a progress bar.

    A resumed run goes on after the line of its checkpoint. TensorBoard's events are written where
    the package tensorboard is installed.
    """

    def __init__(self, folder: Path, last_step: int, unit: str, show: bool) -> None:
        self.path, self._unit = folder / METRICS, unit
        rows: list[dict] = []
        if self.path.exists():
            with self.path.open(newline="") as file:
                rows = [r for r in csv.DictReader(file) if _step(r) <= last_step]
        with self.path.open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore")
            writer.writeheader()
            writer.writerows(rows)
        self._board = _tensorboard(folder)
        columns = (
            BarColumn(),
            TextColumn("{task.percentage:5.1f} %"),
            TextColumn("{task.fields[text]}"),
        )
        self._bar = Progress(*columns, console=Console(stderr=True), disable=not show)
        self._task = self._bar.add_task("train", total=1.0, text="")
        self._bar.start()

    def add(self, row: dict[str, float], progress: float, remaining: float) -> None:
        """Write one measurement, and show it with the time left [s]."""
        with self.path.open("a", newline="") as file:
            csv.writer(file).writerow([f"{row[c]:.9g}" for c in COLUMNS])
        if self._board is not None:
            for name in COLUMNS[3:]:
                self._board.add_scalar(name, row[name], int(row["step"]))
        text = (
            f"loss {row['loss']:.4g}  t {row['trans']:.4g} {self._unit}  "
            f"R {row['rot_deg']:.4g} deg  {row['samples_per_second']:,.0f}/s  "
            f"{duration(remaining)} left"
        )
        self._bar.update(self._task, completed=progress, text=text)

    def close(self) -> None:
        """Write what is buffered and leave the bar as it is."""
        self._bar.stop()
        if self._board is not None:
            self._board.close()


def _tensorboard(folder: Path):
    """A writer of TensorBoard's events, None where the package is missing."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        return None
    return SummaryWriter(str(folder), flush_secs=30)


def _step(row: dict) -> float:
    """Step of a line of measurements; infinity for a line that was cut off."""
    try:
        return float(row["step"]) if row[COLUMNS[-1]] is not None else float("inf")
    except (KeyError, TypeError, ValueError):
        return float("inf")


def duration(seconds: float) -> str:
    """A time as 1:02:03 or 2:03; "?" where it is NaN."""
    if seconds != seconds:
        return "?"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


# ---- environment --------------------------------------------------------------------------


def environment(device: torch.device) -> dict:
    """Versions, machine and git commit: what is needed to repeat a run."""
    facts = {
        "gough": gough.__version__,
        "python": platform.python_version(),
        "torch": torch.__version__,
        "numpy": numpy.__version__,
        "system": platform.system(),
        "machine": platform.machine(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "threads": torch.get_num_threads(),
        "device": str(device),
        "commit": _commit(),
    }
    if device.type == "cuda":
        facts["gpu"] = torch.cuda.get_device_name(device)
    return facts


def _processor() -> str:
    """The CPU's name."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(
            line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")
        )
    except (OSError, StopIteration):
        return platform.processor()


def _commit() -> str | None:
    """The git commit of the package's code, with + where files were changed since."""
    here = Path(__file__).parent
    run = lambda *args: subprocess.run(  # noqa: E731
        ["git", "-C", str(here), *args], capture_output=True, text=True, timeout=10, check=True
    ).stdout.strip()
    try:
        return run("rev-parse", "HEAD") + ("+" if run("status", "--porcelain", "-uno") else "")
    except (OSError, subprocess.SubprocessError):
        return None

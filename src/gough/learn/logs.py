"""What a run writes while it runs: CSV, TensorBoard, a progress bar."""

from __future__ import annotations

import csv
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from gough.learn.metrics import THRESHOLDS

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


class MetricsFile:
    """`metrics.csv`, one line per measurement; a resumed run goes on after its checkpoint."""

    def __init__(self, path: Path, last_step: int) -> None:
        self.path = path
        rows: list[dict] = []
        if path.exists():
            with path.open(newline="") as file:
                rows = [r for r in csv.DictReader(file) if _step(r) <= last_step]
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore")
            writer.writeheader()
            writer.writerows(rows)

    def add(self, row: dict[str, float]) -> None:
        """Append one line."""
        with self.path.open("a", newline="") as file:
            csv.writer(file).writerow([f"{row[c]:.9g}" for c in COLUMNS])


def _step(row: dict) -> float:
    """Its step; beyond all others for a line that was cut off."""
    try:
        return float(row["step"]) if row[COLUMNS[-1]] is not None else float("inf")
    except (KeyError, TypeError, ValueError):
        return float("inf")


class TensorBoard:
    """Event files, if the package tensorboard is installed."""

    def __init__(self, folder: Path) -> None:
        try:
            from torch.utils.tensorboard import SummaryWriter
        except ImportError:
            self._writer = None
        else:
            self._writer = SummaryWriter(str(folder), flush_secs=30)

    def add(self, row: dict[str, float]) -> None:
        """All numbers of one measurement, against the step."""
        if self._writer is not None:
            for name in COLUMNS[3:]:
                self._writer.add_scalar(name, row[name], int(row["step"]))

    def close(self) -> None:
        """Write what is left."""
        if self._writer is not None:
            self._writer.close()


class Bar:
    """The progress bar: share done, errors, samples per second, time left."""

    def __init__(self, unit: str, show: bool) -> None:
        self._unit = unit
        columns = (
            BarColumn(),
            TextColumn("{task.percentage:5.1f} %"),
            TextColumn("{task.fields[text]}"),
        )
        self._progress = Progress(*columns, console=Console(stderr=True), disable=not show)
        self._task = self._progress.add_task("train", total=1.0, text="")
        self._progress.start()

    def update(self, progress: float, row: dict[str, float], remaining: float) -> None:
        """Show the last measurement."""
        text = (
            f"loss {row['loss']:.4g}  t {row['trans']:.4g} {self._unit}  "
            f"R {row['rot_deg']:.4g} deg  {row['samples_per_second']:,.0f}/s  "
            f"{clock(remaining)} left"
        )
        self._progress.update(self._task, completed=progress, text=text)

    def close(self) -> None:
        """Leave the last state on the screen."""
        self._progress.stop()


def clock(seconds: float) -> str:
    """1:02:03 or 2:03; ? for a time that is not known."""
    if seconds != seconds:
        return "?"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"

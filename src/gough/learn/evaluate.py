"""First guesses side by side, over held-out poses: `gough evaluate`."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.fk.solve import solve
from gough.learn.data import DatasetSpec, dataset
from gough.learn.metrics import THRESHOLDS, Metrics, measure
from gough.learn.models.polynomial import PolynomialGuess
from gough.learn.outcomes import Outcome, outcome, same_pose
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.base import Seed, find_seed
from gough.seeds.network import find_network, shipped_names

HELD_OUT = 20_240_314  # seed of the test poses, which no training uses
DEGREES = (3, 5, 7)


@dataclass(frozen=True)
class Row:
    """What one first guess reached.

    Attributes:
        parameters: numbers stored; None where that means nothing.
        seconds: time that training or fitting took.
        seed: of that training.
        per_thousand: seconds for 1000 guesses, in one call, on this machine.
        outcome: where plain Newton ends, with no second try.
        wrong: rows that `gough.solve` from this guess, with all its tries, does not end at the
            true pose.
    """

    name: str
    parameters: int | None
    seconds: float | None
    seed: int | None
    per_thousand: float
    metrics: Metrics
    outcome: Outcome
    wrong: int


def default_names(platform: Platform) -> list[str]:
    """Home, Taylor series, polynomials, and all networks that come for this platform."""
    fitted = [f"polynomial-{d}" for d in DEGREES]
    return ["home", "taylor-2", *fitted, "universal", *shipped_names(platform)]


def held_out(platform: Platform, count: int, same_assembly: bool) -> tuple[Pose, Array]:
    """The test poses (count,) and their readings (count, 6)."""
    return dataset(platform, DatasetSpec(count, HELD_OUT, same_assembly))


def evaluate(platform: Platform, names: Sequence[str], *, poses: int = 100_000,
             same_assembly: bool = False) -> list[Row]:  # fmt: skip
    """Errors, and where Newton's method ends, of first guesses by name.

    Args:
        names: "home", "polynomial-3" (any degree to 8), a network that comes with the package, a
            run's folder or a .onnx file.
        poses: how many held-out poses.
        same_assembly: only poses with det J of home's sign.

    Raises:
        GoughError: a name that stands for nothing.
    """
    truth, legs = held_out(platform, poses, same_assembly)
    return [_row(platform, name, truth, legs, same_assembly) for name in names]


def _row(platform: Platform, name: str, truth: Pose, legs: Array, same_assembly: bool) -> Row:
    seed, parameters, seconds, number = _seed(platform, name, same_assembly)
    guess = seed.guess(legs)
    solved = solve(platform, legs, seed=seed).pose
    return Row(
        name, parameters, seconds, number, per_thousand(seed, legs),
        measure(platform, guess, truth, legs), outcome(platform, guess, truth, legs),
        int(np.sum(~same_pose(platform, solved, truth))),
    )  # fmt: skip


def _seed(platform: Platform, name: str, same_assembly: bool) -> tuple:
    """The first guess of a name; its parameters, training time and seed."""
    if name == "home" or name.startswith("taylor-"):
        return find_seed(platform, name), None, None, None
    if name.startswith("polynomial-"):
        degree = name.removeprefix("polynomial-")
        if not degree.isdigit():
            raise GoughError(f"{name}: expected a degree, such as polynomial-5")
        fitted = PolynomialGuess(platform, int(degree), same_assembly=same_assembly)
        return fitted, fitted.parameters, fitted.seconds, 0
    seed = find_network(platform, name)
    record = seed.facts["record"]
    return seed, seed.facts["parameters"], training_time(record), record["seed"]


def training_time(record: dict) -> float:
    """Seconds of a run and of those before it, whose weights it started from."""
    before = record.get("started_from")
    return record["seconds"] + (training_time(before) if before else 0.0)


def per_thousand(seed: Seed, legs: Array, repeats: int = 7) -> float:
    """Seconds for 1000 guesses in one call: the median of several."""
    some = legs[np.arange(1000) % len(legs)]
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        seed.guess(some)
        times.append(time.perf_counter() - began)
    return float(np.median(times))


def train_peers(platform: Platform, folder: Path, budget: str, *, seed: int = 0,
                threads: int | None = None) -> list[str]:  # fmt: skip
    """Train every network for the same processor time, by the default recipe; their folders.

    Runs that the folder holds already are finished, not repeated.
    """
    from dataclasses import replace

    from gough.learn.config import PRESETS, ModelConfig
    from gough.learn.export import NETWORK
    from gough.learn.models import MODELS
    from gough.learn.train import train

    out = []
    for kind in MODELS:
        config = replace(PRESETS["default"], model=ModelConfig(kind))  # pyright: ignore
        config = config.with_run(budget=budget, clock="processor", seed=seed, threads=threads)
        run = folder / kind
        if not (run / NETWORK).exists():
            train(platform, config, run, resume=(run / "config.json").exists())
        out.append(str(run))
    return out


# ---- shown --------------------------------------------------------------------------------


def table(platform: Platform, rows: Sequence[Row]):
    """A rich table of the rows."""
    from rich.table import Table

    unit = platform.unit or "unit"
    out = Table(title=f"First guesses, {platform.name}, {rows[0].metrics.count:,} held-out poses")
    columns = (
        "first guess", "numbers", "trained s", "seed", f"E-trans {unit}", "median", "worst",
        f"<{THRESHOLDS[1]:g} {unit} %", "E-rot deg", "worst deg", "E-rot paper's", "E-ik",
        "Newton: true %", "other", "twins", "not conv.", "solve: wrong", "1000 guesses ms",
    )  # fmt: skip
    for i, column in enumerate(columns):
        out.add_column(column, justify="left" if i == 0 else "right", no_wrap=i == 0)
    for row in rows:
        out.add_row(*_cells(row))
    return out


def _cells(row: Row) -> list[str]:
    m, o = row.metrics, row.outcome
    ends = [f"{100 * o.share:.4f}", str(o.other), str(o.twins), str(o.unconverged), str(row.wrong)]
    name = Path(row.name).name if "/" in row.name else row.name
    optional = [
        "-" if v is None else f"{v:{spec}}"
        for v, spec in ((row.parameters, ",d"), (row.seconds, ",.1f"), (row.seed, "d"))
    ]
    errors = [m.trans_mean, m.trans_median, m.trans_worst]
    turns = [m.rot_mean, m.rot_worst, m.rot_frobenius, m.ik_mean]
    return [
        name, *optional, *(f"{v:.4g}" for v in errors), f"{100 * m.trans_within[1]:.2f}",
        *(f"{v:.4g}" for v in turns), *ends, f"{1e3 * row.per_thousand:.2f}",
    ]  # fmt: skip


def to_json(rows: Sequence[Row]) -> str:
    """All numbers of the rows."""
    return json.dumps([asdict(row) for row in rows], indent=2) + "\n"

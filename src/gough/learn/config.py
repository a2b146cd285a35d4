"""Settings of a training run, one frozen dataclass per concern.

The same objects are the API, the command line (by tyro) and the file `config.json`.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

from gough.errors import GoughError

Kind = Literal[
    "resmlp", "disgnet", "disgnet-linear", "plain-mlp", "wise-mlp", "gcn", "graphmlp"
]  # fmt: skip
UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0}


@dataclass(frozen=True)
class ModelConfig:
    """Network."""

    kind: Kind = "resmlp"
    """Name of the network."""
    options: dict[str, int] = field(default_factory=dict)
    """Options of the network, such as `width 96`; its class lists them."""


@dataclass(frozen=True)
class DataConfig:
    """Training data."""

    batch: int = 500
    """Samples per step, over all processes together."""
    samples: int | None = None
    """Size of a fixed training set; without it every step draws fresh samples."""
    same_assembly: bool = False
    """Leave out poses beyond a singularity (det J not of home's sign)."""
    test: int = 2000
    """Number of samples that the errors are measured on during the training."""


@dataclass(frozen=True)
class LossConfig:
    """Loss weights."""

    beta: float | None = None
    """Weight of the rotation [platform unit]; 0.3 of the platform's size unless given."""


@dataclass(frozen=True)
class OptimiserConfig:
    """Optimizer settings."""

    kind: Literal["soap", "adam", "adamw"] = "soap"
    """Optimizer."""
    lr: float = 5e-3
    """Highest learning rate."""
    weight_decay: float = 0.0
    """Decoupled weight decay."""
    schedule: Literal["falling", "constant"] = "falling"
    """falling: after the share `hold` of the run the rate falls, to zero at the end."""
    power: float = 2.0
    """The rate falls as this power of the time left; 1 is linear."""
    warmup: int = 200
    """Steps over which the rate rises from zero, at most 5 % of the run."""
    hold: float = 0.3
    """Share of the run during which the rate is constant."""
    refresh: int = 10
    """Steps between refreshes of SOAP's bases."""
    average: float = 0.0
    """Decay of an exponential average of the weights, which becomes the result; 0: no average."""


@dataclass(frozen=True)
class RunConfig:
    """Length, device and random seed of the run."""

    budget: str | None = None
    """Time to train, such as 90s, 30m or 2h; the schedule adapts to it."""
    clock: Literal["wall", "processor"] = "wall"
    """Clock of the budget: time, or this process's processor time (for a shared machine)."""
    steps: int | None = None
    """Number of steps instead of a budget; such a run can be repeated bit for bit."""
    epochs: int | None = None
    """Number of passes over a fixed training set, instead of steps."""
    seed: int = 0
    """Seed of the first weights and of the samples."""
    device: str = "auto"
    """auto, cpu, cuda or cuda:1; auto takes a GPU if there is one."""
    threads: int | None = None
    """CPU threads; PyTorch's default unless given."""
    dtype: Literal["float32", "float64"] = "float32"
    """Precision of the weights."""
    shards: int = 1
    """Number of parts that a step's samples are drawn in; at least the number of processes."""
    checkpoint_every: float = 120.0
    """Seconds between checkpoints."""
    log_every: float = 10.0
    """Seconds between lines of metrics."""


@dataclass(frozen=True)
class TrainConfig:
    """All settings of a run."""

    model: ModelConfig = ModelConfig()
    data: DataConfig = DataConfig()
    loss: LossConfig = LossConfig()
    optimiser: OptimiserConfig = OptimiserConfig()
    run: RunConfig = RunConfig()

    def __post_init__(self) -> None:
        given = [n for n in ("budget", "steps", "epochs") if getattr(self.run, n) is not None]
        if len(given) > 1:
            raise GoughError(
                f"run: give one of budget, steps and epochs, not {' and '.join(given)}"
            )
        if self.run.budget is not None:
            seconds(self.run.budget)
        if self.run.epochs is not None and self.data.samples is None:
            raise GoughError("run.epochs: fresh samples have no epochs; give data.samples or steps")
        for name, value, least in (
            ("data.batch", self.data.batch, 1),
            ("run.shards", self.run.shards, 1),
            ("run.steps", self.run.steps, 1),
            ("run.epochs", self.run.epochs, 1),
            ("data.samples", self.data.samples, self.data.batch),
        ):
            if value is not None and value < least:
                raise GoughError(f"{name}: expected {least} or more, got {value}")
        if not 0 <= self.optimiser.hold <= 1:
            raise GoughError(f"optimiser.hold: expected 0 to 1, got {self.optimiser.hold}")

    def total_steps(self) -> int | None:
        """Number of steps of the run, None under a budget."""
        if self.run.epochs is not None and self.data.samples is not None:
            return self.run.epochs * (self.data.samples // self.data.batch)
        return self.run.steps

    def with_run(self, **changes: Any) -> TrainConfig:
        """Copy with other settings of the run; a new length replaces the old one."""
        lengths = {"budget", "steps", "epochs"}
        if lengths & changes.keys():
            changes = dict.fromkeys(lengths) | changes
        return replace(self, run=replace(self.run, **changes))

    def to_json(self) -> str:
        """Write the text of `config.json`."""
        return json.dumps(asdict(self), indent=2) + "\n"

    @classmethod
    def from_json(cls, text: str) -> TrainConfig:
        """Read the text of `config.json`.

        Raises:
            GoughError: the text is no training configuration.
        """
        try:
            facts = json.loads(text)
            parts = {"model": ModelConfig, "data": DataConfig, "loss": LossConfig}
            parts |= {"optimiser": OptimiserConfig, "run": RunConfig}
            return cls(**{name: kind(**facts[name]) for name, kind in parts.items()})
        except (json.JSONDecodeError, KeyError, TypeError) as error:
            raise GoughError(f"config.json: not a training configuration: {error}") from None


def seconds(text: str) -> float:
    """Convert a time such as "90s", "30m", "1.5h" or "45" to seconds.

    Raises:
        GoughError: not a time above zero.
    """
    number, unit = (text[:-1], text[-1]) if text[-1:] in UNITS else (text, "s")
    try:
        value = float(number) * UNITS[unit]
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise GoughError(f"budget: expected a time such as 90s, 30m or 2h, got {text!r}")
    return value


PRESETS: dict[str, TrainConfig] = {
    "default": TrainConfig(run=RunConfig(budget="10m")),
    "disgnet": TrainConfig(
        model=ModelConfig("disgnet"),
        data=DataConfig(batch=1000),
        optimiser=OptimiserConfig(refresh=30),
        run=RunConfig(budget="25m"),
    ),
    "wide": TrainConfig(data=DataConfig(same_assembly=True), run=RunConfig(budget="15m")),
    "paper": TrainConfig(
        model=ModelConfig("disgnet"),
        data=DataConfig(batch=4000, samples=400_000),
        loss=LossConfig(beta=250.0),
        optimiser=OptimiserConfig("adam", 1e-3, schedule="constant", warmup=0),
        run=RunConfig(epochs=1200),
    ),
}

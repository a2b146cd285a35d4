"""How far a run is, and how fast it learns there."""

from __future__ import annotations

import time
from typing import Protocol

from gough.learn.config import OptimiserConfig, RunConfig, seconds

RESERVE = 0.03  # share of a budget kept for the last checkpoint and the export,
MOST_RESERVED = 10.0  # at most so many seconds
LONGEST_WARMUP = 0.05  # share of a run after which the rate has risen, however few its steps


def learning_rate(config: OptimiserConfig, step: int, progress: float) -> float:
    """The rate of step number `step`, counted from 0, with `progress` in 0..1 of the run done."""
    rate = config.lr
    if config.warmup:
        rate *= min(1.0, max((step + 1) / config.warmup, progress / LONGEST_WARMUP))
    if config.schedule == "falling" and progress > config.hold:
        rate *= max(0.0, (1 - progress) / (1 - config.hold)) ** config.power
    return rate


class Lasting(Protocol):
    """Settings that state how long a run lasts."""

    @property
    def run(self) -> RunConfig:
        """Its budget and clock."""
        ...

    def total_steps(self) -> int | None:
        """Steps of the run, None under a budget."""
        ...


class Clock:
    """Progress by steps, or by time under a budget.

    Time is counted step by step, and no step counts for more than 20 typical ones (at least a
    second): a machine that slept, or a process that was stopped, loses only the time it slept.

    Attributes:
        elapsed: seconds trained so far, over all resumptions, by the configuration's clock.
    """

    def __init__(self, config: Lasting) -> None:
        self.total = config.total_steps()
        self.budget = None
        if self.total is None:
            whole = seconds(config.run.budget or "10m")
            self.budget = whole - min(RESERVE * whole, MOST_RESERVED)
        self.elapsed = 0.0
        self._now = time.process_time if config.run.clock == "processor" else time.monotonic
        self._typical = 0.0
        self._last = self._now()

    def progress(self, step: int) -> float:
        """Share of the run done when `step` steps are, 1 at its end."""
        if self.total is not None:
            return min(1.0, step / self.total)
        assert self.budget is not None
        return min(1.0, self.elapsed / self.budget)

    def remaining(self, step: int) -> float:
        """Seconds left, estimated."""
        done = self.progress(step)
        return self.elapsed * (1 - done) / done if done > 0 else float("nan")

    def tick(self) -> None:
        """Count the time since the last call."""
        now = self._now()
        passed = now - self._last
        self._last = now
        self.elapsed += min(passed, max(1.0, 20 * self._typical)) if self._typical else passed
        self._typical += 0.05 * (min(passed, 20 * self._typical or passed) - self._typical)

"""What became of the rows of a file."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.pose import Pose
from gough.status import Outcome

NAMED = 5  # invalid rows that are described one by one


@dataclass
class Report:
    """Counts over a whole file, and its first rows.

    Attributes:
        outcomes: the ends a row can come to; status numbers are indices here.
        counts: how many rows came to each.
        worst: the largest residual in each [platform unit].
        invalid: the first few invalid rows: where, and what is wrong.
        pose, legs, status: the first rows themselves, as many as were asked for.
        seconds: time taken by the rows.
        preparing: time taken before them, to compile the solver and to fit its seed.
    """

    outcomes: tuple[Outcome, ...]
    head: int = 0
    counts: NDArray[np.int64] = field(init=False)
    worst: Array = field(init=False)
    invalid: list[str] = field(default_factory=list)
    pose: Pose = field(default_factory=lambda: Pose(np.empty((0, 3))))
    legs: Array = field(default_factory=lambda: np.empty((0, 6)))
    status: NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, np.uint8))
    seconds: float = 0.0
    preparing: float = 0.0

    def __post_init__(self) -> None:
        self.counts = np.zeros(len(self.outcomes), np.int64)
        self.worst = np.full(len(self.outcomes), np.nan)
        self._start = time.perf_counter()

    def start(self) -> None:
        """Begin to count the rows' time; what went before is `preparing`."""
        self.preparing = time.perf_counter() - self._start
        self._start = time.perf_counter()

    @property
    def rows(self) -> int:
        """Rows in all."""
        return int(self.counts.sum())

    @property
    def failures(self) -> int:
        """Rows whose answer cannot be used."""
        return sum(int(n) for n, o in zip(self.counts, self.outcomes, strict=True) if not o.usable)

    def add(
        self,
        pose: Pose,
        legs: Array,
        status: NDArray[np.uint8],
        residual: Array | None = None,
    ) -> None:
        """Count a block of rows."""
        self.counts += np.bincount(status, minlength=len(self.outcomes))
        if residual is not None:
            for number in np.unique(status):
                found = np.append(residual[status == number], self.worst[number])
                found = found[~np.isnan(found)]
                self.worst[number] = found.max() if len(found) else np.nan
        room = self.head - len(self.status)
        if room > 0:
            part = slice(0, room)
            self.pose = Pose(
                np.concatenate([self.pose.position, pose.position[part]]),
                np.concatenate([self.pose.wxyz, pose.wxyz[part]]),
            )
            self.legs = np.concatenate([self.legs, legs[part]])
            self.status = np.concatenate([self.status, status[part]])
        self.seconds = time.perf_counter() - self._start

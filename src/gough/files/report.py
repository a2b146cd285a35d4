"""Counts of the rows of a file by status, and the first rows."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gough import compiling
from gough.checks import Array
from gough.errors import GoughError
from gough.files.rows import Block
from gough.pose import Pose
from gough.status import Event, Outcome

if TYPE_CHECKING:
    from gough.margins import Limits

DESCRIBED = 5  # invalid rows that are described one by one


@dataclass
class Report:
    """Counts over a whole file, and its first rows.

    Attributes:
        outcomes: the statuses; those of rows are indices here.
        head: how many of the first rows to hold.
        counts: rows of each status.
        worst: largest residual of each status [platform unit], NaN where there is none.
        invalid: place and fault of each of the first few invalid rows.
        unlikely: place and likely cause of the first few rows that no pose can have.
        events: rows of each `Event`, where rows were followed one after another.
        held: rows with a usable status whose pose was not taken for their event.
        time: a column of times that the rows were not followed by, or "".
        pose, legs, status, event: the first rows, at most `head`; no events where there are none.
        seconds: time taken by the rows.
        frame: whose poses those are, such as "tool in work"; "" for the platform's.
        margin, limit: of the first rows, share that is left of the tightest limit and its name;
            None where limits are not asked for.
        broken: usable rows beyond a limit.
        tightest: least share that a usable row leaves of a limit, and the limit's name.
        compiling: time taken by compiling the solver, which is not in `seconds`.
    """

    outcomes: tuple[Outcome, ...]
    head: int = 0
    frame: str = ""
    counts: NDArray[np.int64] = field(init=False)
    worst: Array = field(init=False)
    invalid: list[str] = field(default_factory=list)
    unlikely: list[str] = field(default_factory=list)
    events: NDArray[np.int64] | None = None
    held: int = 0
    time: str = ""
    pose: Pose = field(default_factory=lambda: Pose(np.empty((0, 3))))
    legs: Array = field(default_factory=lambda: np.empty((0, 6)))
    status: NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, np.uint8))
    event: NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, np.uint8))
    margin: Array | None = None
    limit: list[str] = field(default_factory=list)
    broken: int = 0
    tightest: tuple[float, str] = (np.inf, "")
    seconds: float = 0.0
    compiling: float = 0.0

    def __post_init__(self) -> None:
        if self.head < 0:
            raise GoughError(f"head: expected 0 or more rows, found {self.head}")
        self.counts = np.zeros(len(self.outcomes), np.int64)
        self.worst = np.full(len(self.outcomes), np.nan)
        self._compiled_before = compiling.seconds()
        self.start()

    def start(self) -> None:
        """Begin to count the rows' time."""
        self._start = time.perf_counter() - compiling.seconds()

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.counts.sum())

    @property
    def failures(self) -> int:
        """Number of rows whose result cannot be used."""
        unusable = [not outcome.usable for outcome in self.outcomes]
        return int(self.counts[unusable].sum()) + self.held

    def add(
        self,
        pose: Pose,
        legs: Array,
        status: NDArray[np.uint8],
        residual: Array | None = None,
        event: NDArray[np.uint8] | None = None,
    ) -> None:
        """Count a block of rows."""
        if event is not None:
            counts = np.bincount(event, minlength=len(Event))
            self.events = counts if self.events is None else self.events + counts
            usable = np.array([outcome.usable for outcome in self.outcomes])[status]
            new = np.array([event.usable for event in Event])[event]
            self.held += int(np.sum(usable & ~new))
        counts = self.count(status)
        if residual is not None:
            for number in np.flatnonzero(counts):
                found = np.fmax.reduce(residual[status == number])
                self.worst[number] = np.fmax(self.worst[number], found)
        part = slice(0, max(self.head - len(self.status), 0))
        self.pose = Pose.trusted(
            np.concatenate([self.pose.position, pose.position[part]]),
            np.concatenate([self.pose.wxyz, pose.wxyz[part]]),
        )
        self.legs = np.concatenate([self.legs, legs[part]])
        if event is not None:
            self.event = np.concatenate([self.event, event[part]])
        self.status = np.concatenate([self.status, status[part]])

    def count(self, status: NDArray[np.uint8]) -> NDArray[np.int64]:
        """Count a block of rows by status alone; return its counts."""
        counts = np.bincount(status, minlength=len(self.outcomes))
        self.counts += counts
        self.compiling = compiling.seconds() - self._compiled_before
        self.seconds = time.perf_counter() - compiling.seconds() - self._start
        return counts

    def add_limits(self, limits: Limits, status: NDArray[np.uint8]) -> None:
        """Count the limits that rows of a block break; it comes before `add`."""
        usable = np.isin(status, [i for i, outcome in enumerate(self.outcomes) if outcome.usable])
        share = np.where(usable, limits.tightest, np.nan)
        self.broken += int(np.sum(usable & ~limits.ok))
        if np.any(share < self.tightest[0]):
            row = int(np.nanargmin(share))
            self.tightest = float(share[row]), str(limits.limit[row])
        part = slice(0, max(self.head - len(self.status), 0))
        kept = [] if self.margin is None else self.margin
        self.margin = np.concatenate([kept, limits.tightest[part]])
        self.limit += limits.limit[part].tolist()

    def describe_invalid(
        self, block: Block, rows: NDArray[np.bool_], fault: Callable[[int], str]
    ) -> None:
        """Describe the first few invalid rows of the file.

        Args:
            block: the rows' block.
            rows: (N,), True for its invalid rows.
            fault: gives the fault of a row that could be read.
        """
        for row in map(int, np.flatnonzero(rows)[: DESCRIBED - len(self.invalid)]):
            self.invalid.append(f"{block.place(row)}: {block.bad.get(row) or fault(row)}")

    def describe_unlikely(
        self, block: Block, rows: NDArray[np.bool_], cause: Callable[[int], str]
    ) -> None:
        """Describe the first few rows of the file that have no pose for a likely cause.

        Args:
            block: the rows' block.
            rows: (N,), True for rows that no pose has.
            cause: gives the likely cause, "" where none is known.
        """
        for row in map(int, np.flatnonzero(rows)):
            if len(self.unlikely) == DESCRIBED:
                return
            if text := cause(row):
                self.unlikely.append(f"{block.place(row)}: {text}")

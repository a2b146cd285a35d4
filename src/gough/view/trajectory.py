"""A file of poses or readings as a trajectory to look at, of a bounded number of rows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.columns import LEGS, checked, pose_or_leg_columns
from gough.errors import GoughError, InputError
from gough.files.metadata import check_same
from gough.files.placing import PLACED, placed
from gough.files.source import Reading, Source, open_source
from gough.kinematics import leg_lengths
from gough.platform import Platform
from gough.pose import Pose, poses_from_columns
from gough.view.follow import has_pose
from gough.view.model import Answer

ROWS_A_SECOND = 30.0  # at which a file without times is played


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Rows of a file, evenly spread over it.

    Attributes:
        name: the file's name.
        of: "poses" or "leg readings", what the file holds.
        number: (N,) rows' numbers in the file, from 1.
        total: rows in the file.
        time: (N,) [s], rising; from the file if `timed`, else 30 rows of the file a second.
        pose: batch (N,). legs: (N, 6). NaN where there is none.
        answers: what is known about each.
    """

    name: str
    of: str
    number: Array
    total: int
    time: Array
    timed: bool
    pose: Pose
    legs: Array
    answers: list[Answer]

    def __len__(self) -> int:
        return len(self.number)

    @property
    def failures(self) -> int:
        """Rows without a pose to show."""
        return sum(not answer.reached for answer in self.answers)

    @property
    def about(self) -> str:
        """What is shown of which file, in a sentence."""
        rows = f"{self.total:,} rows of {self.of}"
        if len(self) < self.total:
            step = int(self.number[1] - self.number[0])
            rows += f", of which every {step:,}th is shown"
        failed = f"; {self.failures:,} of the shown rows have no pose" if self.failures else ""
        return f"{self.name}: {rows}{failed}."

    @property
    def pace(self) -> str:
        """What playing at 1x means."""
        return "1x: as fast as it was" if self.timed else f"1x: {ROWS_A_SECOND:.0f} rows a second"

    def where(self, row: int) -> str:
        """Which row of the file is shown, and its time."""
        time = f", {self.time[row]:.6g} s" if self.timed else ""
        return f"row {self.number[row]:,.0f} of {self.total:,}{time}"


class Thin:
    """Keeps at most `most` rows of a stream of unknown length, evenly spread over it."""

    def __init__(self, most: int) -> None:
        self._most, self._step, self._seen = most, 1, 0
        self._kept: list[NDArray[np.floating]] = []
        self._held = 0

    def add(self, values: Array) -> None:
        """Rows (n, K) of the stream."""
        number = self._seen + np.arange(len(values))
        rows = np.column_stack([number + 1.0, values])
        self._seen += len(values)
        self._hold(rows[number % self._step == 0])

    def _hold(self, rows: NDArray[np.floating]) -> None:
        self._kept.append(rows)
        self._held += len(rows)
        while self._held > self._most:
            self._step *= 2
            every = np.concatenate(self._kept)
            self._kept = [every[(every[:, 0] - 1) % self._step == 0]]
            self._held = len(self._kept[0])

    @property
    def rows(self) -> tuple[Array, Array, int]:
        """Numbers (N,) from 1, values (N, K), and how many rows there were in all."""
        every = np.concatenate(self._kept, dtype=np.float64)
        return every[:, 0], every[:, 1:], self._seen


def read(
    path: str | Path,
    platform: Platform,
    *,
    rows: int,
    time: str | None = None,
    reading: Reading = Reading(),  # noqa: B008 - frozen
) -> Trajectory:
    """A file of poses or of leg readings; of one that holds both, the poses.

    Args:
        rows: at most so many are kept, evenly spread.
        time: a column of rising times [s].

    Raises:
        GoughError: what is wrong with the file, where, and what to do.
    """
    if rows < 2:
        raise GoughError(f"--rows {rows}: expected 2 or more")
    with closing(open_source(path)) as source:
        names = pose_or_leg_columns(source.where, source.columns)
        wanted = (
            names if time is None else (*names, *checked(source.where, source.columns, (time,)))
        )
        if not reading.ignore_platform:
            check_same(source.where, source.metadata, platform)
        number, values, total = _thinned(source, wanted, rows, reading)
    clock = (number - number[0]) / ROWS_A_SECOND
    if time is not None:
        clock = _times(str(path), time, number, values[:, -1])
        values = values[:, :-1]
    solved = _from_legs(platform, values) if names == LEGS else _placed(platform, values, names)
    of = "leg readings" if names == LEGS else "poses"
    return Trajectory(Path(path).name, of, number, total, clock, time is not None, *solved)


def _thinned(
    source: Source, names: tuple[str, ...], most: int, reading: Reading
) -> tuple[Array, Array, int]:
    thin = Thin(most)
    for block in _blocks(source, names, reading):
        thin.add(block)
    return thin.rows


def _blocks(source: Source, names: tuple[str, ...], reading: Reading) -> Iterator[Array]:
    wanted = tuple(dict.fromkeys(names))  # a column may be asked for twice
    blocks = source.blocks(wanted, rows=reading.block_rows, keep_bad=reading.keep_bad_rows)
    for block in blocks:
        yield block.numbers(names)


def _times(where: str, name: str, number: Array, times: Array) -> Array:
    """Times from the first one on.

    Raises:
        InputError: naming the first row that has none, or an earlier one than its predecessor.
    """
    rises = np.concatenate([[True], np.diff(times) >= 0]) & np.isfinite(times)
    if not rises.all():
        bad = int(np.argmin(rises))
        raise InputError(
            f"{where}: row {number[bad]:.0f}: {name} is {times[bad]:.9g}; expected times that rise"
        )
    return times - times[0]


def _from_legs(platform: Platform, legs: Array) -> tuple[Pose, Array, list[Answer]]:
    from gough.fk.solve import solve
    from gough.status import Status

    found = solve(platform, legs)
    answers = [
        Answer(has_pose(status), status.text, "forward kinematics", float(residual), int(steps))
        for status, residual, steps in zip(
            map(Status, found.status.tolist()), found.residual, found.iterations, strict=True
        )
    ]
    return found.pose, legs, answers


def _placed(
    platform: Platform, values: Array, names: tuple[str, ...]
) -> tuple[Pose, Array, list[Answer]]:
    pose, _ = poses_from_columns(values, names)
    with np.errstate(invalid="ignore"):
        legs = leg_lengths(platform, pose)
    outcomes = [PLACED[code] for code in placed(platform, pose, legs)]
    answers = [Answer(one.usable, one.text, "inverse kinematics") for one in outcomes]
    return pose, legs, answers

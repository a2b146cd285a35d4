"""Rows of a file of poses or readings that the page plays, evenly spread over the file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import GoughError, InputError
from gough.files import trajectory as files
from gough.files.rows import Reading
from gough.platform import Platform
from gough.pose import Pose
from gough.status import Status
from gough.view.beyond import beyond_limits
from gough.view.follow import REFUSED, has_pose
from gough.view.model import Answer

ROWS_A_SECOND = 30.0  # at which a file without times is played


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Rows of a file, evenly spread over it.

    Attributes:
        name: the file's name.
        of: content of the file, "poses" or "leg readings".
        number: (N,) rows' numbers in the file, from 1.
        total: rows in the file.
        time: (N,) [s], rising; from the file if `timed`, else 30 rows of the file a second.
        pose: batch (N,), of the platform. legs: (N, 6). NaN where there is none.
        answers: result of each row.
        frame: whose poses the file holds, such as "tool in work"; None for the platform's.
    """

    name: str
    of: str
    number: NDArray[np.int64]
    total: int
    time: Array
    timed: bool
    pose: Pose
    legs: Array
    answers: list[Answer]
    frame: str | None = None

    def __len__(self) -> int:
        return len(self.number)

    @property
    def numbers(self) -> tuple[int, int, int]:
        """Numbers of the first and the last row in the file, and the step from row to row."""
        first, last = int(self.number[0]), int(self.number[-1])
        return first, last, int(self.number[1]) - first if len(self) > 1 else 1

    @property
    def failures(self) -> int:
        """Number of rows without a pose."""
        return sum(not answer.reached for answer in self.answers)

    @property
    def about(self) -> str:
        """Sentence that names the file and the rows shown."""
        rows = f"{self.total:,} rows of {self.of}"
        if len(self) < self.total:
            step = self.numbers[2]
            rows += f", of which every {step:,}th is shown"
        failed = f"; {self.failures:,} of the shown rows have no pose" if self.failures else ""
        return f"{self.name}: {rows}{failed}."

    @property
    def pace(self) -> str:
        """Meaning of the speed 1x."""
        return "1x: real time" if self.timed else f"1x: {ROWS_A_SECOND:.0f} rows per second"

    def where(self, row: int) -> str:
        """Number of a row in the file, and its time."""
        time = f", {self.time[row]:.6g} s" if self.timed else ""
        return f"row {self.number[row]:,.0f} of {self.total:,}{time}"


class Thin:
    """At most `most` rows of a stream of unknown length, evenly spread over it.

    Attributes:
        total: rows of the stream.
    """

    def __init__(self, most: int) -> None:
        self._most, self._step, self.total = most, 1, 0
        self._kept: list[Array] = []

    def add(self, rows: Array) -> None:
        """The next rows (n, K) of the stream; the first column numbers them, from 1."""
        self.total += len(rows)
        self._kept.append(self._chosen(rows))
        while sum(map(len, self._kept)) > self._most:
            self._step *= 2
            self._kept = [self._chosen(np.concatenate(self._kept))]

    def _chosen(self, rows: Array) -> Array:
        return rows[(rows[:, 0] - 1) % self._step == 0]

    @property
    def rows(self) -> Array:
        """The rows kept, (N, K)."""
        return np.concatenate(self._kept)


def read(
    path: str | Path,
    platform: Platform,
    *,
    rows: int,
    time: str | None = None,
    reading: Reading = Reading(),
    frame: str | None = None,
) -> Trajectory:
    """Read a file of poses or of leg readings; of one that holds both, the poses.

    Args:
        path: .csv or .parquet, or "-" for standard input.
        platform: the machine.
        rows: largest number of rows kept, evenly spread over the file.
        time: a column of rising times [s].
        reading: options for reading the file.
        frame: whose poses the file holds; those that it states, or the platform's, unless given.

    Raises:
        GoughError, InputError: fewer than two rows wanted, or an error in the file.
    """
    if rows < 2:
        raise GoughError(f"--rows {rows}: expected 2 or more")
    thin = Thin(rows)
    with files.open_trajectory(path, platform, time=time, reading=reading, frame=frame) as file:
        time = file.time
        for block in file.blocks():
            thin.add(block)
    found = file.solve(thin.rows)
    clock = (found.number - found.number[0]) / ROWS_A_SECOND
    if time is not None:
        clock = _times(str(path), time, found)
    of, how = ("poses", "inverse") if file.has_poses else ("leg readings", "forward")
    answers = [
        Answer(*_reached(platform, found, i), f"{how} kinematics", float(residual), int(steps))
        for i, (residual, steps) in enumerate(zip(found.residual, found.iterations, strict=True))
    ]
    return Trajectory(
        Path(path).name, of, found.number, thin.total, clock, time is not None, found.pose,
        found.legs, answers, frame if file.frame is None else file.frame.name,
    )  # fmt: skip


def _reached(platform: Platform, rows: files.Trajectory, i: int) -> tuple[bool, str]:
    """True with the limits of a row's pose; False with the reason why it has none."""
    status = rows.outcomes[i]
    if has_pose(status):
        text = beyond_limits(platform, rows.pose[i], rows.legs[i]).text
        return True, text if status.usable else f"Marked {status.label}. {text}"
    forward = isinstance(status, Status)
    return False, REFUSED[status.label] if forward else status.text


def _times(where: str, name: str, rows: files.Trajectory) -> Array:
    """Times (N,) since the first row.

    Raises:
        InputError: naming the first row that has no time, or an earlier one than its predecessor.
    """
    times = rows.time
    rises = np.concatenate([[True], np.diff(times) >= 0]) & np.isfinite(times)
    if not rises.all():
        bad = int(np.argmin(rises))
        raise InputError(
            f"{where}: row {rows.number[bad]}: {name} is {times[bad]:.9g}; expected times that rise"
        )
    return times - times[0]

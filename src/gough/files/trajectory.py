"""A file of poses or of leg readings, read as poses with their readings and statuses.

    with open_trajectory("log.csv", platform, time="time") as file:
        for rows in file.blocks():
            found = file.solve(rows)

Reading and solving are two steps, so that what shows few of many rows solves only those.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.columns import LEGS, STATUS, checked, pose_or_leg_columns
from gough.errors import InputError
from gough.files.formats import Given, open_source, source_frame
from gough.files.plausible import check_plausible
from gough.files.rows import Block, Reading, Source
from gough.frames import FramePose
from gough.home_mode import pose_status
from gough.kinematics import leg_lengths
from gough.platform import Platform
from gough.pose import Pose, poses_from_columns
from gough.status import InverseStatus, Outcome, Status

if TYPE_CHECKING:
    from gough.fk.solve import Solver

UNUSABLE = {status.label: status for status in Status if not status.usable}


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Rows of a file as poses and readings; NaN where there are none.

    Attributes:
        number: (n,) rows' numbers in the file, from 1.
        time: (n,) the column of times; NaN where absent.
        pose: batch (n,), of the platform whatever the frame of the file.
        legs: (n, 6) readings.
        outcomes: (n,) statuses: `Status` for a file of readings; `InverseStatus` for one of poses,
            or the `Status` that the file states if that is not usable.
        usable: (n,) True for rows with a usable pose.
        residual: (n,) largest strut error [platform unit]; zero for a file of poses.
        iterations: (n,) Newton steps; zero for a file of poses.
    """

    number: NDArray[np.int64]
    time: Array
    pose: Pose
    legs: Array
    outcomes: list[Outcome]
    usable: NDArray[np.bool_]
    residual: Array
    iterations: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class TrajectoryFile:
    """An open file of poses or of leg readings; of one that holds both, the poses.

    Attributes:
        columns: names of the columns of a pose, or `LEGS`.
        time: name of the column of times, or None.
        seed: first guess for leg readings, as for `gough.solve`.
        frame: whose poses the file holds; None for those of the platform.
    """

    source: Source
    platform: Platform
    columns: tuple[str, ...]
    time: str | None
    seed: str
    frame: FramePose | None = None

    @property
    def has_poses(self) -> bool:
        """True for a file of poses, False for one of leg readings."""
        return self.columns != LEGS

    def blocks(self, progress: Callable[[Source], None] | None = None) -> Iterator[Array]:
        """Rows (n, 3 + K), block by block: number from 1, time, unusable status or -1, `columns`.

        Args:
            progress: called after every block.
        """
        time, count = self.time, 0
        keep = () if time is None else (time,)
        for block in read_columns(self.source, self.columns, keep):
            rows = np.full((len(block), 3 + len(self.columns)), np.nan)
            rows[:, 0] = np.arange(count + 1, count + 1 + len(block))
            if time is not None:
                rows[:, 1] = block.times(time)
            rows[:, 2] = unusable_status(block)
            rows[:, 3:] = block.numbers(self.columns)
            if count == 0 and not self.has_poses:
                check_plausible(self.source, self.platform, rows[:, 3:])
            count += len(block)
            yield rows
            if progress:
                progress(self.source)

    def solve(self, rows: Array) -> Trajectory:
        """Calculate the readings of poses, or solve readings for poses."""
        number, time, values = rows[:, 0].astype(np.int64), rows[:, 1], rows[:, 3:]
        if not self.has_poses:
            found = self._solver(values)
            outcomes: list[Outcome] = [Status(code) for code in found.status.tolist()]
            return Trajectory(
                number, time, found.pose, values, outcomes, found.usable, found.residual,
                found.iterations,
            )  # fmt: skip
        pose, _ = poses_from_columns(values, self.columns)
        pose = pose if self.frame is None else self.frame.platform_pose(pose)
        legs = leg_lengths(self.platform, pose)
        stated = rows[:, 2].astype(np.int64)
        outcomes = [
            InverseStatus(code) if one < 0 else Status(one)
            for code, one in zip(
                pose_status(self.platform, pose, legs), stated.tolist(), strict=True
            )
        ]
        usable = np.all(np.isfinite(legs), axis=-1) & (stated < 0)
        none = np.zeros(len(rows))
        return Trajectory(number, time, pose, legs, outcomes, usable, none, none.astype(np.int32))

    @cached_property
    def _solver(self) -> Solver:
        from gough.fk.solve import (
            Solver,  # Numba takes a second, which a file of poses need not wait
        )

        return Solver(self.platform, self.seed)


@contextmanager
def open_trajectory(
    path: Given,
    platform: Platform,
    *,
    time: str | None = None,
    seed: str = "auto",
    reading: Reading = Reading(),
    frame: str | None = None,
) -> Iterator[TrajectoryFile]:
    """Open a file of poses or of leg readings.

    Args:
        path: .csv or .parquet, "-" for standard input, or a `GivenRow`.
        platform: the machine.
        time: name of a column of times.
        seed: first guess for leg readings, as for `gough.solve`.
        reading: options for reading the file.
        frame: whose poses the file holds, such as "tool in work"; those that the file states, or
            the platform's, unless given.

    Raises:
        GoughError: a name of no known format, or an unknown frame.
        InputError: a file that cannot be read, without the columns, or with poses of another frame.
    """
    with closing(open_source(path, platform, reading)) as source:
        columns = pose_or_leg_columns(source.where, source.columns)
        if time is None and source.reading.log.time in source.columns:
            time = source.reading.log.time
        if time is not None:
            checked(source.where, source.columns, (time,))
        view = source_frame(source, platform, frame)
        yield TrajectoryFile(source, platform, columns, time, seed, view)


def read_row(
    path: Given,
    platform: Platform,
    row: int = 1,
    *,
    seed: str = "auto",
    reading: Reading = Reading(),
    frame: str | None = None,
) -> Trajectory:
    """Read the pose in one row of a file of poses, or solve one row of leg readings.

    Args:
        path, platform, seed, reading, frame: as for `open_trajectory`.
        row: number of the row, from 1.

    Returns:
        One row, which has a pose.

    Raises:
        InputError: there is no such row, or it has no pose.
    """
    seen = 0
    with open_trajectory(path, platform, seed=seed, reading=reading, frame=frame) as file:
        for rows in file.blocks():
            seen += len(rows)
            chosen = rows[rows[:, 0] == row]
            if len(chosen):
                found = file.solve(chosen)
                if not np.all(np.isfinite(found.pose.position)):
                    status = found.outcomes[0]
                    raise InputError(
                        f"{path}: row {row} has no pose: {status.label}: {status.text}"
                    )
                return found
    raise InputError(f"{path}: there is no row {row}: rows are 1 to {seen}")


def read_columns(
    source: Source, names: tuple[str, ...], keep: tuple[str, ...] = ()
) -> Iterator[Block]:
    """Read number columns of an open file, with its column of statuses if it has one."""
    keep += (STATUS,) if STATUS in source.columns and STATUS not in names else ()
    return source.blocks(tuple(dict.fromkeys(names)), keep)


def unusable_status(block: Block) -> NDArray[np.int64]:
    """Numbers (n,) of the statuses that a column of the file states if not usable, else -1."""
    if STATUS not in block.table.column_names:
        return np.full(len(block), -1)
    words = block.table.column(STATUS).to_pylist()
    return np.array([int(UNUSABLE.get(str(word), -1)) for word in words])

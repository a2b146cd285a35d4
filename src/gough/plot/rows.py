"""What the rows of a file show: trajectories and errors, a block at a time."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np

from gough.checks import Array
from gough.columns import pose_columns
from gough.errors import InputError
from gough.files.formats import open_source
from gough.files.rows import Reading, Source
from gough.files.trajectory import (
    Trajectory,
    TrajectoryFile,
    open_trajectory,
    read_columns,
    unusable_status,
)
from gough.platform import Platform
from gough.plot.envelope import Envelope
from gough.plot.histograms import LogHistogram
from gough.plot.trajectory import SIGNALS, signals
from gough.pose import Pose, poses_from_columns

RESIDUAL = "residual"
Tick = Callable[[Source], None]


def read_trajectory(
    path: str | Path,
    platform: Platform,
    *,
    time: str | None = None,
    seed: str = "auto",
    reading: Reading = Reading(),  # noqa: B008 - frozen
    tick: Tick | None = None,
) -> Envelope:
    """The envelope of a file of poses or of leg readings, for `trajectory_figure`.

    Rows without a usable pose are counted as unanswered; readings that were read are drawn.

    Args:
        path: .csv or .parquet; a file that has the columns of a pose is read as poses.
        platform: the machine.
        time: the column on the horizontal axis; without it rows are counted from 1.
        seed: first guess for leg readings, as for `gough.solve`.
        reading: options for reading the file.
        tick: called after every block.

    Raises:
        GoughError, InputError: what is wrong, where and what to do.
    """
    envelope = Envelope(SIGNALS)
    with open_trajectory(path, platform, time=time, seed=seed, reading=reading) as file:
        for rows in file.blocks(tick):
            found = file.solve(rows)
            values = signals(platform, found.legs, found.pose.position, found.pose.euler)
            values[~found.usable, 0 if file.has_poses else 6 :] = np.nan
            envelope.add(_times(file, found), values, found.usable)
    return envelope


def read_errors(
    path: str | Path,
    platform: Platform,
    truth: str | Path | None = None,
    *,
    all_rows: bool = False,
    reading: Reading = Reading(),  # noqa: B008 - frozen
    tick: Tick | None = None,
) -> dict[str, LogHistogram]:
    """Histograms of a file of solved poses: "residual" and, with the truth, "shift" and "turn".

    Rows whose status is not usable are left out, and counted as such.

    Args:
        path: poses, as `gough solve` writes them.
        truth: the true poses, row for row.
        all_rows: take rows whatever their status, such as first guesses.

    Returns:
        "residual" [platform unit] where the file has that column; "shift" [platform unit] and
        "turn" [deg] where there is a truth.

    Raises:
        GoughError, InputError: what is wrong; the files' rows do not match; neither a column of
            residuals nor a truth.
    """
    with ExitStack() as stack:
        source = stack.enter_context(closing(open_source(path, platform, reading)))
        residual = (RESIDUAL,) if RESIDUAL in source.columns else ()
        if truth is None and not residual:
            raise InputError(
                f"{path}: no column residual, as gough solve writes it; pass --truth POSES to "
                "compare its poses with true ones"
            )
        names = pose_columns(source.where, source.columns) if truth is not None else ()
        found = {name: LogHistogram() for name in residual}
        true = None
        if truth is not None:
            opened = stack.enter_context(closing(open_source(truth, platform, reading)))
            true = _Feed(opened, reading)
            found |= {"shift": LogHistogram(), "turn": LogHistogram()}
        for block in read_columns(source, (*names, *residual), reading):
            answered = (unusable_status(block) < 0) | all_rows
            if residual:
                values = block.numbers(residual)[:, 0]
                found[RESIDUAL].add(np.where(answered, values, np.nan))
            if true is not None:
                pose, _ = poses_from_columns(block.numbers(names), names)
                shift, turn = pose.distance(true.take(len(block), source.where))
                found["shift"].add(np.where(answered, shift, np.nan))
                found["turn"].add(np.where(answered, np.degrees(turn), np.nan))
            if tick:
                tick(source)
        if true is not None:
            true.finish(source.where)
    return found


def read_pose(path: str | Path, platform: Platform, row: int, seed: str = "auto") -> Pose:
    """The pose in one row of a file of poses, or of one row of leg readings.

    Args:
        path: .csv or .parquet.
        platform: the machine.
        row: number of the row, from 1.
        seed: first guess for leg readings, as for `gough.solve`.

    Raises:
        InputError: there is no such row, or it has no pose.
    """
    seen = 0
    with open_trajectory(path, platform, seed=seed) as file:
        for rows in file.blocks():
            seen += len(rows)
            chosen = rows[rows[:, 0] == row]
            if len(chosen):
                pose = file.solve(chosen).pose[0]
                if not np.all(np.isfinite(pose.position)):
                    raise InputError(f"{path}: row {row} has no pose that could be drawn")
                return pose
    raise InputError(f"{path}: there is no row {row}: rows are 1 to {seen}")


def _times(file: TrajectoryFile, rows: Trajectory) -> Array:
    """The horizontal axis (n,): a column, its gaps bridged, or the numbers of the rows."""
    if file.time is None:
        return rows.number.astype(np.float64)
    known = np.isfinite(rows.time)
    if not np.any(known):
        raise InputError(
            f"{file.source.where}: row {rows.number[0]} and on: column {file.time} holds no numbers"
        )
    return np.interp(rows.number, rows.number[known], rows.time[known])


class _Feed:
    """Poses of a file, as many at a time as are asked for."""

    def __init__(self, source: Source, reading: Reading) -> None:
        self._where = source.where
        self._names = pose_columns(source.where, source.columns)
        self._blocks = read_columns(source, self._names, reading)
        self._values: Array = np.empty((0, len(self._names)))

    def take(self, count: int, beside: str) -> Pose:
        """The next `count` poses."""
        while len(self._values) < count:
            block = next(self._blocks, None)
            if block is None:
                raise InputError(
                    f"{self._where}: has fewer rows than {beside}; expected one true pose for each"
                )
            self._values = np.concatenate([self._values, block.numbers(self._names)])
        values, self._values = self._values[:count], self._values[count:]
        return poses_from_columns(values, self._names)[0]

    def finish(self, beside: str) -> None:
        """That nothing is left over."""
        left = len(self._values) or len(next(self._blocks, ()))
        if left:
            raise InputError(
                f"{self._where}: has more rows than {beside}; expected one true pose for each"
            )

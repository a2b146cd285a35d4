"""What the rows of a file show: trajectories and errors, a block at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.columns import LEGS, STATUS, checked, pose_columns, pose_or_leg_columns
from gough.errors import InputError
from gough.files.block import Block
from gough.files.metadata import check_same
from gough.files.source import Reading, Source, open_source
from gough.fk.solve import solve
from gough.kinematics import leg_lengths
from gough.platform import Platform
from gough.plot.envelope import Envelope
from gough.plot.histograms import LogHistogram
from gough.plot.trajectory import SIGNALS, signals
from gough.pose import Pose, poses_from_columns
from gough.status import Status

RESIDUAL = "residual"
UNUSABLE = tuple(s.label for s in Status if not s.usable)
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

    A file with the columns of a pose is taken for poses, and legs are calculated; any other
    must have leg_1 to leg_6, which are solved. Rows whose status is not usable, and those
    without numbers, count as rows without an answer.

    Args:
        time: the column that gives the horizontal axis; without it rows are counted from 1.
        seed: first guess for leg readings, as for `gough.solve`.
        tick: called after every block.

    Raises:
        GoughError, InputError: what is wrong, where and what to do.
    """
    envelope = Envelope(SIGNALS)
    with closing(open_source(path)) as source:
        names = pose_or_leg_columns(source.where, source.columns)
        poses = names != LEGS
        for block in _blocks(source, platform, names, reading, time):
            if poses:
                pose, _ = poses_from_columns(block.numbers(names), names)
                answered = _usable(block) & np.isfinite(pose.position[:, 0])
                with np.errstate(invalid="ignore"):
                    legs = leg_lengths(platform, pose)
                answered &= np.all(np.isfinite(legs), axis=-1)
            else:
                legs = block.numbers(LEGS)
                solution = solve(platform, legs, seed=seed)
                pose, answered = solution.pose, solution.usable
            values = signals(platform, legs, pose.position, pose.euler)
            values[~answered, 0 if poses else 6 :] = np.nan  # readings that were read are known
            envelope.add(_times(block, time, envelope.rows), values, answered)
            if tick:
                tick(source)
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
        source = stack.enter_context(closing(open_source(path)))
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
            true = _Feed(stack.enter_context(closing(open_source(truth))), platform, reading)
            found |= {"shift": LogHistogram(), "turn": LogHistogram()}
        for block in _blocks(source, platform, (*names, *residual), reading, None):
            answered = _usable(block) | all_rows
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
    """The pose in one row of a file of poses, or that of one row of leg readings.

    Args:
        row: counted from 1.

    Raises:
        InputError: there is no such row, or it has no pose.
    """
    seen = 0
    with closing(open_source(path)) as source:
        names = pose_or_leg_columns(source.where, source.columns)
        poses = names != LEGS
        for block in _blocks(source, platform, names, Reading(), None):
            if seen < row <= seen + len(block):
                values = block.numbers(names)[row - seen - 1 : row - seen]
                pose = poses_from_columns(values, names)[0][0] if poses else (
                    solve(platform, values[0], seed=seed).pose
                )  # fmt: skip
                if not np.all(np.isfinite(pose.position)):
                    raise InputError(f"{path}: row {row} has no pose that could be drawn")
                return pose
            seen += len(block)
    raise InputError(f"{path}: there is no row {row}: rows are 1 to {seen}")


def _times(block: Block, column: str | None, before: int) -> Array:
    """The horizontal axis (n,): a column, its gaps bridged, or the number of the row."""
    rows = np.arange(len(block))
    if column is None:
        return (before + 1 + rows).astype(np.float64)
    x = block.numbers([column])[:, 0]
    known = np.isfinite(x)
    if not np.any(known):
        raise InputError(f"{block.place(0)} and on: column {column} holds no numbers")
    return np.interp(rows, rows[known], x[known])


# ---- parts ----------------------------------------------------------------------------


def _blocks(
    source: Source, platform: Platform, names: Sequence[str], reading: Reading, time: str | None
) -> Iterator[Block]:
    """The file's blocks with these number columns, and its status where it has one."""
    if not reading.ignore_platform:
        check_same(source.where, source.metadata, platform)
    if time is not None:
        checked(source.where, source.columns, (time,))
    keep = (STATUS,) if STATUS in source.columns and STATUS not in names else ()
    more = () if time is None or time in names else (time,)
    numbers = (*names, *more)
    return source.blocks(numbers, keep, rows=reading.block_rows, keep_bad=reading.keep_bad_rows)


def _usable(block: Block) -> NDArray[np.bool_]:
    """Rows (n,) whose status, if there is one, does not say that they have no answer."""
    if STATUS not in block.table.column_names:
        return np.ones(len(block), dtype=bool)
    words = np.array(block.table.column(STATUS).to_pylist(), dtype=object)
    return ~np.isin(words.astype(str), UNUSABLE)


class _Feed:
    """Poses of a file, as many at a time as are asked for."""

    def __init__(self, source: Source, platform: Platform, reading: Reading) -> None:
        self._where = source.where
        self._names = pose_columns(source.where, source.columns)
        self._blocks = _blocks(source, platform, self._names, reading, None)
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

"""From a file of readings to a file of poses, and back, a block of rows at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from gough.arrow import label_column, number_column
from gough.checks import Array
from gough.columns import (
    LEGS,
    STATUS,
    Angles,
    check_kept,
    checked,
    leg_columns,
    pose_columns,
    solution_names,
)
from gough.errors import GoughError
from gough.files.block import Block
from gough.files.metadata import check_same, describe
from gough.files.placing import INVALID, PLACED, placed
from gough.files.report import NAMED, Report
from gough.files.sink import Sink, open_sink
from gough.files.source import STANDARD, Reading, Source, file_format, open_source
from gough.fk.solution import solution_columns
from gough.kinematics import leg_lengths
from gough.platform import Platform
from gough.pose import poses_from_columns
from gough.status import Outcome, Status

Progress = Callable[[Source, Report], None]

SOLVED = tuple(Status)


def solve_file(
    legs: str | Path,
    out: str | Path | None,
    platform: Platform,
    *,
    reading: Reading = Reading(),  # noqa: B008 - frozen
    angles: Angles | None = None,
    leg_noise: float | None = None,
    head: int = 0,
    progress: Progress | None = None,
    **solver: object,
) -> Report:
    """Poses of a file of leg readings, row for row.

    Args:
        legs: .csv or .parquet with columns leg_1 to leg_6, or "-".
        out: .csv or .parquet to write, "-", or None to only count. Columns: the kept ones, the
            pose, status, residual [platform unit], iterations; with `leg_noise` std_x, std_y,
            std_z [platform unit], std_rx, std_ry, std_rz [rad]; with `certify` the radius of
            uniqueness [platform unit].
        angles: write Euler angles (Rx Ry Rz) in these units in place of quaternions.
        leg_noise: standard deviation of the readings, in their unit.
        head: how many first rows the report is to hold.
        progress: called after every block, with how far the file is read and the counts.
        solver: passed on to `gough.solve`: seed, tol, max_iterations and the like.

    Raises:
        GoughError: what is wrong, where and what to do; `out` is then as it was.
    """
    from gough.fk.solve import solve

    def step(block: Block) -> dict[str, pa.Array]:
        readings = block.numbers(LEGS)
        if report.rows == 0:
            solve(platform, platform.home_legs, **solver)  # pyright: ignore[reportArgumentType]
            report.start()
        solution = solve(platform, readings, leg_noise=leg_noise, **solver)  # pyright: ignore[reportArgumentType]
        status = solution.status
        report.add(solution.pose, readings, status, solution.residual)
        _name(
            report,
            block,
            status == Status.INVALID_INPUT,
            lambda i: _bad_legs(readings[i]),
        )
        return solution_columns(solution, angles)

    report = Report(SOLVED, head)
    written = solution_names(angles, leg_noise is not None, bool(solver.get("certify")))
    tick = _tick(report, progress)
    _run(legs, out, platform, reading, leg_columns, written, step, tick)
    return report


def inverse_file(
    poses: str | Path,
    out: str | Path | None,
    platform: Platform,
    *,
    reading: Reading = Reading(),  # noqa: B008 - frozen
    head: int = 0,
    progress: Progress | None = None,
) -> Report:
    """Leg readings of a file of poses, row for row.

    Args:
        poses: .csv or .parquet with columns x, y, z and qw, qx, qy, qz, or rx, ry, rz [rad], or
            rx_deg, ry_deg, rz_deg (R = Rx Ry Rz), or "-".
        out: .csv or .parquet to write, "-", or None to only count. Columns: the kept ones,
            leg_1 to leg_6 and status.

    Raises:
        GoughError: what is wrong, where and what to do; `out` is then as it was.
    """

    def step(block: Block) -> dict[str, pa.Array]:
        names = pose_columns("", block.table.column_names)
        values = block.numbers(names)
        pose, reasons = poses_from_columns(values, names)
        with np.errstate(invalid="ignore"):
            readings = leg_lengths(platform, pose)
        status = placed(platform, pose, readings)
        report.add(pose, readings, status)
        _name(report, block, status == INVALID, reasons)
        columns = {name: number_column(readings[:, i]) for i, name in enumerate(LEGS)}
        return columns | {STATUS: _labels(PLACED, status)}

    report = Report(PLACED, head)
    tick = _tick(report, progress)
    _run(poses, out, platform, reading, pose_columns, [*LEGS, STATUS], step, tick)
    return report


def _run(
    path: str | Path,
    out: str | Path | None,
    platform: Platform,
    reading: Reading,
    pick: Callable[[str, Sequence[str]], tuple[str, ...]],
    written: Sequence[str],
    step: Callable[[Block], dict[str, pa.Array]],
    tick: Callable[[Source], None],
) -> None:
    """Read blocks, `step` each, write what it returns beside the kept columns."""
    _check_paths(path, out)
    check_kept(reading.keep, written)
    with ExitStack() as stack:
        source = stack.enter_context(closing(open_source(path)))
        numbers = pick(source.where, source.columns)
        keep = checked(source.where, source.columns, tuple(dict.fromkeys(reading.keep)))
        if not reading.ignore_platform:
            check_same(source.where, source.metadata, platform)
        sink = stack.enter_context(open_sink(out, describe(platform))) if out else None
        typed = out is not None and file_format(out) == ".parquet"
        blocks = source.blocks(
            numbers,
            keep,
            rows=reading.block_rows,
            keep_bad=reading.keep_bad_rows,
            typed=typed,
        )
        _pump(source, blocks, keep, step, sink, tick)


def _pump(
    source: Source,
    blocks: Iterator[Block],
    keep: Sequence[str],
    step: Callable[[Block], dict[str, pa.Array]],
    sink: Sink | None,
    tick: Callable[[Source], None],
) -> None:
    for block in blocks:
        results = step(block)
        if sink is not None:
            kept = {name: block.table.column(name) for name in keep}
            sink.write(pa.table(kept | results))
        tick(source)


def _tick(report: Report, progress: Progress | None) -> Callable[[Source], None]:
    return lambda source: progress(source, report) if progress else None


def _check_paths(path: str | Path, out: str | Path | None) -> None:
    """That both names are of a known format, and that the readings are not to be replaced."""
    file_format(path)
    if out is None:
        return
    file_format(out)
    if str(out) != STANDARD and str(path) != STANDARD:
        same = Path(out).exists() and Path(path).exists() and Path(out).samefile(path)
        if same:
            raise GoughError(
                f"{out}: is the input itself, which would be lost; write to another name"
            )


def _labels(outcomes: Sequence[Outcome], status: NDArray[np.uint8]) -> pa.Array:
    return label_column(status, [outcome.label for outcome in outcomes])


def _name(
    report: Report,
    block: Block,
    invalid: NDArray[np.bool_],
    reason: Callable[[int], str],
) -> None:
    """Describe invalid rows, as long as the report has room."""
    for i in np.flatnonzero(invalid)[: NAMED - len(report.invalid)]:
        row = int(i)
        report.invalid.append(f"{block.place(row)}: {block.bad.get(row) or reason(row)}")


def _bad_legs(readings: Array) -> str:
    for name, value in zip(LEGS, readings, strict=True):
        if not np.isfinite(value):
            found = "empty or not a number" if np.isnan(value) else value
            return f"{name} is {found}, expected a finite number"
    low = int(np.argmin(readings))
    return f"{LEGS[low]} is {readings[low]:.9g}, which makes no leg longer than 0"

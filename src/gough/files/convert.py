"""Conversion of a file of readings to one of poses, and back, a block of rows at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from gough.checks import Array
from gough.columns import (
    LEGS,
    STATUS,
    Angles,
    check_kept,
    checked,
    file_leg_columns,
    pose_columns,
    solution_names,
)
from gough.errors import GoughError
from gough.files.formats import (
    STANDARD,
    Given,
    GivenRow,
    Out,
    Target,
    file_format,
    open_sink,
    open_source,
    source_frame,
)
from gough.files.log_format import LogFormat, time_column
from gough.files.metadata import describe
from gough.files.overlap import read_ahead, write_behind
from gough.files.plausible import cause, check_plausible
from gough.files.report import Report
from gough.files.rows import Block, Reading, Sink, Source
from gough.files.stores import STORE
from gough.fk.solution import solution_columns
from gough.home_mode import pose_status
from gough.kinematics import leg_lengths
from gough.platform import Platform
from gough.pose import poses_from_columns
from gough.status import InverseStatus, Status
from gough.tables import label_column, number_column

if TYPE_CHECKING:
    from gough.fk.tracker import Tracker

Progress = Callable[[Source, Report], None]


def solve_file(
    legs: Given,
    out: Out | None,
    platform: Platform,
    *,
    reading: Reading = Reading(),
    angles: Angles | None = None,
    leg_noise: float | None = None,
    head: int = 0,
    progress: Progress | None = None,
    certify: bool = False,
    ambiguous: bool = False,
    follow: Mapping[str, float] | None = None,
    limits: bool | None = None,
    **settings: object,
) -> Report:
    """Solve a file of leg readings, row for row.

    Args:
        legs: .csv or .parquet with columns leg_1 to leg_6, "-" for standard input, or a
            `GivenRow`.
        out: .csv or .parquet to write, "-", or None to only count. Columns: the kept ones, the
            pose, status, residual [platform unit], iterations; with `leg_noise` std_x, std_y,
            std_z [platform unit], std_rx, std_ry, std_rz [rad], or std_rx_deg to std_rz_deg with
            angles in degrees; with `certify` the radius of uniqueness [platform unit]; with
            `limits` the margin and the name of the tightest limit.
        platform: the machine.
        reading: options for reading the file.
        angles: write Euler angles in this form instead of quaternions, see `Pose.to_frame`.
        leg_noise: standard deviation of the readings, in their unit.
        head: number of first rows that the report holds.
        progress: called after every block with the file and the counts so far.
        certify, ambiguous, limits: as for `gough.solve`; limits are those of the platform's file
            where it states any, unless this says otherwise.
        follow: rows are consecutive, and each starts at the pose before; arguments of
            `gough.Tracker`, such as max_shift, or {}. Adds the column event.
        settings: of `gough.Solver`: seed, tolerance, max_iterations and others.

    Raises:
        GoughError: what is wrong, where, and what to do; an old file at `out` is unchanged.

    Example:
        >>> report = solve_file("legs.csv", "poses.parquet", platform, angles="deg")
        >>> report.rows, report.failures
        (1000, 0)
    """
    from gough.fk.solve import Solver

    frame: Any = settings.get("frame")
    report = Report(tuple(Status), head, frame or "")
    limits = platform.limits is not None if limits is None else limits
    written = solution_names(angles, leg_noise is not None, certify, follow is not None, limits)
    alone = settings.get("workers") == 1
    with open_job(
        legs, out, platform, reading, file_leg_columns, written, frame, alone=alone
    ) as job:
        solver = Solver(platform, **settings)  # pyright: ignore[reportArgumentType]
        tracker = None if follow is None else _tracker(platform, settings, follow)
        report.time = "" if tracker else time_column(job.source.columns, reading.log)
        for block in job.blocks:
            readings = block.numbers(LEGS)
            if report.rows == 0:
                check_plausible(job.source, platform, readings)
                report.start()
            if tracker:
                solution = tracker.follow(readings, leg_noise=leg_noise, limits=limits)
            else:
                solution = solver(
                    readings, leg_noise=leg_noise, certify=certify, ambiguous=ambiguous,
                    limits=limits,
                )  # fmt: skip
            if solution.limits is not None:
                report.add_limits(solution.limits, solution.status)
            report.add(solution.pose, readings, solution.status, solution.residual, solution.event)
            invalid = solution.status == Status.INVALID_INPUT
            report.describe_invalid(block, invalid, lambda i, legs=readings: leg_fault(legs[i]))
            lost = solution.status == Status.UNREACHABLE
            report.describe_unlikely(block, lost, lambda i, legs=readings: cause(platform, legs[i]))
            job.write(block, solution_columns(solution, angles))
            if progress:
                progress(job.source, report)
    return report


def _tracker(platform: Platform, settings: dict, follow: Mapping[str, float]) -> Tracker:
    """A tracker with the settings of a `Solver`, as far as it has them."""
    from gough.fk.solve import make_tracker

    shared = {name: settings[name] for name in ("tolerance", "singular") if name in settings}
    seed: Any = settings.get("seed", "auto")
    return make_tracker(platform, seed, settings.get("frame"), **shared, **follow)


def inverse_file(
    poses: Given,
    out: Out | None,
    platform: Platform,
    *,
    reading: Reading = Reading(),
    head: int = 0,
    frame: str | None = None,
    progress: Progress | None = None,
) -> Report:
    """Calculate the leg readings of a file of poses, row for row.

    Args:
        poses: .csv or .parquet with columns x, y, z and qw, qx, qy, qz, or rx, ry, rz [rad], or
            rx_deg, ry_deg, rz_deg (R = Rx Ry Rz), "-" for standard input, or a `GivenRow`.
        out: .csv or .parquet to write, "-", or None to only count. Columns: the kept ones,
            leg_1 to leg_6 and status; in text the readings have the form `reading.log`.
        platform, reading, head, progress: as for `solve_file`.
        frame: whose poses the file holds, such as "tool in work"; those that the file states, or
            else of the platform, unless given.

    Raises:
        GoughError: what is wrong, where, and what to do; an old file at `out` is unchanged.
    """
    report = Report(tuple(InverseStatus), head)
    labels = [outcome.label for outcome in InverseStatus]
    # Parquet states its platform; text is written as logs of this machine are
    text = out is not None and file_format(out) == ".csv"
    form = reading.log if text else LogFormat()
    factor, offset, _ = form.conversion(platform, [""] * 6)
    written = (*form.names, STATUS)
    with open_job(poses, out, platform, reading, pose_columns, written) as job:
        view = source_frame(job.source, platform, frame)
        for block in job.blocks:
            pose, fault = poses_from_columns(block.numbers(job.numbers), job.numbers)
            pose = pose if view is None else view.platform_pose(pose)
            legs = leg_lengths(platform, pose)
            status = pose_status(platform, pose, legs)
            report.add(pose, legs, status)
            report.describe_invalid(block, status == InverseStatus.INVALID_INPUT, fault)
            values = ((legs - offset) / factor).T if text else legs.T
            columns = dict(zip(form.names, map(number_column, values), strict=True))
            job.write(block, columns | {STATUS: label_column(status, labels)})
            if progress:
                progress(job.source, report)
    return report


@dataclass(frozen=True)
class _Job:
    """A file being read, and one being written if there is one.

    Attributes:
        numbers: names of the columns to convert.
        keep: names of the columns to copy.
    """

    source: Source
    blocks: Iterator[Block]
    numbers: tuple[str, ...]
    keep: tuple[str, ...]
    sink: Sink | None

    def write(self, block: Block, results: dict[str, pa.Array]) -> None:
        """Write results beside the kept columns of their block."""
        if self.sink is not None:
            kept = {name: block.table.column(name) for name in self.keep}
            self.sink.write(pa.table(kept | results))


@contextmanager
def open_job(
    path: Given,
    out: Out | None,
    platform: Platform,
    reading: Reading,
    pick: Callable[[str, Sequence[str]], tuple[str, ...]],
    written: Sequence[str],
    frame: str | None = None,
    *,
    alone: bool = False,
) -> Iterator[_Job]:
    """Open both files, after all checks that need no rows.

    Args:
        pick: chooses the columns to convert, as `leg_columns` does.
        written: names of the columns that results are written to.
        frame: whose poses are written, for the file's metadata.
        alone: read and write on the calling thread. Pipes and devices always are, since a
            thread that waits for one could not be ended.
    """
    _check_paths(path, out)
    check_kept(reading.keep, written)
    with ExitStack() as stack:
        source = stack.enter_context(closing(open_source(path, platform, reading)))
        numbers = pick(source.where, source.columns)
        keep = checked(source.where, source.columns, tuple(dict.fromkeys(reading.keep)))
        sink = stack.enter_context(open_sink(out, describe(platform, frame))) if out else None
        typed = out is not None and file_format(out) == ".parquet"
        blocks = source.blocks(numbers, keep, typed=typed)
        if source.total is not None and not alone:
            blocks = stack.enter_context(closing(read_ahead(blocks)))
        if sink is not None and out is not None and not alone and _is_file(out):
            sink = stack.enter_context(write_behind(sink))
        yield _Job(source, blocks, numbers, keep, sink)


def _is_file(out: Out) -> bool:
    """True for a plain file, or none yet; False for pipes and devices."""
    path = Path(str(out))
    return str(out) != STANDARD and (path.is_file() or not path.exists())


def _check_paths(path: Given, out: Out | None) -> None:
    """Raise for a name of no known format, and for an output that is the input."""
    file_format(path, read=True)
    if out is None:
        return
    file_format(out)
    if isinstance(path, GivenRow) or isinstance(out, Target) or STANDARD in (str(path), str(out)):
        return
    read, wanted = Path(str(path)), Path(out)
    same = read.exists() and wanted.exists() and read.samefile(wanted)
    if same or (STORE.match(str(out)) and str(path) == str(out)):
        raise GoughError(f"{out}: is the input itself, which would be lost; write to another name")


def leg_fault(legs: Array) -> str:
    """The fault of six readings that cannot be solved."""
    for name, value in zip(LEGS, legs, strict=True):
        if not np.isfinite(value):
            found = "empty or not a number" if np.isnan(value) else value
            return f"{name} is {found}, expected a finite number"
    low = int(np.argmin(legs))
    return f"{LEGS[low]} is {legs[low]:.9g}, which makes no leg longer than 0"

"""A file of every pose that each row of a file of leg readings allows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyarrow as pa

from gough.columns import LEGS, file_leg_columns
from gough.files.convert import Progress, leg_fault, open_job
from gough.files.formats import FilePart, Given, Out
from gough.files.plausible import check_plausible
from gough.files.report import Report
from gough.files.rows import Reading
from gough.modes.assembly import assembly_modes
from gough.modes.choose import Choice, choose_mode
from gough.modes.result import AssemblyModes, mode_columns
from gough.platform import Platform
from gough.status import ModesStatus
from gough.tables import number_column

SETS = 4096  # sets of readings in memory at a time, each with up to 40 poses


def modes_file(
    legs: Given,
    out: Out | None,
    platform: Platform,
    *,
    reading: Reading = Reading(),
    workers: int | None = None,
    frame: str | None = None,
    progress: Progress | None = None,
) -> Report:
    """Find every pose of every row of a file of leg readings.

    Args:
        legs: .csv or .parquet with columns leg_1 to leg_6, "-" for standard input.
        out: .csv or .parquet to write, "-", or None to only count: a row for each pose, the best
            of its set of readings first.
        platform: the machine.
        reading: options for reading the file.
        workers: number of threads; all cores unless given.
        frame: whose poses are written, such as "tool in work"; the platform's unless given.
        progress: called after every block with the file and the counts so far.

    Returns:
        Counts of sets of readings by `ModesStatus`.

    Raises:
        GoughError: what is wrong, where, and what to do; an old file at `out` is unchanged.
    """
    report = Report(tuple(ModesStatus))
    before = legs.before if isinstance(legs, FilePart) else 0
    reading = replace(reading, block_rows=min(reading.block_rows, SETS))
    with open_job(legs, out, platform, reading, file_leg_columns, (), frame) as job:
        for block in job.blocks:
            readings = block.numbers(LEGS)
            if report.rows == 0:
                check_plausible(job.source, platform, readings)
                report.start()
            modes = assembly_modes(platform, readings, workers=workers, frame=frame)
            found = mode_table(modes, choose_mode(modes), before + report.rows)
            report.count(modes.status)
            invalid = modes.status == ModesStatus.INVALID_INPUT
            report.describe_invalid(block, invalid, lambda i, legs=readings: leg_fault(legs[i]))
            if job.sink is not None:
                job.sink.write(pa.table(found))
            if progress:
                progress(job.source, report)
    return report


def mode_table(modes: AssemblyModes, choice: Choice, before: int = 0) -> dict[str, pa.Array]:
    """Columns of all poses; sets of readings and poses of a set are numbered from 1.

    Args:
        modes, choice: the poses, and their order.
        before: sets of readings of the file before these.
    """
    row = number_column(modes.row + before + 1)
    columns = {"row": row, "pose": number_column(choice.rank + 1)}
    columns |= {n: c for n, c in mode_columns(modes, None).items() if n != "row"}
    columns |= {f"passes_{name}": number_column(passed) for name, passed in choice.passes.items()}
    order = number_column(np.lexsort((choice.rank, modes.row)))
    return {name: column.take(order) for name, column in columns.items()}

"""One unit of work: read, convert, write whole."""

from __future__ import annotations

import json
import logging
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from gough.errors import GoughError, printable
from gough.files.convert import Progress, inverse_file, solve_file
from gough.files.formats import Target, file_format
from gough.files.modes import modes_file
from gough.files.report import Report
from gough.files.rows import Source
from gough.files.stores import without_credentials
from gough.jobs.job import Job, Made, Unit
from gough.jobs.outputs import JOB, ROWS, UNIT, output_place, write_record
from gough.modes.assembly import assembly_modes
from gough.status import ModesStatus

MOST_NOTES = 6


def make(job: Job, unit: Unit, progress: Progress | None = None, threads: int = 1) -> Made:
    """Make the output of a unit.

    Args:
        job, unit: what to do.
        progress: called after every block of rows.
        threads: of the solver.

    Returns:
        The unit with its rows by status, or the reason why there is no output; no error of a file,
        of the store or of the disk is raised.
    """
    began = time.perf_counter()
    reports: list[Report] = []

    def tick(source: Source, report: Report) -> None:
        reports[:] = [report]
        if progress:
            progress(source, report)

    def metadata() -> Mapping[str, str]:
        counts = _counts(job, reports[0]) if reports else ({}, 0)
        facts = {JOB: job.facts, UNIT: unit.facts, ROWS: counts}
        return {key: json.dumps(value, sort_keys=True) for key, value in facts.items()}

    with _notes() as notes:
        try:
            place = output_place(job, unit)
            if not place.store:
                Path(place.path).parent.mkdir(parents=True, exist_ok=True)
            _convert(job, unit, Target(place, metadata, tidy=False), tick, threads)
            if file_format(str(place)) == ".csv":
                write_record(job, unit, metadata())
        except Exception as error:  # of one file among many: the others go on
            text = (
                str(error) if isinstance(error, GoughError) else f"{type(error).__name__}: {error}"
            )
            text = printable(without_credentials(text))
            return Made(unit, error=text, seconds=time.perf_counter() - began)
    counts, failures = _counts(job, reports[0])
    notes = [text.removeprefix(f"{unit.source}: ") for text in notes]  # alike for many files
    notes += [f"{unit.input}: {text}" for text in reports[0].invalid + reports[0].unlikely]
    notes = [printable(without_credentials(text)) for text in notes[:MOST_NOTES]]
    seconds = time.perf_counter() - began
    return Made(unit, counts, failures, notes=tuple(notes), seconds=seconds)


def compile_for(job: Job) -> None:
    """Compile, or load from disk, what the units of a job need; other processes then load it."""
    if job.command == "solve":
        from gough.fk.solve import FEW, Solver

        limits = bool(job.options.get("limits")) or job.machine.limits is not None
        for rows in (1, FEW + 1):
            Solver(job.machine, "home", workers=1).compile(rows, limits=limits)
    elif job.command == "modes":
        assembly_modes(job.machine, job.machine.home_legs, workers=1)


def _convert(job: Job, unit: Unit, out: Target, tick: Progress, threads: int) -> None:
    platform, options = job.machine, dict(job.options)
    if job.command == "solve":
        solve_file(
            unit.source, out, platform, reading=job.reading, progress=tick, workers=threads,
            **options,
        )  # fmt: skip
    elif job.command == "inverse":
        inverse_file(unit.source, out, platform, reading=job.reading, progress=tick, **options)
    else:
        modes_file(
            unit.source, out, platform, reading=job.reading, progress=tick, workers=threads,
            **options,
        )  # fmt: skip


def _counts(job: Job, report: Report) -> tuple[dict[str, int], int]:
    """Rows by the label of their status, and how many have no usable result."""
    pairs = zip(report.outcomes, report.counts.tolist(), strict=True)
    counts = {outcome.label: count for outcome, count in pairs if count}
    if job.command != "modes":
        return counts, report.failures
    whole = report.counts[[ModesStatus.COMPLETE, ModesStatus.SINGULAR]].sum()
    return counts, report.rows - int(whole)


@contextmanager
def _notes() -> Iterator[list[str]]:
    """Collect what this thread logs, instead of printing it for each of many files."""
    thread, found = threading.get_ident(), []
    log = logging.getLogger("gough")

    def collect(record: logging.LogRecord) -> bool:
        mine = record.thread == thread
        if mine:
            found.append(record.getMessage())
        return not mine

    log.addFilter(collect)
    try:
        yield found
    finally:
        log.removeFilter(collect)

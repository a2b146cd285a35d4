"""Folders, globs and lists of files for `gough solve`, `inverse` and `modes`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import OmitArgPrefixes, arg

from gough.commands.options import option

if TYPE_CHECKING:
    from gough.jobs import Made, Summary, Unit
    from gough.jobs.job import Command
    from gough.platform import Platform

SHOWN = 10  # inputs that failed, and notes, that are printed
ENDINGS = (".csv", ".parquet")


@dataclass(frozen=True)
class JobOptions:
    """Folders of files, globs such as 'logs/*.csv' and lists of files; -o is a folder then."""

    shard_rows: Annotated[
        int | None,
        option(
            "Cut files of more rows than this into numbered parts, at the ends of row groups or "
            "lines (1,000,000).",
            "N",
        ),
    ] = None
    format: Annotated[
        Literal["csv", "parquet"] | None,
        option("Write all files in this format; without it as they were read.", "csv|parquet"),
    ] = None
    force: Annotated[bool, option("Make all files, also those that an earlier run finished.")] = (
        False
    )
    stop_at_first_error: Annotated[
        bool, option("Stop at the first file that cannot be read or written.")
    ] = False
    share: Annotated[
        str | None,
        option(
            "Make every Nth file from the Kth on: so N machines share a folder, each with its own "
            "K from 1 to N.",
            "K/N",
        ),
    ] = None
    engine: Annotated[
        Literal["local", "ray"],
        arg(metavar="local|ray", help="Use processes of this machine, or a Ray cluster."),
    ] = "local"
    address: Annotated[
        str | None, option("Use the Ray cluster at this address; auto finds it.", "ADDRESS")
    ] = None


FolderOptions = OmitArgPrefixes[JobOptions]


def is_job(words: tuple[str, ...], out: str | None, jobs: JobOptions) -> bool:
    """Return whether a command line means many files, or one to be written in parts."""
    from gough.commands.given import is_number

    first = [*" ".join(words).split(), "-"][0]
    if "-" in (first, *words) or is_number(first.rstrip(",;")):
        return False
    if len(words) > 1 or jobs != JobOptions():
        return True
    return any(map(_is_many, words)) or (out is not None and out != "-" and _is_folder(out))


def _is_many(word: str) -> bool:
    """Return whether a word is a folder or a glob."""
    if "://" in word:
        return _is_folder(word) or any(sign in word for sign in "*[")
    return (
        _is_folder(word)
        or os.path.isdir(word)
        or (any(sign in word for sign in "*?[") and not os.path.exists(word))
    )


def _is_folder(name: str) -> bool:
    """Return whether a name is that of a folder: it ends in / or is one, and not in .csv."""
    if "://" in name:
        name = name.partition("?")[0]
        return name.endswith("/") or "." not in name.rpartition("/")[2]
    called = not name.lower().endswith(ENDINGS) and os.path.isdir(name)
    return name.endswith(("/", os.sep)) or called


def run_folder(
    command: Command,
    words: tuple[str, ...],
    platform: Platform,
    out: str | None,
    jobs: JobOptions,
    *,
    workers: int | None,
    allow_failures: bool,
    json: bool,
    **options: Any,
) -> int:
    """Run a job, print its summary and return the exit code."""
    from gough.commands import as_json, signals
    from gough.errors import InputError
    from gough.files.stores import without_credentials
    from gough.jobs import Job, run_job
    from gough.jobs.job import SHARD_ROWS

    if out is None or out == "-" or without_credentials(out).lower().endswith(ENDINGS):
        found = "pass one" if out is None else f"{out} is one file"
        raise InputError(
            f"{words[0]}: many files are written to a folder, such as -o poses/; {found}"
        )
    shard_rows = SHARD_ROWS if jobs.shard_rows is None else jobs.shard_rows
    job = Job.of(
        command, platform, out, shard_rows=shard_rows,
        ending=f".{jobs.format}" if jobs.format else "", **options,
    )  # fmt: skip
    settings = {"address": jobs.address} if jobs.engine == "ray" else {}
    if jobs.address and not settings:
        raise InputError("--address: is that of a cluster; pass --engine ray too")
    try:
        with _progress() as tick:
            summary = run_job(
                job, words, engine=jobs.engine, force=jobs.force, tick=tick, workers=workers,
                stop_at_first_error=jobs.stop_at_first_error, share=_share(jobs.share),
                progress=lambda source, report: signals.check(), **settings,
            )  # fmt: skip
    except signals.Stopped as stop:
        stop.left = f"files finished are in {without_credentials(out)}; the same command goes on"
        raise
    if json:
        as_json.print_json(summary.facts())
    else:
        _print(summary, without_credentials(out))
    if summary.failed:
        return 2
    return 1 if summary.unusable and not allow_failures else 0


def _share(text: str | None) -> tuple[int, int]:
    """K and N of K/N."""
    from gough.errors import InputError

    if text is None:
        return 1, 1
    k, slash, n = text.partition("/")
    if not (slash and k.isdecimal() and n.isdecimal()):
        raise InputError(f"--share: expected K/N, such as 3/16, found {text!r}")
    return int(k), int(n)


@contextmanager
def _progress() -> Iterator[Callable[[Summary, Made, list[Unit]], None]]:
    """Yield a function to call after every file: a bar over the bytes of all inputs."""
    from gough.commands import show, signals

    done = 0

    def tick(summary: Summary, made: Made, units: list[Unit]) -> None:
        nonlocal done
        done += made.unit.size
        here = sum(unit.size for unit in units) - summary.skipped_bytes
        rate = f"{summary.rows_made / max(summary.seconds, 1e-9):,.0f} rows/s"
        update(done, here, f"{summary.made + summary.skipped:,} of {summary.total:,}, {rate}")
        signals.check()

    with show.bar() as update:
        yield tick


def _print(summary: Summary, out: str) -> None:
    from gough.commands import show

    errors, screen = show.console(errors=True), show.console()
    notes = [f"{text}{_times(count)}" for text, count in summary.notes.items()]
    failed = [why if name in why else f"{name}: {why}" for name, why in summary.failed]
    for lines in (notes, failed):
        for line in lines[:SHOWN]:
            errors.print(line, markup=False, soft_wrap=True)
        if len(lines) > SHOWN:
            errors.print(
                f"and {len(lines) - SHOWN:,} more: see {out.rstrip('/')}/_gough/report.json"
            )
    rate = summary.rows_made / max(summary.seconds, 1e-9)
    screen.print(
        f"{summary.rows_made:,} rows in {summary.seconds:.3g} s ({rate:,.0f} rows/s), written to "
        f"{out}",
        markup=False,
    )
    screen.print(
        f"files: {summary.made:,} made, {summary.skipped:,} finished before, "
        f"{len(summary.failed):,} failed"
    )
    if summary.rows:
        table = show.plain_table("status", ">rows", ">share")
        for outcome in summary.outcomes:
            count = summary.counts[outcome.label]
            table.add_row(outcome.label, f"{count:,}", show.percentage(count, summary.rows))
        screen.print(table)
        for outcome in summary.outcomes:
            screen.print(f"{outcome.label}: {outcome.text}", markup=False)


def _times(count: int) -> str:
    return f" ({count:,} files)" if count > 1 else ""

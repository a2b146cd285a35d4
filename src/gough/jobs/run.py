"""A job from its inputs to its summary: plan, leave out what is finished, make the rest."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from gough.errors import GoughError
from gough.files.stores import Place
from gough.jobs.job import Job, Made, Unit
from gough.jobs.local import run_local
from gough.jobs.outputs import (
    FOLDER,
    OtherJobError,
    differences,
    finished,
    read_json,
    write_json,
)
from gough.jobs.plan import REQUESTS, plan
from gough.jobs.summary import Summary
from gough.whole_file import remove_left_behind

Engine = Callable[..., Generator[Made, None, None]]
log = logging.getLogger("gough")
NAMED = 5  # differing outputs that an error lists


def run_job(
    job: Job,
    inputs: Sequence[str | Path],
    *,
    engine: str = "local",
    force: bool = False,
    stop_at_first_error: bool = False,
    share: tuple[int, int] = (1, 1),
    tick: Callable[[Summary, Made, list[Unit]], None] | None = None,
    **settings: Any,
) -> Summary:
    """Make an output for each input, but those that an earlier run of the same job finished.

    Args:
        job: what to do.
        inputs: files, folders and globs; see `plan`.
        engine: "local", or "ray" for a cluster (extra `cluster`).
        force: make all outputs, whatever is there.
        stop_at_first_error: raise the first error of an input instead of going on.
        share: make only the outputs k, k + n, k + 2 n ... of all, for (k, n); k counts from 1. So
            several machines share a folder: the same job on each, with its own k.
        tick: called after every output with the summary so far, the output and all units.
        settings: of the engine, such as workers, or the address of a cluster.

    Returns:
        Counts of rows and files, which `OUT/_gough/report.json` holds too.

    Raises:
        GoughError: nothing to read, a folder that cannot be written, outputs of another job there.

    Example:
        >>> job = Job.of("solve", platform, "poses/", seed="home")
        >>> summary = run_job(job, ["logs/"])
        >>> summary.made, summary.skipped, summary.rows
        (4, 0, 4000)
    """
    began = time.perf_counter()
    run = find_engine(engine)
    units = _share(plan(job, inputs), *share)
    report = "report.json" if share[1] == 1 else f"report-{share[0]}-of-{share[1]}.json"
    if not job.out.store:
        _make_folder(job.out)
    done = {} if force else _finished(job, units)
    _tidy(job, units)
    write_json(job.out / f"{FOLDER}/job.json", job.facts)
    summary = Summary(job, len(units))
    todo = []
    for unit in units:
        if unit.name in done:
            summary.add(done[unit.name])
        else:
            todo.append(unit)
    try:
        with closing(run(job, todo, **settings)) as results:
            for made in results:
                summary.add(made)
                summary.seconds = time.perf_counter() - began
                if tick:
                    tick(summary, made, units)
                if made.error and stop_at_first_error:
                    raise GoughError(made.error)
                if made.error and job.out.store:
                    job.out.info()  # a store that does not answer fails all other units too
    finally:
        _tidy(job, units)  # after workers that died
        summary.seconds = time.perf_counter() - began
        try:
            write_json(job.out / f"{FOLDER}/{report}", summary.facts())
        except GoughError as error:  # a disk that is full: the summary is returned all the same
            log.warning("%s", error)
    return summary


def _share(units: list[Unit], k: int, n: int) -> list[Unit]:
    if not 1 <= k <= n:
        raise GoughError(f"share: expected k of n with k from 1 to n, such as 3/16, found {k}/{n}")
    return units[k - 1 :: n]


def find_engine(name: str) -> Engine:
    """The function of an engine.

    Raises:
        GoughError: an unknown name.
        ModuleNotFoundError: the extra `cluster` is not installed.
    """
    if name == "local":
        return run_local
    if name == "ray":
        from gough.jobs.ray_engine import run_ray  # pyright: ignore

        return run_ray
    raise GoughError(f"engine: expected local or ray, found {name!r}")


def _make_folder(out: Place) -> None:
    try:
        Path(out.path).mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise GoughError(f"{out}: is a file; name a folder to write to") from None
    except OSError as error:
        raise GoughError(f"{out}: cannot be made: {error.strerror}") from None


def _tidy(job: Job, units: Sequence[Unit]) -> None:
    """Remove the unfinished files of killed jobs."""
    if job.out.store:
        return  # an upload that was not completed is no object
    for folder in {Path(job.out.path, unit.name).parent for unit in units}:
        if folder.is_dir():
            with suppress(OSError):
                remove_left_behind(folder)


def _finished(job: Job, units: Sequence[Unit]) -> dict[str, Made]:
    """The finished outputs by name.

    Raises:
        GoughError: the folder holds outputs of another job; with what differs.
    """
    old = read_json(job.out / f"{FOLDER}/job.json")
    differ = [] if old is None else differences(old, job.facts)
    found: dict[str, Made] = {}

    def look(unit: Unit) -> Made | str | None:
        try:
            return finished(job, unit)
        except OtherJobError as error:
            return str(error)
        except GoughError:  # a hostile name: `make` says so
            return None

    if not differ:
        with ThreadPoolExecutor(REQUESTS if job.out.store else 1) as ahead:
            for unit, made in zip(units, ahead.map(look, units), strict=True):
                if isinstance(made, str):
                    differ.append(made)
                elif made is not None:
                    found[unit.name] = made
    if differ:
        more = f"; and {len(differ) - NAMED:,} more" if len(differ) > NAMED else ""
        raise GoughError(
            f"{job.out}: holds outputs of another job ({'; '.join(differ[:NAMED])}{more}); write "
            "to another folder, or pass --force to make all again"
        )
    return found

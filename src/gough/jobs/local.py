"""The engine of this machine: processes, one unit at a time each."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from types import FrameType
from typing import Any

from gough.files.convert import Progress
from gough.jobs.job import Job, Made, Unit
from gough.jobs.work import compile_for, make
from gough.kernel.threads import cores

# A worker takes one to two seconds of a core to start; less work than this is done in this process.
WORTHWHILE = 5.0  # [s]
PER_UNIT = 0.01  # [s] to open, to bring to the disk, and to rename
BYTES = {"solve": 5e7, "inverse": 5e7, "modes": 2.5e5}  # of input a second and core, about
TRIES = 2  # of a unit whose worker died
PATIENCE = 5.0  # [s] for a worker to remove its unfinished file


def run_local(
    job: Job,
    units: Sequence[Unit],
    *,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Generator[Made, None, None]:
    """Make the units of a job with processes of this machine, in any order.

    A worker that dies, for want of memory or by a signal, is replaced, and its unit is tried once
    more. When the iterator is closed, workers remove their unfinished files and end.

    Args:
        job: what to do.
        units: what to make.
        workers: number of processes; all cores unless given. Unless given, what takes a few
            seconds is done in this process with the solver's threads, as one unit always is.
        progress: called after every block of rows that this process solves.
    """
    count = min(workers or cores(), len(units))
    work = PER_UNIT * len(units) + sum(unit.size for unit in units) / BYTES[job.command]
    if count <= 1 or (workers is None and work < WORTHWHILE):
        for unit in units:
            yield make(job, unit, progress, threads=workers or cores())
        return
    compile_for(job)  # once; and workers that compile at the same time could differ in last digits
    context = multiprocessing.get_context("spawn")
    waiting = [_Try(unit) for unit in reversed(units)]
    busy: list[_Worker] = []
    ended: list[_Worker] = []
    try:
        busy = [_Worker(context, job) for _ in range(count)]
        for worker in busy:
            worker.give(waiting.pop())
        while busy:
            ready = wait([worker.connection for worker in busy])
            for worker in [worker for worker in busy if worker.connection in ready]:
                done = worker.result()
                if done is None:  # it died
                    busy.remove(worker)
                    done = worker.task.failed(worker.exit_code())
                    if done is None:
                        waiting.append(worker.task)
                    if waiting:
                        busy.append(_Worker(context, job))
                        busy[-1].give(waiting.pop())
                elif waiting:
                    worker.give(waiting.pop())
                else:
                    busy.remove(worker)
                    worker.connection.close()  # it ends
                    ended.append(worker)
                if done is not None:
                    yield done
    finally:
        for worker in busy:
            worker.process.terminate()
        for worker in busy + ended:
            worker.process.join(PATIENCE)
            worker.process.kill()


@dataclass
class _Try:
    """A unit to make, and how many workers died on it."""

    unit: Unit
    deaths: int = 0

    def failed(self, code: int | None) -> Made | None:
        """Count a death; the failure once there were too many."""
        self.deaths += 1
        if self.deaths < TRIES:
            return None
        how = signal.strsignal(-code) if code is not None and code < 0 else f"exit code {code}"
        text = f"{self.unit.source}: the process that read it died {TRIES} times ({how})"
        return Made(self.unit, error=f"{text}; if for want of memory, pass fewer --workers")


class _Worker:
    """A process, and the unit it is working on."""

    def __init__(self, context: Any, job: Job) -> None:
        self.connection, far = context.Pipe()
        self.process: BaseProcess = context.Process(target=_serve, args=(far, job), daemon=True)
        self.process.start()
        far.close()  # so that the death of the process ends the connection

    def give(self, task: _Try) -> None:
        self.task = task
        with suppress(OSError):  # it died: `result` will find that out
            self.connection.send(task.unit)

    def result(self) -> Made | None:
        """What came of the unit; None if the process died."""
        try:
            return self.connection.recv()
        except (EOFError, OSError):
            return None

    def exit_code(self) -> int | None:
        self.process.join(PATIENCE)
        return self.process.exitcode


def _serve(connection: Connection, job: Job) -> None:
    """Work on units until the connection is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the first process's to handle
    signal.signal(signal.SIGTERM, _leave)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    while True:
        try:
            unit = connection.recv()
        except (EOFError, OSError):
            return
        connection.send(make(job, unit))


def _leave(number: int, frame: FrameType | None) -> None:
    raise SystemExit(128 + number)


def _end_with_parent() -> None:
    """End at once with the first process: what it left must not appear beside a later job's."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)

"""The engine of a Ray cluster (extra `cluster`): units of work as tasks, one CPU each.

Ray keeps the processes of finished tasks for later ones, so that each compiles, or loads what is
compiled, once. The job, with its platform, is sent to a node once. A unit is written whole or not
at all: if its node dies, Ray runs it again on another, and no row is lost or doubled.
"""

from __future__ import annotations

import logging
import os
import signal
import threading
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import gough
from gough.errors import GoughError, printable
from gough.files.convert import Progress
from gough.files.stores import Place, without_credentials
from gough.jobs.job import Job, Made, Unit
from gough.jobs.work import make
from gough.kernel.threads import cores
from gough.seeds.polynomial import PolynomialSeed

TRIES = 4  # of a unit whose worker or node died
AHEAD = 2  # tasks that Ray holds for each CPU: more would only fill its memory
PATIENCE = 5.0  # [s] for workers to remove their unfinished files


def run_ray(
    job: Job,
    units: Sequence[Unit],
    *,
    workers: int | None = None,
    address: str | None = None,
    progress: Progress | None = None,
) -> Generator[Made, None, None]:
    """Make the units of a job on the nodes of a Ray cluster, in any order.

    When the iterator is closed, running tasks are cancelled and remove their unfinished files.

    Args:
        job: what to do. Every node needs this version of gough, the inputs, and the job's folder,
            by the same names: a shared file system, or a store.
        units: what to make.
        workers: units at the same time; as many as the cluster has CPUs unless given.
        address: of the cluster, "auto" for the one that this machine belongs to; one of this
            machine's processes is started, and ended, unless given.
        progress: not called, since no rows are solved in this process.

    Raises:
        GoughError: there is no cluster at the address.
    """
    with _connected(address, workers) as ray:
        task = ray.remote(num_cpus=1, max_retries=TRIES - 1)(_make)
        sent = ray.put(_sendable(job))
        waiting, running = deque(units), {}
        try:
            while waiting or running:
                most = workers or AHEAD * int(ray.cluster_resources().get("CPU", 1))
                while waiting and len(running) < most:
                    unit = waiting.popleft()
                    running[task.remote(sent, _absolute_source(unit))] = unit
                ready, _ = ray.wait([*running], timeout=1.0)
                for done in ready:
                    yield _result(ray, done, running.pop(done))
        finally:
            for each in running:
                ray.cancel(each)
            if running:
                ray.wait([*running], num_returns=len(running), timeout=PATIENCE)


def _make(job: Job, unit: Unit) -> Made:
    """Make a unit on a node."""
    if gough.__version__ != job.version:
        text = f"a node has gough {gough.__version__}, the job's is {job.version}; install the same"
        return Made(unit, error=text)
    return make(job, unit)


def _result(ray: Any, done: Any, unit: Unit) -> Made:
    """What came of a task; the failure if Ray gave it up."""
    try:
        return replace(ray.get(done), unit=unit)
    except ray.exceptions.RayError as error:
        reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
        text = f"{unit.source}: its worker or node died {TRIES} times: {reason}"
        return Made(unit, error=printable(without_credentials(text)))


@contextmanager
def _connected(address: str | None, workers: int | None) -> Iterator[Any]:
    """The module `ray`, connected to a cluster until the block ends; a connection there is stays.

    Raises:
        GoughError: there is no cluster at the address.
    """
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nothing is sent to Ray's makers
    import ray

    if ray.is_initialized():
        yield ray
        return
    settings: dict[str, Any] = {"address": address}
    if address is None:
        # with one CPU a job hung after a loss
        settings = {"num_cpus": max(workers or cores(), 2), "include_dashboard": False}
    with _own_signals():
        try:
            ray.init(**settings, log_to_driver=False, logging_level=logging.ERROR)
        except (ConnectionError, RuntimeError, ValueError) as error:
            reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
            raise GoughError(f"--address {address}: no Ray cluster answers: {reason}") from None
    try:
        yield ray
    finally:
        ray.shutdown()


@contextmanager
def _own_signals() -> Iterator[None]:
    """Keep what this process does at SIGTERM, for which Ray installs a handler."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


# ---- the same on every node ---------------------------------------------------------------


def _sendable(job: Job) -> Job:
    """The job with names that any folder understands, and with the polynomial that is fitted here.

    Fitted on a node of other hardware, it might differ in the last bit, and so would poses.
    """
    options = dict(job.options)
    if job.command == "solve" and options.get("follow") is None:
        settings = {name: options[name] for name in ("seed", "max_iterations") if name in options}
        seed = gough.Solver(job.machine, **settings).seed
        if isinstance(seed, PolynomialSeed):
            options["seed"] = seed
    sent = replace(job, out=_absolute_place(job.out), options=options)
    vars(sent)["facts"] = job.facts  # outputs name the seed, as those of other engines do
    return sent


def _absolute_source(unit: Unit) -> Unit:
    return replace(unit, source=replace(unit.source, place=_absolute_place(unit.source.place)))


def _absolute_place(place: Place) -> Place:
    return place if place.store else Place(os.path.abspath(place.path))

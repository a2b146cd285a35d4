"""Work on many rows, divided among threads that run compiled code."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache

CHUNK = 8_192  # rows a thread takes at a time: their poses fit in a core's cache
SERIAL = 4_096  # up to this many rows one thread is faster than several


def in_parts(
    work: Callable[[int, int], int],
    count: int,
    workers: int | None,
    chunk: int = CHUNK,
    serial: int = SERIAL,
) -> int:
    """Return the sum of work(first, last) over parts of 0..count, on threads where that pays.

    The compiled code releases the GIL. Threads are the pool's own, not Numba's, whose layers
    abort or hang when two callers, or a forked child, use them at once.

    Args:
        workers: threads; as many as there are cores unless given.
        chunk: rows of a part.
        serial: up to this count one thread does all parts.
    """
    if 0 < count <= min(chunk, serial):
        return work(0, count)
    parts = [(i, min(i + chunk, count)) for i in range(0, count, chunk)]
    threads = workers or cores()
    if threads <= 1 or count <= serial:
        return sum(work(*part) for part in parts)
    with ThreadPoolExecutor(threads) as pool:
        return sum(pool.map(lambda part: work(*part), parts))


@lru_cache
def cores() -> int:
    """Return how many cores this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1

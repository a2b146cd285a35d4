"""Reading ahead and writing behind: a thread each, beside the one that solves.

Decoding, solving and encoding release the GIL, so that two cores do them at once. Few blocks wait
between two threads, which bounds the memory whatever the file's size. Rows stay in order, errors
come where they would without threads, and no thread is left behind by an error or a signal.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

import pyarrow as pa

from gough.files.rows import Sink

Item = TypeVar("Item")
WAITING = 2  # blocks between two threads


def read_ahead(items: Iterator[Item], depth: int = WAITING) -> Generator[Item, None, None]:
    """Yield the items of an iterator, which a thread makes up to `depth` ahead.

    Close the generator before what `items` reads from is closed.
    """
    end = object()
    with _one_thread() as pool:
        waiting = deque(pool.submit(next, items, end) for _ in range(depth))
        while (item := waiting.popleft().result()) is not end:
            waiting.append(pool.submit(next, items, end))
            yield item  # pyright: ignore[reportReturnType]


@contextmanager
def write_behind(sink: Sink, depth: int = WAITING) -> Iterator[Sink]:
    """Yield a sink whose tables a thread writes to `sink`, all of them before the block ends."""
    with _one_thread() as pool:
        behind = _WriteBehind(sink, pool, depth)
        yield behind
        behind.wait_until(0)


class _WriteBehind:
    def __init__(self, sink: Sink, pool: ThreadPoolExecutor, depth: int) -> None:
        self._sink, self._pool, self._depth = sink, pool, depth
        self._waiting: deque[Future[None]] = deque()

    def write(self, table: pa.Table) -> None:
        """Append rows; raises the error of a table written before."""
        self._waiting.append(self._pool.submit(self._sink.write, table))
        self.wait_until(self._depth)

    def wait_until(self, most: int) -> None:
        """Wait until at most this many tables are not written yet."""
        while len(self._waiting) > most:
            self._waiting.popleft().result()


@contextmanager
def _one_thread() -> Iterator[ThreadPoolExecutor]:
    """A pool of one thread, which ends with the work in hand however the block ends."""
    pool = ThreadPoolExecutor(1)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)

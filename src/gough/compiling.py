"""Measure the time that this process compiles, and call a function when compiling begins.

Numba reports to `gough.kernel.jit`, which reports here; nothing is imported.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class _Clock:
    """Adds up the time from the outermost beginning to its end; Numba's lock keeps threads apart.

    Attributes:
        seconds: time spent so far [s].
        announce: called with a function's name when compiling begins; None for silence.
    """

    def __init__(self) -> None:
        self.seconds, self._depth, self._began = 0.0, 0, 0.0
        self.announce: Callable[[str], None] | None = None

    def begin(self, name: str) -> None:
        if self._depth == 0:
            self._began = time.perf_counter()
            if self.announce is not None:
                self.announce(name)
        self._depth += 1

    def end(self) -> None:
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.perf_counter() - self._began


clock = _Clock()


def seconds() -> float:
    """Return the time spent on compiling in this process so far [s]."""
    return clock.seconds


@contextmanager
def announced(announce: Callable[[str], None]) -> Iterator[None]:
    """Call `announce` with the name of each function whose compiling begins."""
    before, clock.announce = clock.announce, announce
    try:
        yield
    finally:
        clock.announce = before

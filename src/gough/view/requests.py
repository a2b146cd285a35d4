"""Requests from the page in order, and the pace of what follows them less often."""

from __future__ import annotations

import threading
from collections import deque

CONTINUOUS = ("legs", "numbers", "drag", "row", "tick")  # only the newest request counts


class RequestQueue:
    """Requests from the page that are not handled yet; of a dragged slider, the newest only."""

    def __init__(self) -> None:
        self._queue: deque[tuple[str, dict]] = deque()
        self._changed = threading.Condition()

    def post(self, kind: str, values: dict) -> None:
        """Add a request; a continuous one is merged with the same kind at the end of the queue."""
        with self._changed:
            if kind in CONTINUOUS and self._queue and self._queue[-1][0] == kind:
                self._queue[-1][1].update(values)
            else:
                self._queue.append((kind, dict(values)))
            self._changed.notify()

    def get(self, timeout: float | None) -> tuple[str, dict] | None:
        """Return the next request, or None after `timeout` seconds without one."""
        with self._changed:
            self._changed.wait_for(lambda: self._queue, timeout)
            return self._queue.popleft() if self._queue else None


class Pace:
    """Work that is done after requests, at most once in `period` seconds."""

    def __init__(self, period: float) -> None:
        self._period, self._last, self._waiting = period, 0.0, False

    def ask(self) -> None:
        """Ask for the work to be done, now or at the end of the period."""
        self._waiting = True

    def wait(self, now: float) -> float | None:
        """Seconds until the work is due; None if nothing waits."""
        return max(0.0, self._last + self._period - now) if self._waiting else None

    def start(self, now: float) -> bool:
        """Return whether the work is due, and take it as done."""
        due = self.wait(now) == 0.0
        if due:
            self._last, self._waiting = now, False
        return due

"""Ctrl-C and requests to terminate: none is lost, and none interrupts the removal of files.

Libraries that import others when first used may swallow an exception raised by a signal handler.
So the request is also recorded, and commands that run long call `check` after every block of rows.
"""

from __future__ import annotations

import signal
import time
from types import FrameType

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
CLEANUP = 2.0  # [s] in which further signals do not interrupt the removal of unfinished files

_requested: int | None = None
_since = 0.0


class Stopped(BaseException):
    """The process was asked to end; passes through every `finally` on its way out.

    Attributes:
        number: of the signal.
        left: what the command leaves behind.
    """

    left = "no file was changed"

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def listen() -> None:
    """Make the signals that end a process raise `Stopped`; ignored ones stay ignored."""
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _record)


def ignore() -> None:
    """Ignore further signals once the work is over, so that none changes the exit code."""
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) == _record:
            signal.signal(number, signal.SIG_IGN)


def requested() -> int | None:
    """The signal that asked the process to end, if one did."""
    return _requested


def check() -> None:
    """Raise `Stopped` if a signal has asked the process to end."""
    if _requested is not None:
        raise Stopped(_requested)


def _record(number: int, frame: FrameType | None) -> None:
    global _requested, _since
    first = _requested is None or time.monotonic() - _since > CLEANUP
    _requested, _since = number, time.monotonic() if first else _since
    if first:
        raise Stopped(number)

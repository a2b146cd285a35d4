"""Ctrl-C and requests to terminate: never lost, and never in the way of tidying up.

An exception that a signal handler raises can be swallowed: libraries that import others when
first used catch whatever goes wrong there. So the request is also noted, and commands that run
long ask for it after every block of rows.
"""

from __future__ import annotations

import signal
import time
from types import FrameType

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
TIDYING = 2.0  # seconds in which more signals do not interrupt the removal of unfinished files

_asked: int | None = None
_since = 0.0


class Stopped(BaseException):
    """The process was asked to end; passes through every `finally` on its way out."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def listen() -> None:
    """Turn the signals that ask a process to end into `Stopped`; ignored ones stay ignored."""
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _note)


def ignore() -> None:
    """The work is over, one way or the other: let nothing change the exit code any more."""
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) == _note:
            signal.signal(number, signal.SIG_IGN)


def asked() -> int | None:
    """The signal that asked for the end, if one did."""
    return _asked


def check() -> None:
    """Raise `Stopped` if a signal has asked for it."""
    if _asked is not None:
        raise Stopped(_asked)


def _note(number: int, frame: FrameType | None) -> None:
    global _asked, _since
    first = _asked is None or time.monotonic() - _since > TIDYING
    _asked, _since = number, time.monotonic() if first else _since
    if first:
        raise Stopped(number)

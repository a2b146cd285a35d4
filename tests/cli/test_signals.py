"""Requests to stop survive libraries that swallow exceptions, and do not disturb tidying up."""

from __future__ import annotations

import contextlib
import signal

import pytest

from gough.commands import signals


@pytest.fixture(autouse=True)
def fresh(monkeypatch):
    monkeypatch.setattr(signals, "_requested", None)
    monkeypatch.setattr(signals, "_since", 0.0)


def test_nothing_happens_unless_asked():
    signals.check()
    assert signals.requested() is None


def test_a_swallowed_request_is_raised_again():
    with contextlib.suppress(BaseException):
        signals._record(signal.SIGTERM, None)
    with pytest.raises(signals.Stopped) as stop:
        signals.check()
    assert stop.value.number == signals.requested() == signal.SIGTERM


def test_a_second_request_waits_while_files_are_tidied_up(monkeypatch):
    with pytest.raises(signals.Stopped):
        signals._record(signal.SIGINT, None)
    signals._record(signal.SIGINT, None)
    monkeypatch.setattr(signals, "CLEANUP", -1.0)
    with pytest.raises(signals.Stopped):
        signals._record(signal.SIGINT, None)

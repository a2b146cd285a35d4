"""Requests to stop survive libraries that swallow exceptions, and do not disturb tidying up."""

from __future__ import annotations

import contextlib
import signal

import pytest

from gough.commands import signals as stopping


@pytest.fixture(autouse=True)
def fresh(monkeypatch):
    monkeypatch.setattr(stopping, "_asked", None)
    monkeypatch.setattr(stopping, "_since", 0.0)


def test_nothing_happens_unless_asked():
    stopping.check()
    assert stopping.asked() is None


def test_a_swallowed_request_is_raised_again():
    with contextlib.suppress(BaseException):
        stopping._note(signal.SIGTERM, None)
    with pytest.raises(stopping.Stopped) as stop:
        stopping.check()
    assert stop.value.number == stopping.asked() == signal.SIGTERM


def test_a_second_request_waits_while_files_are_tidied_up(monkeypatch):
    with pytest.raises(stopping.Stopped):
        stopping._note(signal.SIGINT, None)
    stopping._note(signal.SIGINT, None)
    monkeypatch.setattr(stopping, "TIDYING", -1.0)
    with pytest.raises(stopping.Stopped):
        stopping._note(signal.SIGINT, None)

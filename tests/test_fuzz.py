"""A short run of tools/fuzz.py, and that it notices what it looks for."""

from __future__ import annotations

import fuzz
import pytest
from fuzzing.targets import TARGETS

import gough

NAMES = [name for name in TARGETS if name != "safetensors"]


def test_damaged_inputs_are_refused_in_a_line_and_good_answers_are_good():
    found = fuzz.fuzz(NAMES, inputs=200, seconds=60)
    assert [finding for tally in found.values() for finding in tally.findings] == []
    for tally in found.values():
        assert tally.counts["refused"] > 0
    assert found["toml"].counts["accepted"] > 10
    assert found["csv"].counts["accepted"] > 10


@pytest.mark.torch
def test_damaged_weights_are_refused_in_a_line():
    pytest.importorskip("safetensors")
    tally = fuzz.fuzz(["safetensors"], inputs=60, seconds=60)["safetensors"]
    assert tally.findings == []
    assert tally.counts["refused"] > 30


def test_a_wrong_pose_and_a_traceback_are_noticed(monkeypatch):
    right = gough.Platform.load

    def moved(where):
        platform = right(where)
        return gough.Platform(
            platform.base + 1e-6 * platform.size, platform.moving * 1.001, platform.home,
            unit=platform.unit, legs=platform.legs, rotary=platform.rotary, pivot=platform.pivot,
        )  # fmt: skip

    monkeypatch.setattr(gough.Platform, "load", staticmethod(moved))
    assert fuzz.fuzz(["toml"], inputs=12, seconds=60)["toml"].counts["WRONG"] > 0

    def broken(where):
        raise KeyError(where)

    monkeypatch.setattr(gough.Platform, "load", staticmethod(broken))
    found = fuzz.fuzz(["toml"], inputs=2, seconds=60)
    assert found["toml"].counts["TRACEBACK"] == 2
    assert fuzz.report(found) == 2


def test_an_input_is_the_same_in_every_run():
    runs = [fuzz.fuzz(["toml", "csv"], inputs=40, seconds=60) for _ in range(2)]
    assert [t.counts for t in runs[0].values()] == [t.counts for t in runs[1].values()]

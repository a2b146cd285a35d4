"""What notebooks show: short, escaped, with units, and a row for each pose that is shown."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given
from support import BATCHES, random_platforms

import gough
from gough.text import SHOWN, page

PLATFORM = gough.Platform.load("reference")
POSES = PLATFORM.sample_poses(40, seed=2)
READINGS = gough.leg_lengths(PLATFORM, POSES)


class _Reader(HTMLParser):
    """Collects rows of cells and checks that tags are closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.said, self._open = "", []
        self.feed(text)
        self.close()
        assert not self._open

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self._open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.said += data + "\n"
        if self._open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


def read(thing: object) -> _Reader:
    reader = _Reader(thing._repr_html_())  # pyright: ignore[reportAttributeAccessIssue]
    assert len({len(row) for row in reader.rows}) == 1, "heads and rows have as many cells"
    return reader


def test_a_long_batch_shows_its_ends_and_counts_every_status() -> None:
    readings = READINGS.copy()
    readings[17, 2] = np.nan
    shown = read(gough.solve(PLATFORM, readings, certify=True))
    head, *rows = shown.rows
    assert head[:4] == ["row", "x [mm]", "y [mm]", "z [mm]"]
    assert head[-3:] == ["residual [mm]", "iterations", "radius [mm]"]
    assert [row[0] for row in rows] == [*"01234", "⋮", *map(str, range(35, 40))]
    assert len(rows) == 2 * SHOWN + 1
    assert float(rows[-1][1]) == pytest.approx(POSES.position[-1, 0], rel=1e-6)
    assert "39 certified, first in row 0: Proven" in shown.said
    assert "1 invalid_input, first in row 17: A reading is not" in shown.said


@pytest.mark.parametrize("batch", BATCHES)
def test_every_batch_is_shown_whole_where_it_is_short(batch: tuple[int, ...]) -> None:
    count = int(np.prod(batch))
    found = gough.solve(PLATFORM, READINGS[:count].reshape(*batch, 6))
    for thing in (found, found.pose):
        rows = read(thing).rows[1:]
        assert len(rows) == count
        turns = [[float(c) for c in row[4:7]] for row in rows]
        np.testing.assert_allclose(turns, np.degrees(POSES[:count].euler), atol=1e-4)


def test_invalid_rows_show_dashes_and_no_batch_an_empty_table() -> None:
    row = read(gough.solve(PLATFORM, np.full(6, np.nan))).rows[1]
    assert row == ["", *"––––––", "invalid_input", "–", "0"]
    assert len(read(gough.solve(PLATFORM, np.zeros((0, 6)))).rows) == 1


@given(random_platforms)
def test_every_platform_is_shown_with_its_units(platform: gough.Platform) -> None:
    shown = read(platform)
    unit = "rad" if platform.legs == "rotary" else platform.unit or "unit not named"
    assert shown.rows[0][3:] == [f"home [{unit}]", f"stroke [{unit}]"]
    assert len(shown.rows) == 7
    assert ("pivot: " in shown.said) == (platform.pivot is not None)
    assert "workspace from home: x " in shown.said


def test_text_is_never_taken_for_markup() -> None:
    evil = replace(PLATFORM, name="<script>&amp;", unit="<b>mm</b>")
    solution = gough.solve(evil, READINGS[:3])
    tracker = gough.Tracker(evil)
    tracker.update(READINGS[0])
    modes = gough.assembly_modes(evil, READINGS[:2])
    for thing in (evil, solution, tracker, modes, modes.certificate):
        text = thing._repr_html_()
        assert "<script>" not in text
        assert "<b>" not in text
        read(thing)
    assert "<script>&amp;" in read(evil).said
    assert "<i>" not in page("<i>", ["<i>"], [["<i>"]], ["<i>"])


def test_modes_certificates_and_trackers_say_what_is_known() -> None:
    modes = gough.assembly_modes(PLATFORM, np.vstack([READINGS[:2], np.full(6, np.nan)]))
    shown = read(modes)
    assert shown.rows[0][:3] == ["row", "set", "x [mm]"]
    assert "2 complete: Every complex solution" in shown.said
    assert "1 invalid_input: " in shown.said
    single = read(modes[0])
    assert "set" not in single.rows[0]
    proof = modes[0].certificate
    assert re.fullmatch(
        r"Certificate\((\d+) of \1 certified; smallest radius .* \[mm\]\)", repr(proof)
    )
    assert {row[1] for row in read(proof).rows[1:]} <= {"yes", "⋮"}
    nothing = gough.certify(PLATFORM, READINGS[:1] + 50, POSES[:1])
    assert repr(nothing) == "Certificate(0 of 1 certified)"
    assert read(nothing).rows[1][1:] == ["no", "0", "inf"]
    tracker = gough.Tracker(PLATFORM)
    tracker.update(READINGS[0])
    assert repr(tracker).startswith("Tracker('reference', found, converged, Pose(position=(")
    tracker.update([np.nan] * 6)
    assert "the last good pose is held" in read(tracker).said

"""The documents' pictures come from the commands that stand beside them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")

import pictures

from gough import cli

ROOT = Path(__file__).parents[2]
LARGEST = 300_000  # bytes of a picture in the documents


def outputs() -> set[str]:
    return {line.rpartition(" -o ")[2] for line in pictures.commands() if " plot " in line}


def test_every_picture_has_its_command_and_every_command_its_picture():
    text = (ROOT / "docs" / "plots.md").read_text("utf-8")
    shown = set(re.findall(r"!\[[^]]*\]\(images/([^)]+)\)", text))
    assert shown == outputs()
    assert shown <= {path.name for path in (ROOT / "docs" / "images").iterdir()}


def test_pictures_are_small():
    for path in (ROOT / "docs" / "images").iterdir():
        assert path.stat().st_size < LARGEST, path


def test_the_readme_opens_with_two_of_them_and_their_commands():
    text = (ROOT / "README.md").read_text("utf-8")
    opening = text[: text.index("## ")]
    for name in ("pose.svg", "modes.svg"):
        assert f"](docs/images/{name})" in opening
    commands = re.findall(r"`(gough plot [^`]+)`", opening)
    assert len(commands) == 2
    assert set(commands) <= set(pictures.commands())


@pytest.mark.slow
def test_the_commands_make_the_pictures(tmp_path, monkeypatch):
    for name in ("listen", "ignore"):  # signals belong to the tests
        monkeypatch.setattr(cli.signals, name, lambda: None)
    assert {path.name for path in pictures.make(tmp_path)} == outputs()

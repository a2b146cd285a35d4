"""The figures of the documents are those that their scripts draw."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import documents
import numpy as np
import pytest

IMAGES = documents.ROOT / "docs" / "images"
DRAW = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import draw
draw.draw([], Path(sys.argv[2]))
"""
SLACK = 5.0  # [pt] that rounding may move a curve on a logarithmic axis


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with all figures, drawn now."""
    pytest.importorskip("matplotlib", reason="figures need the extra plot")
    folder = tmp_path_factory.mktemp("figures")
    scripts = str(documents.ROOT / "docs" / "figures")
    subprocess.run([sys.executable, "-c", DRAW, scripts, str(folder)], check=True)
    return folder


def words(svg: str) -> list[str]:
    """The glyphs of all that is written in a figure, in order."""
    return re.findall(r'href="#(DejaVu[^"]+|Cmmi[^"]+|STIX[^"]+)"', svg)


def curves(svg: str) -> np.ndarray:
    """The numbers of all paths, in order."""
    paths = " ".join(re.findall(r'\bd="([^"]+)"', svg))
    return np.array(re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", paths), dtype=float)


@pytest.mark.process
def test_each_figure_is_as_its_script_draws_it(drawn: Path) -> None:
    for path in sorted(drawn.glob("*.svg")):
        now, kept = path.read_text("utf-8"), (IMAGES / path.name).read_text("utf-8")
        told = f"{path.name} is out of date: python docs/figures/draw.py {path.stem}"
        assert words(now) == words(kept), told
        assert curves(now).shape == curves(kept).shape, told
        assert np.abs(curves(now) - curves(kept)).max() < SLACK, told


@pytest.mark.process
def test_each_figure_stands_on_a_page(drawn: Path) -> None:
    text = "".join(page.read_text("utf-8") for page in documents.PAGES)
    unused = [path.name for path in drawn.glob("*.svg") if f"images/{path.name})" not in text]
    assert not unused


def test_pages_show_pictures_that_are_there() -> None:
    for page in documents.PAGES:
        for target in re.findall(r"!\[[^\]]*\]\(([^)\s]+)\)", page.read_text("utf-8")):
            assert (page.parent / target).is_file(), f"{page.name}: {target}"

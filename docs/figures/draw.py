"""Draw the figures of these pages: `python docs/figures/draw.py [NAME ...]`.

They go to docs/images/NAME.svg. Needs the extra `plot`; the pages themselves build without it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import explain
import learned
import measured
import workshop
from style import IMAGES, save

FIGURES = workshop.FIGURES | explain.FIGURES | measured.FIGURES | learned.FIGURES


def draw(names: list[str], folder: Path = IMAGES) -> None:
    """Write the named figures; without names, all."""
    for name in names or FIGURES:
        if name not in FIGURES:
            sys.exit(f"no figure is called {name!r}; there are {', '.join(FIGURES)}")
        save(FIGURES[name](), name, folder)


if __name__ == "__main__":
    draw(sys.argv[1:])

"""Fitted polynomials on disk, under the platform's digest: a convenience, never a need."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from gough.errors import GoughError
from gough.platform import Platform
from gough.seeds.polynomial import Polynomial, monomials
from gough.whole_file import replacing

VERSION = 1  # of the fit: raise it when polynomials fitted before are no longer right


def folder() -> Path:
    """Where fits are kept: $GOUGH_CACHE_DIR, else the user's cache folder."""
    chosen = os.environ.get("GOUGH_CACHE_DIR")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gough"


def remember(platform: Platform, degree: int, make: Callable[[], Polynomial]) -> Polynomial:
    """The kept polynomial, or one made now and kept if the folder can be written."""
    path = folder() / f"polynomial-{VERSION}-{degree}-{platform.digest}.npz"
    kept = _read(path, degree)
    if kept is not None:
        return kept
    made = make()
    _write(path, made)
    return made


def _read(path: Path, degree: int) -> Polynomial | None:
    """The polynomial in a file; None where there is none, or it is damaged."""
    try:
        # opened here, since np.load leaves a damaged file open
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            found = Polynomial(file["coefficients"], file["scaling"], file["anchor"], degree)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    shapes = found.coefficients.shape, found.scaling.shape, found.anchor.shape
    if shapes != ((len(monomials(degree)[0]), 6), (2, 6), (4,)):
        return None
    arrays = (found.coefficients, found.scaling, found.anchor)
    return found if all(np.all(np.isfinite(a)) for a in arrays) else None


def _write(path: Path, made: Polynomial) -> None:
    with suppress(OSError, GoughError):  # a full disk costs the next process a second, no more
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            np.savez(file, coefficients=made.coefficients, scaling=made.scaling, anchor=made.anchor)

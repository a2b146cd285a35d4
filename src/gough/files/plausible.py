"""Readings that are in another unit or count from another zero than the platform's."""

from __future__ import annotations

import numpy as np

from gough.checks import Array
from gough.errors import InputError
from gough.files.log_format import LogFormat
from gough.files.rows import Source
from gough.platform import Platform
from gough.units import LENGTHS

UNITS = ("m", "cm", "mm", "um", "in", "ft")
NEAR = 0.3  # relative difference within which readings agree with a guess at what they are


def check_plausible(source: Source, platform: Platform, legs: Array) -> None:
    """Raise if the readings of most rows have a likely mistake of unit or zero.

    Nothing is checked once a unit, a scale or an offset was given.

    Args:
        source: the file.
        platform: the machine.
        legs: (N, 6) readings of a first part of the file.

    Raises:
        InputError: naming the likely cause and the option that corrects it.
    """
    form = source.reading.log
    if form != LogFormat(form.columns, decimal=form.decimal, time=form.time):
        return
    rows = legs[np.all(np.isfinite(legs), axis=-1) & np.any(legs != 0, axis=-1)]
    if not len(rows):
        return
    fault = _angle_fault(rows) if platform.legs == "rotary" else _length_fault(platform, rows)
    if fault:
        raise InputError(f"{source.where}: {fault}")


def _angle_fault(rows: Array) -> str:
    largest = np.abs(rows).max(axis=-1)
    if np.median(largest) <= 2 * np.pi:
        return ""
    return (
        f"motor angles reach {largest.max():.4g} rad, more than a turn: if they are degrees, pass "
        "--angle-unit deg; if they are right, --angle-unit rad"
    )


def _length_fault(platform: Platform, rows: Array) -> str:
    middle = np.median(rows, axis=0)
    right = f"if they are right, --unit {platform.unit or 'm'}"
    if platform.legs == "length_change":
        if not _agree(middle, platform.home_lengths):
            return ""
        offset = ",".join(f"{-value:.9g}" for value in platform.home_lengths)
        return (
            "readings are like the legs' lengths at home, but this machine's are changes of length "
            f"from home: pass --offset={offset}; {right}"
        )
    home = platform.home_legs
    ratio = float(np.median(middle / home))
    if 1 - NEAR < ratio < 1 + NEAR:
        return ""
    if np.all(np.abs(middle) < NEAR * np.abs(home)) and np.any(rows < 0):
        offset = ",".join(f"{value:.9g}" for value in home)
        return (
            "readings are on both sides of zero, and this machine's are lengths: if they count "
            f"from home, pass --offset={offset}; {right}"
        )
    for unit in UNITS if platform.unit in LENGTHS else ():
        factor = LENGTHS[platform.unit] / LENGTHS[unit]
        if unit != platform.unit and _agree(np.asarray(ratio), np.asarray(factor)):
            return (
                f"readings are about {ratio:.3g} times those at home [{platform.unit}]: if they "
                f"are in [{unit}], pass --unit {unit}; {right}"
            )
    return ""


def _agree(values: Array, expected: Array) -> bool:
    return bool(np.all(np.abs(values - expected) < NEAR * np.abs(expected)))

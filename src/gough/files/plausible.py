"""Readings that are in another unit or count from another zero than the platform's."""

from __future__ import annotations

import numpy as np

from gough.checks import Array
from gough.errors import InputError
from gough.files.log_format import LogFormat
from gough.files.rows import Source
from gough.limit_rules import in_stroke
from gough.platform import Platform
from gough.units import LENGTHS

UNITS = ("m", "cm", "mm", "um", "in", "ft")
NO_SIGNAL = (0, 1, 999, 9999, 99999, 999999, 32767, 32768, 65535)  # written for "no value"
FACTOR = 5.0  # by which no leg is longer or shorter than at home
SAMPLE = 4096  # rows, evenly over those given, that tell a mistake of most rows
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
    if fault := likely_fault(platform, legs[:: max(1, len(legs) // SAMPLE)]):
        raise InputError(f"{source.where}: {fault}")


def likely_fault(platform: Platform, legs: Array) -> str:
    """The likely mistake of unit or zero in most rows of readings (N, 6), with its cure, or ""."""
    rows = legs[np.all(np.isfinite(legs), axis=-1) & np.any(legs != 0, axis=-1)]
    if not len(rows):
        return ""
    return _angle_fault(rows) if platform.legs == "rotary" else _length_fault(platform, rows)


def cause(platform: Platform, legs: Array) -> str:
    """The likely cause of six readings that no pose has, "" where none is known."""
    if platform.legs == "rotary":
        worst = int(np.argmax(np.abs(legs)))
        turns = abs(legs[worst]) > 2 * np.pi
        return f"leg_{worst + 1} is {legs[worst]:.6g} rad, more than a turn" if turns else ""
    lengths = platform.gain * legs + platform.true_at_zero
    ratio = lengths / platform.home_lengths
    far = (ratio < 1 / FACTOR) | (ratio > FACTOR)
    if _below_stroke(platform, legs):
        return "all readings are below the stroke, as if counted from the retracted end"
    if np.all(far):
        middle = float(np.median(ratio))
        if np.all(legs == legs[0]) and abs(legs[0]) in NO_SIGNAL:
            return f"all readings are {legs[0]:.6g}: no signal?"
        named = _unit_of(platform, middle) if platform.legs == "telescopic" else ""
        return f"the legs are about {middle:.3g} times as long as at home{named}"
    if np.any(far):
        legs_far = np.flatnonzero(far)
        named = ", ".join(f"leg_{leg + 1} is {legs[leg]:.6g}" for leg in legs_far)
        return f"{named}, the others are like home's: no signal, or a digit too many or too few?"
    return ""


def _below_stroke(platform: Platform, legs: Array) -> bool:
    """True for six readings below the stroke that are within it if its lower end is added."""
    if platform.stroke is None or platform.legs != "telescopic":
        return False
    low, high = platform.stroke.T
    slack = 0.01 * (high - low)
    return bool(np.all((legs < low) & (legs >= -slack) & (legs <= high - low + slack)))


def _unit_of(platform: Platform, ratio: float) -> str:
    for unit in UNITS if platform.unit in LENGTHS else ():
        factor = LENGTHS[platform.unit] / LENGTHS[unit]
        if unit != platform.unit and _agree(np.asarray(ratio), np.asarray(factor)):
            return f": in [{unit}] instead of [{platform.unit}]?"
    return ""


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
    by_unit = _unit_fault(platform, rows, ratio)
    below = [_below_stroke(platform, row) for row in rows[:: 1 + len(rows) // 100]]
    if np.mean(below) > 0.9 and platform.stroke is not None and not by_unit[1]:
        offset = ",".join(f"{value:.9g}" for value in platform.stroke[:, 0])
        return (
            "readings are below the stroke, by its lower end: if they count from the retracted "
            f"end, pass --offset={offset}; {right}"
        )
    return by_unit[0] and f"{by_unit[0]}; {right}"


def _unit_fault(platform: Platform, rows: Array, ratio: float) -> tuple[str, bool]:
    """Advice on rows in another unit, and whether it brings them within a stated stroke."""
    for unit in UNITS if platform.unit in LENGTHS else ():
        factor = LENGTHS[platform.unit] / LENGTHS[unit]
        if unit != platform.unit and _agree(np.asarray(ratio), np.asarray(factor)):
            text = (
                f"readings are about {ratio:.3g} times those at home [{platform.unit}]: if they "
                f"are in [{unit}], pass --unit {unit}"
            )
            return text, bool(np.mean(in_stroke(platform, rows / factor)) > 0.9)
    return "", False


def _agree(values: Array, expected: Array) -> bool:
    return bool(np.all(np.abs(values - expected) < NEAR * np.abs(expected)))

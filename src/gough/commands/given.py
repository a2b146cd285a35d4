"""Readings and poses that a command line gives: six numbers, or a file."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional

from gough.commands.options import option

if TYPE_CHECKING:
    from gough.checks import Array
    from gough.files.formats import Given
    from gough.files.rows import Reading
    from gough.files.trajectory import Trajectory
    from gough.platform import Platform

Legs = Annotated[Positional[tuple[str, ...]], option(metavar="[LEGS]")]
PoseNumbers = Annotated[
    tuple[str, str, str, str, str, str] | None,
    option(
        "Take this pose: x y z in the platform's unit, rx ry rz in degrees (R = Rx Ry Rz).",
        "X Y Z RX RY RZ",
    ),
]


def legs_given(words: tuple[str, ...]) -> Given:
    """Six readings, or the path of a file of readings.

    Raises:
        InputError: neither six numbers nor one file.
    """
    from gough.columns import LEGS

    return _given("LEGS", words, LEGS, "six readings")


def pose_given(words: tuple[str, ...]) -> Given:
    """Six numbers of a pose, or the path of a file of poses.

    Raises:
        InputError: neither six numbers nor one file.
    """
    from gough.columns import pose_names

    return _given("POSE", words, pose_names("deg"), "six numbers x y z rx ry rz")


def readings_given(words: tuple[str, ...], platform: Platform, name: str) -> Array:
    """Six readings (6,), those of a file (N, 6), or those at home if nothing is given.

    Args:
        words: the words of the command line.
        platform: the machine.
        name: its name or file, for the form of its logs.

    Raises:
        InputError: neither six numbers nor a file that can be read.
    """
    from gough.commands.options import ReadingOptions
    from gough.files import read_legs

    if not words:
        return platform.home_legs
    legs = read_legs(legs_given(words), platform, ReadingOptions().of(name))
    return legs[0] if len(words) == 6 else legs


def row_given(
    legs: tuple[str, ...],
    pose: tuple[str, ...] | None,
    platform: Platform,
    row: int = 1,
    reading: Reading | None = None,
    frame: str | None = None,
) -> Trajectory | None:
    """The pose of a command line with its status, None if it gives none.

    Args:
        legs: six readings or a file, solved unless it holds poses.
        pose: six numbers of a pose.
        platform: the machine.
        row: number of the row in a file, from 1.
        reading: options for reading a file.
        frame: whose pose is given.

    Raises:
        InputError: both are given, or no pose can be found.
    """
    from gough.errors import InputError
    from gough.files.rows import Reading
    from gough.files.trajectory import read_row

    if legs and pose:
        raise InputError("LEGS, --pose: pass one of them, not both")
    if not legs and not pose:
        return None
    given = pose_given(pose) if pose else legs_given(legs)
    return read_row(given, platform, row, reading=reading or Reading(), frame=frame)


def _given(where: str, words: tuple[str, ...], names: tuple[str, ...], expected: str) -> Given:
    from gough.errors import InputError
    from gough.files.formats import GivenRow

    if len(words) == 1 and not is_number(re.split(r"[,;\s]+", words[0].strip())[0]):
        return words[0]
    # numbers as one types or copies them: "1, 2, 3" in quotation marks, or commas between
    parts = re.split(r"[,;\s]+", words[0].strip()) if len(words) == 1 else words
    values = tuple(part.strip().rstrip(",;") for part in parts)
    if len(values) != 6:
        found = f"found {len(values)}: {' '.join(values)}" if values else "found nothing"
        raise InputError(f"{where}: expected {expected}, or a file; {found:.200}")
    for value in values:
        if not is_number(value):
            raise InputError(f"{where}: expected {expected}, or a file; found {value[:40]!r}")
    return GivenRow(where, names, values)


def is_number(text: str) -> bool:
    """Return whether text is a number, with a decimal point or comma."""
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True

"""Files of measurements: readings and what an instrument measured, a row for each pose."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np

from gough.calibration.inputs import check_kind
from gough.checks import Array
from gough.columns import (
    LEGS,
    POSITION,
    ROTATION_TEXT,
    checked,
    leg_columns,
    pose_columns,
    rotation_columns,
)
from gough.errors import GoughError, InputError
from gough.files import open_source
from gough.platform import Platform
from gough.pose import poses_from_columns

TILTS = ("tilt_x", "tilt_y")
COLUMNS = {
    "pose": f"x, y, z and a rotation ({ROTATION_TEXT})",
    "orientation": f"a rotation ({ROTATION_TEXT})",
    "position": "x, y, z",
    "targets": "x_1, y_1, z_1, x_2, y_2, z_2, ...",
    "distances": "distance_1, distance_2, ...",
    "inclinometer": "tilt_x_deg, tilt_y_deg, or tilt_x, tilt_y [rad]",
}

NOISE = {
    "pose": ("sigma", "sigma_deg"),
    "orientation": ("sigma_deg",),
    "position": ("sigma",),
    "targets": ("sigma",),
    "distances": ("sigma",),
    "inclinometer": ("sigma_deg",),
}  # standard deviations of each row: [platform unit], [deg]


@dataclass(frozen=True, eq=False)
class Measured:
    """The rows of a file.

    Attributes:
        legs: (n, 6) readings.
        measured: as `gough.calibrate` takes it.
        sigma: standard deviations as `gough.calibrate` takes them.
        time: (n,) the time column, or None.
        place: where row i stands in the file, such as "line 17".
    """

    legs: Array
    measured: Any
    sigma: Any
    time: Array | None
    place: Callable[[int], str]


def read_measured(
    path: str,
    platform: Platform,
    kind: str = "pose",
    time: str | None = None,
    sigma: Sequence[float] = (),
) -> Measured:
    """Read a .csv or .parquet file of measurements.

    Args:
        kind: what was measured, which says what columns there are; see `COLUMNS`.
        time: name of the column of time.
        sigma: standard deviations [platform unit], [deg] of every row; without them each row has
            its own, in the columns `NOISE[kind]`.

    Raises:
        GoughError: a kind that is not known.
        InputError: columns that are missing, values that are no numbers.
    """
    check_kind(kind)
    with closing(open_source(path, platform)) as source:
        found = source.columns
        legs = leg_columns(source.where, found)
        names = _columns(source.where, kind, found)
        extra = _noise_columns(source.where, kind, found, sigma) + ([time] if time else [])
        checked(source.where, found, extra)
        blocks = list(source.blocks([*legs, *names, *extra]))
    values = np.concatenate([block.numbers([*LEGS, *names, *extra]) for block in blocks])
    starts = np.cumsum([0, *(len(block) for block in blocks)])

    def place(row: int) -> str:
        block = int(np.searchsorted(starts, row, side="right")) - 1
        return blocks[block].place(row - int(starts[block]))

    count = 6 + len(names)
    when = values[:, -1] if time is not None else None
    measured = _as_measured(kind, values[:, 6:count], names)
    own = values[:, count : count + len(NOISE[kind])]
    noise = stated_noise(kind, sigma) if sigma else _sigma(kind, own)
    return Measured(values[:, :6], measured, noise, when, place)


def _noise_columns(
    where: str, kind: str, found: Sequence[str], sigma: Sequence[float]
) -> list[str]:
    if sigma:
        return []
    missing = [name for name in NOISE[kind] if name not in found]
    if missing:
        raise InputError(
            f"{where}: no column {', '.join(missing)}; state the standard deviation of what was "
            "measured by --sigma, or for each row in a column of that name"
        )
    return list(NOISE[kind])


def _sigma(kind: str, values: Array) -> Array:
    """Standard deviations [platform unit], [rad] of those in a file [platform unit], [deg]."""
    degrees = [name.endswith("_deg") for name in NOISE[kind]]
    sigma = np.where(degrees, np.radians(values), values)
    return sigma if kind == "pose" else sigma[:, 0]


def _columns(where: str, kind: str, found: Sequence[str]) -> tuple[str, ...]:
    """The columns of what was measured, with advice where those of another kind are there."""
    try:
        return _columns_of(where, kind, found)
    except InputError as error:
        others = [k for k in COLUMNS if k != kind and _has_columns(k, found)]
        cure = "readings alone show nothing of the machine, something must be measured beside them"
        if others:
            cure = f"the file has the columns of --measured {' or '.join(others)}"
        raise InputError(f"{error}; {cure}") from None


def _has_columns(kind: str, found: Sequence[str]) -> bool:
    try:
        return bool(_columns_of("", kind, found))
    except InputError:
        return False


def _columns_of(where: str, kind: str, found: Sequence[str]) -> tuple[str, ...]:
    if kind == "pose":
        return pose_columns(where, found)
    if kind == "orientation":
        return rotation_columns(where, found)
    if kind == "position":
        return checked(where, found, POSITION)
    if kind == "inclinometer":
        degrees = tuple(f"{name}_deg" for name in TILTS)
        return checked(where, found, TILTS if all(t in found for t in TILTS) else degrees)
    stem = "x" if kind == "targets" else "distance"
    numbers = sorted(
        int(match[1]) for name in found if (match := re.fullmatch(rf"{stem}_(\d+)", name))
    )
    if not numbers or numbers != list(range(1, len(numbers) + 1)):
        raise InputError(
            f"{where}: no whole set of columns for {kind}; expected {COLUMNS[kind]}; found "
            f"{', '.join(found[:12])}"
        )
    stems = ("x", "y", "z") if kind == "targets" else ("distance",)
    return checked(where, found, [f"{s}_{i}" for i in numbers for s in stems])


def _as_measured(kind: str, values: Array, names: tuple[str, ...]) -> Any:
    if kind == "pose":
        return poses_from_columns(values, names)[0]
    if kind == "orientation":
        nowhere = np.zeros((len(values), 3))
        return poses_from_columns(np.concatenate([nowhere, values], axis=1), (*POSITION, *names))[0]
    if kind == "targets":
        return values.reshape(len(values), -1, 3)
    if kind == "inclinometer" and names[0].endswith("_deg"):
        return np.radians(values)
    return values


def stated_noise(kind: str, numbers: Sequence[float]) -> float | tuple[float, ...]:
    """Standard deviation as `gough.calibrate` takes it, of --sigma [platform unit], [deg].

    Raises:
        GoughError: another count of numbers.
    """
    wanted = len(NOISE[kind])
    if len(numbers) != wanted:
        raise GoughError(f"--sigma: expected {wanted} number{'s' * (wanted > 1)} for {kind}, found "
                         f"{len(numbers)}")  # fmt: skip
    noise = _sigma(kind, np.array([numbers]))[0]
    return tuple(noise) if kind == "pose" else float(noise)

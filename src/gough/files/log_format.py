"""The form of the leg readings in a log: names of columns, unit, scale, offset, decimal sign.

It comes from options, from a `[readings]` table in the platform's file, and from what the log
itself states: names such as "L1", "Leg 1 (mm)" or "actuator 1", and units beside or below them.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from gough.checks import Array, as_batch
from gough.columns import LEGS
from gough.errors import GoughError, InputError, suggestion
from gough.platform import Platform
from gough.units import ANGLES, LENGTHS

# words that name a leg or its sensor where a number follows
WORDS = (
    "a", "act", "actuator", "arm", "axis", "cyl", "cylinder", "enc", "encoder", "jack", "joint",
    "l", "leg", "legs", "length", "len", "limb", "m", "motor", "pod", "q", "ram", "servo", "strut",
    "zyl", "zylinder",
)  # fmt: skip
# words after the number; others, such as "velocity", mean another quantity
QUANTITIES = (
    "", "pos", "position", "length", "len", "angle", "reading", "act", "actual", "meas",
    "measured", "fb", "feedback", "abs",
)  # fmt: skip
# names of columns of times
TIMES = (
    "time", "t", "times", "timestamp", "time stamp", "time_stamp", "stamp", "datetime", "date time",
    "date", "utc", "clock", "zeit", "time_s", "time_ms", "t_s", "t_ms", "seconds", "ms",
)  # fmt: skip
NUMBERED = re.compile(r"(?P<word>[^\W\d_]+)[\s_.#-]*(?P<digit>[0-6])[\s_.-]*(?P<tail>[^\W\d]*)")
UNIT = re.compile(r"^(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]$")


@dataclass(frozen=True)
class LogFormat:
    """Form of the leg readings of a log: reading = scale * value + offset, in `unit`.

    Attributes:
        columns: the six columns in the order of the legs, by name or by number from 1; empty to
            find them by their names.
        unit: unit of the readings; empty for the one that the log states, or else the platform's.
        scale, offset: (6,) or one number.
        angle_unit: "deg" or "rad": unit of motor angles.
        decimal: "." or ","; empty to recognise it.
        time: column of times.

    Raises:
        GoughError: naming the field.
    """

    columns: tuple[str | int, ...] = ()
    unit: str = ""
    scale: float | tuple[float, ...] = 1.0
    offset: float | tuple[float, ...] = 0.0
    angle_unit: str = ""
    decimal: str = ""
    time: str = ""

    def __post_init__(self) -> None:
        for name in ("unit", "decimal", "angle_unit", "time"):
            if not isinstance(getattr(self, name), str):
                raise GoughError(f"{name}: expected text, found {getattr(self, name)!r}")
        if self.columns and (len(self.columns) != 6 or len(set(self.columns)) != 6):
            raise GoughError(f"columns: expected six different columns, found {self.columns!r}")
        if self.decimal not in ("", ".", ","):
            raise GoughError(f"decimal: expected '.' or ',', found {self.decimal!r}")
        if self.angle_unit not in ("", "deg", "rad"):
            raise GoughError(f"angle_unit: expected 'deg' or 'rad', found {self.angle_unit!r}")
        for name in ("scale", "offset"):
            value = as_batch(name, getattr(self, name), ())
            if value.shape not in ((), (6,)) or not np.all(np.isfinite(value)):
                raise GoughError(f"{name}: expected one number or six, found {value.tolist()}")
        if np.any(np.asarray(self.scale) == 0):
            raise GoughError("scale: expected numbers other than 0")

    @classmethod
    def of(cls, platform: str | Path, **options: Any) -> LogFormat:
        """The `[readings]` table of a platform's file, with options instead of its entries.

        Args:
            platform: name in the catalog, which gives no table, or path of a .toml file.
            options: fields; those that are empty or None leave the file's.

        Raises:
            GoughError: an unknown entry, or one of another type.
        """
        table: dict[str, Any] = {}
        if str(platform).endswith(".toml"):
            with open(platform, "rb") as file:
                table = tomllib.load(file).get("readings", {})
        names = [field.name for field in fields(cls)]
        for key in table:
            if key not in names:
                raise InputError(
                    f"{platform}: readings.{key}: unknown entry{suggestion(key, names)} entries "
                    f"are {', '.join(names)}"
                )
        table |= {name: value for name, value in options.items() if value not in (None, "")}
        for name in ("columns", "scale", "offset"):
            if name in table:
                table[name] = _parsed(name, table[name])
        try:
            return cls(**table)
        except GoughError as error:
            raise InputError(f"readings.{error}") from None

    def find(self, names: list[str]) -> list[int]:
        """Places of the six leg columns among `names`, empty if they are not all there.

        Raises:
            InputError: columns given by number where others are called leg_1 to leg_6.
        """
        if all(isinstance(column, int) for column in self.columns) and self.columns:
            places = [int(column) - 1 for column in self.columns]
            called = [names.index(leg) for leg in LEGS] if {*LEGS} <= {*names} else places
            if places != called:
                raise InputError(
                    "the columns given by number are not those called leg_1 to leg_6; pass "
                    f"--columns {','.join(LEGS)}, or rename these columns"
                )
            return places if max(places) < len(names) else []
        bare = [split_unit(name)[0] for name in names]
        if self.columns:
            places = [_place(str(column), names, bare) for column in self.columns]
            return [place for place in places if place is not None] if None not in places else []
        if {*LEGS} <= {*names}:
            twice = any(names.count(leg) > 1 for leg in LEGS)
            return [] if twice else [names.index(leg) for leg in LEGS]
        return recognise(bare)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the leg columns in a text file that is written in this form."""
        named = self.columns and all(isinstance(column, str) for column in self.columns)
        return tuple(map(str, self.columns)) if named else LEGS

    def conversion(self, platform: Platform, units: Sequence[str]) -> tuple[Array, Array, str]:
        """Factor (6,) and offset (6,) from values to readings of the platform, and the unit used.

        Args:
            units: what the log states for each leg, empty where it states none.

        Raises:
            InputError: a unit that cannot be converted.
        """
        rotary = platform.legs == "rotary"
        given = self.angle_unit if rotary else self.unit
        stated = [""] * 6 if given or np.any(np.asarray(self.scale) != 1.0) else list(units)
        known, target = (ANGLES, "rad") if rotary else (LENGTHS, platform.unit)
        factors = []
        for unit in stated:
            unit = given or unit or target
            if unit == target:
                factors.append(1.0)
            elif unit.lower() not in known or target not in known:
                raise InputError(
                    f"readings are in [{unit}], which cannot be converted to [{target}]; pass "
                    f"{'--angle-unit' if rotary else '--unit'} and --scale"
                )
            else:
                factors.append(known[unit.lower()] / known[target])
        factor = np.array(factors)
        used = given or next(iter(filter(None, stated)), "") or target
        return factor * self.scale, factor * self.offset, used


def time_column(names: Sequence[str], form: LogFormat) -> str:
    """The column of times among `names`: the one that was given, or one named like it, or ""."""
    if form.time in names:
        return form.time
    found = [name for name in names if split_unit(name)[0].strip("# ").lower() in TIMES]
    return found[0] if found else ""


def split_unit(name: str) -> tuple[str, str]:
    """Name and unit of "leg 1 [mm]" or "leg 1 (mm)"; the unit is empty where there is none."""
    found = UNIT.match(name.strip())
    return (found[1].strip(), found[2].strip()) if found else (name.strip(), "")


def unit_of(text: str) -> str | None:
    """The unit that a field of a row of units states; None if it is no unit."""
    bare = split_unit(text)[1] or text.strip()
    known = bare.lower() in LENGTHS or bare.lower() in ANGLES or bare == ""
    return bare if known or split_unit(text)[1] else None


def recognise(names: Sequence[str]) -> list[int]:
    """Places of six columns that are named like legs, counted from 1 or from 0; else empty."""
    groups: dict[tuple[str, str], dict[int, int]] = {}
    for place, name in enumerate(names):
        found = NUMBERED.fullmatch(name.strip().lower())
        if found and found["word"] in WORDS and found["tail"] in QUANTITIES:
            group = groups.setdefault((found["word"], found["tail"]), {})
            digit = int(found["digit"])
            group[digit] = -1 if digit in group else place  # -1: the name occurs twice
    whole = [g for g in groups.values() if sorted(g) in ([*range(6)], [*range(1, 7)])]
    if len(whole) != 1 or -1 in whole[0].values():
        return []
    return [whole[0][digit] for digit in sorted(whole[0])]


def _place(column: str, names: Sequence[str], bare: Sequence[str]) -> int | None:
    for candidates in (names, bare):
        if list(candidates).count(column) == 1:
            return list(candidates).index(column)
    return None


def _parsed(name: str, value: Any) -> Any:
    """A field as text of the command line or as a value of TOML.

    Columns are "1:6", six names or numbers, or NAME=LEG pairs, separated by commas.
    """
    if not isinstance(value, str):
        return tuple(value) if isinstance(value, list) else value
    parts = [part.strip() for part in value.split(",") if part.strip()]
    number = re.compile(r"\d{1,6}", re.ASCII)  # of a column
    try:
        if name != "columns":
            numbers = tuple(map(float, parts))
            return numbers[0] if len(numbers) == 1 else numbers
        ends = value.split(":")
        if len(ends) == 2 and all(end.strip().isdecimal() for end in ends):
            first, last = map(int, ends)
            return tuple(range(first, min(last, first + 6) + 1))  # six are expected
        if all("=" in part for part in parts):
            pairs = {leg.strip(): column for column, _, leg in (p.rpartition("=") for p in parts)}
            parts = [pairs[str(leg)].strip() for leg in range(1, 7)]
    except (ValueError, KeyError):
        wanted = "1:6, six names in order, or NAME=LEG,..." if name == "columns" else "numbers"
        raise InputError(f"--{name} {value}: expected {wanted}") from None
    return tuple(int(part) if number.fullmatch(part) else part for part in parts)

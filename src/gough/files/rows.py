"""Rows of a file in blocks, and the interface of the objects that read and write them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Protocol

import numpy as np
import pyarrow as pa

from gough.checks import Array
from gough.errors import GoughError, InputError
from gough.files.log_format import LogFormat
from gough.tables import arrow_values

# text that stands for "no value" in a number column
MISSING = ("", "NaN", "nan", "NAN", "NA", "N/A", "n/a", "#N/A", "null", "NULL", "None")
MOST_ROWS = 1_000_000_000  # in a block
Conversions = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class Reading:
    """Options for reading a file.

    Attributes:
        keep: columns to copy to the output unchanged.
        keep_bad_rows: mark rows with text in a number column, or with too few or too many
            fields, as invalid instead of raising an error.
        ignore_platform: accept a file that was written for another platform.
        block_rows: rows held in memory at a time.
        log: the form of the leg readings.
    """

    keep: tuple[str, ...] = ()
    keep_bad_rows: bool = False
    ignore_platform: bool = False
    block_rows: int = 65536
    log: LogFormat = field(default_factory=LogFormat)

    def __post_init__(self) -> None:
        if not 1 <= self.block_rows <= MOST_ROWS:
            found = f"{self.block_rows:.6g}"
            raise GoughError(f"block_rows: expected 1 to {MOST_ROWS:,}, found {found}")


@dataclass(frozen=True)
class Block:
    """Consecutive rows of a file.

    Attributes:
        table: number columns, with gaps where fields are empty; kept columns as they were read.
        place: gives the place in the file of row i (from 0) of the block, such as "line 17".
        bad: reason for each row that could not be read.
        conversions: factor and offset of the columns that are converted.
    """

    table: pa.Table
    place: Callable[[int], str]
    bad: dict[int, str] = field(default_factory=dict)
    conversions: Conversions = field(default_factory=dict)

    def __len__(self) -> int:
        return self.table.num_rows

    def numbers(self, names: Sequence[str]) -> Array:
        """The columns `names` as an array (N, len(names)).

        Absent values are NaN, and so are all values of a row that could not be read.
        """
        array = np.empty((len(self), len(names)))
        for i, name in enumerate(names):
            array[:, i] = arrow_values(self.table.column(name))
            if name in self.conversions:
                factor, offset = self.conversions[name]
                array[:, i] = factor * array[:, i] + offset
        array[list(self.bad)] = np.nan
        return array

    def times(self, name: str) -> Array:
        """A column of times (N,) [s], NaN where absent: numbers, or date and time as in ISO 8601.

        Dates and times are counted from 1970-01-01, in UTC where no zone is stated.

        Raises:
            InputError: a text that is neither; with its place.
        """
        column = self.table.column(name)
        if pa.types.is_timestamp(column.type):
            return arrow_values(column.cast(pa.timestamp("us")).cast(pa.int64())) / 1e6
        if not pa.types.is_string(column.type):
            return self.numbers([name])[:, 0]
        seconds = np.full(len(self), np.nan)
        for row, text in enumerate(column.to_pylist()):
            if row not in self.bad and text and text.strip() not in MISSING:
                try:
                    seconds[row] = _seconds(text.strip())
                except ValueError:
                    raise InputError(
                        f"{self.place(row)}: column {name}: found {text[:40]!r}, expected a number "
                        "or a time such as 2026-11-24T10:02:11.5"
                    ) from None
        return seconds


def _seconds(text: str) -> float:
    if ":" not in text:
        return float(text.replace(",", "."))
    moment = datetime.fromisoformat(text)
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


class Source(Protocol):
    """A file being read.

    Attributes:
        where: name of the file for messages.
        reading: options for reading it.
        columns, units: names of its columns, and units that stand below them.
        conversions: factor and offset of the columns to convert.
        metadata: text that the file carries, such as the platform it belongs to.
        total, done: size of the file and how much of it has been read, in the same unit; total
            is None where it is not known.
    """

    where: str
    reading: Reading
    columns: list[str]
    units: list[str]
    conversions: Conversions
    metadata: dict[str, str]
    total: int | None
    done: int

    def blocks(
        self, numbers: Sequence[str], keep: Sequence[str] = (), *, typed: bool = False
    ) -> Iterator[Block]:
        """Read the rest of the file, about `reading.block_rows` rows at a time.

        Args:
            numbers: columns to read as numbers.
            keep: columns to copy unchanged: as text from CSV, in their type from Parquet.
            typed: read kept columns of CSV as numbers if the first block holds nothing else.

        Raises:
            InputError: a value that is no number, or a damaged file; with its place.
        """
        ...

    def rename(self, names: list[str]) -> None:
        """Give the columns other names."""
        ...

    def close(self) -> None:
        """Close the file."""
        ...


class Sink(Protocol):
    """A file being written."""

    def write(self, table: pa.Table) -> None:
        """Append rows; all tables must have the same columns."""
        ...

"""Where rows come from: the file's name picks the format."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from gough.errors import GoughError, InputError
from gough.files.block import Block

STANDARD = "-"  # standard input or output, as CSV
FORMATS = (".csv", ".parquet")


@dataclass(frozen=True)
class Reading:
    """How to read a file.

    Attributes:
        keep: columns to pass through unchanged.
        keep_bad_rows: rows with text in a number column or with too few or too many fields
            are marked as invalid, not an error.
        ignore_platform: take the numbers of a file that names another platform.
        block_rows: rows held in memory at a time.
    """

    keep: tuple[str, ...] = ()
    keep_bad_rows: bool = False
    ignore_platform: bool = False
    block_rows: int = 65536

    def __post_init__(self) -> None:
        if self.block_rows < 1:
            raise GoughError(f"block_rows: expected 1 or more, found {self.block_rows}")


class Source(Protocol):
    """A file being read; see `CsvSource` for what the members mean."""

    where: str
    columns: list[str]
    metadata: dict[str, str]
    total: int | None
    done: int

    def blocks(
        self,
        numbers: Sequence[str],
        keep: Sequence[str] = (),
        *,
        rows: int,
        keep_bad: bool = False,
        typed: bool = False,
    ) -> Iterator[Block]:
        """The rows, block by block."""
        ...

    def close(self) -> None:
        """Close the file."""
        ...


def file_format(path: str | Path) -> str:
    """The format a name stands for, ".csv" or ".parquet".

    Raises:
        GoughError: the name ends in neither.
    """
    if str(path) == STANDARD:
        return ".csv"
    ending = Path(path).suffix.lower()
    if ending not in FORMATS:
        raise GoughError(
            f"{path}: the name must end in .csv or .parquet, or be - for CSV on standard input or "
            "output"
        )
    return ending


def open_source(path: str | Path) -> Source:
    """A file of rows, or standard input for "-".

    Raises:
        GoughError, InputError: what is wrong with the name or the file.
    """
    from gough.files.csv_source import CsvSource
    from gough.files.parquet_source import ParquetSource

    ending = file_format(path)
    if str(path) == STANDARD:
        return CsvSource(sys.stdin.buffer, "standard input", None)
    try:
        file = open(path, "rb")  # noqa: SIM115 - the source closes it
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder; name a file in it") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    try:
        if ending == ".parquet":
            return ParquetSource(file, str(path))
        size = os.fstat(file.fileno()).st_size
        return CsvSource(file, str(path), size or None)
    except BaseException:
        file.close()
        raise

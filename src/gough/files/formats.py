"""Files opened by the format that their name stands for."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow as pa

from gough.checks import Array
from gough.columns import LEGS, leg_columns
from gough.errors import GoughError, InputError
from gough.files.csv import CsvSink, CsvSource
from gough.files.metadata import check_same, describe
from gough.files.parquet import ParquetSink, ParquetSource
from gough.files.rows import Reading, Sink, Source
from gough.platform import Platform
from gough.whole_file import explain, replacing

STANDARD = "-"  # standard input or output, as CSV
FORMATS = (".csv", ".parquet")


def file_format(path: str | Path) -> str:
    """The format that a name stands for, ".csv" or ".parquet".

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
    """Open a file of rows to read, or standard input for "-".

    Raises:
        GoughError: a name of no known format.
        InputError: no such file, or one that cannot be read.
    """
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


@contextmanager
def open_sink(path: str | Path, metadata: Mapping[str, str]) -> Iterator[Sink]:
    """Open a file to append tables to, or standard output for "-".

    The file appears whole when the block ends without an error; see `replacing`.

    Args:
        path: .csv or .parquet, or "-".
        metadata: text for the file to carry; Parquet only.

    Raises:
        GoughError: a name of no known format, no such folder, a full disk.
        BrokenPipeError: the reader of standard output is gone.
    """
    if str(path) == STANDARD:
        with _standard_output() as file:
            yield CsvSink(file)
    elif file_format(path) == ".csv":
        with replacing(path) as file:
            yield CsvSink(file)
    else:
        with replacing(path) as file:
            sink = ParquetSink(file, metadata)
            try:
                yield sink
                sink.finish()
            finally:
                sink.close()


@contextmanager
def _standard_output() -> Iterator[BinaryIO]:
    file = sys.stdout.buffer
    try:
        yield file
        file.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        raise GoughError(f"standard output: {explain(error)}") from None


def read_legs(path: str | Path, platform: Platform) -> Array:
    """Read all leg readings (N, 6) of a file, NaN where a value is absent.

    Args:
        path: .csv or .parquet with columns leg_1 to leg_6, or "-".
        platform: the machine that the readings belong to.

    Raises:
        GoughError: a name of no known format.
        InputError: a file that cannot be read, or one of another platform.
    """
    with closing(open_source(path)) as source:
        columns = leg_columns(source.where, source.columns)
        check_same(source.where, source.metadata, platform)
        blocks = source.blocks(columns, rows=Reading().block_rows)
        return np.concatenate([block.numbers(LEGS) for block in blocks])


def write_table(path: str | Path, columns: Mapping[str, pa.Array], platform: Platform) -> None:
    """Write columns to a .csv or .parquet file, or to standard output for "-".

    Raises:
        GoughError: a name of no known format, no such folder, a full disk; an old file at `path`
            is unchanged.
    """
    with open_sink(path, describe(platform)) as sink:
        sink.write(pa.table(dict(columns)))

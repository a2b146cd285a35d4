"""Where rows go: the file's name picks the format."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import pyarrow as pa
import pyarrow.csv as pacsv
import pyarrow.parquet as pq

from gough.columns import STATUS
from gough.errors import GoughError
from gough.files.source import STANDARD, file_format
from gough.whole_file import explain, replacing

ROW_GROUP = 1 << 18  # rows


class Sink(Protocol):
    """A file being written."""

    def write(self, table: pa.Table) -> None:
        """Append rows; all tables must have the same columns."""
        ...


@contextmanager
def open_sink(path: str | Path, metadata: Mapping[str, str]) -> Iterator[Sink]:
    """A file to append tables to, or standard output for "-".

    The file appears whole when the block is left without an error; see `replacing`.

    Args:
        metadata: text for the file to carry; Parquet only.

    Raises:
        GoughError: a bad name, no such folder, a full disk.
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


class CsvSink:
    """CSV with commas and a header line; numbers in the fewest digits that give them back."""

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._begun = file, False

    def write(self, table: pa.Table) -> None:
        """Append rows.

        Raises:
            GoughError: a kept column of a type that has no place in CSV.
        """
        if not self._begun:
            self._file.write(_header(table.column_names))
            self._begun = True
        self._file.write(_csv_rows(table))


class ParquetSink:
    """Parquet, zstd-compressed; floats split by byte, which compresses them best."""

    def __init__(self, file: BinaryIO, metadata: Mapping[str, str]) -> None:
        self._file, self._metadata = file, dict(metadata)
        self._waiting: list[pa.Table] = []
        self._writer: pq.ParquetWriter | None = None

    def write(self, table: pa.Table) -> None:
        """Append rows; they reach the file a row group at a time."""
        self._waiting.append(table)
        if sum(t.num_rows for t in self._waiting) >= ROW_GROUP:
            self._flush()

    def finish(self) -> None:
        """Write what is waiting and the footer."""
        self._flush()
        if self._writer is not None:
            self._writer.close()

    def close(self) -> None:
        """Let go of the writer; after `finish` this does nothing."""
        if self._writer is not None and self._writer.is_open:
            with suppress(Exception):  # it tries to write a footer to a file that may be full
                self._writer.close()

    def _flush(self) -> None:
        if not self._waiting:
            return
        table = pa.concat_tables(self._waiting)
        self._waiting = []
        if self._writer is None:
            self._writer = _parquet_writer(self._file, table.schema, self._metadata)
        self._writer.write_table(table, row_group_size=2 * ROW_GROUP)


def _parquet_writer(
    file: BinaryIO, schema: pa.Schema, metadata: Mapping[str, str]
) -> pq.ParquetWriter:
    floats = [f.name for f in schema if f.type in (pa.float32(), pa.float64())]
    options: dict[str, Any] = {
        "compression": "zstd",
        "use_dictionary": [STATUS] if STATUS in schema.names else False,
        "use_byte_stream_split": floats,
        "write_page_checksum": True,  # damage on the way is noticed when the file is read
    }
    writer = pq.ParquetWriter(file, schema.with_metadata(None), **options)
    writer.add_key_value_metadata(dict(metadata))
    return writer


def _header(names: list[str]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(names)
    return text.getvalue().encode()


def _csv_rows(table: pa.Table) -> bytes:
    columns = [
        c.cast(c.type.value_type) if pa.types.is_dictionary(c.type) else c for c in table.columns
    ]
    table = pa.table(columns, names=table.column_names)
    # pyarrow's "needed" quotes all text; try without, which it refuses where quotes are needed
    problem = ""
    for style in ("none", "needed"):
        buffer = pa.BufferOutputStream()
        options = pacsv.WriteOptions(include_header=False, quoting_style=style)
        try:
            pacsv.write_csv(table, buffer, options)
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
            problem = str(error)
        else:
            return buffer.getvalue().to_pybytes()
    nested = [f"column {f.name} ({f.type})" for f in table.schema if pa.types.is_nested(f.type)]
    what = " and ".join(nested) or problem.splitlines()[0]
    raise GoughError(f"{what} cannot be written as CSV; leave it out or write .parquet")


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

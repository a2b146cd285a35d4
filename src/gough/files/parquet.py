"""Parquet files, read and written in blocks of rows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq

from gough.columns import STATUS
from gough.errors import InputError
from gough.files.rows import Block, Reading
from gough.tables import check_number

PAGE_BUFFER = 1 << 20  # bytes read ahead in each column
ROW_GROUP = 1 << 18  # rows


class ParquetSource:
    """Rows of a Parquet file, or of some of its row groups.

    See `Source`; `total` and `done` count rows.

    Args:
        start, stop: first row group and the one after the last; no stop: to the end.
        before: rows of the file before them.

    Raises:
        InputError: not a Parquet file, cut off, or without rows.
    """

    def __init__(
        self,
        file: BinaryIO,
        where: str,
        reading: Reading,
        start: int = 0,
        stop: int | None = None,
        before: int = 0,
    ) -> None:
        self.where, self.reading, self.done = where, reading, 0
        self._input = file
        try:
            # without pre_buffer and with a small buffer a row group is read page by page, so
            # that memory does not grow with its size
            self._file = pq.ParquetFile(
                file,
                pre_buffer=False,
                buffer_size=PAGE_BUFFER,
                page_checksum_verification=True,
            )
            raw = self._file.metadata.metadata or {}
            self.metadata = {k.decode(): v.decode("utf-8", "replace") for k, v in raw.items()}
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            raise InputError(f"{where}: {_not_parquet(file, error)}") from None
        self._schema = self._file.schema_arrow
        self.columns: list[str] = list(self._schema.names)
        self.units, self.conversions = [""] * len(self.columns), {}
        self._stored = {name: name for name in self.columns}  # names in the file
        facts = self._file.metadata
        self._groups = list(range(facts.num_row_groups))[start:stop]
        self._before = before
        self.total: int | None = sum(facts.row_group(i).num_rows for i in self._groups)
        if not self.total:
            raise InputError(f"{where}: holds no rows; expected a row per pose")

    def blocks(
        self, numbers: Sequence[str], keep: Sequence[str] = (), *, typed: bool = False
    ) -> Iterator[Block]:
        for name in numbers:
            self._check_number(name)
        wanted = list(dict.fromkeys([*keep, *numbers]))
        stored = [self._stored[name] for name in wanted]
        batches = self._file.iter_batches(
            batch_size=self.reading.block_rows, columns=stored, row_groups=self._groups
        )
        while (batch := self._next(batches)) is not None:
            first = self._before + self.done + 1
            self.done += len(batch)
            table = pa.Table.from_batches([batch]).select(stored).rename_columns(wanted)
            yield Block(
                table, lambda row, first=first: f"row {first + row}", conversions=self.conversions
            )

    def rename(self, names: list[str]) -> None:
        self._stored = dict(zip(names, self._schema.names, strict=True))
        self.columns = names

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        self._input.close()

    def _next(self, batches: Iterator[pa.RecordBatch]) -> pa.RecordBatch | None:
        try:
            return next(batches, None)
        except (pa.ArrowException, OSError) as error:
            row = self._before + self.done
            raise InputError(
                f"{self.where}: damaged after row {row}: {_first_line(error)}; write or copy the "
                "file again"
            ) from None

    def _check_number(self, name: str) -> None:
        kind = self._schema.field(self._stored[name]).type
        if pa.types.is_floating(kind) or pa.types.is_integer(kind):
            return
        first = self._next(
            self._file.iter_batches(
                batch_size=1, columns=[self._stored[name]], row_groups=self._groups
            )
        )
        value = first.column(0)[0].as_py() if first is not None and len(first) else None
        check_number(self.where, name, kind, value)


class ParquetSink:
    """Parquet, zstd-compressed; floats split by byte, which compresses them best."""

    def __init__(self, file: BinaryIO, metadata: Mapping[str, str]) -> None:
        self._file, self._metadata = file, dict(metadata)
        self._waiting: list[pa.Table] = []
        self._writer: pq.ParquetWriter | None = None

    def write(self, table: pa.Table) -> None:
        """Append rows; they are written a row group at a time."""
        self._waiting.append(table)
        if sum(t.num_rows for t in self._waiting) >= ROW_GROUP:
            self._flush()

    def finish(self, more: Mapping[str, str] = {}) -> None:
        """Write the last rows and the footer, with `more` metadata."""
        self._flush()
        if self._writer is not None:
            self._writer.add_key_value_metadata(self._metadata | dict(more))
            self._writer.close()

    def close(self) -> None:
        """Release the writer after an error; after `finish` this does nothing."""
        if self._writer is not None and self._writer.is_open:
            with suppress(Exception):  # it tries to write a footer to a file that may be full
                self._writer.close()

    def _flush(self) -> None:
        if not self._waiting:
            return
        table = pa.concat_tables(self._waiting)
        self._waiting = []
        if self._writer is None:
            self._writer = self._open(table.schema)
        self._writer.write_table(table, row_group_size=2 * ROW_GROUP)

    def _open(self, schema: pa.Schema) -> pq.ParquetWriter:
        options: dict[str, Any] = {
            "compression": "zstd",
            "use_dictionary": [STATUS] if STATUS in schema.names else False,
            "use_byte_stream_split": [f.name for f in schema if pa.types.is_floating(f.type)],
            "write_page_checksum": True,  # damage on the way is noticed when the file is read
        }
        return pq.ParquetWriter(self._file, schema.with_metadata(None), **options)


def _not_parquet(file: BinaryIO, error: Exception) -> str:
    """The reason why a file could not be opened as Parquet, and the cure."""
    try:
        file.seek(0)
        start = file.read(4)
        size = file.seek(0, 2)
    except (OSError, ValueError):
        return f"cannot be read: {_first_line(error)}"
    if size == 0:
        return "is empty; expected a Parquet file"
    if start == b"PAR1":
        return f"is a Parquet file cut off or damaged ({size} bytes); write or copy it again"
    return "is not a Parquet file; rename it to .csv if it is text with commas"


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or ["no reason given"])[0]

"""Parquet files as blocks of rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq

from gough.arrow import check_number, to_float
from gough.errors import InputError
from gough.files.block import Block

PAGE_BUFFER = 1 << 20  # bytes read ahead in each column


class ParquetSource:
    """Rows of a Parquet file.

    Attributes:
        where: what to call the file in messages.
        columns: the names of its columns.
        metadata: text that the file carries, such as the platform it belongs to.
        total, done: rows there are and rows read.

    Raises:
        InputError: not a Parquet file, cut off, or without rows.
    """

    def __init__(self, file: BinaryIO, where: str) -> None:
        self.where, self.done = where, 0
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
        except (pa.ArrowException, OSError) as error:
            raise InputError(f"{where}: {_not_parquet(file, error)}") from None
        self._schema = self._file.schema_arrow
        self.columns: list[str] = list(self._schema.names)
        raw = self._file.metadata.metadata or {}
        self.metadata = {k.decode(): v.decode("utf-8", "replace") for k, v in raw.items()}
        self.total: int | None = self._file.metadata.num_rows
        if not self.total:
            raise InputError(f"{where}: holds no rows; expected a row per pose")

    def blocks(
        self,
        numbers: Sequence[str],
        keep: Sequence[str] = (),
        *,
        rows: int,
        keep_bad: bool = False,
        typed: bool = False,
    ) -> Iterator[Block]:
        """The file, `rows` rows at a time; `keep_bad` and `typed` change nothing here.

        Raises:
            InputError: a column of another type than numbers, or a damaged part.
        """
        for name in numbers:
            self._check_number(name)
        wanted = list(dict.fromkeys([*keep, *numbers]))
        batches = self._file.iter_batches(batch_size=rows, columns=wanted)
        while (batch := self._next(batches)) is not None:
            table = pa.Table.from_batches([batch]).select(wanted)
            for name in numbers:
                column = to_float(table.column(name))
                table = table.set_column(table.column_names.index(name), name, column)
            first = self.done + 1
            self.done += len(batch)
            yield Block(table, lambda row, first=first: f"row {first + row}")

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        self._input.close()

    def _next(self, batches: Iterator[pa.RecordBatch]) -> pa.RecordBatch | None:
        try:
            return next(batches, None)
        except (pa.ArrowException, OSError) as error:
            raise InputError(
                f"{self.where}: damaged after row {self.done}: {_first_line(error)}; write or copy "
                "the file again"
            ) from None

    def _check_number(self, name: str) -> None:
        kind = self._schema.field(name).type
        first = self._next(self._file.iter_batches(batch_size=1, columns=[name]))
        value = first.column(0)[0].as_py() if first is not None and len(first) else None
        check_number(self.where, name, kind, value)


def _not_parquet(file: BinaryIO, error: Exception) -> str:
    """Why a file could not be opened as Parquet, and what to do."""
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

"""CSV files and standard input as blocks of rows."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator, Sequence
from typing import BinaryIO

import pyarrow as pa
import pyarrow.csv as pacsv

from gough.errors import InputError
from gough.files.block import Block
from gough.files.csv_rows import MISSING, Layout, read_rows, split_rows

HEAD = 1 << 16  # bytes read to find the header
LONGEST_LINE = 1 << 24  # bytes; a "line" beyond it means wrong line ends or an open quote
DELIMITERS = (",", ";", "\t", "|")
COMPRESSED = {
    b"\x1f\x8b": "gzip",
    b"(\xb5/\xfd": "zstd",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
}


class CsvSource:
    """Rows of a CSV file: a header line, then fields split by comma, semicolon, tab or bar.

    Attributes:
        where: what to call the file in messages.
        columns: the names in its header.
        metadata: empty; CSV files have none.
        total, done: bytes there are (None for a pipe) and bytes read.

    Raises:
        InputError: the file is empty, holds no header or only one, or is not CSV text.
    """

    def __init__(self, file: BinaryIO, where: str, total: int | None) -> None:
        self.where, self.total, self.done = where, total, 0
        self.metadata: dict[str, str] = {}
        self._file = file
        start = self._read(HEAD)
        _check_text(where, start)
        start = start.removeprefix(b"\xef\xbb\xbf")
        header, self._rest = self._split_header(start)
        self._layout = _layout(where, header)
        self._first_line = 1 + header.count(b"\n")
        self.columns = self._layout.header
        while not self._rest.strip():
            more = self._read(HEAD)
            if not more:
                raise InputError(f"{where}: holds a header and no rows; expected a row per pose")
            self._rest += more

    def blocks(
        self,
        numbers: Sequence[str],
        keep: Sequence[str] = (),
        *,
        rows: int,
        keep_bad: bool = False,
        typed: bool = False,
    ) -> Iterator[Block]:
        """The rest of the file, about `rows` rows at a time.

        Args:
            numbers: columns to read as numbers.
            keep: columns to pass through; as text, so that nothing of them changes.
            keep_bad: rows that make no sense are marked, not an error.
            typed: kept columns that are all numbers in the first block become numbers.

        Raises:
            InputError: with the line, the column and what was found.
        """
        types = {name: pa.string() for name in keep} | {name: pa.float64() for name in numbers}
        # pyarrow catches Ctrl-C itself while it reads CSV, and loses it in blocks this small
        pa.enable_signal_handlers(False)
        for line, data in self._chunks(rows):
            if typed:
                types |= self._number_types(data, line, [k for k in keep if k not in numbers])
                typed = False
            layout = Layout(self.where, self._layout.header, self._layout.delimiter, types)
            block = _quick_block(layout, data, line) or _slow_block(layout, data, line, keep_bad)
            if len(block):
                yield block

    def close(self) -> None:
        """Close the file; standard input stays open."""
        if self._file is not sys.stdin.buffer:
            self._file.close()

    # ---- bytes to lines ---------------------------------------------------------------

    def _read(self, count: int) -> bytes:
        try:
            data = self._file.read(count)
        except OSError as error:
            raise InputError(f"{self.where}: cannot be read: {error.strerror}") from None
        self.done += len(data)
        return data

    def _split_header(self, start: bytes) -> tuple[bytes, bytes]:
        """The header line with its end, and what follows it."""
        while (end := _first_line_end(start)) == 0:
            more = self._read(HEAD)
            if not more:
                return start, b""
            start += more
            if len(start) > LONGEST_LINE:
                raise InputError(f"{self.where}: line 1 has no end; expected lines of text")
        return start[:end], start[end:]

    def _chunks(self, rows: int) -> Iterator[tuple[int, bytes]]:
        """(number of the first line, whole lines) until the end of the file."""
        line, rest = self._first_line, self._rest
        per_row = (rest.find(b"\n") + 1) or len(rest)
        size = max(rows * per_row, 1 << 8)
        while data := rest + (self._read(size - len(rest)) if len(rest) < size else b""):
            # a block ends where a line ends, or where the file does
            end = _last_line_end(data, size) if len(data) >= size else len(data)
            if end:
                yield line, data[:end]
                line += data.count(b"\n", 0, end)
            elif size > LONGEST_LINE:
                raise InputError(
                    f"{self.where}: line {line}: no end found; put the row's quotation marks in "
                    "order, and end lines with LF or CRLF"
                )
            else:
                size *= 2
            rest = data[end:]

    # ---- kept columns -----------------------------------------------------------------

    def _number_types(self, data: bytes, line: int, keep: list[str]) -> dict[str, pa.DataType]:
        """Types of kept columns that hold nothing but whole or decimal numbers."""
        types = {name: pa.string() for name in keep}
        layout = Layout(self.where, self._layout.header, self._layout.delimiter, types)
        table = (_quick_block(layout, data, line) or _slow_block(layout, data, line, True)).table
        return {name: _number_type(table.column(name)) for name in keep}


def _number_type(text: pa.ChunkedArray) -> pa.DataType:
    for kind in (pa.int64(), pa.float64()):
        try:
            numbers = text.cast(kind)
        except pa.ArrowInvalid:
            continue
        # 007 and +1 are labels that happen to be digits: as numbers they would change
        if kind == pa.float64() or numbers.cast(pa.string()).equals(text):
            return kind
        return pa.string()
    return pa.string()


def _quick_block(layout: Layout, data: bytes, line: int) -> Block | None:
    """The rows as pyarrow reads them; None where it finds fault with one."""
    quoted = b'"' in data
    try:
        table = pacsv.read_csv(
            pa.BufferReader(data),
            read_options=pacsv.ReadOptions(column_names=layout.header),
            parse_options=pacsv.ParseOptions(delimiter=layout.delimiter, newlines_in_values=quoted),
            convert_options=pacsv.ConvertOptions(
                column_types=layout.types,
                include_columns=list(layout.types),
                null_values=MISSING,
                strings_can_be_null=False,
            ),
        )
    except pa.ArrowInvalid:
        return None
    regular = not quoted and data.count(b"\n") + (not data.endswith(b"\n")) == table.num_rows

    def place(row: int) -> str:
        if regular:
            return f"line {line + row}"
        lines = [number for number, _ in split_rows(layout, data, line)]
        return f"line {lines[row]}"

    return Block(table, place)


def _slow_block(layout: Layout, data: bytes, line: int, keep_bad: bool) -> Block:
    table, lines, bad = read_rows(layout, data, line, keep_bad)
    return Block(table, lambda row: f"line {lines[row]}", bad)


def _first_line_end(data: bytes) -> int:
    """Where the first line ends that is not inside quotation marks, or 0."""
    end = 0
    while (end := data.find(b"\n", end) + 1) and data.count(b'"', 0, end) % 2:
        pass
    return end


def _last_line_end(data: bytes, limit: int) -> int:
    """Where the last line up to `limit` ends that is not inside quotation marks, or 0."""
    end = data.rfind(b"\n", 0, limit) + 1
    if b'"' not in data:
        return end
    quotes = data.count(b'"', 0, end)
    while end and quotes % 2:
        previous = data.rfind(b"\n", 0, end - 1) + 1
        quotes -= data.count(b'"', previous, end)
        end = previous
    return end


def _check_text(where: str, start: bytes) -> None:
    """That a file begins like CSV text.

    Raises:
        InputError: empty, Parquet, compressed, UTF-16 or another binary file.
    """
    if not start.strip():
        raise InputError(f"{where}: is empty; expected a header line and a row per pose")
    if start.startswith(b"PAR1"):
        raise InputError(f"{where}: holds Parquet, not CSV; rename it to end in .parquet")
    for magic, name in COMPRESSED.items():
        if start.startswith(magic):
            raise InputError(f"{where}: is compressed ({name}); unpack it first")
    if start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise InputError(f"{where}: is UTF-16 text; save it as UTF-8")
    if b"\0" in start:
        raise InputError(f"{where}: holds binary data, not CSV text")


def _layout(where: str, header: bytes) -> Layout:
    """Column names and delimiter from the header line."""
    try:
        text = header.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{where}: line 1: byte {error.start + 1} is not UTF-8 text; save the file as UTF-8"
        ) from None
    text = text.rstrip("\r\n")
    if "\r" in text:
        raise InputError(f"{where}: its lines end in CR alone; save it with LF or CRLF line ends")
    delimiter = max(DELIMITERS, key=text.count)
    try:
        names = [
            name.strip() for name in next(csv.reader([text], delimiter=delimiter, strict=True), [])
        ]
    except csv.Error as error:
        raise InputError(f"{where}: line 1: {error}; expected column names") from None
    if names and all(_is_number(name) for name in names):
        raise InputError(
            f"{where}: line 1 holds numbers; put a line with the names of the columns above it"
        )
    return Layout(where, names, delimiter)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True

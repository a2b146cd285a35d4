"""CSV files, and standard input and output, read and written in blocks of rows."""

from __future__ import annotations

import csv
import io
import math
import re
import sys
import zlib
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import BinaryIO

import pyarrow as pa
import pyarrow.csv as pacsv

from gough.errors import GoughError, InputError
from gough.files.layout import BLANKS, as_utf8, check_text, find_layout
from gough.files.rows import MISSING, Block, Conversions, Reading

HEAD = 1 << 16  # bytes read to find the header
LONGEST_HEADER = 1 << 19  # bytes
LONGEST_LINE = 1 << 22  # bytes; a "line" beyond it means wrong line ends or an open quote


class CsvSource:
    """Rows of a text file: a header line, then fields separated by comma, semicolon, tab or blanks.

    See `Source`; `total` and `done` count bytes, `total` is None for a pipe, `metadata` is empty.

    Args:
        start, stop: bytes of the lines to read, for some lines of a file; the header is read too.
        before: lines of the file before `start`.

    Raises:
        InputError: the file is empty, is not text, or has a header and no rows.
    """

    def __init__(
        self,
        file: BinaryIO,
        where: str,
        total: int | None,
        reading: Reading = Reading(),
        start: int = 0,
        stop: int | None = None,
        before: int = 0,
    ) -> None:
        self._sample, self._left = b"", None
        self.where, self.reading, self.done, self.metadata = where, reading, 0, {}
        self.conversions: Conversions = {}
        self._given = file
        try:
            self._file, recoded = as_utf8(file)
        except (OSError, EOFError, zlib.error) as error:
            raise InputError(f"{where}: is damaged or no gzip file: {error}") from None
        self.total = None if recoded else total
        head = self._read(HEAD)
        check_text(where, head)
        ended = len(head) < HEAD
        head = head.removeprefix(b"\xef\xbb\xbf")
        while not ended and not _last_line_end(head, len(head)):
            more = self._read(len(head))
            head, ended = head + more, not more
            if len(head) > LONGEST_HEADER:
                raise InputError(
                    f"{where}: line 1 has no end within {LONGEST_HEADER >> 10} kB; expected lines "
                    "of text that end with LF or CRLF"
                )
        whole = head if ended else head[: _last_line_end(head, len(head))]
        self.layout = find_layout(where, whole, reading.log)
        self.columns, self.units = self.layout.names, self.layout.units
        self._rest, self._lines = head[self.layout.size :], self.layout.lines
        if stop is not None:
            self._take_lines(start, stop, before, whole)
        while not self._rest.strip():
            more = self._read(HEAD)
            if not more:
                raise InputError(f"{where}: holds a header and no rows; expected a row per pose")
            self._rest += more

    def _take_lines(self, start: int, stop: int, before: int, head: bytes) -> None:
        """Go to some lines of the file; all parts take the types of kept columns from its head."""
        self._sample = head[self.layout.size :]
        first = self.done - len(self._rest)  # byte after the header
        self._lines = max(before, self._lines)
        self._file.seek(max(start, first))
        self.total = self._left = stop - max(start, first)
        self.done, self._rest = 0, b""

    def rename(self, names: list[str]) -> None:
        self.columns = names

    def blocks(
        self, numbers: Sequence[str], keep: Sequence[str] = (), *, typed: bool = False
    ) -> Iterator[Block]:
        types = {name: pa.string() for name in keep} | {name: pa.float64() for name in numbers}
        # pyarrow catches Ctrl-C itself while it reads CSV, and loses it in blocks this small
        pa.enable_signal_handlers(False)
        for line, data in self._chunks(self.reading.block_rows):
            if typed:
                text = {name: pa.string() for name in keep if name not in numbers}
                table = self._block(self._sample or data, line, text, keep_bad=True).table
                types |= {name: _number_type(table.column(name)) for name in text}
                typed = False
            block = self._block(data, line, types, self.reading.keep_bad_rows)
            if len(block):
                yield block

    def close(self) -> None:
        """Close the file; standard input stays open."""
        if self._given is not sys.stdin.buffer:
            self._file.close()
            self._given.close()

    # ---- bytes to lines ---------------------------------------------------------------

    def _read(self, count: int) -> bytes:
        if self._left is not None:
            count = min(count, self._left)
            self._left -= count
        try:
            data = self._file.read(count)
        except (OSError, EOFError, zlib.error) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"{self.where}: cannot be read: {reason}") from None
        self.done += len(data)
        return data

    def _chunks(self, rows: int) -> Iterator[tuple[int, bytes]]:
        """(number of the first line, whole lines) until the end of the file."""
        line, rest = 1 + self._lines, self._rest
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

    # ---- lines to columns -------------------------------------------------------------

    def _block(
        self, data: bytes, line: int, types: dict[str, pa.DataType], keep_bad: bool
    ) -> Block:
        """The columns `types` of whole lines, of which the first is line number `line`.

        pyarrow reads them fast, but names no line, or the wrong one, where it cannot; such a
        block is read again row by row.
        """
        delimiter = self.layout.delimiter
        if delimiter == BLANKS:
            data, delimiter = _tabbed(data), "\t"
        try:
            table = pacsv.read_csv(
                pa.BufferReader(data),
                # a thread of Arrow's that still holds the block when Python ends aborts the process
                read_options=pacsv.ReadOptions(column_names=self.columns, use_threads=False),
                parse_options=pacsv.ParseOptions(
                    delimiter=delimiter, newlines_in_values=b'"' in data
                ),
                convert_options=pacsv.ConvertOptions(
                    column_types=types,
                    include_columns=list(types),
                    null_values=MISSING,
                    strings_can_be_null=False,
                    decimal_point=self.layout.decimal,
                ),
            )
        except pa.ArrowInvalid:
            return self._block_row_by_row(data, line, types, keep_bad)

        def place(row: int) -> str:
            return f"line {next(islice(self._fields(data, line), row, None))[0]}"

        return Block(table, place, conversions=self.conversions)

    def _block_row_by_row(
        self, data: bytes, line: int, types: dict[str, pa.DataType], keep_bad: bool
    ) -> Block:
        """The same, slowly, with the reason for every row that cannot be read."""
        lines: list[int] = []
        rows: list[list[str]] = []
        bad: dict[int, str] = {}
        for number, fields in self._fields(data, line):
            if len(fields) != len(self.columns):
                count = f"{len(fields)} field{'s' * (len(fields) != 1)}"
                bad[len(rows)] = f"found {count}, expected {len(self.columns)} as in the header"
                if self.layout.delimiter == "," and len(fields) > 1.5 * len(self.columns):
                    bad[len(rows)] += " (write decimal points, or semicolons between the fields)"
                fields = [""] * len(self.columns)
            lines.append(number)
            rows.append(fields)
        columns = {}
        for name, kind in types.items():
            place = self.columns.index(name)
            values: list = [_absent(kind)] * len(rows)
            for row, fields in enumerate(rows):
                try:
                    values[row] = _value(fields[place], kind, self.layout.decimal)
                except ValueError:
                    bad.setdefault(row, f"column {name}: {_complaint(fields[place], kind)}")
            columns[name] = pa.array(values, kind)
        if bad and not keep_bad:
            raise InputError(
                f"{self.where}: line {lines[min(bad)]}: {bad[min(bad)]}; correct the row, or pass "
                "--keep-bad-rows"
            )
        bad = dict(sorted(bad.items()))
        return Block(pa.table(columns), lambda row: f"line {lines[row]}", bad, self.conversions)

    def _fields(self, data: bytes, line: int) -> Iterator[tuple[int, list[str]]]:
        """(line, fields) of every row that is not empty.

        Raises:
            InputError: a quoted field without an end.
        """
        delimiter = self.layout.delimiter
        if delimiter == BLANKS:
            data, delimiter = _tabbed(data), "\t"
        text = io.StringIO(data.decode("utf-8", errors="surrogateescape"), newline="")
        reader = csv.reader(text, delimiter=delimiter, strict=True)
        number = line
        try:
            for fields in reader:
                if fields:
                    yield number, fields
                number = line + reader.line_num
        except csv.Error as error:
            raise InputError(
                f"{self.where}: line {number}: {error}; put the row's quotation marks in order"
            ) from None


class CsvSink:
    """CSV with commas and a header line; numbers in the fewest digits that give them back."""

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._begun = file, False

    def write(self, table: pa.Table) -> None:
        """Append rows.

        Raises:
            GoughError: a kept column of a type that CSV cannot hold.
        """
        if not self._begun:
            text = io.StringIO()
            csv.writer(text, lineterminator="\n").writerow(table.column_names)
            self._file.write(text.getvalue().encode())
            self._begun = True
        columns = [
            c.cast(c.type.value_type) if pa.types.is_dictionary(c.type) else c
            for c in table.columns
        ]
        table = pa.table(columns, names=table.column_names)
        # pyarrow's "needed" quotes all text; try without, which it refuses where quotes are needed
        problem = ""
        for style in ("none", "needed"):
            rows = pa.BufferOutputStream()
            options = pacsv.WriteOptions(include_header=False, quoting_style=style)
            try:
                pacsv.write_csv(table, rows, options)
            except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
                problem = str(error)
            else:
                self._file.write(rows.getvalue())
                return
        nested = [f"column {f.name} ({f.type})" for f in table.schema if pa.types.is_nested(f.type)]
        what = " and ".join(nested) or problem.splitlines()[0]
        raise GoughError(f"{what} cannot be written as CSV; leave it out or write .parquet")


# ---- fields ---------------------------------------------------------------------------


def _absent(kind: pa.DataType) -> object:
    """The value of an empty field."""
    if pa.types.is_floating(kind):
        return math.nan
    return "" if pa.types.is_string(kind) else None


def _value(text: str, kind: pa.DataType, decimal: str) -> object:
    """The value of a field.

    Raises:
        ValueError: it is not of this kind.
    """
    if pa.types.is_string(kind):
        text.encode()  # fails where a byte was not UTF-8
        return text
    bare = text.strip()
    if bare in MISSING:
        return _absent(kind)
    if "_" in bare or not bare.isascii():  # Python reads 1_000 as a number, CSV files do not
        raise ValueError
    if pa.types.is_floating(kind):
        return float(bare if decimal == "." else bare.replace(".", "_.").replace(",", "."))
    number = int(bare)
    if not -(1 << 63) <= number < 1 << 63:
        raise ValueError
    return number


def _complaint(text: str, kind: pa.DataType) -> str:
    """Describe the fault of a field that is not of this kind."""
    if pa.types.is_string(kind):
        return "not UTF-8 text; save the file as UTF-8"
    shown = repr(text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")[:40])
    wanted = "a whole number" if pa.types.is_integer(kind) else "a number"
    comma = text.count(",") == 1 and text.replace(",", "").strip().lstrip("+-").isdigit()
    point = " with a decimal point, not a comma" if comma else ""
    return f"found {shown}, expected {wanted}{point}"


def _number_type(text: pa.ChunkedArray) -> pa.DataType:
    """The type of a column of text that holds nothing but whole or decimal numbers, else text."""
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


def _last_line_end(data: bytes, limit: int) -> int:
    """End of the last line before `limit` that does not end inside quotation marks, or 0."""
    end = data.rfind(b"\n", 0, limit) + 1
    if b'"' not in data:
        return end
    quotes = data.count(b'"', 0, end)
    while end and quotes % 2:
        previous = data.rfind(b"\n", 0, end - 1) + 1
        quotes -= data.count(b'"', previous, end)
        end = previous
    return end


def _tabbed(data: bytes) -> bytes:
    """Lines with a tab for each run of blanks, and none at their ends."""
    data = re.sub(rb"^[ \t]+|[ \t]+(?=\r?$)", b"", data, flags=re.MULTILINE)
    return re.sub(rb"[ \t]+", b"\t", data)

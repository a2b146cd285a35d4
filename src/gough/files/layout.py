"""The layout of a text file: encoding, header, units, separator and decimal sign."""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

from gough.columns import position_columns
from gough.errors import InputError
from gough.files.log_format import LogFormat, unit_of

DELIMITERS = (",", ";", "\t", "|")
BLANKS = " "  # fields separated by runs of blanks
SEARCHED = 200  # lines in which a header is looked for
SAMPLED = 100  # rows that are looked at for their decimal sign
COMPRESSED = {b"(\xb5/\xfd": "zstd", b"BZh": "bzip2", b"\xfd7zXZ": "xz", b"PK\x03\x04": "zip"}
NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)", re.IGNORECASE)


@dataclass(frozen=True)
class Layout:
    """The layout of a text file.

    Attributes:
        names: of the columns; "1", "2", ... in a file without a header.
        units: of the columns, empty where none is stated below the names.
        delimiter: the character between fields, or BLANKS.
        decimal: "." or ",".
        size: number of bytes before the first row.
        lines: number of lines before the first row.
        header: number of the header's line, 0 if there are no lines above it.
    """

    names: list[str]
    units: list[str]
    delimiter: str
    decimal: str
    size: int
    lines: int
    header: int

    def notes(self, log: LogFormat) -> list[str]:
        """Remarks on what was recognised and not given, for the user."""
        found = []
        if self.header:
            found.append(f"line {self.header} is the header")
        if self.decimal == "," and not log.decimal:
            found.append("numbers have a decimal comma")
        return found


def as_utf8(file: BinaryIO) -> tuple[io.BufferedReader, bool]:
    """A file with its gzip compression and its UTF-16 encoding undone, and whether it had any."""
    plain = file if isinstance(file, io.BufferedReader) else io.BufferedReader(file)  # pyright: ignore[reportArgumentType]
    start = plain.peek(200)[:200]
    if start.startswith(b"\x1f\x8b"):
        return as_utf8(gzip.GzipFile(fileobj=plain))[0], True  # pyright: ignore[reportArgumentType]
    zeros = [start[k::2].count(0) for k in (0, 1)]
    if start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return io.BufferedReader(_Recoded(plain, "utf-16")), True
    if max(zeros) > 20 and min(zeros) == 0:
        return io.BufferedReader(_Recoded(plain, "utf-16-be" if zeros[0] else "utf-16-le")), True
    return plain, False


class _Recoded(io.RawIOBase):
    """The text of a file as UTF-8."""

    def __init__(self, file: BinaryIO, encoding: str) -> None:
        self._file, self._held = file, b""
        self._decoder = codecs.getincrementaldecoder(encoding)("replace")

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        while not self._held:
            data = self._file.read(len(buffer))
            self._held = self._decoder.decode(data, not data).encode()
            if not data:
                break
        part, self._held = self._held[: len(buffer)], self._held[len(buffer) :]
        buffer[: len(part)] = part
        return len(part)


def check_text(where: str, start: bytes) -> None:
    """Raise unless a file begins like UTF-8 text with more than blanks.

    Raises:
        InputError: empty, Parquet, or another binary file.
    """
    if not start.strip():
        raise InputError(f"{where}: is empty; expected a header line and a row per pose")
    if start.startswith(b"PAR1"):
        raise InputError(f"{where}: holds Parquet, not CSV; rename it to end in .parquet")
    for magic, name in COMPRESSED.items():
        if start.startswith(magic):
            raise InputError(
                f"{where}: is compressed ({name}); unpack it first; a spreadsheet's name must end "
                "in .xlsx"
            )
    if b"\0" in start:
        raise InputError(f"{where}: holds binary data, not CSV text")


def find_layout(where: str, start: bytes, log: LogFormat) -> Layout:
    """Find the layout of a text file from its first bytes.

    The header is the first line that names six legs or a pose; without one, the first line.

    Args:
        where: the file, for messages.
        start: bytes of whole lines.
        log: the form of readings that was given.

    Raises:
        InputError: the first line is no header, and no other is.
    """
    lines = list(_lines(start))
    chosen = re.fullmatch(rb'"?sep=(.)"?', lines[0].strip()) if lines else None
    delimiters = [chosen[1].decode("latin-1")] if chosen else [*DELIMITERS, BLANKS]
    first = 1 if chosen else 0
    if log.columns and all(isinstance(column, int) for column in log.columns):
        header, delimiter, names = _numbered(where, lines, delimiters, log)
    else:
        header, delimiter, names = _named(where, lines, first, delimiters, log)
    below = header + 1
    units, rows = [""] * len(names), _rows(lines[below : below + SAMPLED], delimiter)
    places = log.find(names)
    if rows and places and len(rows[0][1]) == len(names):
        found = [unit_of(rows[0][1][place]) for place in places]
        if None not in found and any(found):
            units = [unit_of(text) or "" for text in rows[0][1]]
            below += rows[0][0] + 1
            rows = rows[1:]
    if rows and all(len(r) == len(names) + 1 and not r[-1].strip() for _, r in rows):
        names, units = [*names, ""], [*units, ""]  # rows end with a separator, the header does not
    decimal = log.decimal or _decimal([r for _, r in rows], places, delimiter)
    head = b"".join(lines[:below])
    shown = header + 1 if header > first else 0
    return Layout(names, units, delimiter, decimal, len(head), head.count(b"\n"), shown)


def _named(
    where: str, lines: list[bytes], first: int, delimiters: Sequence[str], log: LogFormat
) -> tuple[int, str, list[str]]:
    """Index of the header, delimiter and names."""
    for index, line in enumerate(lines[first : first + SEARCHED], first):
        text = _text(line)
        for delimiter in sorted(delimiters, key=lambda d: (d == BLANKS, -text.count(d))):
            for names in _headers(text, delimiter):
                if log.find(names) or position_columns(names) is not None:
                    return index, delimiter, names
    found = _above_numbers(lines[first : first + SEARCHED], delimiters)
    if found:
        return first + found[0], found[1], found[2]
    index = next((i for i in range(first, len(lines)) if lines[i].strip()), first)
    try:
        text = lines[index].decode("utf-8").rstrip("\r\n")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{where}: line {index + 1}: byte {error.start + 1} is not UTF-8 text; save the file "
            "as UTF-8"
        ) from None
    if "\r" in text:
        raise InputError(f"{where}: its lines end in CR alone; save it with LF or CRLF line ends")
    for delimiter in _in_order(delimiters):
        fields = _fields(lines[index], delimiter)
        if len(fields) > 1 and all(map(NUMBER.fullmatch, fields)):
            raise InputError(
                f"{where}: line {index + 1} holds numbers; put a line with the names of the "
                "columns above it, or pass the columns of legs 1 to 6, as in --columns 1:6"
            )
    delimiter = max(delimiters[:4], key=text.count)
    if delimiter not in text and len(text.split()) > 1:
        delimiter = BLANKS
    try:
        names = _split(text, delimiter)
    except csv.Error as error:
        raise InputError(f"{where}: line {index + 1}: {error}; expected column names") from None
    return index, delimiter, names


def _above_numbers(
    lines: list[bytes], delimiters: Sequence[str]
) -> tuple[int, str, list[str]] | None:
    """Index, delimiter and fields of a line of words above a row of six numbers or more."""
    for index in range(len(lines) - 1):
        for delimiter in _in_order(delimiters):
            above, below = (_fields(line, delimiter) for line in lines[index : index + 2])
            words = not any(map(NUMBER.fullmatch, above))
            numbers = sum(NUMBER.fullmatch(field) is not None for field in below)
            if words and len(above) == len(below) and numbers >= 6:
                return index, delimiter, above
    return None


def _numbered(
    where: str, lines: list[bytes], delimiters: Sequence[str], log: LogFormat
) -> tuple[int, str, list[str]]:
    """The same where columns are given by number: the line above the first row of numbers."""
    for index, line in enumerate(lines):
        for delimiter in _in_order(delimiters):
            fields = _fields(line, delimiter)
            places = log.find(fields)
            if places and all(NUMBER.fullmatch(fields[place]) for place in places):
                above = _fields(lines[index - 1], delimiter) if index else []
                if len(above) == len(fields) and not any(map(NUMBER.fullmatch, above)):
                    return index - 1, delimiter, above
                return index - 1, delimiter, [str(k + 1) for k in range(len(fields))]
    raise InputError(f"{where}: no line has numbers in columns {', '.join(map(str, log.columns))}")


def _in_order(delimiters: Sequence[str]) -> list[str]:
    """The delimiters, those first that are no part of numbers."""
    return sorted(delimiters, key=(",", BLANKS).count)


def _lines(start: bytes) -> Iterator[bytes]:
    """Lines with their ends; one that ends within quotation marks goes on in the next."""
    held = b""
    for line in start.splitlines(keepends=True) if b"\n" in start else [start]:
        held += line
        if held.count(b'"') % 2 == 0 and held.endswith(b"\n"):
            yield held
            held = b""
    if held:
        yield held


def _text(line: bytes) -> str:
    return line.decode("utf-8", "replace").rstrip("\r\n")


def _headers(text: str, delimiter: str) -> Iterator[list[str]]:
    """Ways to read a line as a header: names with single blanks in them first."""
    text = re.sub(r"^\s*[#%]+\s*", "", text)
    if delimiter == BLANKS:
        yield re.split(r"\s{2,}", text.strip())
    yield _fields(text.encode(), delimiter)


def _split(text: str, delimiter: str) -> list[str]:
    """Fields of a line.

    Raises:
        csv.Error: quotation marks that are out of order.
    """
    if delimiter == BLANKS:
        return text.split()
    fields = next(csv.reader([text], delimiter=delimiter, strict=True), [])
    return [field.strip() for field in fields]


def _fields(line: bytes, delimiter: str) -> list[str]:
    """Fields of a line; none where a quotation mark has no partner."""
    try:
        return _split(_text(line), delimiter)
    except csv.Error:
        return []


def _rows(lines: list[bytes], delimiter: str) -> list[tuple[int, list[str]]]:
    """Index and fields of each line that is not blank."""
    return [(i, _fields(line, delimiter)) for i, line in enumerate(lines) if line.strip()]


def _decimal(rows: list[list[str]], places: list[int], delimiter: str) -> str:
    """The decimal sign: a comma if legs have commas, and none has a point."""
    fields = [row[k] for row in rows for k in places or range(len(row)) if k < len(row)]
    numbers = [field for field in fields if NUMBER.fullmatch(field)]
    comma = delimiter != "," and any("," in number for number in numbers)
    return "," if comma and not any("." in number for number in numbers) else "."

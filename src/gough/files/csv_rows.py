"""CSV text row by row: slow, but able to say exactly what is wrong with which row.

The quick reader is pyarrow's. When it meets a block it cannot read it names no line or the
wrong one, so the block is read again here.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import pyarrow as pa

from gough.errors import InputError

# What stands for "no value" in a number column
MISSING = ("", "NaN", "nan", "NAN", "NA", "N/A", "n/a", "#N/A", "null", "NULL", "None")


@dataclass(frozen=True)
class Layout:
    """What is known about the rows of a CSV file.

    Attributes:
        where: what to call the file in messages.
        header: the names of all columns.
        delimiter: the character between fields.
        types: the columns to read and the type of each.
    """

    where: str
    header: list[str]
    delimiter: str
    types: dict[str, pa.DataType] = field(default_factory=dict)


def split_rows(layout: Layout, data: bytes, first_line: int) -> Iterator[tuple[int, list[str]]]:
    """(line, fields) of every row that is not empty.

    Raises:
        InputError: a quoted field without an end.
    """
    text = data.decode("utf-8", errors="surrogateescape")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=layout.delimiter, strict=True)
    line = first_line
    try:
        for fields in reader:
            if fields:
                yield line, fields
            line = first_line + reader.line_num
    except csv.Error as error:
        raise InputError(
            f"{layout.where}: line {line}: {error}; put the row's quotation marks in order"
        ) from None


def read_rows(
    layout: Layout, data: bytes, first_line: int, keep_bad: bool
) -> tuple[pa.Table, list[int], dict[int, str]]:
    """The columns of `layout.types`, the line of each row, and the rows that make no sense.

    Args:
        keep_bad: a row that cannot be read becomes NaN and is named in the result; without
            it, it is an error.

    Raises:
        InputError: file, line, column, what was found and what was expected.
    """
    columns: dict[str, list] = {name: [] for name in layout.types}
    places = [(name, layout.header.index(name), kind) for name, kind in layout.types.items()]
    lines: list[int] = []
    bad: dict[int, str] = {}
    for line, fields in split_rows(layout, data, first_line):
        wrong = _wrong_width(layout, fields)
        for name, place, kind in places:
            value, reason = (_absent(kind), "") if wrong else _parse(name, fields[place], kind)
            columns[name].append(value)
            wrong = wrong or reason
        if wrong and not keep_bad:
            raise InputError(
                f"{layout.where}: line {line}: {wrong}; correct the row, or pass --keep-bad-rows"
            )
        if wrong:
            bad[len(lines)] = wrong
        lines.append(line)
    table = pa.table({name: pa.array(columns[name], kind) for name, kind in layout.types.items()})
    return table, lines, bad


def _wrong_width(layout: Layout, fields: list[str]) -> str:
    found, expected = len(fields), len(layout.header)
    if found == expected:
        return ""
    return f"found {found} field{'s' * (found != 1)}, expected {expected} as in the header"


def _absent(kind: pa.DataType) -> object:
    if pa.types.is_floating(kind):
        return math.nan
    return "" if pa.types.is_string(kind) else None


def _parse(name: str, text: str, kind: pa.DataType) -> tuple[object, str]:
    """The value of a field and what is wrong with it, if anything is."""
    if pa.types.is_string(kind):
        if text.isprintable() or not any("\udc80" <= c <= "\udcff" for c in text):
            return text, ""
        return "", f"column {name}: not UTF-8 text; save the file as UTF-8"
    bare = text.strip()
    if bare in MISSING:
        return _absent(kind), ""
    try:
        if "_" in bare or not bare.isascii():  # Python reads 1_000, CSV files do not mean it
            raise ValueError
        return (int(bare) if pa.types.is_integer(kind) else float(bare)), ""
    except ValueError:
        return _absent(kind), _not_a_number(name, text, kind)


def _not_a_number(name: str, text: str, kind: pa.DataType) -> str:
    shown = repr(text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")[:40])
    wanted = "a whole number" if pa.types.is_integer(kind) else "a number"
    reason = f"column {name}: found {shown}, expected {wanted}"
    if text.count(",") == 1 and text.replace(",", "").strip().lstrip("+-").isdigit():
        reason += " with a decimal point, not a comma"
    return reason

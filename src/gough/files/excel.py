"""Sheets of Excel files as text, which is then read as any other log is."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from datetime import date, datetime, time, timedelta
from typing import Any, BinaryIO

from gough.columns import position_columns
from gough.errors import InputError
from gough.files.csv import CsvSource
from gough.files.layout import find_layout
from gough.files.log_format import LogFormat
from gough.files.rows import Reading

EXCEL = (".xlsx", ".xlsm")


def open_sheet(file: BinaryIO, where: str, reading: Reading) -> CsvSource:
    """Open the first sheet that has columns of six legs or of a pose, else the first with cells.

    Lines of the text are rows of the sheet. The sheet is read as a whole; Excel's have at most
    1,048,576 rows.

    Raises:
        InputError: no Excel file, or one without cells.
        ModuleNotFoundError: the extra `excel` is not installed.
    """
    from python_calamine import CalamineError, CalamineWorkbook, PasswordError, XmlError, ZipError

    try:
        book = CalamineWorkbook.from_filelike(file)
        sheets = {name: book.get_sheet_by_name(name).iter_rows() for name in book.sheet_names}
        texts = {name: _as_text(rows) for name, rows in sheets.items()}
    except PasswordError:
        raise InputError(f"{where}: is protected by a password; save it without one") from None
    except (CalamineError, XmlError, ZipError, OSError) as error:
        raise InputError(f"{where}: is damaged or no Excel file: {error}") from None
    texts = {name: text for name, text in texts.items() if text.strip()}
    if not texts:
        raise InputError(f"{where}: has no sheet with cells; expected a header and a row per pose")
    named = (name for name, text in texts.items() if _has_legs(text, reading.log))
    chosen = next(named, next(iter(texts)))
    name = f"{where}, sheet {chosen!r}" if len(texts) > 1 else where
    return CsvSource(io.BytesIO(texts[chosen]), name, None, reading)


def _has_legs(text: bytes, log: LogFormat) -> bool:
    """Return whether a sheet has columns of six legs or of a pose."""
    try:
        names = find_layout("sheet", text, log).names
        return bool(log.find(names)) or position_columns(names) is not None
    except InputError:
        return False


def _as_text(rows: Iterable[list[Any]]) -> bytes:
    """Rows of cells as lines of UTF-8 with tabs."""
    text = io.StringIO()
    writer = csv.writer(text, delimiter="\t", lineterminator="\n")
    writer.writerows([_cell(value) for value in row] for row in rows)
    return text.getvalue().encode()


def _cell(value: Any) -> str:
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    if isinstance(value, (datetime, date, time)):
        return value.isoformat()
    return " ".join(value.split()) if isinstance(value, str) else repr(value)

"""Files opened by the format that their name stands for."""

from __future__ import annotations

import io
import logging
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow as pa

from gough.checks import Array
from gough.columns import LEGS, file_leg_columns, position_columns
from gough.errors import GoughError, InputError
from gough.files.csv import CsvSink, CsvSource
from gough.files.excel import EXCEL, open_sheet
from gough.files.log_format import LogFormat, split_unit
from gough.files.metadata import check_same, describe, pose_frame
from gough.files.plausible import check_plausible
from gough.files.rows import Reading, Sink, Source
from gough.files.stores import Place, without_credentials, written
from gough.frames import FramePose
from gough.platform import Platform
from gough.whole_file import explain

STANDARD = "-"  # standard input or output, as CSV
FORMATS = (".csv", ".parquet")
TEXT = (".txt", ".tsv", ".dat", ".log", ".gz", *EXCEL)  # read as CSV
log = logging.getLogger("gough")


@dataclass(frozen=True)
class GivenRow:
    """Numbers of a command line, to be read as a text file with one row is.

    Attributes:
        where: name for messages.
        names: of the columns.
        values: the numbers as text.
    """

    where: str
    names: tuple[str, ...]
    values: tuple[str, ...]

    def __str__(self) -> str:
        return self.where

    def open(self, reading: Reading) -> CsvSource:
        """The row as a file; `reading` names no columns here."""
        text = "\t".join(self.names) + "\n" + "\t".join(self.values) + "\n"
        return CsvSource(io.BytesIO(text.encode()), self.where, None, reading)


@dataclass(frozen=True)
class FilePart:
    """Consecutive rows of a file: whole row groups of Parquet, or whole lines of text.

    Attributes:
        place: the file.
        start, stop: first row group and the one after the last, or bytes; no stop: to the end.
        before: rows, or lines, of the file before them.
    """

    place: Place
    start: int = 0
    stop: int | None = None
    before: int = 0

    def __str__(self) -> str:
        return str(self.place)


@dataclass(frozen=True)
class Target:
    """A file to write.

    Attributes:
        place: the file.
        metadata: gives text for the file to carry, when all rows are written; Parquet only.
        tidy: as for `replacing`.
    """

    place: Place
    metadata: Callable[[], Mapping[str, str]] = dict
    tidy: bool = True

    def __str__(self) -> str:
        return str(self.place)


Given = str | Path | GivenRow | FilePart  # what rows are read from
Out = str | Path | Target  # what rows are written to


def file_format(path: Given | Out, *, read: bool = False) -> str:
    """The format that a name stands for, ".csv" or ".parquet".

    Args:
        path: name of a file, or "-".
        read: True for a file to read, which may be any text file.

    Raises:
        GoughError: another ending.
    """
    name = without_credentials(str(path))  # nor options of a store
    ending = Path(name).suffix.lower()
    if isinstance(path, GivenRow) or str(path) == STANDARD or (read and ending in TEXT):
        return ".csv"
    if ending not in FORMATS:
        text = f" (or {', '.join(TEXT)} for text and sheets)" if read else ""
        raise GoughError(
            f"{name}: the name must end in .csv or .parquet{text}, or be - for CSV on standard "
            f"{'input' if read else 'output'}"
        )
    return ending


def open_source(
    path: Given,
    platform: Platform | None = None,
    reading: Reading = Reading(),
) -> Source:
    """Open a file of rows to read, or standard input for "-".

    For a platform the six leg columns are called leg_1 to leg_6, whatever the file calls them,
    and their readings are converted to the platform's unit.

    Args:
        path: .csv, another text file, or .parquet, or "-", or numbers.
        platform: the machine whose readings or poses these are.
        reading: options for reading the file.

    Raises:
        GoughError: a name of no known format.
        InputError: no such file, one that cannot be read, or one of another platform.
    """
    if isinstance(path, GivenRow):  # its columns are named, whatever those of logs are
        reading = replace(reading, log=replace(reading.log, columns=()))
    source = _open(path, reading)
    if platform is None:
        return source
    # a file that gough wrote is in the platform's unit
    form = LogFormat() if "gough.geometry" in source.metadata else reading.log
    try:
        if not reading.ignore_platform:
            check_same(source.metadata, platform)
        notes = _name_legs(source, platform, form)
    except InputError as error:
        source.close()
        raise InputError(f"{source.where}: {error}") from None
    if isinstance(source, CsvSource):
        notes += source.layout.notes(form)
    if notes:
        log.warning("%s: %s", source.where, "; ".join(notes))
    return source


def source_frame(source: Source, platform: Platform, frame: str | None) -> FramePose | None:
    """The frame whose poses an open file holds; see `pose_frame`.

    Raises:
        InputError: naming the file, if it states another frame.
        GoughError: no such frame.
    """
    try:
        return pose_frame(source.metadata, platform, frame)
    except InputError as error:
        raise InputError(f"{source.where}: {error}") from None


def _name_legs(source: Source, platform: Platform, form: LogFormat) -> list[str]:
    """Name the leg columns of a source, set their conversions, and return notes for the user.

    Raises:
        InputError: given columns that are not there, or a unit that cannot be converted.
    """
    found = source.columns
    has_pose = position_columns(found) is not None
    if has_pose and not isinstance((*form.columns, "")[0], str):
        return []  # columns by number are those of logs, not of files with poses
    places = form.find(found)
    if not places:
        if form.columns and not has_pose:
            wanted = ", ".join(map(str, form.columns))
            raise InputError(f"no columns {wanted}; the columns are {', '.join(found)}")
        return []
    names = [f"{name} (not used)" if name in LEGS else name for name in found]
    for leg, place in zip(LEGS, places, strict=True):
        names[place] = leg
    source.rename(names)
    units = [split_unit(found[place])[1] or source.units[place] for place in places]
    factor, offset, unit = form.conversion(platform, units)
    if np.any(factor != 1) or np.any(offset != 0):
        pairs = zip(factor.tolist(), offset.tolist(), strict=True)
        source.conversions = dict(zip(LEGS, pairs, strict=True))
    notes = []
    if [found[place] for place in places] != list(LEGS) and not form.columns:
        notes.append(f"{', '.join(found[place] for place in places)} are read as leg_1 to leg_6")
    target = "rad" if platform.legs == "rotary" else platform.unit
    if unit not in (target, form.unit, form.angle_unit):
        notes.append(f"readings are converted from [{unit}] to [{target}]")
    return notes


def _open(path: Given, reading: Reading) -> Source:
    if isinstance(path, GivenRow):
        return path.open(reading)
    ending = file_format(path, read=True)
    if str(path) == STANDARD:
        return CsvSource(sys.stdin.buffer, "standard input", None, reading)
    part = path if isinstance(path, FilePart) else FilePart(Place.of(path))
    file, where = part.place.open(), str(part.place)
    try:
        if ending == ".parquet":
            from gough.files.parquet import ParquetSource  # not for text: it takes long to import

            return ParquetSource(file, where, reading, part.start, part.stop, part.before)
        if Path(where).suffix.lower() in EXCEL:
            with file:
                return open_sheet(file, where, reading)
        size = part.place.info().size if part.place.store else os.fstat(file.fileno()).st_size
        return CsvSource(file, where, size or None, reading, part.start, part.stop, part.before)
    except BaseException:
        file.close()
        raise


@contextmanager
def open_sink(path: Out, metadata: Mapping[str, str]) -> Iterator[Sink]:
    """Open a file to append tables to, or standard output for "-".

    The file appears whole when the block ends without an error; see `written`.

    Args:
        path: .csv or .parquet, here or in a store, or "-".
        metadata: text for the file to carry; Parquet only.

    Raises:
        GoughError: a name of no known format, no such folder, a full disk.
        BrokenPipeError: the reader of standard output is gone.
    """
    if str(path) == STANDARD:
        with _standard_output() as file:
            yield CsvSink(file)
        return
    ending = file_format(path)
    target = path if isinstance(path, Target) else Target(Place.of(path))
    with written(target.place, tidy=target.tidy) as file:
        if ending == ".csv":
            yield CsvSink(file)
            return
        from gough.files.parquet import ParquetSink

        sink = ParquetSink(file, metadata)
        try:
            yield sink
            sink.finish(target.metadata())
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


def read_legs(
    path: Given,
    platform: Platform,
    reading: Reading = Reading(),
) -> Array:
    """Read all leg readings (N, 6) of a file, NaN where a value is absent.

    Args:
        path: .csv or .parquet with columns leg_1 to leg_6, or "-".
        platform: the machine that the readings belong to.
        reading: options for reading the file.

    Raises:
        GoughError: a name of no known format.
        InputError: a file that cannot be read, or one of another platform.
    """
    with closing(open_source(path, platform, reading)) as source:
        columns = file_leg_columns(source.where, source.columns)
        legs = np.concatenate([block.numbers(LEGS) for block in source.blocks(columns)])
        check_plausible(source, platform, legs)
        return legs


def write_table(
    path: str | Path, columns: Mapping[str, pa.Array], platform: Platform, frame: str | None = None
) -> None:
    """Write columns to a .csv or .parquet file, or to standard output for "-".

    Args:
        frame: whose poses they hold, for the file's metadata.

    Raises:
        GoughError: a name of no known format, no such folder, a full disk; an old file at `path`
            is unchanged.
    """
    with open_sink(path, describe(platform, frame)) as sink:
        sink.write(pa.table(dict(columns)))

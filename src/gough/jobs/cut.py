"""Large files cut into parts of consecutive rows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from itertools import pairwise
from typing import BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from gough.errors import GoughError
from gough.files.csv import CsvSource
from gough.files.excel import EXCEL
from gough.files.formats import FilePart, file_format
from gough.files.stores import Place
from gough.jobs.job import Job

SMALL = 8  # bytes a row: smaller files than this have no more rows than a unit
CHUNK = 1 << 24  # bytes of text read at a time
TAIL = 1 << 12  # bytes that may be nothing but the blank end of a text
LF, QUOTE = 10, 34

Parts = list[tuple[FilePart, float]]  # with their shares of the file


def parts(job: Job, place: Place, size: int) -> Parts:
    """Cut a file of `size` bytes into parts of at most `job.shard_rows` rows.

    Parquet is cut between row groups, of which a part has at least one. Text on this machine is
    cut at the ends of lines. Not cut are compressed text and sheets, text in a store, where finding
    the lines would read all of it once more, rows that are followed one after another, sets of
    readings in text, whose rows have numbers, and damaged files, whose unit says so.
    """
    whole: Parts = [(FilePart(place), 1.0)]
    if job.options.get("follow") is not None or size <= SMALL * job.shard_rows:
        return whole
    try:
        if file_format(place.path, read=True) == ".parquet":
            found = _row_groups(job, place)
        elif place.store or job.command == "modes" or place.path.lower().endswith((".gz", *EXCEL)):
            return whole
        else:
            found = _lines(job, place, size)
    except (GoughError, pa.ArrowException, OSError):
        return whole
    return found if len(found) > 1 else whole


def _row_groups(job: Job, place: Place) -> Parts:
    with closing(place.open()) as file:
        facts = pq.ParquetFile(file).metadata
    rows = [facts.row_group(i).num_rows for i in range(facts.num_row_groups)]
    cuts, held = [0], 0
    for i, count in enumerate(rows):
        if held and held + count > job.shard_rows:
            cuts.append(i)
            held = 0
        held += count
    return [
        (FilePart(place, start, stop, sum(rows[:start])), sum(rows[start:stop]) / sum(rows))
        for start, stop in pairwise([*cuts, len(rows)])
    ]


def _lines(job: Job, place: Place, size: int) -> Parts:
    with closing(CsvSource(place.open(), str(place), size, job.reading)) as source:
        if source.total is None:  # UTF-16
            return []
    with closing(place.open()) as file:
        cuts = [(0, 0), *line_ends(file, job.shard_rows)]
        file.seek(max(cuts[-1][0], size - TAIL))
        if not file.read().strip():  # nothing but blank lines after the last cut
            cuts.pop()
    starts = [start for start, _ in cuts]
    return [
        (FilePart(place, start, stop, before), (stop - start) / size)
        for (start, stop), (_, before) in zip(pairwise([*starts, size]), cuts, strict=True)
    ]


def line_ends(file: BinaryIO, rows: int) -> Iterator[tuple[int, int]]:
    """Bytes and lines up to the end of every `rows`-th row, which is outside quotation marks."""
    place, lines, quotes, found = 0, 0, 0, 0
    while data := file.read(CHUNK):
        text = np.frombuffer(data, np.uint8)
        ends, marks = np.flatnonzero(text == LF), np.flatnonzero(text == QUOTE)
        outside = (np.searchsorted(marks, ends) + quotes) % 2 == 0
        numbers = np.flatnonzero(outside)
        for i in numbers[rows - 1 - found % rows :: rows].tolist():
            yield place + int(ends[i]) + 1, lines + i + 1
        place, lines = place + len(data), lines + len(ends)
        quotes, found = quotes + len(marks), found + len(numbers)

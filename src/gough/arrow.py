"""Arrays to and from Arrow columns, without copies that are not needed.

pa.array and to_numpy would do for most of it, but they import pandas where that is installed,
for nothing: half a second.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import InputError

Column: TypeAlias = pa.ChunkedArray | pa.Array
KINDS = {"float64": pa.float64(), "int32": pa.int32(), "int64": pa.int64(), "bool": pa.bool_()}


def check_number(where: str, name: str, kind: pa.DataType, first: object) -> None:
    """That a column holds numbers, or nothing at all.

    Args:
        where: what to call the file or table in messages.
        kind: the column's type; first: a value of it, to be shown.

    Raises:
        InputError: text, categories of text, dates, truth values and the like.
    """
    if pa.types.is_dictionary(kind):
        kind = kind.value_type
    tests = (pa.types.is_integer, pa.types.is_floating, pa.types.is_decimal, pa.types.is_null)
    if not any(test(kind) for test in tests):
        raise InputError(
            f"{where}: column {name}: holds {kind}, expected numbers; row 1 has {first!r:.60}; "
            "convert the column to float64"
        )


def to_float(column: Column) -> Column:
    """Integers, decimals and shorter floats as float64; absent values stay absent."""
    if pa.types.is_dictionary(column.type):
        column = column.cast(column.type.value_type)
    return column.cast(pa.float64(), safe=False)


def put_numbers(out: Array, column: Column) -> None:
    """A float64 column into `out` (N,), which may be strided; absent values become NaN."""
    chunks = column.chunks if isinstance(column, pa.ChunkedArray) else [column]
    first = 0
    for chunk in chunks:
        filled = chunk.fill_null(math.nan) if chunk.null_count else chunk
        if len(filled):
            out[first : first + len(filled)] = np.from_dlpack(filled)
        first += len(filled)


def number_column(values: NDArray) -> pa.Array:
    """A float64, int32, int64 or bool array (N,) as a column."""
    kind = KINDS[values.dtype.name]
    exact = np.packbits(values, bitorder="little") if kind == pa.bool_() else values
    data = pa.py_buffer(np.ascontiguousarray(exact))
    return pa.Array.from_buffers(kind, len(values), [None, data])


def label_column(codes: NDArray, labels: Sequence[str]) -> pa.Array:
    """Words (N,), each `labels[code]`, as a column of text."""
    words = [label.encode() for label in labels]
    ends = np.cumsum([0, *map(len, words)], dtype=np.int32)
    buffers = [None, pa.py_buffer(ends), pa.py_buffer(b"".join(words))]
    dictionary = pa.Array.from_buffers(pa.string(), len(words), buffers)
    rows = number_column(codes.astype(np.int32))
    return pa.DictionaryArray.from_arrays(rows, dictionary).cast(pa.string())

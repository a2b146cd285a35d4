"""Some rows of a file, with the means to say where each stood."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa

from gough.checks import Array


@dataclass(frozen=True)
class Block:
    """Rows of a file.

    Attributes:
        table: number columns as float64, NaN where empty; kept columns as they were read.
        place: where row i (from 0) of the block stood, such as "line 17".
        bad: rows that could not be read, and why.
    """

    table: pa.Table
    place: Callable[[int], str]
    bad: dict[int, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return self.table.num_rows

    def numbers(self, names: Sequence[str]) -> Array:
        """The columns `names` as an array (N, len(names)).

        A value that is absent is NaN, and so is all of a row that could not be read.
        """
        array = np.stack([number_array(self.table.column(name)) for name in names], axis=-1)
        array[list(self.bad)] = np.nan
        return array


def to_float(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Integers, decimals and shorter floats as float64; absent values stay absent."""
    if pa.types.is_dictionary(column.type):
        column = column.cast(column.type.value_type)
    return column.cast(pa.float64(), safe=False)


# pa.array and to_numpy would do for the next three, but they import pandas where that is
# installed, for nothing: half a second.


def number_array(column: pa.ChunkedArray) -> Array:
    """A float64 column as an array (N,); absent values are NaN."""
    filled = column.fill_null(math.nan) if column.null_count else column
    return np.concatenate([np.from_dlpack(chunk) for chunk in filled.chunks], dtype=np.float64)


def number_column(values: np.ndarray) -> pa.Array:
    """A float64 or int32 array (N,) as a column."""
    kind = {"f": pa.float64(), "i": pa.int32()}[values.dtype.kind]
    exact = np.ascontiguousarray(values, dtype=kind.to_pandas_dtype())
    return pa.Array.from_buffers(kind, len(exact), [None, pa.py_buffer(exact)])


def label_column(codes: np.ndarray, labels: Sequence[str]) -> pa.Array:
    """Words (N,), each `labels[code]`, as a column of text."""
    words = [label.encode() for label in labels]
    ends = np.cumsum([0, *map(len, words)], dtype=np.int32)
    buffers = [None, pa.py_buffer(ends), pa.py_buffer(b"".join(words))]
    dictionary = pa.Array.from_buffers(pa.string(), len(words), buffers)
    rows = number_column(codes.astype(np.int32))
    return pa.DictionaryArray.from_arrays(rows, dictionary).cast(pa.string())

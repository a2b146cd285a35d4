"""Tables with named columns (pandas, polars, pyarrow, other Arrow streams): read and made.

None of the libraries is imported to read its tables: a table is recognised by what it offers.
Columns are found by name (`gough.columns`), never by order; other columns are ignored. An absent
value becomes NaN, which makes its row invalid.

Numbers pass between NumPy and Arrow by their buffers, since pa.array, pa.scalar and to_numpy import
pandas where it is installed, which takes half a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough.checks import Array, as_batch
from gough.columns import LEGS, leg_columns, pose_columns
from gough.errors import GoughError, InputError

if TYPE_CHECKING:
    import pyarrow as pa

Table = Any  # with named columns; the types are those of libraries that may not be installed
Kind = Literal["pandas", "polars", "pyarrow"]


@dataclass(frozen=True, eq=False)
class TableInfo:
    """Library and row labels of a table, to make another table like it.

    Attributes:
        kind: the library; "pyarrow" for Arrow streams of any other.
        index: row labels of a pandas table.
    """

    kind: Kind
    index: Any = None

    def at(self, rows: Any) -> TableInfo:
        """The same for some rows; labels are lost unless `rows` is one-dimensional."""
        if self.index is None or isinstance(rows, slice):
            return self if self.index is None else replace(self, index=self.index[rows])
        chosen = np.atleast_1d(np.asarray(rows))
        plain = chosen.ndim == 1 and chosen.dtype.kind in "iub"
        return replace(self, index=self.index[chosen] if plain else None)


# ---- tables to arrays -----------------------------------------------------------------


def as_readings(legs: ArrayLike | Table) -> Array:
    """Leg readings (..., 6) from an array, a table with columns leg_1 to leg_6, or a row of one.

    Raises:
        GoughError: another shape.
        InputError: other columns, or values that are not numbers.
    """
    if isinstance(legs, (np.ndarray, list, tuple)):
        return as_batch("legs", legs, (6,))
    names = column_names(legs)
    if names is not None:
        return _numbers("legs", legs, leg_columns("legs", names))
    return as_batch("legs", _row("legs", legs) if is_arrow(legs) else legs, (6,))


def read_pose_columns(table: Table) -> tuple[Array, tuple[str, ...]]:
    """Values (N, 6) or (N, 7) of the pose columns of a table, and the columns' names.

    Raises:
        GoughError: not a table.
        InputError: other columns, or values that are not numbers.
    """
    found = column_names(table)
    if found is None:
        raise GoughError(
            f"pose: expected a Pose or a table with columns x, y, z and a rotation; found "
            f"{type(table).__name__}"
        )
    names = pose_columns("pose", found)
    return _numbers("pose", table, names), names


def table_info(value: object) -> TableInfo | None:
    """Library and row labels of a table; None for anything else."""
    if isinstance(value, (np.ndarray, list, tuple)) or column_names(value) is None:
        return None
    kind = _library(value)
    return TableInfo(kind or "pyarrow", getattr(value, "index", None) if kind == "pandas" else None)


def column_names(value: Any) -> list[str] | None:
    """Names of a table's columns; None if `value` is no table.

    Raises:
        InputError: a lazy table, whose rows have not been computed yet.
    """
    if not is_arrow(value):
        if type(value).__name__ == "LazyFrame" and _library(value) == "polars":
            raise InputError("a polars LazyFrame has no rows yet; call .collect() first")
        return None
    names = getattr(value, "column_names", None)  # pyarrow's
    names = getattr(value, "columns", None) if names is None else names
    if names is None and hasattr(value, "schema"):  # pyarrow's RecordBatchReader
        names = value.schema.names
    if names is None or callable(names):
        return None
    return [name if isinstance(name, str) else repr(name) for name in names]


def is_arrow(value: object) -> bool:
    """Return True for objects that export Arrow data, and for pandas', of which old ones do not."""
    protocol = hasattr(value, "__arrow_c_stream__") or hasattr(value, "__arrow_c_array__")
    return protocol or _library(value) == "pandas"


def _library(value: object) -> Kind | None:
    """The library that a table's class, or one of its base classes, comes from."""
    homes = [base.__module__.partition(".")[0] for base in type(value).__mro__]
    return next((kind for kind in get_args(Kind) if kind in homes), None)


def _numbers(where: str, table: Table, names: Sequence[str]) -> Array:
    """Columns of a table as an array (N, len(names)), absent values NaN."""
    if not hasattr(table, "__getitem__") or _library(table) is None:
        import pyarrow as pa

        table = pa.table(table)
    return np.stack([_column(where, table[name], name) for name in names], axis=-1)


def _row(where: str, series: Any) -> Array:
    """One reading (6,) from a pandas Series whose labels are column names, or from six values."""
    labels = getattr(series, "index", None) if _library(series) == "pandas" else None
    if labels is not None and any(isinstance(name, str) for name in labels):
        leg_columns(where, [name if isinstance(name, str) else repr(name) for name in labels])
        series = series[list(LEGS)]
    return _column(where, series, "of readings")


def _column(where: str, column: Any, name: str) -> Array:
    """A column of numbers as float64 (N,), absent values NaN."""
    kind = getattr(column, "dtype", None)
    if isinstance(kind, np.dtype) and kind.kind in "fiu":
        return np.asarray(column, dtype=np.float64)
    import pyarrow as pa

    pandas = _library(column) == "pandas"
    try:
        if not isinstance(column, (pa.Array, pa.ChunkedArray)):
            column = pa.array(column, from_pandas=True) if pandas else pa.chunked_array(column)
    except Exception as error:  # each library has its own for what Arrow cannot hold
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(
            f"{where}: column {name}: expected numbers; {reason}; convert the column to float64"
        ) from None
    check_number(where, name, column.type, column[0].as_py() if len(column) else None)
    return arrow_values(column)


# ---- Arrow columns --------------------------------------------------------------------


def check_number(where: str, name: str, kind: pa.DataType, first: object) -> None:
    """Raise unless an Arrow column holds numbers, or nothing at all.

    Args:
        where: the file or table, for the message.
        name: the column.
        kind: its type.
        first: its first value, for the message.

    Raises:
        InputError: text, categories of text, dates, truth values and the like.
    """
    from pyarrow import types

    if types.is_dictionary(kind):
        kind = kind.value_type
    tests = (types.is_integer, types.is_floating, types.is_decimal, types.is_null)
    if not any(test(kind) for test in tests):
        raise InputError(
            f"{where}: column {name}: holds {kind}, expected numbers; row 1 has {first!r:.60}; "
            "convert the column to float64"
        )


def arrow_values(column: pa.ChunkedArray | pa.Array) -> Array:
    """An Arrow column of numbers as float64 (N,); absent values become NaN."""
    import pyarrow as pa

    if pa.types.is_dictionary(column.type):
        column = column.cast(column.type.value_type)
    if column.null_count or not (
        pa.types.is_integer(column.type) or pa.types.is_floating(column.type)
    ):  # the others are NumPy's to convert: pyarrow.compute takes long to import
        nan = number_column(np.array([np.nan]))[0]
        column = column.cast(pa.float64(), safe=False).fill_null(nan)
    chunks = column.chunks if isinstance(column, pa.ChunkedArray) else [column]
    parts = [np.from_dlpack(chunk) for chunk in chunks if len(chunk)]
    if len(parts) == 1:
        return parts[0].astype(np.float64, copy=False)
    return np.concatenate([np.empty(0), *parts], dtype=np.float64)


def number_column(values: NDArray) -> pa.Array:
    """A float64, int32, int64 or bool array (N,) as an Arrow column."""
    import pyarrow as pa

    kind = pa.type_for_alias(values.dtype.name)
    exact = np.packbits(values, bitorder="little") if kind == pa.bool_() else values
    data = pa.py_buffer(np.ascontiguousarray(exact))
    return pa.Array.from_buffers(kind, len(values), [None, data])


def label_column(codes: NDArray, labels: Sequence[str]) -> pa.Array:
    """An Arrow column of text (N,), each `labels[code]`."""
    import pyarrow as pa

    words = np.array([label.encode() for label in labels], object)
    lengths = np.array([len(word) for word in words], np.int32)
    ends = np.concatenate([[0], np.cumsum(lengths[codes])]).astype(np.int32)
    text = b"".join(words[codes].tolist())  # a cast of Arrow's would import pyarrow.compute
    buffers = [None, pa.py_buffer(ends), pa.py_buffer(text)]
    return pa.Array.from_buffers(pa.string(), len(codes), buffers)


# ---- columns to tables ----------------------------------------------------------------


def make_frame(
    columns: dict[str, pa.Array], kind: Kind | None = None, like: TableInfo | None = None
) -> Any:
    """A pandas or polars DataFrame, or a pyarrow Table.

    Args:
        columns: Arrow columns by name.
        kind: the library; unless given, that of `like`, else pandas.
        like: the table that the readings came in; a pandas result takes its row labels.

    Raises:
        GoughError: another kind, or a library that is not installed.
    """
    kind = kind or (like.kind if like is not None else "pandas")
    if kind not in get_args(Kind):
        raise GoughError(f"kind: expected 'pandas', 'polars' or 'pyarrow', found {kind!r}")
    import pyarrow as pa

    table = pa.table(columns)
    if kind == "pyarrow":
        return table
    try:
        if kind == "polars":
            import polars

            return polars.from_arrow(table)
        import pandas  # noqa: F401 - to name it where it is missing; pyarrow would not
    except ModuleNotFoundError:
        raise GoughError(
            f"kind: {kind} is not installed; install it with: pip install {kind}, or pass "
            "kind='pyarrow'"
        ) from None
    frame = table.to_pandas()
    if like is not None and like.index is not None:
        frame.index = like.index
    return frame

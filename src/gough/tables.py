"""Tables with named columns -- pandas, polars, pyarrow, other Arrow streams -- in and out.

None of them is imported to be read: a table is known by what it can do. Columns are found by
the names that files use, too (`gough.columns`); others are ignored, and no table is ever read by
the order of its columns. A value that is absent becomes NaN, and so a row without an answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from gough.checks import Array, as_batch
from gough.columns import LEGS, leg_columns, pose_columns
from gough.errors import GoughError, InputError

if TYPE_CHECKING:
    import pyarrow as pa

Table = Any  # with named columns; which types these are is for their libraries to say
Kind = Literal["pandas", "polars", "pyarrow"]


@dataclass(frozen=True, eq=False)
class Origin:
    """The table that a question came in, for the answer to come in one like it.

    Attributes:
        kind: the library; "pyarrow" for Arrow streams of any other.
        index: of a pandas table: the labels of its rows.
    """

    kind: Kind
    index: Any = None

    def at(self, rows: Any) -> Origin:
        """The same for some rows of the table; labels are lost where these are no plain list."""
        if self.index is None or isinstance(rows, slice):
            return self if self.index is None else replace(self, index=self.index[rows])
        chosen = np.atleast_1d(np.asarray(rows))
        plain = chosen.ndim == 1 and chosen.dtype.kind in "iub"
        return replace(self, index=self.index[chosen] if plain else None)


# ---- in -------------------------------------------------------------------------------


def as_readings(legs: ArrayLike | Table) -> Array:
    """Leg readings (..., 6) from an array, a table with columns leg_1 to leg_6, or a row of one.

    Raises:
        GoughError, InputError: another shape or other columns; values that are not numbers.
    """
    if isinstance(legs, (np.ndarray, list, tuple)):
        return as_batch("legs", legs, (6,))
    names = column_names(legs)
    if names is not None:
        return _numbers("legs", legs, leg_columns("legs", names))
    if is_arrow(legs):
        return as_batch("legs", _row("legs", legs), (6,))
    return as_batch("legs", legs, (6,))


def read_pose_columns(table: Table) -> tuple[Array, tuple[str, ...]]:
    """Values (N, 6) or (N, 7) of the pose columns of a table, and the columns' names.

    Raises:
        GoughError: not a table. InputError: other columns, or no numbers in them.
    """
    found = column_names(table)
    if found is None:
        raise GoughError(
            f"pose: expected a Pose or a table with columns x, y, z and a rotation; found "
            f"{type(table).__name__}"
        )
    names = pose_columns("pose", found)
    return _numbers("pose", table, names), names


def origin(value: object) -> Origin | None:
    """Where a question came from, if it came in a table."""
    if isinstance(value, (np.ndarray, list, tuple)) or column_names(value) is None:
        return None
    kind = _library(value)
    return Origin(kind or "pyarrow", getattr(value, "index", None) if kind == "pandas" else None)


def column_names(value: Any) -> list[str] | None:
    """The names of a table's columns; None for what is no table.

    Raises:
        InputError: a table whose rows have not been computed yet.
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
    """Whether a value hands out Arrow data, or is pandas', of which old ones do not."""
    protocol = hasattr(value, "__arrow_c_stream__") or hasattr(value, "__arrow_c_array__")
    return protocol or _library(value) == "pandas"


def _library(value: object) -> Kind | None:
    """Which library's table a value is, or is made from."""
    homes = [base.__module__.partition(".")[0] for base in type(value).__mro__]
    return next((kind for kind in get_args(Kind) if kind in homes), None)


def _numbers(where: str, table: Table, names: Sequence[str]) -> Array:
    """Columns of a table as an array (N, len(names)), absent values NaN."""
    if not hasattr(table, "__getitem__") or _library(table) is None:
        import pyarrow as pa

        table = pa.table(table)
    first = _column(where, table[names[0]], names[0])
    out = np.empty((len(first), len(names)))
    for i, name in enumerate(names):
        _put(out[:, i], first if i == 0 else _column(where, table[name], name))
    return out


def _row(where: str, series: Any) -> Array:
    """One reading (6,) from a pandas Series with the columns' names as labels, or from six."""
    labels = getattr(series, "index", None) if _library(series) == "pandas" else None
    names = LEGS if labels is None else list(labels)
    if labels is not None and any(isinstance(name, str) for name in names):
        leg_columns(where, [name if isinstance(name, str) else repr(name) for name in names])
        series = series[list(LEGS)]
    column = _column(where, series, "of readings")
    out = np.empty(len(column))
    _put(out, column)
    return out


def _column(where: str, column: Any, name: str) -> np.ndarray | pa.ChunkedArray | pa.Array:
    """A column's numbers, as they are in an array of pandas, else as float64 in Arrow."""
    kind = getattr(column, "dtype", None)
    if isinstance(kind, np.dtype) and kind.kind in "fiu":
        return np.asarray(column)
    import pyarrow as pa

    from gough.arrow import check_number, to_float

    pandas = _library(column) == "pandas"
    try:
        if isinstance(column, (pa.Array, pa.ChunkedArray)):
            found = column
        else:
            found = pa.array(column, from_pandas=True) if pandas else pa.chunked_array(column)
    except Exception as error:  # each library has its own for what Arrow cannot hold
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(
            f"{where}: column {name}: expected numbers; {reason}; convert the column to float64"
        ) from None
    check_number(where, name, found.type, found[0].as_py() if len(found) else None)
    return to_float(found)


def _put(out: Array, column: np.ndarray | pa.ChunkedArray | pa.Array) -> None:
    if isinstance(column, np.ndarray):
        out[:] = column
        return
    from gough.arrow import put_numbers

    put_numbers(out, column)


# ---- out ------------------------------------------------------------------------------


def make_frame(
    columns: dict[str, pa.Array], kind: Kind | None = None, like: Origin | None = None
) -> Any:
    """A table of a library's own: a pandas or polars DataFrame, or a pyarrow Table.

    Args:
        kind: which; unless given, that of `like`, else pandas.
        like: the table that the question came in; a pandas result takes its row labels.

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
        import pandas  # noqa: F401 - to say what is missing; pyarrow would not
    except ModuleNotFoundError:
        raise GoughError(
            f"kind: {kind} is not installed; install it with: pip install {kind}, or ask for "
            "kind='pyarrow'"
        ) from None
    frame = table.to_pandas()
    if like is not None and like.index is not None:
        frame.index = like.index
    return frame

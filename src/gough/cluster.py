"""Functions on batches for the data engines of clusters: Ray Data, Spark, Dask.

    dataset.map_batches(gough.cluster.Solver("mine.toml"), batch_format="pyarrow")  # Ray
    frame.mapInArrow(gough.cluster.Solver("mine.toml"), schema)  # Spark
    frame.map_partitions(gough.cluster.Solver("mine.toml"))  # Dask

An object is sent to the nodes as the platform and the settings. What is fitted, opened or compiled
is made by each process at its first batch.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

import gough
from gough.columns import Angles, check_kept, checked, solution_names
from gough.errors import GoughError
from gough.files.modes import mode_table
from gough.fk.solution import solution_columns
from gough.modes.assembly import assembly_modes
from gough.modes.choose import choose_mode
from gough.platform import Platform, as_platform
from gough.tables import as_readings, make_frame, number_column, table_info

Batch = Any  # a pyarrow, pandas or polars table, a dictionary of arrays, or an iterator of them
Columns = dict[str, Any]  # of Arrow
TEMPORARY = "_"  # what begins so is not sent to the nodes


class _OnBatches:
    """A function from a batch to one of the same kind; subclasses say what becomes of its rows."""

    def __init__(self, platform: Platform | str | Path, keep: Sequence[str] | None) -> None:
        self.platform = as_platform(platform)
        self.keep = None if keep is None else tuple(keep)

    def __call__(self, batch: Batch) -> Batch:
        """Return the columns of a batch that are kept, and those of its poses.

        Args:
            batch: with columns leg_1 to leg_6: a pyarrow Table or RecordBatch, a pandas or polars
                DataFrame, a dictionary of NumPy arrays, or an iterator of such batches.

        Returns:
            A batch of the same kind; an iterator for an iterator.

        Raises:
            GoughError: columns that are missing, or that have the names of those to write.
        """
        if isinstance(batch, Iterator):
            return map(self, batch)
        if isinstance(batch, pa.RecordBatch):
            return pa.record_batch(self._columns(batch))
        if isinstance(batch, Mapping):
            found = self._columns(pa.table(dict(batch)))
            return {name: column.to_numpy(zero_copy_only=False) for name, column in found.items()}
        info = table_info(batch)
        if info is None:
            raise GoughError(
                "batch: expected a pyarrow, pandas or polars table, or a dictionary of arrays; "
                f"found {type(batch).__name__}"
            )
        found = self._columns(batch if isinstance(batch, pa.Table) else _arrow(batch))
        same_rows = len(next(iter(found.values()))) == len(batch)
        return make_frame(found, info.kind, info if same_rows else None)

    def _columns(self, table: pa.Table | pa.RecordBatch) -> Columns:
        raise NotImplementedError

    def _kept(self, table: pa.Table | pa.RecordBatch, written: Sequence[str]) -> Columns:
        """The columns to keep, which must not have the names of those that are written."""
        found = table.schema.names
        names = found if self.keep is None else checked("batch", found, self.keep)
        check_kept(names, written)
        return {name: table.column(name) for name in names}

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in vars(self).items() if not k.startswith(TEMPORARY)}


class Solver(_OnBatches):
    """Forward kinematics of batches: each row with its pose and status.

    Args:
        platform: the machine; a name in the catalog or the path of a .toml file will do.
        keep: columns of a batch to return beside the new ones; all unless given.
        angles: "deg" or "rad": Euler angles, as in `Solution.to_frame`, instead of quaternions.
        settings: of `gough.Solver`, such as seed. One thread (workers) unless given: the engine
            runs one function on each CPU.

    Raises:
        GoughError: a setting out of range, an unknown seed or frame.

    Example:
        >>> solver = gough.cluster.Solver("reference", seed="polynomial")
        >>> legs = gough.Platform.load("reference").home_legs
        >>> batch = {f"leg_{i}": legs[i - 1 : i] for i in range(1, 7)}
        >>> solver(batch)["status"]
        array(['converged'], dtype=object)
    """

    def __init__(
        self,
        platform: Platform | str | Path,
        *,
        keep: Sequence[str] | None = None,
        angles: Angles | None = None,
        **settings: Any,
    ) -> None:
        super().__init__(platform, keep)
        self.angles: Angles | None = angles
        self.settings: dict[str, Any] = {"workers": 1} | settings
        solution_names(angles, covariance=False, radius=False)
        _ = self._solver  # raises for a wrong setting, here and not on a node

    @cached_property
    def _solver(self) -> gough.Solver:
        return gough.Solver(self.platform, **self.settings)

    def _columns(self, table: pa.Table | pa.RecordBatch) -> Columns:
        found = solution_columns(self._solver(as_readings(table)), self.angles)
        return self._kept(table, [*found]) | found


class Modes(_OnBatches):
    """Every pose that the readings of each row allow, each with its certificate.

    A row becomes as many rows as it has poses, the best of them first, with the columns of a file
    that `gough modes` writes, but its numbers of rows: keep a column that names the row.

    Args:
        platform, keep: as for `Solver`.
        workers: threads; one unless given.

    Example:
        >>> modes = gough.cluster.Modes("dietmaier", keep=["time"])
        >>> legs = gough.Platform.load("dietmaier").home_legs
        >>> batch = {f"leg_{i}": legs[i - 1 : i] for i in range(1, 7)} | {"time": np.zeros(1)}
        >>> modes(batch)["pose"].shape
        (40,)
    """

    def __init__(
        self,
        platform: Platform | str | Path,
        *,
        keep: Sequence[str] | None = None,
        workers: int = 1,
    ) -> None:
        super().__init__(platform, keep)
        self.workers = workers

    def _columns(self, table: pa.Table | pa.RecordBatch) -> Columns:
        modes = assembly_modes(self.platform, as_readings(table), workers=self.workers)
        found = mode_table(modes, choose_mode(modes))
        del found["row"]
        row = number_column(np.sort(modes.row))
        kept = {name: column.take(row) for name, column in self._kept(table, [*found]).items()}
        return kept | found


def _arrow(frame: Any) -> pa.Table:
    """A data frame as an Arrow table, without the row labels of pandas."""
    is_pandas = hasattr(frame, "reset_index")
    return pa.Table.from_pandas(frame, preserve_index=False) if is_pandas else pa.table(frame)

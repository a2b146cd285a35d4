"""Some rows of a file, with the means to say where each stood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa

from gough.arrow import put_numbers
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
        array = np.empty((len(self), len(names)))
        for i, name in enumerate(names):
            put_numbers(array[:, i], self.table.column(name))
        array[list(self.bad)] = np.nan
        return array

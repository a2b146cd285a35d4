"""Files small enough to be held whole: readings in, a table out."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

import numpy as np
import pyarrow as pa

from gough.checks import Array
from gough.columns import LEGS, leg_columns
from gough.files.metadata import check_same, describe
from gough.files.sink import open_sink
from gough.files.source import Reading, open_source
from gough.platform import Platform


def read_legs(path: str | Path, platform: Platform) -> Array:
    """The readings (N, 6) in a file, NaN where a value is absent.

    Args:
        path: .csv or .parquet with columns leg_1 to leg_6, or "-".

    Raises:
        GoughError, InputError: what is wrong with the name or the file.
    """
    with closing(open_source(path)) as source:
        columns = leg_columns(source.where, source.columns)
        check_same(source.where, source.metadata, platform)
        blocks = source.blocks(columns, rows=Reading().block_rows)
        return np.concatenate([block.numbers(LEGS) for block in blocks])


def write_table(path: str | Path, columns: Mapping[str, pa.Array], platform: Platform) -> None:
    """Write columns to a .csv or .parquet file, or to standard output for "-".

    Raises:
        GoughError: a bad name, no such folder, a full disk; what was at `path` is untouched.
    """
    with open_sink(path, describe(platform)) as sink:
        sink.write(pa.table(dict(columns)))

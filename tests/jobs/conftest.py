"""A folder of logs, and what its rows should become."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import gough
from gough.columns import LEGS

ROWS = 40  # of a file


@pytest.fixture(scope="session")
def platform() -> gough.Platform:
    return gough.Platform.load("reference")


@pytest.fixture(scope="session")
def readings(platform: gough.Platform) -> np.ndarray:
    """(400, 6) [mm]."""
    return gough.leg_lengths(platform, platform.sample_poses(400, seed=5))


def write(path: Path, rows: np.ndarray, group: int = 1000) -> None:
    """Write readings with their number as .parquet or .csv."""
    path.parent.mkdir(parents=True, exist_ok=True)
    columns = {"id": np.arange(len(rows))} | dict(zip(LEGS, rows.T, strict=True))
    if path.suffix == ".parquet":
        pq.write_table(pa.table(columns), path, row_group_size=group)
        return
    lines = [",".join(columns)]
    lines += [f"{i}," + ",".join(map(repr, row)) for i, row in enumerate(rows.tolist())]
    path.write_text("\n".join(lines) + "\n", "utf-8")


@pytest.fixture
def logs(tmp_path: Path, readings: np.ndarray) -> Path:
    """Six files of 40 rows: two in partitions, one CSV, and what is no log."""
    folder = tmp_path / "logs"
    names = ("a", "b", "day=1/c", "day=2/c", "deep/er/d")
    for i, name in enumerate(names):
        write(folder / f"{name}.parquet", readings[i * ROWS : (i + 1) * ROWS])
    write(folder / "text.csv", readings[5 * ROWS : 6 * ROWS])
    (folder / "notes.txt").write_text("not a log", "utf-8")
    (folder / "_SUCCESS").write_text("", "utf-8")
    write(folder / ".hidden/e.parquet", readings[:1])
    return folder

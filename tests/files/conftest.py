"""Readings of a small file, and ways to write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import gough
from gough.columns import LEGS


@pytest.fixture(scope="session")
def platform() -> gough.Platform:
    return gough.Platform.load("reference")


@pytest.fixture(scope="session")
def readings(platform: gough.Platform) -> np.ndarray:
    """(200, 6) [mm]."""
    return gough.leg_lengths(platform, platform.sample_poses(200, seed=3))


@pytest.fixture
def legs_csv(tmp_path: Path, readings: np.ndarray) -> Path:
    """The readings and a time column."""
    path = tmp_path / "legs.csv"
    path.write_bytes(csv_text(readings))
    return path


@pytest.fixture
def legs_parquet(tmp_path: Path, readings: np.ndarray) -> Path:
    """The readings and a time column, a few rows to a group."""
    path = tmp_path / "legs.parquet"
    pq.write_table(parquet_table(readings), path, row_group_size=64)
    return path


def csv_text(readings: np.ndarray) -> bytes:
    rows = [",".join(["time", *LEGS])]
    rows += [f"{i * 0.5}," + ",".join(map(repr, row)) for i, row in enumerate(readings.tolist())]
    return ("\n".join(rows) + "\n").encode()


def parquet_table(readings: np.ndarray) -> pa.Table:
    columns = {name: readings[:, i] for i, name in enumerate(LEGS)}
    return pa.table({"time": np.arange(len(readings)) * 0.5} | columns)

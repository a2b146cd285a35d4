"""Functions on batches: each kind of batch is answered in kind, here and after a pickle."""

from __future__ import annotations

import pickle

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

import gough
from gough.columns import LEGS

PLATFORM = gough.Platform.load("reference")
LEGS_6 = gough.leg_lengths(PLATFORM, PLATFORM.sample_poses(20, seed=4))
TABLE = pa.table(dict(zip(LEGS, LEGS_6.T, strict=True)) | {"id": np.arange(20)})
SOLVER = gough.cluster.Solver(PLATFORM, seed="home", keep=["id"])
NAMES = ["id", "x", "y", "z", "qw", "qx", "qy", "qz", "status", "residual", "iterations"]


@pytest.fixture(scope="module")
def expected() -> np.ndarray:
    return gough.Solver(PLATFORM, seed="home")(LEGS_6).pose.position[:, 0]


def test_batches_are_answered_in_kind(expected):
    table = SOLVER(TABLE)
    assert isinstance(table, pa.Table)
    assert table.column_names == NAMES
    assert table["x"].to_numpy().tolist() == expected.tolist()
    batch = SOLVER(TABLE.to_batches()[0])
    assert isinstance(batch, pa.RecordBatch)
    assert pa.table(batch).equals(table)
    arrays = SOLVER({name: TABLE[name].to_numpy() for name in TABLE.column_names})
    assert list(arrays) == NAMES
    assert arrays["x"].tolist() == expected.tolist()
    frame = SOLVER(TABLE.to_pandas().set_index(np.arange(100, 120)))
    assert isinstance(frame, pd.DataFrame)
    assert frame.index.tolist() == list(range(100, 120))
    assert frame["x"].tolist() == expected.tolist()
    assert next(SOLVER(iter(TABLE.to_batches()))).equals(batch)


def test_what_is_sent_to_nodes_is_small_and_the_same():
    SOLVER(TABLE)
    sent = pickle.dumps(SOLVER)
    assert len(sent) < 4096
    assert pickle.loads(sent)(TABLE).equals(SOLVER(TABLE))


def test_a_batch_without_rows_has_the_same_columns():
    assert SOLVER(TABLE.slice(0, 0)).schema == SOLVER(TABLE).schema


def test_all_columns_are_kept_unless_named():
    found = gough.cluster.Solver(PLATFORM, seed="home", angles="deg")(TABLE)
    assert found.column_names[:7] == TABLE.column_names
    assert found.column_names[10:13] == ["rx_deg", "ry_deg", "rz_deg"]


def test_modes_name_the_row_of_each_pose():
    modes = gough.cluster.Modes(PLATFORM, keep=["id"])
    found = modes(TABLE.slice(3, 2))
    alone = gough.assembly_modes(PLATFORM, LEGS_6[3:5])
    counts = alone.counts.tolist()
    assert found["id"].to_pylist() == [3] * counts[0] + [4] * counts[1]
    assert found["pose"].to_pylist() == [*range(1, counts[0] + 1), *range(1, counts[1] + 1)]
    assert modes(TABLE.slice(3, 2).to_pandas())["id"].tolist() == found["id"].to_pylist()


@pytest.mark.parametrize(
    ("batch", "words"),
    [
        (3, "batch: expected a pyarrow"),
        (TABLE.select(["id"]), "no leg columns"),
        (TABLE.append_column("x", TABLE["id"]).rename_columns([*LEGS, "a", "x"]), "no column 'id'"),
    ],
)
def test_other_batches_are_errors(batch, words):
    with pytest.raises(gough.GoughError, match=words):
        SOLVER(batch)


def test_wrong_settings_are_errors_before_anything_is_sent():
    with pytest.raises(gough.GoughError, match="seed"):
        gough.cluster.Solver(PLATFORM, seed="nonesuch")
    with pytest.raises(gough.GoughError, match="angles"):
        gough.cluster.Solver(PLATFORM, angles="grad")  # pyright: ignore[reportArgumentType]

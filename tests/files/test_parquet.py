"""What is read from Parquet files, and what is said of files that cannot be read."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from gough.columns import LEGS
from gough.errors import InputError
from gough.files.formats import open_source
from gough.files.rows import Block, Reading

from .conftest import parquet_table


def numbers(path: Path, rows: int = 50) -> np.ndarray:
    return np.concatenate([block.numbers(LEGS) for block in blocks(path, rows)])


def blocks(path: Path, rows: int) -> list[Block]:
    with closing(open_source(path, reading=Reading(block_rows=rows))) as source:
        return list(source.blocks(LEGS))


def write(path: Path, table: pa.Table) -> Path:
    pq.write_table(table, path)
    return path


def cast(table: pa.Table, kind: pa.DataType) -> pa.Table:
    return pa.table({name: table[name].cast(kind, safe=False) for name in LEGS})


@pytest.mark.parametrize("rows", [1, 7, 64, 1000])
def test_rows_come_back_bit_for_bit_from_blocks_of_any_size(legs_parquet, readings, rows):
    np.testing.assert_array_equal(numbers(legs_parquet, rows), readings)


@pytest.mark.parametrize(
    ("kind", "error"),
    [
        (pa.float32(), 1e-4),
        (pa.int32(), 1),
        (pa.uint16(), 1),
        (pa.decimal128(20, 9), 1e-8),
        (pa.dictionary(pa.int32(), pa.float64()), 0),
    ],
)
def test_every_kind_of_number_is_read(tmp_path, readings, kind, error):
    table = parquet_table(readings)
    if pa.types.is_dictionary(kind):
        table = pa.table({name: table[name].dictionary_encode() for name in LEGS})
    path = write(tmp_path / "legs.parquet", cast(table, kind) if error else table)
    np.testing.assert_allclose(numbers(path), readings, rtol=0, atol=error)


def test_absent_values_are_nan(tmp_path):
    column = pa.array([None, 1.0, 2.0], pa.float64())
    path = write(tmp_path / "legs.parquet", pa.table(dict.fromkeys(LEGS, column)))
    assert np.isnan(numbers(path)[0]).all()
    path = write(tmp_path / "null.parquet", pa.table(dict.fromkeys(LEGS, pa.nulls(3))))
    assert np.isnan(numbers(path)).all()


@pytest.mark.parametrize("kind", [pa.string(), pa.bool_()])
def test_columns_of_another_kind_are_an_error_that_shows_a_value(tmp_path, readings, kind):
    path = write(tmp_path / "legs.parquet", cast(parquet_table(readings.round()), kind))
    with pytest.raises(InputError, match=f"column leg_1: holds {kind}, .*row 1 has .*float64"):
        numbers(path)


def test_truncated_damaged_empty_and_foreign_files(tmp_path, legs_parquet):
    data = legs_parquet.read_bytes()
    half = tmp_path / "half.parquet"
    half.write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match=r"half\.parquet: is a Parquet file cut off"):
        open_source(half)
    for content, words in ((b"", "is empty"), (b"leg_1,leg_2\n1,2\n", "is not a Parquet file")):
        half.write_bytes(content)
        with pytest.raises(InputError, match=words):
            open_source(half)


def test_a_file_without_rows_is_an_error(tmp_path, readings):
    path = write(tmp_path / "none.parquet", parquet_table(readings).slice(0, 0))
    with pytest.raises(InputError, match="holds no rows"):
        open_source(path)


def test_a_damaged_page_is_noticed(tmp_path, readings):
    path = tmp_path / "legs.parquet"
    table = cast(parquet_table(readings), pa.float64())
    pq.write_table(table, path, compression="none", use_dictionary=False, write_page_checksum=True)
    data = bytearray(path.read_bytes())
    place = data.find(readings[100, 2].tobytes())
    data[place + 3] ^= 0x40  # still a number, only not the right one
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"legs\.parquet: damaged after row 0"):
        numbers(path)


def test_rows_are_named_by_number(legs_parquet):
    first, second, *_ = blocks(legs_parquet, 30)
    assert first.place(0) == "row 1"
    assert second.place(4) == "row 35"


def test_names_that_are_no_text_are_damage(tmp_path):
    path = tmp_path / "legs.parquet"
    table = pa.table({"leg_1": [1.0]}).replace_schema_metadata({"note": "x"})
    pq.write_table(table, path)
    content = path.read_bytes()
    for name in (b"leg_1", b"note"):
        assert name in content
        path.write_bytes(content.replace(name, b"\xff" + name[1:]))
        with pytest.raises(InputError, match="cut off or damaged"):
            open_source(path)

"""What is read from CSV text, and what is said of text that cannot be read."""

from __future__ import annotations

import io
import re

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gough.columns import LEGS
from gough.errors import InputError
from gough.files.csv import CsvSink, CsvSource
from gough.files.rows import Reading

from .conftest import csv_text

HEADER = b"time," + ",".join(LEGS).encode() + b"\n"


def read(data: bytes, rows: int = 64, keep: tuple[str, ...] = (), typed=False, **options) -> list:
    reading = Reading(block_rows=rows, **options)
    source = CsvSource(io.BytesIO(data), "legs.csv", len(data), reading)
    return list(source.blocks(LEGS, keep, typed=typed))


def numbers(data: bytes, **options) -> np.ndarray:
    return np.concatenate([block.numbers(LEGS) for block in read(data, **options)])


@pytest.mark.parametrize("rows", [1, 7, 64, 100000])
def test_rows_come_back_bit_for_bit_from_blocks_of_any_size(readings, rows):
    np.testing.assert_array_equal(numbers(csv_text(readings), rows=rows), readings)


@pytest.mark.parametrize(
    "change",
    [
        lambda s: b"\xef\xbb\xbf" + s,
        lambda s: s.replace(b"\n", b"\r\n"),
        lambda s: s.replace(b",", b";"),
        lambda s: s.replace(b",", b"\t"),
        lambda s: s.replace(b",", b" , "),
        lambda s: s.replace(b"\n", b"\n\n"),
        lambda s: s.rstrip(b"\n"),
        lambda s: s.replace(HEADER, b'"' + HEADER.strip().replace(b",", b'","') + b'"\n'),
        lambda s: re.sub(rb"\n[\d.]+,", b'\n"a, b\nc",', s),
    ],
    ids=["bom", "crlf", "semicolon", "tab", "spaces", "blanks", "no end", "quoted", "quoted lf"],
)
@pytest.mark.parametrize("rows", [1, 64])
def test_the_dialects_of_spreadsheets_are_read(readings, change, rows):
    np.testing.assert_array_equal(numbers(change(csv_text(readings)), rows=rows), readings)


def test_columns_are_found_by_name(readings):
    order = [3, 0, 5, 1, 4, 2]
    lines = [",".join([*(LEGS[i] for i in order), "note"])]
    lines += [",".join([*(repr(float(row[i])) for i in order), "x"]) for row in readings]
    np.testing.assert_array_equal(numbers("\n".join(lines).encode()), readings)


def test_values_that_are_absent_are_nan_and_whole_numbers_are_numbers():
    found = numbers(HEADER + b"0,1,2,3,4,5,6\n0,,NaN,NA,null, ,#N/A\n0,inf,-inf,1e400,-0,1e-5,7\n")
    np.testing.assert_array_equal(found[0], [1, 2, 3, 4, 5, 6])
    assert np.isnan(found[1]).all()
    np.testing.assert_array_equal(found[2], [np.inf, -np.inf, np.inf, 0, 1e-5, 7])


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (b"9,1,2,abc,4,5,6", ["line 42", "leg_3", "'abc'", "a number", "--keep-bad-rows"]),
        (b"9,1,2,1_0,4,5,6", ["line 42", "leg_3", "'1_0'"]),
        (b"9,1,2,3,4,5", ["line 42", "6 fields", "expected 7"]),
        (b"9,1,2,3,4,5,6,7", ["line 42", "8 fields", "expected 7"]),
        (b"9", ["line 42", "1 field,", "expected 7"]),
        (b'9,1,2,"3,5",4,5,6', ["line 42", "leg_3", "'3,5'", "decimal point"]),
        (b"9,1,2,\xe9,4,5,6", ["line 42", "leg_3"]),
    ],
)
@pytest.mark.parametrize("rows", [5, 1000])
def test_a_bad_row_is_named_by_line_and_column(readings, row, words, rows):
    lines = csv_text(readings).split(b"\n")
    lines[41] = row
    with pytest.raises(InputError) as error:
        read(b"\n".join(lines), rows=rows)
    assert "\n" not in str(error.value)
    for word in ["legs.csv", *words]:
        assert word in str(error.value)


def test_the_line_is_right_after_blank_lines_and_lines_within_quotes():
    data = HEADER + b'\n"a\nb",1,2,3,4,5,6\n\n\n0,1,2,x,4,5,6\n'
    with pytest.raises(InputError, match="line 7: column leg_3: found 'x'"):
        read(data)


def test_bad_rows_can_be_kept_and_their_neighbours_are_read(readings):
    lines = csv_text(readings).split(b"\n")
    lines[11], lines[21] = b"10,1,2,x,4,5,6", b"20,1"
    blocks = read(b"\n".join(lines), rows=1000, keep=("time",), keep_bad_rows=True)
    assert sum(map(len, blocks)) == len(readings)
    assert list(blocks[0].bad) == [10, 20]
    assert [blocks[0].place(i) for i in (10, 20)] == ["line 12", "line 22"]
    found = blocks[0].numbers(LEGS)
    good = np.delete(np.arange(len(readings)), [10, 20])
    np.testing.assert_array_equal(found[good], readings[good])
    assert np.isnan(found[[10, 20]]).all()
    assert blocks[0].table.column("time")[10].as_py() == "10"


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is empty"),
        (b"  \n", "is empty"),
        (HEADER, "a header and no rows"),
        (HEADER + b"\n \n", "a header and no rows"),
        (b"1,2,3\n4,5,6\n", "line 1 holds numbers"),
        (b"PAR1....", "rename it to end in .parquet"),
        (b"\x1f\x8b123", "is damaged or no gzip file"),
        (b"BZh9", "compressed (bzip2); unpack it"),
        ("a,b\n".encode("utf-16"), "a header and no rows"),
        (b"a\0b,c\n", "binary"),
        (b"caf\xe9,b\n1,2\n", "byte 4 is not UTF-8"),
        (b"a,b\r1,2\r", "CR alone"),
        (b'"a,b\n1,2\n', "line 1"),
    ],
)
def test_files_that_are_not_csv_say_what_they_are(data, words):
    with pytest.raises(InputError) as error:
        CsvSource(io.BytesIO(data), "legs.csv", len(data))
    assert words in str(error.value)
    assert str(error.value).startswith("legs.csv: ")


def test_a_quote_that_never_ends_is_named(readings):
    data = csv_text(readings).replace(b"\n20.0,", b'\n"20.0,')
    with pytest.raises(InputError, match=r"line 42: .*quotation marks"):
        read(data)


def test_a_kept_column_that_is_not_utf8_is_an_error_with_its_line():
    data = b"name," + HEADER + b"caf\xe9,0,1,2,3,4,5,6\n"
    assert len(read(data)[0]) == 1
    with pytest.raises(InputError, match="line 2: column name: not UTF-8"):
        read(data, keep=("name",))


def test_kept_columns_stay_text_unless_types_are_asked_for():
    data = b"a,b,c,d," + HEADER + b"007,7,1.50,,0,1,2,3,4,5,6\n008,8,x,,1,1,2,3,4,5,6\n"
    keep = ("a", "b", "c", "d", "time")
    text = read(data, keep=keep)[0].table
    assert text.select(keep).to_pylist()[0] == dict(
        zip(keep, ["007", "7", "1.50", "", "0"], strict=True)
    )
    typed = read(data, keep=keep, typed=True)[0].table
    expected = [pa.string(), pa.int64(), pa.string(), pa.string(), pa.int64()]
    assert typed.select(keep).schema.types == expected


def test_a_kept_number_column_that_turns_to_text_is_an_error_with_its_line():
    rows = b"".join(b"%d,0,1,2,3,4,5,6\n" % i for i in range(900))
    data = b"id," + HEADER + rows + b"B7,0,1,2,3,4,5,6\n"
    assert sum(map(len, read(data, rows=10, keep=("id",)))) == 901
    with pytest.raises(InputError, match="line 902: column id: found 'B7', expected a whole"):
        read(data, rows=10, keep=("id",), typed=True)


@given(st.lists(st.lists(st.floats(width=64), min_size=6, max_size=6), min_size=1, max_size=20))
def test_every_float_survives_writing_and_reading(rows):
    values = np.array(rows)
    file = io.BytesIO()
    CsvSink(file).write(pa.table({name: values[:, i] for i, name in enumerate(LEGS)}))
    found = numbers(file.getvalue(), rows=3)
    np.testing.assert_array_equal(found, values)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(values) & ~np.isnan(values))

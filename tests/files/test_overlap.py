"""Reading ahead and writing behind keep order, pass errors on, and leave no thread behind."""

from __future__ import annotations

import threading
from contextlib import closing

import pyarrow as pa
import pytest

from gough.files.overlap import read_ahead, write_behind


@pytest.fixture(autouse=True)
def no_thread_stays():
    before = threading.active_count()
    yield
    assert threading.active_count() == before


class Kept:
    """A sink that keeps what it gets, and fails at one table."""

    def __init__(self, bad: int = -1) -> None:
        self.tables, self.bad = [], bad

    def write(self, table: pa.Table) -> None:
        if len(self.tables) == self.bad:
            raise OSError("disk full")
        self.tables.append(table)


def numbered(count: int, made: list[int], bad: int = -1):
    for i in range(count):
        if i == bad:
            raise ValueError("damaged")
        made.append(i)
        yield i


@pytest.mark.parametrize("depth", [1, 2, 5])
def test_items_come_in_order_and_few_wait(depth):
    made = []
    for i, item in enumerate(read_ahead(numbered(20, made), depth)):
        assert item == i
        assert len(made) <= i + 1 + depth
    assert made == list(range(20))


def test_an_error_of_reading_comes_after_the_items_before_it():
    found = []
    with pytest.raises(ValueError, match="damaged"):
        found.extend(read_ahead(numbered(9, [], bad=6)))
    assert found == list(range(6))


def test_an_iterator_that_is_left_early_makes_no_more():
    made = []
    with closing(read_ahead(numbered(99, made))) as ahead:
        next(ahead)
    assert len(made) <= 4


def test_tables_are_written_in_order_before_the_block_ends():
    sink, tables = Kept(), [pa.table({"x": [i]}) for i in range(9)]
    with write_behind(sink) as behind:
        for table in tables:
            behind.write(table)
    assert sink.tables == tables


@pytest.mark.parametrize("bad", [0, 3, 8])
def test_an_error_of_writing_ends_the_block(bad):
    sink = Kept(bad)

    def write_all() -> None:
        with write_behind(sink) as behind:
            for i in range(9):
                behind.write(pa.table({"x": [i]}))

    with pytest.raises(OSError, match="disk full"):
        write_all()
    assert len(sink.tables) == bad

"""Logs as loggers write them are read, or refused with the cure."""

from __future__ import annotations

import logging
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import xlsxwriter
from logs import make

from gough.columns import LEGS
from gough.errors import InputError
from gough.files import LogFormat, Reading, inverse_file, read_legs
from gough.files.trajectory import open_trajectory
from gough.kinematics import leg_lengths
from gough.platform import Platform


@pytest.mark.parametrize("name", make.LOGS)
def test_a_log_is_read_or_refused_with_a_cure_that_works(name, caplog):
    log, path = make.LOGS[name], make.FOLDER / name
    platform = make.machine(log.machine)
    expected = make.readings(log.machine)
    assert path.read_bytes() == log.make(expected), "run python tests/logs/make.py"
    with caplog.at_level(logging.WARNING, "gough"):
        if not log.refused:
            found = read_legs(path, platform)
        else:
            with pytest.raises(InputError) as error:
                read_legs(path, platform)
            assert log.refused in str(error.value)
            assert "\n" not in str(error.value)
            if not log.options:
                return
            reading = Reading(log=LogFormat.of(log.machine, **log.options))
            found = read_legs(path, platform, reading)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-8)
    assert log.said in caplog.text
    assert log.refused or bool(caplog.text) == bool(log.said)


def test_every_refusal_names_an_option():
    cures = ("--", "write decimal points")
    assert all(any(c in log.refused for c in cures) for log in make.LOGS.values() if log.refused)


def test_the_form_of_readings_is_written_once_in_the_platforms_file(tmp_path):
    path = tmp_path / "press.toml"
    make.press().save(path)
    names = ",".join(f'"{name}"' for name in make.LEFT)
    path.write_text(path.read_text() + f'\n[readings]\ncolumns = [{names}]\nunit = "in"\n')
    platform = Platform.load(path)
    assert platform == make.press()
    reading = Reading(log=LogFormat.of(path))
    found = read_legs(make.FOLDER / "own_names.csv", platform, reading)
    np.testing.assert_allclose(found, make.readings("press"), rtol=0, atol=2e-8)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("unit = 3", "readings.unit: expected text"),
        ("colums = 3", r"readings.colums: unknown entry; did you mean 'columns'\?"),
        ('columns = "1:5"', "readings.columns: expected six different columns"),
        ('columns = ["a", "a", "b", "c", "d", "e"]', "readings.columns: expected six different"),
        ('decimal = ":"', r"readings.decimal: expected '.' or ','"),
        ('angle_unit = "turns"', "readings.angle_unit: expected 'deg' or 'rad'"),
        ("scale = [1, 2]", "readings.scale: expected one number or six"),
        ("scale = 0", "readings.scale: expected numbers other than 0"),
        ('offset = "a"', "offset a: expected numbers"),
    ],
)
def test_mistakes_in_the_table_are_named(tmp_path, table, words):
    path = Path(tmp_path / "m.toml")
    path.write_text(f"[readings]\n{table}\n")
    with pytest.raises(InputError, match=words):
        LogFormat.of(path)


def test_an_unknown_column_lists_those_there_are():
    reading = Reading(log=LogFormat.of("press", columns="a,b,c,d,e,f"))
    with pytest.raises(
        InputError, match="no columns a, b, c, d, e, f; the columns are time, leg_1"
    ):
        read_legs(make.FOLDER / "plain.csv", make.press(), reading)


def test_a_log_of_millimetres_that_is_right_is_read_when_its_unit_is_given(tmp_path):
    """A given unit is believed: nothing is compared with home."""
    reading = Reading(log=LogFormat(unit="in"))
    found = read_legs(make.FOLDER / "millimetres.csv", make.press(), reading)
    np.testing.assert_allclose(found, 25.4 * make.readings("press"), rtol=0, atol=1e-7)


def test_a_damaged_gzip_file_is_an_error(tmp_path):
    path = tmp_path / "cut.csv.gz"
    path.write_bytes((make.FOLDER / "packed.csv.gz").read_bytes()[:-20])
    with pytest.raises(InputError, match=r"cut\.csv\.gz: (is damaged|cannot be read)"):
        read_legs(path, make.press())


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
@pytest.mark.parametrize(
    ("name", "form"),
    [
        ("press", LogFormat(columns=tuple("abcdef"), unit="mm", offset=3.0)),
        ("press", LogFormat(columns=(1, 2, 3, 4, 5, 6), scale=0.01, offset=(1, 2, 3, 4, 5, 6))),
        ("reachy_mini", LogFormat(angle_unit="deg")),
    ],
)
def test_readings_that_inverse_writes_are_read_back_in_the_same_form(tmp_path, ending, name, form):
    platform, legs = make.machine(name), tmp_path / f"legs{ending}"
    poses = platform.sample_poses(5, seed=4) if name == "press" else make.arms()
    pq.write_table(poses.to_frame("pyarrow"), tmp_path / "poses.parquet")
    reading = Reading(log=form)
    inverse_file(tmp_path / "poses.parquet", legs, platform, reading=reading)
    expected = leg_lengths(platform, poses)
    np.testing.assert_allclose(read_legs(legs, platform, reading), expected, rtol=1e-12)
    if ending == ".parquet":
        np.testing.assert_array_equal(read_legs(legs, platform), expected)


def test_columns_by_number_that_are_not_the_ones_called_legs_are_refused():
    reading = Reading(log=LogFormat(columns=(1, 2, 3, 4, 5, 6)))
    with pytest.raises(InputError, match="not those called leg_1 to leg_6"):
        read_legs(make.FOLDER / "plain.csv", make.press(), reading)


def test_date_and_time_are_seconds(tmp_path):
    platform = make.press()
    with open_trajectory(make.FOLDER / "stamps.csv", platform, time="timestamp") as file:
        times = np.concatenate([rows[:, 1] for rows in file.blocks()])
    start = datetime(2026, 11, 24, 10, 2, 11, 250_000, tzinfo=UTC).timestamp()
    np.testing.assert_allclose(times, start + np.arange(8))
    stamps = pa.array([1, None], pa.timestamp("ms"))
    legs = {name: [27.0, 26.0] for name in LEGS}
    pq.write_table(pa.table({"time": stamps, **legs}), tmp_path / "legs.parquet")
    with open_trajectory(tmp_path / "legs.parquet", platform, time="time") as file:
        np.testing.assert_array_equal(next(file.blocks())[:, 1], [0.001, np.nan])
    path = tmp_path / "legs.csv"
    path.write_text("t,L1,L2,L3,L4,L5,L6\n10:2,27,27,27,27,27,27\n")
    with (
        open_trajectory(path, platform, time="t") as file,
        pytest.raises(InputError, match="line 2: column t: found '10:2', expected a number or"),
    ):
        next(file.blocks())


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"leg_1,leg_2\n", None])
def test_files_that_are_no_workbook_are_refused(tmp_path, content):
    path = tmp_path / "log.xlsx"
    path.write_bytes(
        (make.FOLDER / "sheet.xlsx").read_bytes()[:3000] if content is None else content
    )
    with pytest.raises(InputError, match="is damaged or no Excel file") as error:
        read_legs(path, make.press())
    assert "\n" not in str(error.value)


def test_a_workbook_without_cells_is_empty(tmp_path):
    path = tmp_path / "log.xlsx"
    with xlsxwriter.Workbook(path) as book:
        book.add_worksheet()
    with pytest.raises(InputError, match="has no sheet with cells"):
        read_legs(path, make.press())


def test_times_of_a_sheet_are_read():
    path = make.FOLDER / "sheet.xlsx"
    with open_trajectory(path, make.press(), time="time") as file:
        time = np.concatenate([rows[:, 1] for rows in file.blocks()])
    np.testing.assert_allclose(np.diff(time), 0.02, atol=1e-6)

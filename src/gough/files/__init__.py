"""Leg readings and poses in CSV and Parquet files of any size, a block of rows at a time.

    report = solve_file("legs.parquet", "poses.parquet", platform)
    report = inverse_file("poses.csv", "legs.csv", platform)

A file name ending in .csv or .parquet gives the format; "-" is CSV on standard input or output.
"""

from __future__ import annotations

from gough.files.convert import inverse_file, solve_file
from gough.files.formats import GivenRow, open_source, read_legs, write_table
from gough.files.log_format import LogFormat
from gough.files.report import Report
from gough.files.rows import Reading

__all__ = [
    "GivenRow",
    "LogFormat",
    "Reading",
    "Report",
    "inverse_file",
    "open_source",
    "read_legs",
    "solve_file",
    "write_table",
]

"""A log of leg readings examined: what was understood, what its rows give, and likely mistakes."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.columns import LEGS, file_leg_columns
from gough.errors import InputError
from gough.examination.mistakes import Remark
from gough.files.csv import CsvSource
from gough.files.formats import STANDARD, open_source
from gough.files.log_format import time_column
from gough.files.plausible import cause, likely_fault
from gough.files.report import Report
from gough.files.rows import Reading
from gough.fk.solve import Solver
from gough.limit_rules import legs_in_stroke
from gough.platform import Platform
from gough.status import Status

SAMPLE = 20  # rows that other orders of the legs are tried on
GOOD = 0.9  # share of rows within the workspace above which the order is not doubted
GAIN = 0.3  # by which this share must grow for another order to be suggested
SHOWN = 3  # other orders that are named


@dataclass(frozen=True, eq=False)
class LogCheck:
    """Facts about a log, and remarks on what may be wrong.

    Attributes:
        where: name of the log.
        columns: the columns of legs 1 to 6, as the log names them.
        conversion: factor and offset (6, 2) from the log's values to readings of the platform.
        layout: remarks on the form of the text: header, separators, decimal sign.
        time: the column of times, "" if there is none.
        low, high: (6,) lowest and highest reading.
        outside: (6,) rows whose reading is outside the stroke.
        report: rows by status, and the first bad rows.
        remarks: what may be wrong, with the evidence.
    """

    where: str
    columns: list[str]
    conversion: Array
    layout: list[str]
    time: str
    low: Array
    high: Array
    outside: Array
    report: Report
    remarks: list[Remark]

    @property
    def ok(self) -> bool:
        """All rows have a usable pose, and nothing looks like a mistake."""
        return not self.report.failures and not any(remark.mistake for remark in self.remarks)

    def to_dict(self) -> dict[str, Any]:
        """Facts and remarks as dicts, lists, numbers and text."""
        counts = zip(self.report.outcomes, self.report.counts.tolist(), strict=True)
        return {
            "log": self.where, "columns": self.columns, "factor": self.conversion[:, 0],
            "offset": self.conversion[:, 1], "layout": self.layout, "time": self.time,
            "low": self.low, "high": self.high, "outside_stroke": self.outside,
            "rows": self.report.rows,
            "statuses": {outcome.label: count for outcome, count in counts if count},
            "invalid": self.report.invalid, "unlikely": self.report.unlikely,
            "remarks": [vars(remark) for remark in self.remarks],
        }  # fmt: skip


def check_log(path: str, platform: Platform, reading: Reading = Reading()) -> LogCheck:
    """Examine a log of leg readings.

    Args:
        path: a file as for `gough.files.solve_file`, but for standard input.
        platform: the machine.
        reading: options for reading the file; its rows that cannot be read count as invalid.

    Raises:
        InputError: a file that cannot be read, or in which no leg columns were found.
    """
    if path == STANDARD:
        raise InputError("LOG: a log is read twice, so name a file instead of standard input")
    with closing(open_source(path, None, reading)) as source:
        named = list(source.columns)
    with closing(open_source(path, platform, reading)) as source:
        file_leg_columns(source.where, source.columns)
        columns = [named[source.columns.index(leg)] for leg in LEGS]
        conversion = np.array([source.conversions.get(leg, (1.0, 0.0)) for leg in LEGS])
        layout = source.layout.notes(reading.log) if isinstance(source, CsvSource) else []
        report, low, high, outside, sample = _read(source, platform)
    remarks = _remarks(platform, sample, report, reading)
    time = time_column(named, reading.log)
    if time and report.rows > 1:
        text = f"Rows have times ({time}): if they follow each other, solve them with --follow."
        remarks.append(Remark(False, text))
    return LogCheck(
        path, columns, conversion, layout, time, low, high, outside, report, remarks
    )  # fmt: skip


def _read(source: Any, platform: Platform) -> tuple[Report, Array, Array, Array, Array]:
    """Report, lowest and highest readings (6,), rows outside the stroke (6,), a sample of rows."""
    report, solver = Report(tuple(Status)), Solver(platform)
    low, high, outside = np.full(6, np.nan), np.full(6, np.nan), np.zeros(6, dtype=int)
    sample = np.empty((0, 6))
    for block in source.blocks(LEGS):
        legs = block.numbers(LEGS)
        found = solver(legs)
        report.add(found.pose, legs, found.status, found.residual)
        lost = np.isin(found.status, (Status.INVALID_INPUT, Status.UNREACHABLE))
        report.describe_unlikely(block, lost, lambda i, legs=legs: _fault(platform, legs[i]))
        finite = np.where(np.isfinite(legs), legs, np.nan)
        low = np.fmin(low, np.fmin.reduce(finite, axis=0))
        high = np.fmax(high, np.fmax.reduce(finite, axis=0))
        outside += np.sum(np.isfinite(legs) & ~legs_in_stroke(platform, legs), axis=0)
        whole = legs[np.all(np.isfinite(legs), axis=-1)]
        sample = np.concatenate([sample, whole[:: max(1, len(whole) // 500)]])
    return report, low, high, outside, sample


def _fault(platform: Platform, legs: Array) -> str:
    if not np.all(np.isfinite(legs)):
        return f"{LEGS[int(np.argmin(np.isfinite(legs)))]} is empty or no number"
    return cause(platform, legs)


def _remarks(platform: Platform, sample: Array, report: Report, reading: Reading) -> list[Remark]:
    """Guesses at unit, zero and order of the readings."""
    remarks = []
    if fault := likely_fault(platform, sample):
        remarks.append(Remark(True, fault[0].upper() + fault[1:] + "."))
        return remarks
    if text := _beyond_stroke(platform, sample):
        remarks.append(Remark(True, text))
    if len(sample) and (text := order_guess(platform, sample)):
        remarks.append(Remark(True, text))
    return remarks


def _beyond_stroke(platform: Platform, legs: Array) -> str:
    """The remark on readings of which most are on one side of the stroke."""
    if platform.stroke is None or not len(legs):
        return ""
    low, high = platform.stroke.T
    for words, over in (("above", legs - high), ("below", low - legs)):
        share = float(np.mean(np.all(over > 0, axis=-1)))
        if share > 0.5:
            by = float(np.median(over[over > 0]))
            return (
                f"In {100 * share:.0f} % of the rows all six readings are {words} the stroke, by "
                f"about {by:.4g}: is their zero off (--offset), or the stroke in the file?"
            )
    return ""


def order_guess(platform: Platform, legs: Array) -> str:
    """The remark on another order of the legs in which more rows are within the workspace."""
    rows = legs[np.linspace(0, len(legs) - 1, min(SAMPLE, len(legs))).astype(int)]
    orders = np.array(list(permutations(range(6))))
    tried = rows[:, orders].transpose(1, 0, 2)  # (720, rows, 6)
    found = Solver(platform, restarts=0, max_iterations=12)(tried)
    good = found.usable & (found.status != Status.OUTSIDE_WORKSPACE)
    good &= found.status != Status.OUTSIDE_STROKE
    share = good.mean(axis=1)
    if share[0] >= GOOD or share.max() < share[0] + GAIN:
        return ""
    best = np.flatnonzero(share >= share.max() - 1e-9)
    best = best[np.argsort(np.sum(orders[best] != np.arange(6), axis=1), kind="stable")]
    shown = " or ".join(_order_text(orders[k]) for k in best[:SHOWN])
    more = f" ({len(best) - SHOWN} more orders do as well)" if len(best) > SHOWN else ""
    return (
        f"As read, {100 * share[0]:.0f} % of the rows are within workspace and stroke; with the "
        f"columns taken in the order {shown}{more} it would be {100 * share.max():.0f} %: are the "
        "legs numbered otherwise in the log? Move one leg at a time to be sure."
    )


def _order_text(order: NDArray[np.intp]) -> str:
    return " ".join(str(leg + 1) for leg in order.tolist())

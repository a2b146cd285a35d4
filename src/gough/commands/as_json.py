"""Answers of the commands as JSON, for other programs."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import numpy as np

from gough.checks import Array
from gough.columns import LEGS, Angles, pose_names
from gough.commands.show import STANDARD
from gough.pose import pose_values

if TYPE_CHECKING:
    from gough.files.report import Report
    from gough.platform import Platform


def print_json(facts: object, out: str | None = None) -> None:
    """Print facts where commands print text; NaN and infinity become null.

    Args:
        facts: dicts, lists, arrays, numbers and text.
        out: the file that the command wrote; beside standard output facts go to standard error.
    """
    stream = sys.stderr if out == STANDARD else sys.stdout
    print(json.dumps(_plain(facts), indent=2, allow_nan=False), file=stream)


def _plain(value: object) -> object:
    """Arrays as lists, and numbers that JSON does not have as None."""
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def report_facts(report: Report, platform: Platform, rows: list[dict]) -> dict:
    """The summary of a file and its first rows."""
    statuses = {
        outcome.label: {"rows": count, "worst_residual": worst, "text": outcome.text}
        for outcome, count, worst in zip(report.outcomes, report.counts, report.worst, strict=True)
        if count
    }
    return {
        "platform": platform.name,
        "unit": platform.unit,
        "frame": report.frame,
        "rows": report.rows,
        "usable": report.rows - report.failures,
        "seconds": report.seconds,
        "statuses": statuses,
        "invalid": report.invalid,
        "unlikely": report.unlikely,
        "events": _events(report),
        **_limit_facts(report),
        "first_rows": rows,
    }


def _events(report: Report) -> dict | None:
    from gough.status import Event

    if report.events is None:
        return None
    return {event.label: report.events[event] for event in Event if report.events[event]}


def _limit_facts(report: Report) -> dict:
    if report.margin is None:
        return {}
    margin, limit = report.tightest
    return {"limits": {"rows_beyond": report.broken, "margin": margin, "limit": limit}}


def first_poses(report: Report, angles: Angles | None) -> list[dict]:
    """The first poses of a report, by the names of their columns."""
    rows = _rows(report, pose_names(angles), pose_values(report.pose, angles))
    if report.margin is not None:
        for row, margin, limit in zip(rows, report.margin, report.limit, strict=True):
            row |= {"margin": margin, "limit": limit}
    return rows


def first_legs(report: Report) -> list[dict]:
    """The first readings of a report, by the names of their columns."""
    return _rows(report, LEGS, report.legs)


def _rows(report: Report, names: tuple[str, ...], values: Array) -> list[dict]:
    return [
        dict(zip(names, row, strict=True)) | {"status": report.outcomes[status].label}
        for row, status in zip(values, report.status, strict=True)
    ]

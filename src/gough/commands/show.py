"""Tables, summaries and the progress bar of the commands."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from rich.box import Box
from rich.console import Console
from rich.table import Table

from gough.commands import signals

if TYPE_CHECKING:
    from gough.files.convert import Progress as Tick
    from gough.files.report import Report
    from gough.files.rows import Source
    from gough.platform import Platform

WIDTH = 80  # columns that tables of poses fit in
NOTICEABLE = 0.5  # [s] of compiling that are reported
STANDARD = "-"  # as in gough.files, whose import takes too long for a help text
# one rule, below the head
RULE = Box("    \n    \n -- \n    \n    \n    \n    \n    \n", ascii=True)


def console(*, errors: bool = False) -> Console:
    """A console for plain text on standard output or standard error; numbers are not coloured."""
    return Console(stderr=errors, highlight=False, soft_wrap=False)


def console_beside(out: str | None) -> Console:
    """The console to print on: standard error if `out` is standard output, else that."""
    return console(errors=out == STANDARD)


def plain_table(*heads: str) -> Table:
    """A table with a rule below its head; a column whose head starts with > is set to the right."""
    table = Table(box=RULE, pad_edge=False, padding=(0, 1, 0, 0), header_style="", show_edge=False)
    for head in heads:
        side = "right" if head.startswith(">") else "left"
        table.add_column(head.removeprefix(">"), justify=side, no_wrap=head != "status")
    return table


def print_report(
    report: Report,
    platform: Platform,
    given: object,
    out: str | None,
    head: int,
    print_rows: Callable[[Report, Platform, Console], None],
    allow_failures: bool,
) -> int:
    """Print the first rows unless a file was written, invalid rows and the summary.

    Returns:
        The exit code: 1 if a row has no usable result and `allow_failures` is False, else 0.
    """
    screen = console_beside(out)
    if not out and head:
        print_rows(report, platform, screen)
    print_invalid(report, str(given))
    print_summary(report, platform, out, screen)
    return exit_code(report, allow_failures)


def exit_code(report: Report, allow_failures: bool) -> int:
    """1 if a row has no usable result and `allow_failures` is False, else 0."""
    return 1 if report.failures and not allow_failures else 0


def print_summary(report: Report, platform: Platform, out: str | None, screen: Console) -> None:
    """Print rows by status with shares and largest residuals, and the text of each status."""
    target = "" if out is None else f", written to {'standard output' if out == STANDARD else out}"
    rate = report.rows / max(report.seconds, 1e-9)
    screen.print(
        f"{report.rows:,} rows in {report.seconds:.3g} s ({rate:,.0f} rows/s){target}",
        markup=False,
    )
    if report.compiling > NOTICEABLE:
        screen.print(f"(besides {report.compiling:.1f} s to compile the solver, once)")
    residuals = not np.all(np.isnan(report.worst))
    heads = ["status", ">rows", ">share"] + ["worst residual"] * residuals
    table = plain_table(*heads)
    found = [i for i in range(len(report.counts)) if report.counts[i]]
    for i in found:
        worst = report.worst[i]
        row = [
            report.outcomes[i].label,
            f"{report.counts[i]:,}",
            percentage(report.counts[i], report.rows),
        ]
        row += ["" if np.isnan(worst) else f"{worst:.2g} {platform.unit}"] * residuals
        table.add_row(*row)
    screen.print(table)
    for i in found:
        screen.print(f"{report.outcomes[i].label}: {report.outcomes[i].text}", markup=False)
    if report.margin is not None and report.tightest[1]:
        share, limit = report.tightest
        left = f"{share:.3g} of the tightest is left ({limit})"
        screen.print(f"limits: {report.broken:,} rows beyond one; {left}", markup=False)
    print_events(report, screen)


def print_events(report: Report, screen: Console) -> None:
    """Print the rows of each event; where rows were not followed but have times, suggest it."""
    from gough.status import Event

    if report.events is not None:
        table = plain_table("event", ">rows", ">share")
        shown = [event for event in Event if report.events[event]]
        for event in shown:
            share = 100 * report.events[event] / report.rows
            table.add_row(event.label, f"{report.events[event]:,}", f"{share:.1f} %")
        screen.print(table)
        for event in shown:
            screen.print(f"{event.label}: {event.text}", markup=False)
    elif report.time and report.rows > 1:
        screen.print(
            f"The file has times ({report.time}). If its rows follow each other, --follow starts "
            "each at the pose before and marks jumps.",
            markup=False,
        )


def percentage(count: int, rows: int) -> str:
    """A percentage that is shown as 100 or 0 only where that is exact."""
    part = 100 * count / rows
    if 99.95 <= part < 100:
        return "> 99.9 %"
    return "< 0.1 %" if part < 0.05 else f"{part:.1f} %"


def print_invalid(report: Report, where: str) -> None:
    """Print the first invalid rows and the number of others, on standard error."""
    screen = console(errors=True)
    for text in report.invalid + report.unlikely:
        screen.print(f"{where}: {text}", markup=False, soft_wrap=True)
    invalid = next(
        int(n)
        for n, outcome in zip(report.counts, report.outcomes, strict=True)
        if outcome.label == "invalid_input"
    )
    if invalid > len(report.invalid):
        more = f"{where}: and {invalid - len(report.invalid):,} more invalid rows"
        screen.print(more, markup=False, soft_wrap=True)


def print_poses(report: Report, platform: Platform, screen: Console) -> None:
    """Print the first poses, angles in degrees."""
    unit = f" [{platform.unit}]".replace("[", r"\[") if platform.unit else ""
    heads = [f">{name}{unit}" for name in ("x", "y", "z")]
    if report.frame:
        screen.print(f"poses of {report.frame}", markup=False)
    table = plain_table(*heads, ">rx_deg", ">ry_deg", ">rz_deg", "status")
    for row in _fitting_rows(report, _decimals(platform.size)):
        table.add_row(*row)
    screen.print(table)
    if report.margin is not None:
        table = plain_table(">row", ">margin", "tightest limit")
        for i, (margin, limit) in enumerate(zip(report.margin, report.limit, strict=True)):
            table.add_row(str(i + 1), f"{margin:.3f}", limit)
        screen.print(table)


def _fitting_rows(report: Report, places: int) -> list[list[str]]:
    """The first poses and their statuses, with as many digits as leave room for the statuses."""
    angles = np.degrees(report.pose.euler)
    labels = _labels(report)

    def written(drop: int) -> list[list[str]]:
        return [
            [f"{v:z.{places - drop}f}" for v in position]
            + [f"{v:z.{max(5 - drop, 2)}f}" for v in turn]
            + [label]
            for position, turn, label in zip(report.pose.position, angles, labels, strict=True)
        ]

    for drop in range(places):
        widths = [max(map(len, column)) for column in zip(*written(drop), strict=True)]
        if sum(max(width, 6) + 1 for width in widths) <= WIDTH:
            return written(drop)
    return written(places)


def _labels(report: Report) -> list[str]:
    """The status of each of the first rows, or the event for which its pose was not taken."""
    from gough.status import Event

    labels = [report.outcomes[status].label for status in report.status]
    for i, code in enumerate(report.event):
        event = Event(int(code))
        if not event.usable and report.outcomes[report.status[i]].usable:
            labels[i] = event.label
    return labels


def print_legs(report: Report, platform: Platform, screen: Console) -> None:
    """Print the first leg readings."""
    table = plain_table(*(f">leg_{i}" for i in range(1, 7)), "status")
    places = 6 if platform.legs == "rotary" else _decimals(platform.size)
    for i, status in enumerate(report.status):
        numbers = [f"{v:.{places}f}" for v in report.legs[i]]
        table.add_row(*numbers, report.outcomes[status].label)
    screen.print(table)


def _decimals(size: float) -> int:
    """Number of decimals that show a ten-millionth of a length: seven for a metre."""
    return int(np.clip(7 - np.floor(np.log10(size)), 0, 12))


@contextmanager
def progress_bar() -> Iterator[Tick]:
    """Yield a function to call after every block of rows.

    It draws a bar with rate and remaining time on standard error, if that is a terminal, and
    ends the command if a signal has asked for it.
    """
    with bar() as update:

        def tick(source: Source, report: Report) -> None:
            rate = f"{report.rows / max(report.seconds, 1e-9):,.0f} rows/s"
            update(source.done, source.total, rate)
            signals.check()

        yield tick


@contextmanager
def bar() -> Iterator[Callable[[int, int | None, str], None]]:
    """Yield a function that shows how much is done, of how much, and a text, on a terminal."""
    if not sys.stderr.isatty():
        yield lambda done, total, text: None
        return
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (BarColumn(), TaskProgressColumn(), TextColumn("{task.fields[text]}"))
    with Progress(*columns, TimeRemainingColumn(), console=console(errors=True)) as drawn:
        task = drawn.add_task("", total=None, text="starting")
        yield lambda done, total, text: drawn.update(task, completed=done, total=total, text=text)

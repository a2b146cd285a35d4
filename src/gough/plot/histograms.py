"""Histograms of residuals and errors over many decades."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing
from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from gough.checks import Array
from gough.columns import pose_columns
from gough.errors import GoughError, InputError
from gough.files.formats import open_source
from gough.files.rows import Reading, Source
from gough.files.trajectory import read_columns, unusable_status
from gough.platform import Platform
from gough.plot.style import CURVES, GREY, new_figure, styled
from gough.pose import Pose, poses_from_columns

RESIDUAL = "residual"
PER_DECADE = 5  # bars in a picture
FINER = 10  # bins behind each bar, from which quantiles are read
LOWEST, HIGHEST = -324, 309  # decades that float64 has
_FINE = PER_DECADE * FINER


class LogHistogram:
    """Number of values in each fiftieth of a decade, for any number of values in little memory.

    Attributes:
        count: finite values added.
        zeros: number of them that are exactly zero.
        left_out: values that are NaN or infinite.
        largest: the largest value, exactly.
    """

    def __init__(self) -> None:
        self.count, self.zeros, self.left_out, self.largest = 0, 0, 0, 0.0
        self._bins = np.zeros((HIGHEST - LOWEST) * _FINE, dtype=np.int64)

    @classmethod
    def of(cls, values: Array) -> LogHistogram:
        """Histogram of values (N,)."""
        histogram = cls()
        histogram.add(values)
        return histogram

    def add(self, values: Array) -> None:
        """Add values (n,), none below zero."""
        finite = values[np.isfinite(values)]
        self.left_out += len(values) - len(finite)
        if not len(finite):
            return
        if finite.min() < 0:
            raise GoughError(f"errors: expected values of 0 or more, found {finite.min():g}")
        self.count += len(finite)
        self.largest = max(self.largest, float(finite.max()))
        above = finite[finite > 0]
        self.zeros += len(finite) - len(above)
        places = np.floor((np.log10(above) - LOWEST) * _FINE).astype(np.int64)
        self._bins += np.bincount(np.clip(places, 0, len(self._bins) - 1),
                                  minlength=len(self._bins))  # fmt: skip

    def as_dict(self) -> dict:
        """Content as numbers and lists, for JSON; `from_dict` reads it."""
        first, last = self.range
        return {
            "first": first, "last": last, "bins": self._bins[_bins(first, last)].tolist(),
            "count": self.count, "zeros": self.zeros, "left_out": self.left_out,
            "largest": self.largest,
        }  # fmt: skip

    @classmethod
    def from_dict(cls, facts: dict) -> LogHistogram:
        """Histogram from `as_dict`; its bins may be coarser, by a whole factor."""
        histogram = cls()
        histogram.count, histogram.zeros = facts["count"], facts["zeros"]
        histogram.left_out, histogram.largest = facts["left_out"], facts["largest"]
        part = histogram._bins[_bins(facts["first"], facts["last"])]
        if len(part):
            part.reshape(len(facts["bins"]), -1)[:, -1] = facts["bins"]
        return histogram

    @property
    def range(self) -> tuple[int, int]:
        """Decades [first, last) that hold the values above zero; (0, 0) without any."""
        found = np.flatnonzero(self._bins)
        if not len(found):
            return 0, 0
        return int(found[0] // _FINE) + LOWEST, int(found[-1] // _FINE) + LOWEST + 1

    def shares(self, first: int, last: int) -> Array:
        """Share of all values in each fifth of the decades [first, last)."""
        fine = self._bins[_bins(first, last)]
        return fine.reshape(-1, FINER).sum(axis=1) / max(self.count, 1)

    def quantile(self, share: float) -> float:
        """Upper edge of the bin below which at least `share` of all values lie."""
        wanted = int(np.ceil(share * self.count)) - self.zeros
        if wanted <= 0:
            return 0.0
        place = int(np.searchsorted(np.cumsum(self._bins), wanted))
        return min(10.0 ** ((place + 1) / _FINE + LOWEST), self.largest)


def read_errors(
    path: str | Path,
    platform: Platform,
    truth: str | Path | None = None,
    *,
    all_rows: bool = False,
    reading: Reading = Reading(),
    tick: Callable[[Source], None] | None = None,
) -> dict[str, LogHistogram]:
    """Read a file of solved poses into histograms of its errors.

    Rows whose status is not usable are left out, and their number is kept.

    Args:
        path: poses, as `gough solve` writes them.
        truth: the true poses, row for row.
        all_rows: keep rows whatever their status, such as first guesses.

    Returns:
        "residual" [platform unit] where the file has that column; "position" [platform unit]
        and "rotation" [deg] where there is a truth.

    Raises:
        GoughError, InputError: an error in a file; different numbers of rows; neither a column
            of residuals nor a truth.
    """
    with ExitStack() as stack:
        source = stack.enter_context(closing(open_source(path, platform, reading)))
        residual = (RESIDUAL,) if RESIDUAL in source.columns else ()
        if truth is None and not residual:
            raise InputError(
                f"{path}: no column residual, as gough solve writes it; pass --truth POSES to "
                "compare its poses with true ones"
            )
        names = pose_columns(source.where, source.columns) if truth is not None else ()
        found = {name: LogHistogram() for name in residual}
        true = None
        if truth is not None:
            opened = stack.enter_context(closing(open_source(truth, platform, reading)))
            true = _Feed(opened)
            found |= {"position": LogHistogram(), "rotation": LogHistogram()}
        for block in read_columns(source, (*names, *residual)):
            answered = (unusable_status(block) < 0) | all_rows
            if residual:
                values = block.numbers(residual)[:, 0]
                found[RESIDUAL].add(np.where(answered, values, np.nan))
            if true is not None:
                pose, _ = poses_from_columns(block.numbers(names), names)
                translation, rotation = pose.distance(true.take(len(block), source.where))
                found["position"].add(np.where(answered, translation, np.nan))
                found["rotation"].add(np.where(answered, np.degrees(rotation), np.nan))
            if tick:
                tick(source)
        if true is not None:
            true.finish(source.where)
    return found


@styled
def histogram_figure(
    panels: Mapping[str, Mapping[str, LogHistogram]], *, title: str = ""
) -> Figure:
    """One panel for each quantity, with a line for each series.

    Args:
        panels: label of the horizontal axis, with its unit in brackets -> name -> histogram.
    """
    figure = new_figure(7.6, 0.7 + 2.6 * len(panels))
    axes = np.atleast_1d(figure.subplots(len(panels), 1))
    for panel, (label, series) in zip(axes, panels.items(), strict=True):
        draw_histogram(panel, series, label)
    figure.suptitle(title)
    return figure


def draw_histogram(axes: Axes, series: Mapping[str, LogHistogram], label: str) -> None:
    """Shares of values in each fifth of a decade, both axes logarithmic.

    Values of exactly zero have no place on a logarithmic axis: they stand at the left, at the
    mark 0. The legend gives the number of values, quantiles and the largest.

    Args:
        series: name -> histogram.
        label: label of the horizontal axis, with its unit in brackets.
    """
    ranges = [h.range for h in series.values() if h.range != (0, 0)] or [(0, 1)]
    first, last = min(r[0] for r in ranges), max(r[1] for r in ranges)
    edges = np.logspace(first, last, (last - first) * PER_DECADE + 1)
    zero = 10.0 ** (first - 0.6)
    lowest = 1.0
    for (name, histogram), (color, line) in zip(series.items(), cycle(CURVES), strict=False):
        shares = histogram.shares(first, last)
        none = histogram.zeros / max(histogram.count, 1)
        seen = [s for s in (*shares, none) if s > 0]
        lowest = min([lowest, *seen])
        axes.stairs(shares, edges, color=color, linestyle=line, linewidth=1.5, baseline=None,
                    label=_legend(name, histogram))  # fmt: skip
        axes.stairs(shares, edges, color=color, fill=True, alpha=0.12, baseline=1e-12)
        if none:
            axes.plot(zero, none, "D", color=color, markersize=6)
    zeros = any(h.zeros for h in series.values())
    axes.set(xscale="log", yscale="log", xlabel=label, ylabel="share of rows")
    axes.set_xlim(10.0 ** (first - (1.0 if zeros else 0.1)), 10.0 ** (last + 0.1))
    axes.set_ylim(10.0 ** np.floor(np.log10(lowest)) * 0.8, 1.6)
    _decades(axes, first, last, zero if zeros else None)
    axes.legend(loc="upper left", bbox_to_anchor=(0, -0.24), alignment="left")


def _bins(first: int, last: int) -> slice:
    """Indices of the bins of the decades [first, last)."""
    return slice((first - LOWEST) * _FINE, (last - LOWEST) * _FINE)


def _decades(axes: Axes, first: int, last: int, zero: float | None) -> None:
    """A tick for each decade, or every few, and one for zero."""
    step = max(1, round((last - first) / 12))
    powers = list(range(first, last + 1, step))
    ticks = [10.0**p for p in powers] + ([] if zero is None else [zero])
    axes.xaxis.set_major_locator(FixedLocator(ticks))

    def text(value: float, _: int) -> str:
        if zero is not None and abs(value / zero - 1) < 1e-6:
            return "0"
        return rf"$10^{{{round(np.log10(value))}}}$"

    axes.xaxis.set_major_formatter(FuncFormatter(text))
    axes.xaxis.set_minor_locator(FixedLocator([]))
    axes.xaxis.set_minor_formatter(NullFormatter())
    if zero is not None:
        axes.axvline(zero * 10**0.3, color=GREY, linewidth=0.7, linestyle=":")


def _legend(name: str, histogram: LogHistogram) -> str:
    if not histogram.count:
        return f"{name}: no value"
    middle, tail = histogram.quantile(0.5), histogram.quantile(0.99)
    text = (
        f"{name}: {histogram.count:,} rows, half below {middle:.2g}, 99 % below {tail:.2g}, "
        f"largest {histogram.largest:.2g}"
    )
    return text + (f"; {histogram.left_out:,} left out" if histogram.left_out else "")


class _Feed:
    """Poses of a file, in pieces of any length."""

    def __init__(self, source: Source) -> None:
        self._where = source.where
        self._names = pose_columns(source.where, source.columns)
        self._blocks = read_columns(source, self._names)
        self._values: Array = np.empty((0, len(self._names)))

    def take(self, count: int, beside: str) -> Pose:
        """The next `count` poses."""
        while len(self._values) < count:
            block = next(self._blocks, None)
            if block is None:
                raise InputError(
                    f"{self._where}: has fewer rows than {beside}; expected one true pose for each"
                )
            self._values = np.concatenate([self._values, block.numbers(self._names)])
        values, self._values = self._values[:count], self._values[count:]
        return poses_from_columns(values, self._names)[0]

    def finish(self, beside: str) -> None:
        """Raise InputError if rows are left."""
        left = len(self._values) or len(next(self._blocks, ()))
        if left:
            raise InputError(
                f"{self._where}: has more rows than {beside}; expected one true pose for each"
            )

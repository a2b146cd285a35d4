"""Leg readings and pose over the rows of a file of any length."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import InputError
from gough.files.rows import Reading, Source
from gough.files.trajectory import Trajectory, TrajectoryFile, open_trajectory
from gough.frames import FramePose
from gough.platform import Platform
from gough.plot.style import (
    CURVES,
    INK,
    MINUS,
    VERMILION,
    label_number,
    length_unit,
    new_figure,
    reading_name,
    reading_unit,
    shown_readings,
    styled,
)
from gough.pose import Pose, pose_values

SIGNALS = (*(f"leg {i}" for i in range(1, 7)), "x", "y", "z", "rx", "ry", "rz")
JUMP = 180.0  # [deg] a larger change from row to row is an angle that passes +-180 deg
FAR = 8.0  # distance of limits / range of the curves, beyond which limits would flatten them
BINS = 600  # least number; a page is hardly finer
# a column's name that is or ends in a unit of time: "seconds", "time_ms", "t [s]"
UNIT = re.compile(
    r"^(?:(.+?)[ _]*[ _(\[])?(s|sec|seconds|ms|us|ns|min|minutes|h|hours)[\])]?$", re.IGNORECASE
)


class Envelope:
    """Lowest and highest value of each of K signals over equal runs of rows, in little memory.

    Rows are added in blocks. Few rows have one bin each; where bins run out, neighbours are
    merged, so that a bin stands for 2, 4, 8, ... rows and no peak is lost.

    Attributes:
        names: names of the signals.
        width: rows in a bin.
        rows: rows added.
        unanswered: number of them without a usable pose.
        time: name of the column on the horizontal axis, or "row".
        frame: whose poses x to rz are; None for those of the platform.
    """

    time = "row"
    frame: FramePose | None = None

    def __init__(self, names: tuple[str, ...], bins: int = BINS) -> None:
        self.names, self.width, self.rows, self.unanswered = names, 1, 0, 0
        self._most = 2 * bins
        # columns: first and last x, rows without a pose, then lows, then highs
        self._bins = self._waiting = np.empty((0, 3 + 2 * len(names)))

    def add(self, x: Array, values: Array, answered: NDArray[np.bool_]) -> None:
        """Add rows.

        Args:
            x: (n,) on the horizontal axis, rising.
            values: (n, K), NaN where there is none.
            answered: (n,) True for rows with a usable pose.
        """
        gone = (~answered).astype(np.float64)
        self.rows += len(x)
        self.unanswered += int(gone.sum())
        rows = np.concatenate([self._waiting, np.column_stack([x, x, gone, values, values])])
        while len(rows) >= self.width:
            free = (self._most - len(self._bins)) * self.width
            whole = min(free, len(rows) // self.width * self.width)
            self._bins = np.concatenate([self._bins, self._merge(rows[:whole], self.width)])
            rows = rows[whole:]
            if len(self._bins) == self._most:
                self._bins = self._merge(self._bins, 2)
                self.width *= 2
        self._waiting = rows

    def _merge(self, rows: Array, width: int) -> Array:
        """One bin for each run of `width` bins."""
        groups = rows.reshape(-1, width, rows.shape[1])
        lows, highs = np.split(groups[:, :, 3:], 2, axis=2)
        return np.column_stack([
            groups[:, 0, 0], groups[:, -1, 1], groups[:, :, 2].sum(axis=1),
            np.fmin.reduce(lows, axis=1), np.fmax.reduce(highs, axis=1),  # NaN only where all are
        ])  # fmt: skip

    def _table(self) -> Array:
        """All bins; the last one may hold fewer rows."""
        left = self._waiting
        return (
            np.concatenate([self._bins, self._merge(left, len(left))]) if len(left) else self._bins
        )

    @property
    def x(self) -> Array:
        """Middle (B,) of each bin."""
        return self._table()[:, :2].mean(axis=1)

    @property
    def low(self) -> Array:
        """Lowest values (B, K) of each bin."""
        return self._table()[:, 3 : 3 + len(self.names)]

    @property
    def high(self) -> Array:
        """Highest values (B, K) of each bin."""
        return self._table()[:, 3 + len(self.names) :]

    @property
    def missing(self) -> NDArray[np.int64]:
        """Number (B,) of rows without a usable pose in each bin."""
        return self._table()[:, 2].astype(np.int64)


def read_trajectory(
    path: str | Path,
    platform: Platform,
    *,
    time: str | None = None,
    seed: str = "auto",
    reading: Reading = Reading(),
    frame: str | None = None,
    tick: Callable[[Source], None] | None = None,
) -> Envelope:
    """Read a file of poses or of leg readings into an envelope for `trajectory_figure`.

    Of rows without a usable pose, only readings that stand in the file are kept.

    Args:
        path: .csv or .parquet; a file that has the columns of a pose is read as poses.
        platform: the machine.
        time: the column on the horizontal axis; without it that of the platform file's [readings],
            or else rows are counted from 1.
        seed: first guess for leg readings, as for `gough.solve`.
        reading: options for reading the file.
        frame: whose poses are drawn, such as "tool in work"; those that the file states, or the
            platform's, unless given.
        tick: called after every block.

    Raises:
        GoughError, InputError: an error in the file, with its row or line.
    """
    envelope = Envelope(SIGNALS)
    options = {"time": time, "seed": seed, "reading": reading, "frame": frame}
    with open_trajectory(path, platform, **options) as file:
        envelope.time, envelope.frame = file.time or "row", file.frame
        for rows in file.blocks(tick):
            found = file.solve(rows)
            pose = found.pose if file.frame is None else file.frame.of(found.pose)
            values = signals(platform, found.legs, pose)
            values[~found.usable, 0 if file.has_poses else 6 :] = np.nan
            envelope.add(_times(file, found), values, found.usable)
    return envelope


def signals(platform: Platform, readings: Array, pose: Pose) -> Array:
    """Values (n, 12) of `SIGNALS`: readings as shown, position [platform unit], angles [deg]."""
    return np.concatenate([shown_readings(platform, readings), pose_values(pose, "deg")], axis=1)


@styled
def trajectory_figure(
    platform: Platform, envelope: Envelope, *, time: str = "row", title: str = ""
) -> Figure:
    """Leg readings, position and angles over time.

    Stroke limits are thick grey lines. Rows without a usable pose leave a gap and a cross below.

    Args:
        platform: the machine.
        envelope: of the twelve `signals`, named `SIGNALS`.
        time: name of the column on the horizontal axis, or "row". Its unit is taken from the
            name, as in "time_ms" or "t [min]"; without one, times are in seconds.
        title: text above the panels; without it the platform's name.
    """
    figure = new_figure(7.6, 7.4)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=[1.5, 1, 1])
    _legs(panels[0], platform, envelope)
    _position(panels[1], platform, envelope)
    _curves(panels[2], envelope, range(9, 12), SIGNALS[9:], wrap=True)
    whose = "" if envelope.frame is None else f" of {envelope.frame.name}"
    panels[2].set_ylabel(f"angle{whose} [deg]\nR = Rx Ry Rz")
    label = _time_label(time)
    panels[2].set_xlabel(label)
    if time == "row":
        panels[2].xaxis.set_major_locator(MaxNLocator(integer=True))
    for axes in panels:
        axes.yaxis.set_major_locator(MaxNLocator(6))
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=2.6)
        _gaps(axes, envelope)
    figure.align_ylabels(panels)
    figure.suptitle(title or platform.name)
    remark = note(envelope)
    if remark:
        figure.text(0.99, 0.0, remark, fontsize=7.5, ha="right", va="bottom", in_layout=True)
        panels[2].set_xlabel(label, labelpad=6)
        figure.get_layout_engine().set(rect=(0, 0.025, 1, 0.975))  # pyright: ignore[reportOptionalMemberAccess, reportCallIssue]
    return figure


def _time_label(name: str) -> str:
    """Label of the horizontal axis, with the unit in brackets."""
    if name == "row":
        return name
    found = UNIT.match(name)
    if found is None:
        return f"{name} [s]"
    return f"{found[1]} [{found[2]}]" if found[1] else name


def note(envelope: Envelope) -> str:
    """Note on rows without a pose, and on the number of rows at each point; may be empty."""
    parts = []
    if envelope.width > 1:
        parts.append(
            f"{envelope.rows:,} rows: each point spans {envelope.width:,}, from lowest to highest"
        )
    if envelope.unanswered:
        plural = "s" if envelope.unanswered > 1 else ""
        parts.append(f"\N{MULTIPLICATION SIGN} {envelope.unanswered:,} row{plural} without a "
                     "usable pose")  # fmt: skip
    return "; ".join(parts)


# ---- panels ---------------------------------------------------------------------------


def _legs(axes: Axes, platform: Platform, envelope: Envelope) -> None:
    _curves(axes, envelope, range(6), SIGNALS[:6], wrap=platform.legs == "rotary")
    axes.set_ylabel(f"{reading_name(platform)} [{reading_unit(platform)}]")
    if platform.stroke is None:
        return
    limits = shown_readings(platform, platform.stroke)
    low, high = envelope.low[:, :6], envelope.high[:, :6]
    lowest, highest = np.nanmin(low, initial=np.inf), np.nanmax(high, initial=-np.inf)
    near = FAR * max(highest - lowest, 1e-12 * platform.size)
    drawn = 0
    for end, name in ((0, "lowest"), (1, "highest")):
        for value in np.unique(limits[:, end]):
            if lowest - near <= value <= highest + near:
                axes.axhline(value, color="#8C8C8C", linewidth=2.4, zorder=1,
                             label="_limit" if drawn else "stroke")  # fmt: skip
                drawn += 1
            else:
                text = f"{name} reading of the stroke, {value:.4g}, is outside the picture"
                axes.annotate(text.replace("-", MINUS), (0.01, 0.02 + 0.92 * end),
                              xycoords="axes fraction", fontsize=7.5, color=INK,
                              bbox={"color": "white", "alpha": 0.8, "pad": 1})  # fmt: skip


def _position(axes: Axes, platform: Platform, envelope: Envelope) -> None:
    """Position from home; the height of the machine would flatten the other curves."""
    view = envelope.frame
    home = (platform.home if view is None else view.of(platform.home)).position
    names = []
    for name, value in zip("xyz", home, strict=True):
        sign = MINUS if value > 0 else "+"
        text = label_number(abs(value), platform.size)
        names.append(name if not value else f"{name} {sign} {text.rstrip('0').rstrip('.')}")
    _curves(axes, envelope, range(6, 9), names, offsets=home)
    whose = "position" if view is None else view.name
    axes.set_ylabel(f"{whose} from home\n[{length_unit(platform)}]")


def _curves(axes: Axes, envelope: Envelope, which, names, *, offsets=None, wrap=False) -> None:
    """Draw a line for each signal, or a band where a point stands for many rows."""
    x = envelope.x
    low, high = envelope.low[:, which], envelope.high[:, which]
    if offsets is not None:
        low, high = low - offsets, high - offsets
    marker = "o" if len(x) == 1 else ""
    for i, (name, (color, line)) in enumerate(zip(names, CURVES, strict=False)):
        middle = (low[:, i] + high[:, i]) / 2
        if envelope.width > 1:
            axes.fill_between(x, low[:, i], high[:, i], color=color, alpha=0.3, linewidth=0)
        elif wrap:
            middle = np.where(np.abs(np.diff(middle, prepend=middle[:1])) > JUMP, np.nan, middle)
        axes.plot(x, middle, marker=marker, color=color, linestyle=line, label=name, markersize=3)


def _gaps(axes: Axes, envelope: Envelope) -> None:
    """Draw a cross at the bottom for every bin with rows that have no usable pose."""
    x = envelope.x[envelope.missing > 0]
    if len(x):
        axes.plot(x, np.full(len(x), 0.03), "x", color=VERMILION, markersize=5, label="_gap",
                  transform=axes.get_xaxis_transform(), clip_on=False)  # fmt: skip


def _times(file: TrajectoryFile, rows: Trajectory) -> Array:
    """Horizontal axis (n,): a column, with gaps interpolated, or the numbers of the rows."""
    if file.time is None:
        return rows.number.astype(np.float64)
    known = np.isfinite(rows.time)
    if not np.any(known):
        raise InputError(
            f"{file.source.where}: row {rows.number[0]} and on: column {file.time} holds no numbers"
        )
    return np.interp(rows.number, rows.number[known], rows.time[known])

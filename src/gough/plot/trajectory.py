"""Leg readings and pose over the rows of a file."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gough.checks import Array
from gough.platform import Platform
from gough.plot.envelope import Envelope
from gough.plot.style import (
    CURVES,
    INK,
    VERMILION,
    length_unit,
    new_figure,
    number,
    reading_name,
    reading_unit,
    shown_readings,
    styled,
)

SIGNALS = (*(f"leg {i}" for i in range(1, 7)), "x", "y", "z", "rx", "ry", "rz")
JUMP = 180.0  # [deg] an angle that changes more from row to row has gone round
FAR = 8.0  # limits farther off than that many times the curves' range would flatten them


def signals(platform: Platform, readings: Array, position: Array, euler: Array) -> Array:
    """What `trajectory_figure` draws, (n, 12): readings as shown, position, angles [deg].

    Args:
        readings: (n, 6), as `gough.leg_lengths` gives them.
        position: (n, 3) [platform unit].
        euler: (n, 3) [rad].
    """
    return np.concatenate(
        [shown_readings(platform, readings), position, np.degrees(euler)], axis=1
    )


@styled
def trajectory_figure(
    platform: Platform, envelope: Envelope, *, time: str = "row", title: str = ""
) -> Figure:
    """Leg readings, position and angles over time.

    Stroke limits are thick grey lines. Rows without an answer leave a gap and a cross below.

    Args:
        envelope: of the twelve `signals`, named `SIGNALS`.
        time: what the horizontal axis is.
        title: what stands above; without it the platform's name.
    """
    figure = new_figure(7.6, 7.4)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=[1.5, 1, 1])
    _legs(panels[0], platform, envelope)
    _position(panels[1], platform, envelope)
    _curves(panels[2], envelope, range(9, 12), SIGNALS[9:], wrap=True)
    panels[2].set_ylabel("angle [deg]\nR = Rx Ry Rz")
    panels[2].set_xlabel(time)
    for axes in panels:
        axes.yaxis.set_major_locator(MaxNLocator(6))
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=2.6)
        _gaps(axes, envelope)
    figure.align_ylabels(panels)
    figure.suptitle(title or platform.name)
    said = note(envelope)
    if said:
        figure.text(0.99, 0.0, said, fontsize=7.5, ha="right", va="bottom", in_layout=True)
        panels[2].set_xlabel(time, labelpad=6)
        figure.get_layout_engine().set(rect=(0, 0.025, 1, 0.975))  # pyright: ignore[reportOptionalMemberAccess, reportCallIssue]
    return figure


def note(envelope: Envelope) -> str:
    """What a reader must know of how the picture was made."""
    parts = []
    if envelope.width > 1:
        parts.append(
            f"{envelope.rows:,} rows: each point spans {envelope.width:,}, from lowest to highest"
        )
    if envelope.unanswered:
        plural = "s" if envelope.unanswered > 1 else ""
        parts.append(f"\N{MULTIPLICATION SIGN} {envelope.unanswered:,} row{plural} without an "
                     "answer")  # fmt: skip
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
                axes.annotate(text, (0.01, 0.02 + 0.9 * end), xycoords="axes fraction",
                              fontsize=7.5, color=INK)  # fmt: skip


def _position(axes: Axes, platform: Platform, envelope: Envelope) -> None:
    """Position from home, for else the height of the machine would flatten all else."""
    home = platform.home.position
    names = []
    for name, value in zip("xyz", home, strict=True):
        sign = "\N{MINUS SIGN}" if value > 0 else "+"
        text = number(abs(value), platform.size)
        names.append(name if not value else f"{name} {sign} {text.rstrip('0').rstrip('.')}")
    _curves(axes, envelope, range(6, 9), names, offsets=home)
    axes.set_ylabel(f"position from home\n[{length_unit(platform)}]")


def _curves(axes: Axes, envelope: Envelope, which, names, *, offsets=None, wrap=False) -> None:
    """One line for each signal, or a band where a point stands for many rows."""
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
    """A cross at the bottom for every bin that holds rows without an answer."""
    x = envelope.x[envelope.missing > 0]
    if len(x):
        axes.plot(x, np.full(len(x), 0.03), "x", color=VERMILION, markersize=5, label="_gap",
                  transform=axes.get_xaxis_transform(), clip_on=False)  # fmt: skip

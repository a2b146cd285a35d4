"""Parts of all figures: colours, arrows, dimensions, files with the same bytes each time."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

IMAGES = Path(__file__).resolve().parent.parent / "images"

# Okabe and Ito: told apart by all kinds of colour vision, and in grey print by lightness
BLACK, GREY = "#222222", "#8a8a8a"
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"
ORANGE, SKY, PURPLE = "#E69F00", "#56B4E9", "#CC79A7"

matplotlib.rcParams.update(
    {
        "font.size": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.edgecolor": BLACK,
        "axes.linewidth": 0.8,
        "grid.linewidth": 0.3,
        "legend.frameon": False,
        "svg.hashsalt": "gough",
        "svg.fonttype": "path",
    }
)


def figure(width: float, height: float) -> Figure:
    """Make an empty figure [inch] on white, readable on dark pages too."""
    return Figure(figsize=(width, height), layout="constrained", facecolor="white")


def save(drawn: Figure, name: str, folder: Path = IMAGES) -> None:
    """Write NAME.svg: the same bytes each time, without date or version."""
    none = {"Date": None, "Creator": None}
    drawn.savefig(folder / f"{name}.svg", metadata=none)


def sketch(axes: Axes) -> None:
    """Set equal scales, and hide the frame."""
    axes.set_aspect("equal")
    axes.set_axis_off()


def arrow(axes: Axes, start, end, color: str = BLACK, width: float = 1.2, style="-|>") -> None:
    """Draw an arrow between two points; "<|-|>" has two heads, for dimensions."""
    axes.annotate(
        "", xy=end, xytext=start,
        arrowprops={
            "arrowstyle": style, "color": color, "linewidth": width,
            "shrinkA": 0, "shrinkB": 0, "mutation_scale": 9,
        },
    )  # fmt: skip


def label(axes: Axes, at, text: str, color: str = BLACK, size: float = 9, **more) -> None:
    """Write text at a point, on white, so that lines below do not cross it."""
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
    middle = {"ha": "center", "va": "center", "bbox": box, "zorder": 6}
    axes.text(*at, text, color=color, fontsize=size, **(middle | more))


def dimension(axes: Axes, start, end, text: str, ends=()) -> None:
    """Draw a dimension line with its number, and thin lines from the measured `ends`."""
    for near, far in zip((start, end), ends, strict=False):
        axes.plot(*np.transpose([near, far]), color=GREY, linewidth=0.5)
    arrow(axes, start, end, width=0.7, style="<|-|>")
    label(axes, (np.asarray(start) + end) / 2, text)


def arc(axes: Axes, radius: float, low_deg: float, high_deg: float, **line) -> None:
    """Draw part of a circle about the origin."""
    turn = np.radians(np.linspace(low_deg, high_deg, 181))
    axes.plot(radius * np.cos(turn), radius * np.sin(turn), **line)


def polar(radius: float, degrees) -> np.ndarray:
    """Points (..., 2) on a circle."""
    turn = np.radians(np.asarray(degrees, dtype=float))
    return radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)


def oblique(points: np.ndarray, turn_deg: float = -35, tilt_deg: float = 22) -> np.ndarray:
    """Project points (..., 3) to (..., 2), seen from the front and somewhat above."""
    turn, tilt = np.radians(turn_deg), np.radians(tilt_deg)
    x = points[..., 0] * np.cos(turn) - points[..., 1] * np.sin(turn)
    depth = points[..., 0] * np.sin(turn) + points[..., 1] * np.cos(turn)
    return np.stack([x, points[..., 2] * np.cos(tilt) + depth * np.sin(tilt)], axis=-1)

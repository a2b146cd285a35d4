"""A figure of the workspace: a slice by colour, with the limits that end it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.patheffects import withStroke

from gough.checks import Array
from gough.plot.slices import WorkspaceSlice, is_angle, workspace_box
from gough.plot.style import (
    BLUE,
    FAINT,
    INK,
    PURPLE,
    VERMILION,
    label_number,
    length_unit,
    muted,
    new_figure,
    styled,
)

NEAR_ZERO = 0.25  # colours begin at 0 where the least value / largest is below this
MOST_OF_MEDIAN = 4.0  # colours end at this multiple of the median value
RIM = "#22222266"  # around lines on colours
HATCHES = {
    "stroke": "///", "arm": "---", "base joint": "..", "platform joint": "oo",
    "clearance": "xx", "leg force": "++",
}  # fmt: skip


@styled
def workspace_figure(cut: WorkspaceSlice) -> Figure:
    """Draw a slice, with colour bar and legend."""
    figure = new_figure(6.8, 5.6 if len(cut.limits) < 3 else 5.9)
    axes = figure.add_subplot()
    image = draw_slice(axes, cut)
    bar = figure.colorbar(image, ax=axes, shrink=0.85, aspect=26, pad=0.02)
    bar.set_label(cut.quantity.label)
    bar.outline.set_visible(False)
    whose = f"{cut.frame}, " if cut.frame else ""
    figure.suptitle(f"{cut.platform.name}: {whose}{_fixed_text(cut)}")
    figure.legend(handles=_marks(cut), loc="outside lower center", ncols=3)
    return figure


def draw_slice(axes: Axes, cut: WorkspaceSlice) -> Any:
    """Draw a slice into given axes; returns the image, for a colour bar.

    Darker is closer to a singularity (or less margin, stiffness or speed, or more force or error);
    the colours span the values within the limits. Thin lines join poses of equal value. The
    singularity curve, where det J changes its sign, is vermilion and dashed. The edge of the
    limits is a thick dark line, and everything outside is hatched, by the limit that it breaks
    most; the limits of the single legs' strokes are thin dotted lines. Poses that the motors of a
    rotary machine cannot reach are grey.
    """
    half = [(values[1] - values[0]) / 2 for values in (cut.u, cut.v)]
    extent = (cut.u[0] - half[0], cut.u[-1] + half[0], cut.v[0] - half[1], cut.v[-1] + half[1])
    scale = muted("cividis", 0.0, 0.95)
    scale = scale if cut.quantity.high_is_good else scale.reversed()
    scale = scale.with_extremes(bad=FAINT)
    inside = _inside(cut)
    lowest = max(0.0, np.nanmin(inside, initial=np.inf)) if np.any(np.isfinite(inside)) else 0.0
    highest = np.nanmax(inside, initial=lowest)
    if np.any(np.isfinite(inside)):  # forces, speeds and errors grow without bound
        highest = min(highest, MOST_OF_MEDIAN * np.nanmedian(inside))
    lowest = 0.0 if lowest < NEAR_ZERO * highest else lowest
    image = axes.imshow(
        np.ma.masked_invalid(cut.values), origin="lower", extent=extent, aspect="auto",
        cmap=scale, vmin=lowest, vmax=highest, interpolation="nearest",
    )  # fmt: skip
    _equal_distance(axes, cut)
    _limits(axes, cut)
    _zero(axes, cut, cut.signed, colors="white", linewidths=4.0)  # a rim, for dark ground
    _zero(axes, cut, cut.signed, colors=VERMILION, linewidths=2.2, linestyles="dashed")
    _box(axes, cut)
    axes.set(xlim=(cut.u[0], cut.u[-1]), ylim=(cut.v[0], cut.v[-1]))
    axes.set(xlabel=_label(cut, 0), ylabel=_label(cut, 1))
    axes.grid(visible=False)
    if len({is_angle(name) for name in cut.axes}) == 1:
        axes.set_aspect("equal", adjustable="box")
    return image


# ---- drawing -------------------------------------------------------------------------


def _inside(cut: WorkspaceSlice) -> Array:
    """Values (m, n) of the slice, NaN outside the limits; only margins are ever below 0."""
    outside = np.any([left < 0 for left in cut.limits.values()] or [np.False_], axis=0)
    return np.where(outside | ~(np.isfinite(cut.values) & (cut.values >= 0)), np.nan, cut.values)


def _equal_distance(axes: Axes, cut: WorkspaceSlice) -> None:
    """Draw lines of equal value within the limits, with labels that read on any colour."""
    inside = _inside(cut)
    if np.nanmax(inside, initial=0) > np.nanmin(inside, initial=0):
        lines = axes.contour(
            cut.u, cut.v, np.ma.masked_invalid(inside), levels=6, colors="white", linewidths=0.8
        )
        lines.set_path_effects([withStroke(linewidth=1.8, foreground=RIM)])
        for label in axes.clabel(lines, fontsize=8, fmt="%.3g", colors="white"):
            label.set_path_effects([withStroke(linewidth=1.4, foreground=INK)])


def _limits(axes: Axes, cut: WorkspaceSlice) -> None:
    """Draw the edge of all limits, and hatch what is outside by the limit that it breaks most."""
    limits = cut.limits
    if not limits:
        return
    for leg in range(6):
        _zero(axes, cut, cut.margin[..., leg], colors=INK, linewidths=0.7, linestyles="dotted")
    worst = np.minimum.reduce(list(limits.values()))
    for name, region in _regions(limits, worst).items():
        axes.contourf(cut.u, cut.v, region, levels=[-np.inf, 0.0], colors=["#FFFFFF70"],
                      hatches=[HATCHES[name]])  # fmt: skip
    _zero(axes, cut, worst, colors=INK, linewidths=2.0)


def _regions(limits: Mapping[str, Array], worst: Array) -> dict[str, Any]:
    """Masked values (m, n) of the limits that end the slice, below 0 where each is broken most."""
    broken = {name: left for name, left in limits.items() if np.any((left < 0) & (left == worst))}
    if len(limits) == 1:
        return {name: np.ma.masked_invalid(left) for name, left in broken.items()}
    # the regions of several limits meet between two poses
    return {
        name: np.where((left < 0) & (left == worst), -1.0, 1.0) for name, left in broken.items()
    }


def _zero(axes: Axes, cut: WorkspaceSlice, values: Array, **look: Any) -> None:
    """Draw the line where values change their sign, if they do."""
    if np.nanmin(values, initial=0) < 0 < np.nanmax(values, initial=0):
        axes.contour(cut.u, cut.v, np.ma.masked_invalid(values), levels=[0.0], **look)


def _box(axes: Axes, cut: WorkspaceSlice) -> None:
    """Draw the stated workspace."""
    box = workspace_box(cut.platform, cut.frame)
    if box is None:
        return
    (a, b), (c, d) = (box[name] for name in cut.axes)
    for color, width, line in (("white", 3.0, "-"), (PURPLE, 1.6, "-")):
        axes.add_patch(Rectangle((a, c), b - a, d - c, fill=False, edgecolor=color,
                                 linewidth=width, linestyle=line))  # fmt: skip


def _marks(cut: WorkspaceSlice) -> list[Any]:
    marks: list[Any] = []
    if np.nanmin(cut.signed, initial=0) < 0 < np.nanmax(cut.signed, initial=0):
        marks.append(Line2D([], [], color=VERMILION, linestyle="--", linewidth=2.2,
                            label="singularity: det J changes sign"))  # fmt: skip
    limits = cut.limits
    if limits:
        edge = "edge of the stroke" if set(limits) == {"stroke"} else "edge of all limits"
        marks.append(Line2D([], [], color=INK, linewidth=2, label=edge))
    if cut.platform.stroke is not None:
        marks.append(
            Line2D([], [], color=INK, linewidth=0.7, linestyle=":", label="limit of one leg")
        )
    ended = _regions(limits, np.minimum.reduce(list(limits.values()))) if limits else {}
    for name in ["stroke"] if set(limits) == {"stroke"} else ended:
        text = "outside the stroke" if name == "stroke" else f"beyond the limit: {name}"
        hatch = HATCHES[name] + HATCHES[name][:1]
        marks.append(Patch(facecolor="white", edgecolor=INK, hatch=hatch, label=text))
    if workspace_box(cut.platform, cut.frame) is not None:
        marks.append(Line2D([], [], color=PURPLE, linewidth=1.6, label="stated workspace"))
    if not np.all(cut.reachable):
        marks.append(Patch(facecolor=FAINT, label="out of the motors' reach"))
    return marks or [Patch(facecolor=BLUE, label="all poses regular")]


def _label(cut: WorkspaceSlice, i: int) -> str:
    name = cut.axes[i]
    return f"{name} [{'deg' if is_angle(name) else length_unit(cut.platform)}]"


def _fixed_text(cut: WorkspaceSlice) -> str:
    lengths = [n for n in cut.fixed if not is_angle(n)]
    angles = [n for n in cut.fixed if is_angle(n)]
    parts = []
    for names, size, unit in (
        (lengths, cut.platform.size, length_unit(cut.platform)),
        (angles, 100.0, "deg"),
    ):
        if names:
            values = ", ".join(f"{n} {label_number(cut.fixed[n], size)}" for n in names)
            parts.append(f"{values} {unit}")
    return "; ".join(parts)

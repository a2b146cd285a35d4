"""A pose in 3-D: base, plate, and legs coloured by how much of their stroke they use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from gough.checks import Array
from gough.kinematics import assembly_sign, singularity_distance
from gough.plot.shapes import Skeleton, outline_order, skeleton
from gough.plot.style import (
    BLUE,
    FAINT,
    GREY,
    INK,
    VERMILION,
    length_unit,
    muted,
    new_figure,
    number,
    reading_name,
    reading_unit,
    shown_readings,
    styled,
)
from gough.platform import Platform
from gough.pose import Pose

STROKE = ("viridis", 0.0, 0.9)  # colour map of the stroke, without its palest part
PLAIN = "#4F6D8A"  # legs of a platform that states no stroke
VIEW = (20.0, -62.0)  # [deg] elevation, azimuth


@dataclass(frozen=True)
class PoseStyle:
    """How one pose is drawn.

    Attributes:
        plate: colour of the plate.
        line: style of its outline.
        width: of its outline [pt].
        fill: opacity of the plate, 0 for an outline only.
        legs: colour of the legs; "stroke" for one by stroke, "" to draw none.
        base: whether base and motor arms are drawn.
        numbers: whether legs are numbered, at the base.
        label: name of the plate in a legend.
    """

    plate: str = BLUE
    line: str = "-"
    width: float = 1.8
    fill: float = 0.22
    legs: str = "stroke"
    base: bool = True
    numbers: bool = True
    label: str = ""


SOLVED = PoseStyle()
# a second pose beside the first: a dashed outline
GHOST = PoseStyle(plate=VERMILION, line="--", width=1.3, fill=0.0, legs="", base=False,
                  numbers=False)  # fmt: skip


def draw_pose(
    axes: Axes3D, platform: Platform, pose: Pose, *, style: PoseStyle = SOLVED
) -> dict[str, Any]:
    """Draw one pose into 3-D axes, which several poses may share; see `pose_axes`.

    Legs are coloured by stroke, from dark (shortest) to light (longest). Legs outside their
    stroke are vermilion and dashed, with a cross; motors that cannot reach are dotted. Rotary
    machines show motor arms as thick dark lines and rods as legs.

    Returns:
        What was drawn: "legs" (six lines from strut start to platform joint), "plate", and
        "base" and "arms" where they are.

    Raises:
        GoughError: a batch of poses, or a pose of NaN.
    """
    bones = skeleton(platform, pose)
    drawn: dict[str, Any] = {}
    if style.base:
        drawn["base"] = _polygon(axes, bones.base, GREY, "-", 1.4, 0.16, 1.0)
        axes.plot(*bones.base.T, "o", color=GREY, markersize=3.5)
    if style.base and platform.rotary is not None:
        drawn["arms"] = [
            axes.plot(*np.stack(ends, axis=1), color=INK, linewidth=3.2, solid_capstyle="round")[0]
            for ends in zip(bones.base, bones.tips, strict=True)
        ]
    if style.legs:
        drawn["legs"] = _legs(axes, bones, style)
    drawn["plate"] = _polygon(
        axes, bones.plate, style.plate, style.line, style.width, style.fill, 1.0
    )
    drawn["plate"].set_label(style.label)
    if style.fill:
        axes.plot(*bones.plate.T, "o", color=style.plate, markersize=3.5)
    if style.numbers:
        _number_legs(axes, bones.base)
    return drawn


@styled
def pose_axes(
    figure: Any, platform: Platform, poses: Sequence[Pose], place: Any = 111
) -> Axes3D:
    """3-D axes to scale that hold all of `poses`, with units.

    Args:
        figure: a Figure or SubFigure.
        place: as for `Figure.add_subplot`.
    """
    axes: Axes3D = figure.add_subplot(place, projection="3d", proj_type="persp")
    points = np.concatenate([skeleton(platform, pose).points for pose in poses])
    low, high = points.min(axis=0), points.max(axis=0)
    middle, span = (low + high) / 2, np.maximum(high - low, 0.15 * np.max(high - low))
    half = 0.54 * span
    for name, centre, reach in zip("xyz", middle, half, strict=True):
        getattr(axes, f"set_{name}lim")(centre - reach, centre + reach)
        axis = getattr(axes, f"{name}axis")
        count = int(np.clip(round(5 * reach / max(half)), 2, 5))
        axis.set_major_locator(MaxNLocator(count, prune="both"))
        axis.set_pane_color("#F7F7F7")
        axis.line.set_color(FAINT)
        axis.set_tick_params(pad=0)
    unit = length_unit(platform)
    axes.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]", zlabel=f"z [{unit}]")
    axes.set_box_aspect(half / max(half), zoom=1.08)
    axes.view_init(*VIEW)
    return axes


@styled
def pose_figure(
    platform: Platform, pose: Pose, *, ghost: Pose | None = None, title: str = ""
) -> Figure:
    """One pose in 3-D, and the readings of its legs within their strokes.

    Args:
        ghost: a second pose, dashed, such as home or the true pose.
        title: what stands above; without it the platform's name and the pose.

    Raises:
        GoughError: a batch of poses, or a pose of NaN.
    """
    figure = new_figure(8.6, 4.9)
    figure.suptitle(title or _title(platform, pose))
    poses = [pose] if ghost is None else [pose, ghost]
    left, right = figure.add_gridspec(1, 2, width_ratios=[1.7, 1])
    axes = pose_axes(figure, platform, poses, left)
    draw_pose(axes, platform, pose)
    if ghost is not None:
        draw_pose(axes, platform, ghost, style=GHOST)
    _draw_readings(figure.add_subplot(right), platform, skeleton(platform, pose))
    _legend(figure, platform, ghost is not None)
    return figure


# ---- parts ----------------------------------------------------------------------------


def _polygon(
    axes: Axes3D, points: Array, color: str, line: str, width: float, fill: float, alpha: float
) -> Line2D:
    """Joints joined around their centre; returns the outline."""
    corners = points[outline_order(points)]
    if fill:
        axes.add_collection3d(
            Poly3DCollection([corners], facecolors=mpl.colors.to_rgba(color, fill), linewidths=0)
        )
    closed = np.concatenate([corners, corners[:1]])
    return axes.plot(*closed.T, line, color=color, linewidth=width, alpha=alpha)[0]


def _legs(axes: Axes3D, bones: Skeleton, style: PoseStyle) -> list[Line2D]:
    lines = []
    starts = np.where(bones.unreachable[:, None], bones.base, bones.tips)
    by_stroke = style.legs == "stroke"
    for i, ends in enumerate(zip(starts, bones.plate, strict=True)):
        wrong = bones.outside[i] or bones.unreachable[i]
        line = ":" if bones.unreachable[i] else "--" if wrong else "-"
        color = VERMILION if wrong else leg_color(bones.share[i]) if by_stroke else style.legs
        width = 2.6 if by_stroke else 0.9
        lines += axes.plot(*np.stack(ends, axis=1), line, color=color, linewidth=width)
        if wrong and by_stroke:
            axes.plot(*np.mean(ends, axis=0)[:, None], "X", color=VERMILION, markersize=8)
    return lines


def leg_color(share: float) -> Any:
    """The colour of a leg that uses this share of its stroke; slate where none is stated."""
    return PLAIN if np.isnan(share) else muted(*STROKE)(share)


def _number_legs(axes: Axes3D, base: Array) -> None:
    """Numbers just outside the base joints; joints that coincide share a place."""
    centre = base.mean(axis=0)
    places: dict[tuple[float, ...], list[str]] = {}
    spread = np.abs(base - centre).max()
    for i, joint in enumerate(base):
        key = tuple(np.round((joint - centre) / spread, 6))
        places.setdefault(key, []).append(str(i + 1))
    for key, names in places.items():
        where = centre + spread * 1.16 * np.array(key)
        axes.text(*where, ", ".join(names), fontsize=8, color=INK, ha="center", va="center")


def _draw_readings(axes: Axes, platform: Platform, bones: Skeleton) -> None:
    """Six horizontal scales: stroke, home and reading of each leg."""
    readings = shown_readings(platform, bones.readings)
    home = shown_readings(platform, platform.home_legs)
    rows = np.arange(1, 7)
    axes.plot(home, rows, "|", color=INK, markersize=13, markeredgewidth=1.1)
    if platform.stroke is not None:
        low, high = shown_readings(platform, platform.stroke).T
        axes.barh(rows, high - low, left=low, height=0.34, color="#E3E3E3", zorder=0)
    for i in range(6):
        if bones.unreachable[i]:
            axes.annotate("cannot reach", (home[i], rows[i]), color=VERMILION, fontsize=8,
                          xytext=(0, 9), textcoords="offset points", ha="center")  # fmt: skip
            continue
        wrong = bool(bones.outside[i])
        color = VERMILION if wrong else leg_color(bones.share[i])
        axes.plot(readings[i], rows[i], "X" if wrong else "o", color=color, markersize=7)
        text = number(readings[i], 100 if platform.legs == "rotary" else _digits(platform))
        axes.annotate(text, (readings[i], rows[i]), xytext=(0, 8), textcoords="offset points",
                      ha="center", fontsize=7.5, color=VERMILION if wrong else INK)  # fmt: skip
    axes.set(ylim=(6.6, 0.3), yticks=rows, ylabel="leg")
    axes.set_xlabel(f"{reading_name(platform)} [{reading_unit(platform)}]")
    axes.margins(x=0.14)
    axes.grid(axis="y", visible=False)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    axes.xaxis.set_major_locator(MaxNLocator(5))


def _digits(platform: Platform) -> float:
    """The size of what readings tell: the stroke of length changes, else the machine."""
    if platform.legs == "length_change" and platform.stroke is not None:
        return float(np.abs(platform.stroke).max())
    return platform.size


def _legend(figure: Figure, platform: Platform, ghost: bool) -> None:
    marks = [Line2D([], [], color=INK, marker="|", linestyle="", markersize=9, label="home")]
    if platform.stroke is not None:
        marks += [
            Line2D([], [], color="#E3E3E3", linewidth=6, label="stroke"),
            Line2D([], [], color=VERMILION, marker="X", linestyle="--", label="outside stroke"),
        ]
        scale = ScalarMappable(Normalize(0, 100), muted(*STROKE))
        bar = figure.colorbar(scale, ax=figure.axes[1], aspect=30, pad=0.02, location="top",
                              ticks=[0, 25, 50, 75, 100])  # fmt: skip
        bar.set_label("stroke used [%]")
        bar.outline.set_visible(False)
    if ghost:
        marks.append(Line2D([], [], color=GHOST.plate, linestyle="--", label="plate at home"))
    figure.legend(handles=marks, loc="outside lower right", ncols=len(marks))


def _title(platform: Platform, pose: Pose) -> str:
    lengths = ", ".join(number(v, platform.size) for v in pose.position)
    angles = ", ".join(number(v, 100) for v in np.degrees(pose.euler))
    where = f"({lengths}) {platform.unit}".rstrip() + f", ({angles}) deg"
    away = float(singularity_distance(platform, pose))
    if np.isnan(away):
        return f"{platform.name}: {where}\nout of the motors' reach"
    side = "" if assembly_sign(platform, pose) > 0 else ", beyond a singularity"
    return f"{platform.name}: {where}\ndistance to singularity {away:.2g}{side}"

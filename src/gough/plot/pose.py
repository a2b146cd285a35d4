"""A pose in 3-D: base, plate, and legs coloured by their position in the stroke."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from gough.checks import Array
from gough.kinematics import assembly_sign, singularity_distance
from gough.platform import Platform
from gough.plot.style import (
    BLUE,
    FAINT,
    GREY,
    INK,
    VERMILION,
    label_number,
    length_unit,
    muted,
    new_figure,
    pose_text,
    reading_name,
    reading_unit,
    shown_readings,
    styled,
)
from gough.pose import Pose
from gough.skeleton import Skeleton, outline_order, skeleton

STROKE = ("viridis", 0.0, 0.9)  # colour map of the stroke, without its palest part
PLAIN = "#4F6D8A"  # legs of a platform that states no stroke
VIEW = (20.0, -62.0)  # [deg] elevation, azimuth


@dataclass(frozen=True)
class PoseStyle:
    """Appearance of one pose.

    Attributes:
        plate: colour of the plate.
        line: style of its outline.
        width: of its outline [pt].
        fill: opacity of the plate, 0 for an outline only.
        legs: colour of the legs; "stroke" to colour them by stroke, "" to draw none.
        base: True to draw base and motor arms.
        numbers: True to number the legs, at the base.
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
GHOST = PoseStyle(plate=INK, line="--", width=1.3, fill=0.0, legs="", base=False,
                  numbers=False)  # fmt: skip


def draw_pose(
    axes: Axes3D, platform: Platform, pose: Pose, *, style: PoseStyle = SOLVED
) -> dict[str, Any]:
    """Draw one pose into 3-D axes, which several poses may share; see `pose_axes`.

    Legs are coloured by stroke, from dark (shortest) to light (longest). Legs outside their
    stroke are vermilion and dashed, with a cross; motors that cannot reach are dotted. Rotary
    machines show motor arms as thick dark lines and rods as legs.

    Returns:
        The lines drawn: "legs" (six, from strut start to platform joint), "plate", and "base" and
        "arms" where drawn.

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
def pose_axes(figure: Any, platform: Platform, poses: Sequence[Pose], place: Any = 111) -> Axes3D:
    """Make 3-D axes to scale that hold all of `poses`, with units.

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
    axes.set_box_aspect(half / max(half), zoom=1.2)  # pyright: ignore[reportArgumentType]
    axes.view_init(*VIEW)
    return axes


@styled
def pose_figure(
    platform: Platform,
    pose: Pose,
    *,
    ghost: Pose | None = None,
    title: str = "",
    frame: str | None = None,
) -> Figure:
    """Draw one pose in 3-D, and the readings of its legs within their strokes.

    Args:
        platform: the machine.
        pose: the pose.
        ghost: a second pose, dashed, such as home or the true pose.
        title: text above the picture; without it the platform's name and the pose.
        frame: whose pose the title states, such as "tool in work"; `pose` is the platform's.

    Raises:
        GoughError: a batch of poses, a pose of NaN, or an unknown frame.
    """
    bones = skeleton(platform, pose)
    figure = new_figure(8.0, 4.5)
    figure.suptitle(title or _title(platform, pose, frame))
    poses = [pose] if ghost is None else [pose, ghost]
    left, _, right = figure.add_gridspec(1, 3, width_ratios=[1.7, 0.1, 1])
    axes = pose_axes(figure, platform, poses, left)
    draw_pose(axes, platform, pose)
    if ghost is not None:
        draw_pose(axes, platform, ghost, style=GHOST)
    _draw_readings(figure.add_subplot(right), platform, bones)
    _legend(figure, bones, ghost is not None)
    return figure


# ---- parts ----------------------------------------------------------------------------


def _polygon(
    axes: Axes3D, points: Array, color: str, line: str, width: float, fill: float, alpha: float
) -> Line2D:
    """Draw joints joined around their centre; returns the outline."""
    corners = points[outline_order(points)]
    if fill:
        axes.add_collection3d(
            Poly3DCollection([corners], facecolors=to_rgba(color, fill), linewidths=0)
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
    """Colour of a leg at a position in its stroke, 0 to 1; slate where none is stated."""
    return PLAIN if np.isnan(share) else muted(*STROKE)(share)


def _number_legs(axes: Axes3D, base: Array) -> None:
    """Write numbers just outside the base joints; those of joints at one point side by side."""
    centre = base.mean(axis=0)
    places: dict[tuple[float, ...], list[str]] = {}
    spread = np.abs(base - centre).max()
    for i, joint in enumerate(base):
        key = tuple(np.round((joint - centre) / spread, 6))
        places.setdefault(key, []).append(str(i + 1))
    for key, names in places.items():
        where = centre + spread * 1.16 * np.array(key)
        x, y, z = where
        axes.text(x, y, z, ", ".join(names), fontsize=8, color=INK, ha="center", va="center")


def _draw_readings(axes: Axes, platform: Platform, bones: Skeleton) -> None:
    """Draw six horizontal scales: stroke, as a colour bar, with home and reading of each leg."""
    readings = shown_readings(platform, bones.readings)
    home = shown_readings(platform, platform.home_legs)
    rows = np.arange(1, 7)
    ends = np.concatenate([home, readings[~bones.unreachable]])
    if platform.stroke is not None:
        limits = shown_readings(platform, platform.stroke)
        ends = np.append(ends, limits)
        for row, (low, high) in zip(rows, limits, strict=True):
            axes.imshow(
                np.linspace(0, 1, 256)[None], cmap=muted(*STROKE), aspect="auto", alpha=0.6,
                zorder=1, extent=(low, high, row + 0.16, row - 0.16),
            )  # fmt: skip
    axes.plot(home, rows, "|", color=INK, markersize=13, markeredgewidth=1.1)
    for i in range(6):
        if bones.unreachable[i]:
            axes.annotate("cannot reach", (home[i], rows[i]), color=VERMILION, fontsize=8,
                          xytext=(0, 9), textcoords="offset points", ha="center")  # fmt: skip
            continue
        wrong = bool(bones.outside[i])
        color = VERMILION if wrong else leg_color(bones.share[i])
        axes.plot(readings[i], rows[i], "X" if wrong else "o", color=color, markersize=7,
                  markeredgecolor=color if wrong else "white")  # fmt: skip
        text = label_number(readings[i], 100 if platform.legs == "rotary" else _digits(platform))
        axes.annotate(text, (readings[i], rows[i]), xytext=(0, 8), textcoords="offset points",
                      ha="center", fontsize=7.5, color=VERMILION if wrong else INK)  # fmt: skip
    margin = 0.14 * (np.ptp(ends) or 0.01 * platform.size)
    axes.set(xlim=(ends.min() - margin, ends.max() + margin), ylim=(6.6, 0.3), yticks=rows,
             yticklabels=[f"leg {row}" for row in rows])  # fmt: skip
    axes.set_xlabel(f"{reading_name(platform)} [{reading_unit(platform)}]")
    axes.grid(axis="y", visible=False)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    axes.xaxis.set_major_locator(MaxNLocator(5))


def _digits(platform: Platform) -> float:
    """Length that sets the digits of readings: the stroke of length changes, else the size."""
    if platform.legs == "length_change" and platform.stroke is not None:
        return float(np.abs(platform.stroke).max())
    return platform.size


def _legend(figure: Figure, bones: Skeleton, ghost: bool) -> None:
    """List the marks that the picture holds."""
    marks: list[Any] = [
        Line2D([], [], color=INK, marker="|", linestyle="", markersize=9, label="home")
    ]
    if not np.all(np.isnan(bones.share)):
        ends = [(Patch(color=leg_color(share), alpha=0.6)) for share in (0.0, 0.5, 1.0)]
        marks.append(tuple(ends))
    labels = ["home", "stroke, shortest to longest"][: len(marks)]
    if bones.outside.any():
        marks.append(Line2D([], [], color=VERMILION, marker="X", linestyle="--"))
        labels.append("outside stroke")
    if ghost:
        marks.append(Line2D([], [], color=GHOST.plate, linestyle="--"))
        labels.append("plate at home")
    figure.legend(
        marks, labels, loc="outside lower right", ncols=len(marks),
        handler_map={tuple: HandlerTuple(ndivide=None, pad=0)},
    )  # fmt: skip


def _title(platform: Platform, pose: Pose, frame: str | None) -> str:
    where = pose_text(platform, pose, frame).replace("\n", ", ")
    where = f"{frame} at {where}" if frame else where
    away = float(singularity_distance(platform, pose))
    if np.isnan(away):
        return f"{platform.name}: {where}\nout of the motors' reach"
    side = "" if assembly_sign(platform, pose) > 0 else ", beyond a singularity"
    return f"{platform.name}: {where}\ndistance to singularity {away:.2g}{side}"

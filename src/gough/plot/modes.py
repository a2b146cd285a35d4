"""All assembly modes of one set of readings in one figure."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import GoughError
from gough.kinematics import equivalent_struts, joint_positions
from gough.modes.choose import choose_mode
from gough.modes.result import AssemblyModes
from gough.plot.style import (
    BLUE,
    FAINT,
    GREY,
    VERMILION,
    length_unit,
    new_figure,
    pose_text,
    styled,
)
from gough.skeleton import outline_order

Look = tuple[str, Literal["-", "--"]]  # colour and line
FEW = 8  # modes that are drawn in panels alone, each with its pose
LEFT, LEAST = 3.6, 5.6  # [inch] width of the overlays, least height
CELL, FEW_CELL = 1.02, 2.1  # [inch] width of one pose
BASE = GREY
SAME: Look = (BLUE, "-")
OTHER: Look = (VERMILION, "--")


@styled
def modes_figure(modes: AssemblyModes) -> Figure:
    """Draw every pose of one set of readings, each in its own panel.

    Many poses are also drawn together, from the front and from above; few have their position
    and angles above. Poses whose det J has home's sign are blue, the others vermilion and
    dashed; they are numbered as `gough modes` lists them.

    Raises:
        GoughError: the modes of several sets of readings; pass modes[i].
    """
    if modes.legs.ndim > 1:
        raise GoughError(f"modes: expected one set of readings, found {len(modes)}; pass modes[i]")
    count = len(modes.row)
    few = count <= FEW
    columns = max(1, min(count, FEW // 2) if few else math.ceil(math.sqrt(1.6 * count)))
    rows = max(1, math.ceil(count / columns))
    base = equivalent_struts(modes.platform, modes.legs)[0]
    joints = joint_positions(modes.platform, modes.platform_pose)
    low, high = _frames(_oblique(base), _oblique(joints))
    span = (high - low).max(axis=0, initial=1e-9)
    wide = (FEW_CELL if few else CELL) * columns
    tall = (wide / columns * span[1] / span[0] + (0.4 if few else 0.16)) * rows + 0.9
    left, least = (0.0, 0.0) if few else (LEFT, LEAST)
    figure = new_figure(max(left + wide, LEFT), min(max(least, tall), 2 * (left + wide) + 1))
    panels: Any = figure
    if not few:
        halves: Any = figure.subfigures(1, 2, width_ratios=[LEFT, wide])
        together, panels = halves
        figure.get_layout_engine().set(w_pad=0.02, h_pad=0.02, wspace=0.0, hspace=0.0)  # pyright: ignore[reportOptionalMemberAccess, reportCallIssue]
        _draw_together(together, modes, base, joints)
        panels.suptitle("each by itself, all to one scale", fontsize=9)
    order = np.argsort(choose_mode(modes).rank)
    _draw_apart(panels, modes, base, joints, order, (rows, columns))
    if few:
        figure.legend(handles=_marks(), loc="outside lower center", ncols=1 if columns < 3 else 3)
    certified = int(modes.certified.sum())
    shown = f"\nposes of {modes.frame}" if modes.frame and few else ""
    plural = "" if count == 1 else "s"
    figure.suptitle(
        f"{modes.platform.name}: {count} pose{plural} with the same six readings,"
        f"{chr(10) if columns < 3 else ' '}{certified} proven{shown}"
    )
    return figure


def _draw_together(figure: Any, modes: AssemblyModes, base: Array, joints: Array) -> None:
    """Draw all poses on top of each other: front view above top view."""
    unit = length_unit(modes.platform)
    views = (((0, 2), "all, from the front"), ((0, 1), "all, from above"))
    for axes, ((a, b), name) in zip(figure.subplots(2, 1), views, strict=True):
        for plate, sign in zip(joints, modes.sign, strict=True):
            color, line = _look(sign)
            axes.plot(*_outline(plate)[:, [a, b]].T, color=color, linestyle=line, linewidth=0.9,
                      alpha=0.7)  # fmt: skip
        axes.plot(*_outline(base)[:, [a, b]].T, color=BASE, linewidth=2)
        axes.plot(*base[:, [a, b]].T, "o", color=BASE, markersize=4)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set(xlabel=f"{'xyz'[a]} [{unit}]", ylabel=f"{'xyz'[b]} [{unit}]", title=name)
    figure.legend(handles=_marks(), loc="outside lower center", ncols=2)


def _marks() -> list[Line2D]:
    return [
        Line2D([], [], color=BASE, marker="o", label="base joints"),
        Line2D([], [], color=SAME[0], linestyle=SAME[1], label="plate, det J as at home"),
        Line2D([], [], color=OTHER[0], linestyle=OTHER[1], label="plate, other sign of det J"),
    ]


def _draw_apart(
    figure: Any, modes: AssemblyModes, base: Array, joints: Array, order: NDArray[np.intp],
    shape: tuple[int, int],
) -> None:  # fmt: skip
    """Draw each pose by itself, all to one scale, seen from the front, right and above."""
    plates, ground = _oblique(joints), _oblique(base)
    low, high = _frames(ground, plates)
    middle, half = (low + high) / 2, 0.53 * (high - low).max(axis=0, initial=1e-9)
    panels = np.atleast_1d(figure.subplots(*shape)).ravel()
    for k, axes in enumerate(panels):
        axes.set_axis_off()
        if k >= len(plates):
            continue
        i = int(order[k])
        (left, bottom), (right, top) = middle[i] - half, middle[i] + half
        axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
        _single(axes, ground, plates[i], base, joints[i], float(modes.sign[i]))
        axes.text(0.02, 0.99, f"{k + 1}", fontsize=8, va="top", transform=axes.transAxes)
        if len(plates) <= FEW:
            text = pose_text(modes.platform, modes.platform_pose[i], modes.frame)
            axes.set_title(text, fontsize=7.5)


def _frames(ground: Array, plates: Array) -> tuple[Array, Array]:
    """Lowest and highest corners (M, 2) of base and plate, for each of M poses."""
    below = np.minimum(ground.min(axis=0), plates.min(axis=1))
    above = np.maximum(ground.max(axis=0), plates.max(axis=1))
    return below, above


def _single(
    axes: Axes, ground: Array, plate: Array, base: Array, joints: Array, sign: float
) -> None:
    color, line = _look(sign)
    legs = np.stack([ground, plate], axis=1)
    gaps = np.full((6, 1, 2), np.nan)  # six legs as one line with gaps
    axes.plot(*np.concatenate([legs, gaps], axis=1).reshape(-1, 2).T, color="#A0A0A0",
              linewidth=0.6)  # fmt: skip
    around = outline_order(base)
    axes.fill(*ground[around].T, facecolor=FAINT, edgecolor=BASE, linewidth=1, alpha=0.6)
    around = outline_order(joints)
    axes.fill(*plate[around].T, facecolor=color, alpha=0.15, linewidth=0)
    closed = plate[np.append(around, around[0])]
    axes.plot(*closed.T, color=color, linestyle=line, linewidth=1.3)


def _look(sign: float) -> Look:
    return SAME if sign > 0 else OTHER


def _outline(points: Array) -> Array:
    """Closed outline (7, 3) through joints (6, 3)."""
    order = outline_order(points)
    return points[np.append(order, order[0])]


def _oblique(points: Array) -> Array:
    """Project points (..., 3) to (..., 2), seen from the front, right and somewhat above."""
    pan, tilt = np.radians(-35), np.radians(22)
    x = points[..., 0] * np.cos(pan) - points[..., 1] * np.sin(pan)
    depth = points[..., 0] * np.sin(pan) + points[..., 1] * np.cos(pan)
    return np.stack([x, points[..., 2] * np.cos(tilt) + depth * np.sin(tilt)], axis=-1)

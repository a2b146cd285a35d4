"""All assembly modes of one set of readings in one figure."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gough.checks import Array
from gough.errors import GoughError
from gough.kinematics import equivalent_struts, joint_positions
from gough.modes.choose import choose_mode
from gough.modes.result import AssemblyModes
from gough.plot.shapes import outline_order
from gough.plot.style import BLUE, FAINT, GREY, VERMILION, length_unit, new_figure, styled

LEFT, LEAST, CELL = 4.4, 5.6, 1.3  # [inch] overlays wide, figure tall, one pose wide
SAME, OTHER, BASE = (BLUE, "-"), (VERMILION, "--"), GREY


@styled
def modes_figure(modes: AssemblyModes) -> Figure:
    """Every pose of one set of readings, seen from the front and from above, then each alone.

    Poses whose det J has home's sign are blue, the others vermilion and dashed; they are
    numbered as `gough modes` lists them.

    Raises:
        GoughError: the modes of several sets of readings; pass modes[i].
    """
    if modes.legs.ndim > 1:
        raise GoughError(f"modes: expected one set of readings, found {len(modes)}; pass modes[i]")
    count = len(modes.row)
    columns = max(1, math.ceil(math.sqrt(1.6 * count)))
    rows = max(1, math.ceil(count / columns))
    base = equivalent_struts(modes.platform, modes.legs)[0]
    joints = joint_positions(modes.platform, modes.pose)
    low, high = _frame(_oblique(np.concatenate([base[None], joints])))
    wide = CELL * columns
    tall = (CELL * (high[1] - low[1]) / (high[0] - low[0]) + 0.16) * rows + 0.7
    figure = new_figure(LEFT + wide, min(max(LEAST, tall), 2 * (LEFT + wide)))
    parts: Any = figure.subfigures(1, 2, width_ratios=[LEFT, wide])
    figure.get_layout_engine().set(w_pad=0.02, h_pad=0.02, wspace=0.0, hspace=0.0)  # pyright: ignore[reportOptionalMemberAccess, reportCallIssue]
    _draw_together(parts[0], modes, base, joints)
    order = np.argsort(choose_mode(modes).rank)
    _draw_apart(parts[1], base, joints[order], modes.sign[order], (rows, columns), (low, high))
    certified = int(modes.certified.sum())
    plural = "" if count == 1 else "s"
    figure.suptitle(
        f"{modes.platform.name}: {count} pose{plural} with the same six readings, "
        f"{certified} proven"
    )
    return figure


def _draw_together(figure: Any, modes: AssemblyModes, base: Array, joints: Array) -> None:
    """All poses on top of each other: front view above top view."""
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
    marks = [
        Line2D([], [], color=BASE, marker="o", label="base joints"),
        Line2D([], [], color=SAME[0], linestyle=SAME[1], label="plate, det J as at home"),
        Line2D([], [], color=OTHER[0], linestyle=OTHER[1], label="plate, other sign of det J"),
    ]
    figure.legend(handles=marks, loc="outside lower center", ncols=2)


def _draw_apart(
    figure: Any, base: Array, joints: Array, sign: Array, shape: tuple[int, int],
    frame: tuple[Array, Array],
) -> None:
    """Each pose by itself, all to one scale, seen from the front, right and above."""
    plates, ground = _oblique(joints), _oblique(base)
    low, high = frame
    panels = np.atleast_1d(figure.subplots(*shape)).ravel()
    for k, axes in enumerate(panels):
        axes.set_axis_off()
        if k < len(plates):
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
            _single(axes, ground, plates[k], base, joints[k], float(sign[k]))
            axes.text(0.02, 0.99, f"{k + 1}", fontsize=8, va="top", transform=axes.transAxes)
    figure.suptitle("each by itself, all to one scale", fontsize=9)


def _frame(points: Array) -> tuple[Array, Array]:
    """Lowest and highest corner (2,) of a frame around points (..., 2)."""
    flat = points.reshape(-1, 2)
    low, high = flat.min(axis=0), flat.max(axis=0)
    margin = 0.05 * (high - low).max()
    return low - margin, high + margin


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


def _look(sign: float) -> tuple[str, str]:
    return SAME if sign > 0 else OTHER


def _outline(points: Array) -> Array:
    """Joints (6, 3) around their centre, closed."""
    order = outline_order(points)
    return points[np.append(order, order[0])]


def _oblique(points: Array) -> Array:
    """Points (..., 3) seen from the front, right and somewhat above, (..., 2)."""
    turn, tilt = np.radians(-35), np.radians(22)
    x = points[..., 0] * np.cos(turn) - points[..., 1] * np.sin(turn)
    depth = points[..., 0] * np.sin(turn) + points[..., 1] * np.cos(turn)
    return np.stack([x, points[..., 2] * np.cos(tilt) + depth * np.sin(tilt)], axis=-1)

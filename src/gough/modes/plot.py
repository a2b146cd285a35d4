"""All assembly modes of one set of readings in one figure."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from gough.checks import Array
from gough.kinematics import equivalent_struts, joint_positions
from gough.modes.choose import choose_mode
from gough.modes.result import AssemblyModes

# Okabe and Ito's colours, told apart by all kinds of colour vision
SAME, OTHER, BASE = "#0072B2", "#D55E00", "#555555"


def draw(modes: AssemblyModes, path: str | Path) -> None:
    """Write a picture: every pose seen from the front and from above, then each by itself.

    Poses whose det J has home's sign are blue, the others vermilion and dashed; they are
    numbered as `gough modes` lists them. The file name's ending picks the format.
    """
    count = len(modes.row)
    order = np.argsort(choose_mode(modes).rank)
    columns = max(1, math.ceil(math.sqrt(1.6 * count)))
    rows = max(1, math.ceil(count / columns))
    figure = Figure(figsize=(5 + 1.3 * columns, max(5.2, 1.5 * rows + 0.9)), layout="constrained")
    parts: Any = figure.subfigures(1, 2, width_ratios=[5, 1.3 * columns])
    left, right = parts
    base, _ = equivalent_struts(modes.platform, modes.legs)
    joints = joint_positions(modes.platform, modes.pose)
    unit = modes.platform.unit or "unit"
    for axes, (a, b), name in zip(
        left.subplots(2, 1), ((0, 2), (0, 1)), ("from the front", "from above"), strict=True
    ):
        _overlay(axes, base[:, [a, b]], joints[:, :, [a, b]], modes.sign)
        axes.set(xlabel=f"{'xyz'[a]} [{unit}]", ylabel=f"{'xyz'[b]} [{unit}]", title=name)
    _legend(left)
    panels = np.atleast_1d(right.subplots(rows, columns)).ravel()
    views = _oblique(base), _oblique(joints)
    low = np.minimum(views[0].min(axis=0), views[1].min(axis=(0, 1), initial=np.inf))
    high = np.maximum(views[0].max(axis=0), views[1].max(axis=(0, 1), initial=-np.inf))
    low, high = low - 0.08 * (high - low), high + 0.08 * (high - low)
    for k, axes in enumerate(panels):
        axes.set_axis_off()
        axes.set_aspect("equal")
        if k < count:
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
            _single(axes, views[0], views[1][order[k]], float(modes.sign[order[k]]))
            axes.set_title(f"{k + 1}", fontsize=8, pad=1)
    right.suptitle("each pose by itself, all to one scale", fontsize=10)
    certified = int(modes.certified.sum())
    figure.suptitle(f"{modes.platform.name}: {count} poses, {certified} certified")
    with matplotlib.rc_context({"svg.hashsalt": "gough"}):
        figure.savefig(path, dpi=140)


def _overlay(axes, base: Array, joints: Array, sign: Array) -> None:
    """All poses on top of each other, in two coordinates."""
    for platform, s in zip(joints, sign, strict=True):
        color, style = (SAME, "-") if s > 0 else (OTHER, "--")
        outline = _outline(platform)
        axes.plot(*outline.T, style, color=color, linewidth=0.8, alpha=0.6)
    axes.plot(*_outline(base).T, color=BASE, linewidth=2)
    axes.plot(*base.T, "o", color=BASE, markersize=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(linewidth=0.3)


def _single(axes, base: Array, platform: Array, sign: float) -> None:
    color, style = (SAME, "-") if sign > 0 else (OTHER, "--")
    for start, end in zip(base, platform, strict=True):
        axes.plot(*np.array([start, end]).T, color="#999999", linewidth=0.6)
    axes.plot(*_outline(base).T, color=BASE, linewidth=1)
    axes.plot(*_outline(platform).T, style, color=color, linewidth=1.3)


def _legend(figure) -> None:
    from matplotlib.lines import Line2D

    lines = [
        Line2D([], [], color=BASE, marker="o", label="base joints"),
        Line2D([], [], color=SAME, label="platform, det J as at home"),
        Line2D([], [], color=OTHER, linestyle="--", label="platform, other sign of det J"),
    ]
    figure.legend(handles=lines, loc="outside lower center", fontsize=8, frameon=False)


def _outline(points: Array) -> Array:
    """The joints in the order of the legs, closed."""
    return np.concatenate([points, points[:1]])


def _oblique(points: Array) -> Array:
    """Points (..., 3) seen from the front, right and somewhat above, (..., 2)."""
    turn, tilt = np.radians(-35), np.radians(22)
    x = points[..., 0] * np.cos(turn) - points[..., 1] * np.sin(turn)
    depth = points[..., 0] * np.sin(turn) + points[..., 1] * np.cos(turn)
    return np.stack([x, points[..., 2] * np.cos(tilt) + depth * np.sin(tilt)], axis=-1)

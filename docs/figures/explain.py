"""Sketches of formulas: the leg, its rate of change, the certificate's parabola."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILION, arrow, figure, label, sketch


def leg_equation() -> Figure:
    """Draw the vectors of one leg, and its change in a small motion of the platform."""
    whole = figure(6.8, 3.3)
    left, right = whole.subplots(1, 2)
    _vectors(left)
    _rate(right)
    return whole


def _vectors(axes: Axes) -> None:
    sketch(axes)
    origin, foot = np.array([0.0, 0.0]), np.array([1.9, 0.25])
    centre, head = np.array([0.35, 2.6]), np.array([1.25, 3.1])
    _plates(axes, foot, centre, head)
    arrow(axes, origin, foot, BLACK)
    arrow(axes, origin, centre, VERMILION)
    arrow(axes, centre, head, BLUE)
    arrow(axes, foot, head, GREEN, 2.2)
    label(axes, (0.95, -0.08), "$b_i$", BLACK, 12)
    label(axes, (-0.02, 1.45), "$t$", VERMILION, 12)
    label(axes, (0.68, 3.08), "$R\\,p_i$", BLUE, 12)
    label(axes, (1.85, 1.75), "$d_i$", GREEN, 12)
    label(axes, (0.1, -0.5), "base coordinates", GREY, 8)
    label(axes, (-0.55, 2.75), "platform", GREY, 8)
    axes.set_title("$d_i = R\\,p_i + t - b_i$", pad=10)
    axes.set(xlim=(-1.3, 2.9), ylim=(-0.9, 3.9))


def _rate(axes: Axes) -> None:
    sketch(axes)
    foot = np.array([1.9, 0.25])
    centre, head = np.array([0.35, 2.6]), np.array([1.25, 3.1])
    _plates(axes, foot, centre, head)
    axes.plot(*np.transpose([foot, head]), color=GREEN, linewidth=2.2)
    along = (head - foot) / np.linalg.norm(head - foot)
    motion = np.array([0.62, 0.5])
    arrow(axes, centre, head, BLUE)
    label(axes, (0.68, 3.1), "$r_i$", BLUE, 12)
    arrow(axes, head, head + motion, VERMILION, 1.8)
    label(axes, head + motion + (0.45, 0.12), "$v + \\omega \\times r_i$", VERMILION, 11)
    gained = (motion @ along) * along
    arrow(axes, head, head + gained, ORANGE, 1.8)
    axes.plot(*np.transpose([head + motion, head + gained]), ":", color=GREY, linewidth=1)
    label(axes, head + gained + (-0.3, 0.2), "$\\dot l_i$", ORANGE, 12)
    arrow(axes, foot, foot + 0.8 * along, BLACK, 1.6)
    label(axes, foot + 0.55 * along + (0.35, 0), "$n_i$", BLACK, 12)
    axes.set_title("$\\dot l_i = n_i \\cdot v + (r_i \\times n_i) \\cdot \\omega$", pad=10)
    axes.set(xlim=(-1.3, 2.9), ylim=(-0.9, 3.9))


def frames() -> Figure:
    """Draw the frames of a machine, who hangs on whom, and the chain from tool to work."""
    whole = figure(5.4, 3.7)
    axes = whole.subplots()
    sketch(axes)
    base, platform = np.array([1.2, 0.9]), np.array([1.5, 2.6])
    axes.plot([0.3, 2.1], [0.9, 0.9], color="#d0d0d0", linewidth=7, solid_capstyle="round")
    axes.plot([0.85, 2.15], [2.5, 2.7], color="#cfe3f1", linewidth=7, solid_capstyle="round")
    feet, heads = np.linspace(0.35, 2.05, 6), np.linspace(0.9, 2.1, 6)
    for i in range(6):
        x = [feet[i], heads[min(max(i + (-1) ** i, 0), 5)]]
        axes.plot(x, [0.93, 2.47 + 0.15 * (x[1] - 0.85)], color=GREY, linewidth=1)
    places = {
        "world": ((-0.9, 0.1), 0, BLACK, (-0.25, -0.2)),
        "base": (base, 0, BLACK, (-0.1, -0.25)),
        "platform": (platform, 9, BLUE, (-0.55, 0.12)),
        "tool": ((2.3, 3.7), 9, BLUE, (-0.4, 0.1)),
        "work": ((3.9, 2.2), -20, BLACK, (0.0, -0.3)),
    }
    for name, (at, angle, color, beside) in places.items():
        for turn in (angle, angle + 90):
            way = 0.42 * np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
            arrow(axes, at, np.add(at, way), color, 1.4)
        label(axes, np.add(at, beside), name, color, 10)
    chain = [("world", "base"), ("platform", "tool"), ("world", "work")]
    for start, end in chain:
        arrow(axes, places[start][0], places[end][0], ORANGE, 1.0)
    arrow(axes, base, platform, VERMILION, 2.0)
    arrow(axes, places["work"][0], places["tool"][0], GREEN, 2.0)
    for at, text, color in (
        ((0.1, 0.3), "base_in_world", ORANGE),
        ((1.55, 3.2), "tool_in_platform", ORANGE),
        ((2.95, 1.45), "work_in_world", ORANGE),
        ((1.62, 1.75), "the legs", VERMILION),
        ((3.35, 3.1), "tool in work", GREEN),
    ):
        label(axes, at, text, color, 9)
    axes.set(xlim=(-1.6, 4.9), ylim=(-0.35, 4.3))
    return whole


def _plates(axes: Axes, foot, centre, head) -> None:
    """Draw base and platform as bars with their joints."""
    axes.plot([-1.1, 2.5], [-0.02, 0.33], color="#d0d0d0", linewidth=7, solid_capstyle="round")
    across = (head - centre) / np.linalg.norm(head - centre)
    bar = centre + across * np.array([[-1.1], [1.25]])
    axes.plot(*bar.T, color="#cfe3f1", linewidth=7, solid_capstyle="round")
    axes.plot(*foot, "o", color=BLACK, markersize=7, zorder=5)
    axes.plot(*head, "o", color=BLUE, markersize=7, zorder=5)
    axes.plot(*centre, "o", color=VERMILION, markersize=4, zorder=5)
    axes.plot(0, 0, "o", color=VERMILION, markersize=4, zorder=5)


def certificate() -> Figure:
    """Draw the image radius of a ball of radius rho; below the diagonal it maps into itself."""
    whole = figure(5.4, 3.5)
    axes = whole.subplots()
    beta, delta, kappa = 0.06, 0.12, 0.85
    rho = np.linspace(0, 1.05, 300)
    root = np.sqrt((1 - delta) ** 2 - 4 * kappa * beta)
    near, far = 2 * beta / (1 - delta + root), (1 - delta) / (2 * kappa)
    axes.axvspan(near, far, color=BLUE, alpha=0.12, linewidth=0)
    axes.plot(rho, rho, color=GREY, linewidth=1)
    axes.plot(rho, beta + delta * rho + kappa * rho**2, color=BLUE, linewidth=2)
    for x, name in ((near, "$\\rho_-$\nthe solution\nis within this"),
                    (far, "$\\rho_+$\nno other\nwithin this")):  # fmt: skip
        axes.plot([x, x], [0, 1], color=VERMILION, linewidth=1, linestyle="--")
        axes.text(x + 0.012, 0.98, name, color=VERMILION, va="top", fontsize=9)
    axes.text(0.93, 0.9, "$\\rho$", color=GREY, ha="right")
    axes.text(0.79, 0.52, "$\\beta + \\delta\\rho + \\kappa\\rho^2$", color=BLUE)
    axes.plot(0, beta, "o", color=BLUE)
    axes.text(0.015, beta - 0.01, "$\\beta$", color=BLUE, va="top")
    axes.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[])
    axes.set_xlabel("radius $\\rho$ of a ball about the computed pose")
    axes.set_ylabel("radius of its image")
    return whole


FIGURES = {"leg_equation": leg_equation, "certificate": certificate, "frames": frames}

"""The workshop drawing of the tutorial's hexapod, and the leg of a 6-RSS machine."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    VERMILION,
    arc,
    arrow,
    dimension,
    figure,
    label,
    polar,
    sketch,
)

BASE_RADIUS, PLATE_RADIUS, HEIGHT = 300, 200, 517  # [mm]
FEET, TABLE = 45, 30  # [mm] from floor to base joints, from platform joints to the table's top
BASE_DEG = np.array([-10, 10, 110, 130, 230, 250])
PLATE_DEG = np.array([-52, 52, 68, 172, 188, 292])


def drawing() -> Figure:
    """Draw plan, elevation and a strut, with dimensions."""
    whole = figure(6.4, 8.4)
    axes = whole.subplot_mosaic("aa;bc", width_ratios=[1.25, 1], height_ratios=[2.2, 1])
    _plan(axes["a"])
    _elevation(axes["b"])
    _strut(axes["c"])
    return whole


def _plan(axes: Axes) -> None:
    sketch(axes)
    base, plate = polar(BASE_RADIUS, BASE_DEG), polar(PLATE_RADIUS, PLATE_DEG)
    arc(axes, BASE_RADIUS, 0, 360, color=BLACK, linewidth=0.8, linestyle=(0, (8, 2, 1, 2)))
    arc(axes, PLATE_RADIUS, 0, 360, color=BLUE, linewidth=0.8, linestyle=(0, (8, 2, 1, 2)))
    for i, (foot, head) in enumerate(zip(base, plate, strict=True)):
        axes.plot(*np.transpose([foot, head]), color=GREY, linewidth=3, solid_capstyle="round")
        label(axes, foot * 1.115, f"B{i + 1}", BLACK, 10)
        label(axes, head * 0.82, f"P{i + 1}", BLUE, 10)
        label(axes, (foot + head) / 2, f"{i + 1}", GREY, 9)
    axes.plot(*base.T, "o", color=BLACK, markersize=6)
    axes.plot(*plate.T, "o", color=BLUE, markersize=6)
    for middle in (0, 120, 240):
        _pair(axes, middle, 10, BASE_RADIUS + 85, BASE_RADIUS, BLACK)
    for middle in (60, 180, 300):
        _pair(axes, middle, 8, PLATE_RADIUS + 45, PLATE_RADIUS, BLUE)
    arrow(axes, (0, 0), (95, 0), VERMILION)
    arrow(axes, (0, 0), (0, 95), VERMILION)
    label(axes, (112, 0), "x", VERMILION, 10)
    label(axes, (0, 112), "y", VERMILION, 10)
    label(axes, (0, -45), "base joints B on Ø 600", BLACK)
    label(axes, (0, -75), "platform joints P on Ø 400", BLUE)
    axes.set_title("plan, seen from above; all lengths in mm")
    axes.set(xlim=(-400, 470), ylim=(-445, 445))


def _pair(axes: Axes, middle: float, half: float, radius: float, inner: float, color: str) -> None:
    """Draw the angle between the two joints of a pair, halved by a centre line."""
    for degrees, start in ((middle, 0.55 * inner), (middle - half, inner), (middle + half, inner)):
        ends = polar(1, degrees) * np.array([[start], [radius + 12]])
        axes.plot(*ends.T, color=color, linewidth=0.5, linestyle=(0, (8, 2, 1, 2)))
    arc(axes, radius, middle - half, middle + half, color=color, linewidth=0.7)
    label(
        axes,
        polar(max(radius + 44, BASE_RADIUS + 48), middle),
        f"2 × {half}°\nabout {middle}°",
        color,
    )


def _elevation(axes: Axes) -> None:
    sketch(axes)
    base, plate = polar(BASE_RADIUS, BASE_DEG), polar(PLATE_RADIUS, PLATE_DEG)
    for foot, head in zip(base, plate, strict=True):
        axes.plot([foot[0], head[0]], [0, HEIGHT], color=GREY, linewidth=3)
    axes.fill_between([-330, 330], -FEET - 18, -FEET, color=BLACK)
    axes.fill_between([-230, 230], HEIGHT + TABLE - 16, HEIGHT + TABLE, color=BLUE)
    for x in base[:, 0]:
        axes.plot([x, x], [-FEET, 0], color=BLACK, linewidth=2)
    for x in plate[:, 0]:
        axes.plot([x, x], [HEIGHT, HEIGHT + TABLE - 16], color=BLUE, linewidth=2)
    axes.plot(base[:, 0], 0 * base[:, 0], "o", color=BLACK, markersize=4.5)
    axes.plot(plate[:, 0], 0 * plate[:, 0] + HEIGHT, "o", color=BLUE, markersize=4.5)
    dimension(axes, (420, 0), (420, HEIGHT), f"{HEIGHT}", ends=[(300, 0), (200, HEIGHT)])
    dimension(axes, (-400, -FEET), (-400, 0), "", ends=[(-330, -FEET), (-230, 0)])
    label(axes, (-445, -FEET / 2), "45")
    dimension(
        axes, (-400, HEIGHT), (-400, HEIGHT + TABLE), "",
        ends=[(-200, HEIGHT), (-230, HEIGHT + TABLE)],
    )  # fmt: skip
    label(axes, (-445, HEIGHT + TABLE / 2), "30")
    arrow(axes, (0, 0), (0, 110), VERMILION)
    label(axes, (26, 105), "z", VERMILION, 10)
    axes.set_title("front, all struts at mid-stroke")
    axes.set(xlim=(-480, 480), ylim=(-85, 565))


def _strut(axes: Axes) -> None:
    sketch(axes)
    for y, length, color in ((60, 480, BLACK), (0, 630, GREEN)):
        axes.plot([0, 330], [y, y], color=GREY, linewidth=7, solid_capstyle="butt")
        axes.plot([330, length], [y, y], color=GREY, linewidth=3)
        axes.plot([0, length], [y, y], "o", color=color, markersize=5)
    dimension(axes, (0, 105), (480, 105), "480 retracted", ends=[(0, 60), (480, 60)])
    dimension(axes, (0, -50), (630, -50), "630 extended", ends=[(0, 0), (630, 0)])
    axes.set_title("strut, joint centre to joint centre")
    axes.set(xlim=(-20, 650), ylim=(-80, 135))


def rotary_leg() -> Figure:
    """Draw the plane of an arm: centre, angle, tip, rod, and the other branch."""
    whole = figure(5.6, 3.4)
    axes = whole.subplots()
    sketch(axes)
    arm, rod, joint = 1.0, 2.1, np.array([0.25, 2.35])
    distance, towards = np.hypot(*joint), np.arctan2(joint[1], joint[0])
    bend = np.arccos((distance**2 + arm**2 - rod**2) / (2 * arm * distance))
    arrow(axes, (0, 0), (1.75, 0), BLACK)
    arrow(axes, (0, 0), (0, 1.75), BLACK)
    label(axes, (2.1, 0), "axis_x", BLACK)
    label(axes, (-0.12, 1.9), "axis_y", BLACK)
    turn = np.linspace(0, 2 * np.pi, 181)
    axes.plot(np.cos(turn), np.sin(turn), color=GREY, linewidth=0.6)
    for branch, color, line in ((-1, BLUE, "-"), (1, VERMILION, "--")):
        angle = towards + branch * bend
        tip = arm * np.array([np.cos(angle), np.sin(angle)])
        axes.plot(*np.transpose([(0, 0), tip]), line, color=color, linewidth=3)
        axes.plot(*np.transpose([tip, joint]), line, color=color, linewidth=1.5)
        axes.plot(*tip, "o", color=color)
        sign = "+1" if branch > 0 else "−1"
        offset = np.array([0.72, -0.02 if branch > 0 else 0.12]) * [-branch, 1]
        label(axes, tip + offset, f"branch = {sign}", color)
    angle = towards - bend
    sweep = np.linspace(0, angle, 40)
    axes.plot(0.5 * np.cos(sweep), 0.5 * np.sin(sweep), color=BLUE, linewidth=0.9)
    middle = 0.66 * np.array([np.cos(angle / 2), np.sin(angle / 2)])
    label(axes, middle, "q", BLUE, 11)
    axes.plot(0, 0, "o", color=BLACK)
    axes.plot(*joint, "o", color=GREEN, markersize=7)
    label(axes, joint + np.array([0.75, 0.12]), "platform joint", GREEN)
    label(axes, (-0.05, -0.22), "base: centre of the arm", BLACK)
    tip = arm * np.array([np.cos(angle), np.sin(angle)])
    label(axes, (tip + joint) / 2 + (0.42, 0.05), "rod_length", BLUE)
    axes.set(xlim=(-2.1, 2.6), ylim=(-1.1, 2.6))
    return whole


FIGURES = {"workshop_drawing": drawing, "rotary_leg": rotary_leg}

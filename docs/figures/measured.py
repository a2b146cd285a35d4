"""Figures of what gough computes: steps of Newton, modes, a singularity, a control loop."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    figure,
    oblique,
    sketch,
)

import gough


def newton() -> Figure:
    """Draw the errors of first guesses, and of the steps of Newton's method after them."""
    platform = gough.Platform.load("reference")
    true = platform.sample_poses(5000, seed=5)
    legs = gough.leg_lengths(platform, true)
    whole = figure(6.8, 3.1)
    left, right = whole.subplots(1, 2)
    seeds = (("home", VERMILION, "o"), ("polynomial", BLUE, "s"), ("polynomial-5", GREEN, "^"))
    for seed, color, marker in seeds:
        errors = []
        for steps in range(8):
            found = gough.solve(platform, legs, seed=seed, max_iterations=steps, restarts=0)
            errors.append(found.pose.distance(true)[0])
        values, edges = np.histogram(errors[0], bins=np.geomspace(1e-2, 1e2, 61))
        left.stairs(values / len(legs), edges, color=color, linewidth=1.4, label=f'"{seed}"')
        median = np.median(errors, axis=1)
        right.plot(range(8), median, color=color, marker=marker, markersize=4, linewidth=1.2)
    left.set(xscale="log", xlabel="position error of the guess [mm]", ylabel="share of poses")
    left.legend()
    right.set(yscale="log", xlabel="Newton steps", ylabel="median position error [mm]")
    right.grid()
    return whole


def two_modes() -> Figure:
    """Draw the places of a point on two legs, and poses of a hexapod, with equal lengths."""
    whole = figure(6.8, 2.8)
    left, right = whole.subplots(1, 2, width_ratios=[1, 1.5])
    _two_circles(left)
    _three_poses(right)
    return whole


def _two_circles(axes: Axes) -> None:
    sketch(axes)
    feet, lengths = np.array([[0.0, 0.0], [2.2, 0.0]]), (1.9, 1.5)
    x = (lengths[0] ** 2 - lengths[1] ** 2 + feet[1, 0] ** 2) / (2 * feet[1, 0])
    y = np.sqrt(lengths[0] ** 2 - x**2)
    turn = np.linspace(0, 2 * np.pi, 181)
    for foot, length in zip(feet, lengths, strict=True):
        circle = foot[:, None] + length * np.array([np.cos(turn), np.sin(turn)])
        axes.plot(*circle, color=GREY, linewidth=0.7)
    for sign, color, line in ((1, BLUE, "-"), (-1, VERMILION, "--")):
        for foot in feet:
            axes.plot([foot[0], x], [0, sign * y], line, color=color, linewidth=2)
        axes.plot(x, sign * y, "o", color=color, markersize=7)
    axes.plot(*feet.T, "o", color=BLACK, markersize=7)
    axes.set_title("two legs: two places")


def _three_poses(axes: Axes) -> None:
    sketch(axes)
    platform = gough.Platform.load("reference")
    modes = gough.assembly_modes(platform, platform.home_legs)
    joints = gough.joint_positions(platform, modes.pose)
    base = platform.base
    order = np.argsort(gough.choose_mode(modes).rank)
    first, *pair = [k for k in order if modes.pose.position[k, 2] > 0][:3]
    # mirror images of each other, of which rounding alone says which comes first
    pair.sort(key=lambda k: modes.pose.position[k, 1])
    for place, k in enumerate([first, *pair]):
        shift = np.array([place * 950.0, 0.0])
        color = BLUE if modes.sign[k] > 0 else VERMILION
        foot, head = oblique(base) + shift, oblique(joints[k]) + shift
        for start, end in zip(foot, head, strict=True):
            axes.plot(*np.transpose([start, end]), color=GREY, linewidth=1.3)
        axes.plot(*np.vstack([foot, foot[:1]]).T, color=BLACK, linewidth=1.4)
        axes.fill(*head.T, color=color, alpha=0.25)
        axes.plot(*np.vstack([head, head[:1]]).T, color=color, linewidth=1.6)
    axes.set_title(f"six legs: three of the {len(order)} poses at home's lengths")


def singularity() -> Figure:
    """Draw distance to singularity and pose error of the reference platform, rotated about z."""
    platform = gough.Platform.load("reference")
    angle = np.linspace(0, 120, 481)
    turn = np.stack([0 * angle, 0 * angle, np.radians(angle)], axis=-1)
    pose = gough.Pose.from_euler(np.broadcast_to(platform.home.position, turn.shape), turn)
    distance = gough.singularity_distance(platform, pose)
    spread = np.sqrt(np.diagonal(gough.pose_covariance(platform, pose, 0.01), axis1=-2, axis2=-1))
    spread[np.abs(angle - 90) < 0.2] = np.nan  # nothing is known there
    whole = figure(6.8, 3.1)
    left, right = whole.subplots(1, 2)
    left.plot(angle, distance, color=BLUE, linewidth=2)
    left.set(ylabel="distance to singularity", ylim=(0, None))
    for values, color, line, name in (
        (spread[:, 0], VERMILION, "-", "x, y"),
        (spread[:, 2], BLUE, "--", "z"),
    ):
        right.plot(angle, values, line, color=color, linewidth=1.6, label=name)
    right.plot(angle, 150 * spread[:, 5], ":", color=GREEN, linewidth=2, label="turn, at 150 mm")
    right.set(yscale="log", ylabel="standard deviation [mm]\nfor 0.01 mm of each leg")
    right.legend(loc="upper left")
    for axes in (left, right):
        axes.grid()
        axes.set(xlabel="turn about z [deg]", xlim=(0, 120), xticks=range(0, 121, 30))
    return whole


def control_loop() -> Figure:
    """Draw a tracker through a dropout, a bad reading and a sensor whose zero moved."""
    platform = gough.Platform.load("reference")
    time = np.arange(120)
    side = 20 * np.sin(time / 20)
    true = gough.Pose(platform.home.position + np.stack([0 * side, side, 0 * side], axis=-1))
    legs = gough.leg_lengths(platform, true)
    legs[30:36] = np.nan
    legs[60, 4] += 25
    legs[90:] += [0, 0, 0, 0, 12, 0]
    tracker = gough.Tracker(platform, max_shift=2.0)
    places, events = [], []
    for reading in legs:
        places.append(tracker.update(reading).position[1])
        events.append(tracker.event)
    alone = gough.solve(platform, legs, seed="home").pose.position[:, 1]
    whole = figure(6.4, 3.1)
    axes = whole.subplots()
    axes.plot(time, alone, color=GREY, linewidth=1.2, label="each reading by itself")
    axes.plot(time, places, color=BLUE, linewidth=2, label="Tracker")
    marks = {
        gough.Event.HELD: ("v", VERMILION),
        gough.Event.JUMPED: ("D", PURPLE),
        gough.Event.FOUND: ("*", ORANGE),
        gough.Event.MODE_CHANGED: ("X", SKY),
    }
    for event, (marker, color) in marks.items():
        at = [k for k, e in enumerate(events) if e == event]
        if at:
            axes.plot(time[at], np.array(places)[at], marker, color=color, label=event.name)
    axes.set(xlabel="cycle", ylabel="y [mm]")
    axes.legend(ncols=2)
    axes.grid()
    return whole


FIGURES = {
    "newton": newton,
    "two_modes": two_modes,
    "singularity": singularity,
    "control_loop": control_loop,
}

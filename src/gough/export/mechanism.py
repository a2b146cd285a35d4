"""A platform at home as rigid bodies and joints: what the models for simulators are written from.

Each leg is a chain whose rod a ball joint ties to the platform, which closes a loop:

    telescopic, length change   base - universal joint - cylinder - driven slide - rod
    rotary                      base - driven hinge - arm - universal joint - rod

Universal joints have axes at right angles to the leg at home. The platform is a free body whose
frame is at the pivot. Slides go along the z axis of their bodies, hinges about it; the axes of
universal joints are x, then y.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gough import quaternion
from gough.checks import Array
from gough.kinematics import equivalent_struts, joint_positions
from gough.platform import Platform
from gough.pose import Pose
from gough.struts import arm_directions
from gough.units import LENGTHS, in_unit

PLATFORM_MASS, PART_MASS = 1.0, 0.02  # [kg] of the platform, and of each part of a leg
LEG_RADIUS = 0.01  # of legs as drawn, as a share of the size
LEGS = [f"leg{number}" for number in range(1, 7)]
BASE = "base"  # the body that rests
NOT_STATED = "Masses are not the machine's: put its own in."


@dataclass(frozen=True)
class Bar:
    """Cylinder between two points of a body, which is drawn and has mass."""

    start: Array
    end: Array
    radius: float
    mass: float


@dataclass(frozen=True)
class Body:
    """Rigid body, and the joint by which its parent holds it.

    Attributes:
        parent: name of a body that is listed before, or `BASE`.
        pose: in the parent, at home.
        joint: at the body's origin.
        leg: which leg the joint drives, None for joints without a drive.
    """

    name: str
    parent: str
    pose: Pose
    joint: Literal["universal", "slide", "hinge", "free"]
    bars: list[Bar]
    leg: int | None = None


@dataclass(frozen=True)
class Mechanism:
    """Bodies of a machine at home, and the ball joints that close its loops.

    Attributes:
        machine: the platform, in metres where its unit is known.
        base: bars of the body that rests, in base coordinates.
        bodies: parents before children.
        loops: for each leg the name of its rod, and the same point in the rod and in the platform.
        travel: (6,) of the driven joints at home, from where the leg's sensor reads 0.
    """

    machine: Platform
    base: list[Bar]
    bodies: list[Body]
    loops: list[tuple[str, Array, Array]]
    travel: Array


def mechanism(platform: Platform) -> Mechanism:
    """Bodies and joints of a platform at home."""
    machine = in_unit(platform, "m") if platform.unit in LENGTHS else platform
    tips, lengths = equivalent_struts(machine, machine.home_legs)
    rods = joint_positions(machine, machine.home) - tips
    travel = machine.gain * machine.home_legs
    bodies = [
        body for leg in range(6) for body in _leg(machine, leg, rods[leg], lengths[leg], travel)
    ]
    joints = machine.moving - machine.pivot_point
    place = Pose(machine.home.position + machine.pivot_point, machine.home.wxyz)
    plate = _sides(joints, 1.6 * LEG_RADIUS * machine.size, PLATFORM_MASS)
    bodies.append(Body("platform", BASE, place, "free", plate))
    ends = np.array([0, 0, 1]) * lengths[:, None]
    loops = [(f"{name}_rod", *points) for name, *points in zip(LEGS, ends, joints, strict=True)]
    base = _sides(machine.base, LEG_RADIUS * machine.size, PLATFORM_MASS)
    return Mechanism(machine, base, bodies, loops, travel)


def facts(platform: Platform) -> str:
    """Where a model comes from, and its unit of length."""
    unit = (
        f"metres (the platform's file: {platform.unit})" if platform.unit in LENGTHS else "as given"
    )
    return f"from a platform with digest {platform.digest}. Lengths: {unit}."


def inertia(bars: list[Bar]) -> tuple[float, Array, Array]:
    """Mass, centre of mass (3,) and inertia (3, 3) about it of a body, its bars solid cylinders."""
    mass = sum(bar.mass for bar in bars)
    centre = sum((bar.mass * (bar.start + bar.end) / 2 for bar in bars), np.zeros(3)) / mass
    tensor = np.zeros((3, 3))
    for bar in bars:
        way, away = bar.end - bar.start, (bar.start + bar.end) / 2 - centre
        square, radius = way @ way, bar.radius**2
        along = np.outer(way, way) / square
        tensor += bar.mass * (radius / 2 * along + (radius / 4 + square / 12) * (np.eye(3) - along))
        tensor += bar.mass * (away @ away * np.eye(3) - np.outer(away, away))
    return mass, centre, tensor


def along(vector: Array) -> Pose:
    """Rotation whose z axis is along a vector (3,), by the least angle."""
    x, y, z = vector / np.linalg.norm(vector)
    upside_down = 1 + z < 1e-12
    return Pose(np.zeros(3), [0.0, 1, 0, 0] if upside_down else [1 + z, -y, x, 0])


def _leg(machine: Platform, leg: int, rod: Array, length: float, travel: Array) -> list[Body]:
    """Bodies of one leg."""
    name, radius = LEGS[leg], LEG_RADIUS * machine.size
    bar = [_bar([0, 0, length], radius)]
    if machine.rotary is None:
        place = Pose(machine.base[leg], along(rod).wxyz)
        cylinder = [_bar([0, 0, 0.5 * length], 1.6 * radius)]
        return [
            Body(f"{name}_cylinder", BASE, place, "universal", cylinder),
            Body(f"{name}_rod", f"{name}_cylinder", Pose.identity(), "slide", bar, leg),
        ]
    arms, tip = machine.rotary, np.array([machine.rotary.arm_length[leg], 0, 0])
    pointing, across = (d[leg] for d in arm_directions(arms, travel + machine.true_at_zero))
    axes = np.stack([pointing, across, np.cross(pointing, across)])
    place = Pose(machine.base[leg], quaternion.from_matrix(axes.T))
    return [
        Body(f"{name}_arm", BASE, place, "hinge", [_bar(tip, radius)], leg),
        Body(f"{name}_rod", f"{name}_arm", Pose(tip, along(axes @ rod).wxyz), "universal", bar),
    ]


def _bar(end: list | Array, radius: float) -> Bar:
    return Bar(np.zeros(3), np.asarray(end, float), radius, PART_MASS)


def _sides(joints: Array, radius: float, mass: float) -> list[Bar]:
    """Sides of the hexagon through six joints, without those of length 0."""
    pairs = zip(joints, np.roll(joints, -1, axis=0), strict=True)
    sides = [(a, b) for a, b in pairs if np.any(a != b)]
    return [Bar(a, b, radius, mass / len(sides)) for a, b in sides]

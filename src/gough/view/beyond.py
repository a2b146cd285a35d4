"""Limits that a pose exceeds, leg by leg, and the sentence that names them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.limit_geometry import (
    PAIRS,
    joint_angles,
    least_gaps,
    leg_gaps,
    payload_forces,
    shared_joints,
)
from gough.limit_rules import SLACK, in_workspace
from gough.machine_limits import MachineLimits
from gough.platform import Platform
from gough.pose import Pose
from gough.skeleton import outside_stroke

Legs = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Beyond:
    """Limits that one pose exceeds, up to the slack of `gough.limit_rules`.

    Attributes:
        stroke, base_joint, moving_joint, near, force: (6,) legs outside their stroke, beyond the
            cone of a joint, too near another leg, or under too much force.
        outside: True outside the stated workspace.
        text: a sentence that names them, or the limits that the pose keeps.
    """

    stroke: Legs
    base_joint: Legs
    moving_joint: Legs
    near: Legs
    force: Legs
    outside: bool
    text: str

    @property
    def legs(self) -> Legs:
        """(6,) legs that exceed any of their limits."""
        return self.stroke | self.base_joint | self.moving_joint | self.near | self.force

    @property
    def ok(self) -> bool:
        """True if the pose keeps every limit."""
        return not (self.outside or self.legs.any())

    def label(self, leg: int) -> str:
        """What a leg exceeds, in two words; "" if nothing."""
        kinds = (
            ("outside stroke", self.stroke), ("too near", self.near),
            ("joint bent", self.base_joint | self.moving_joint), ("force", self.force),
        )  # fmt: skip
        return ", ".join(name for name, which in kinds if which[leg])


def leg_factor(platform: Platform) -> float:
    """Factor from readings to the numbers on the page, where motor angles are in degrees."""
    return 180 / np.pi if platform.legs == "rotary" else 1.0


def leg_unit(platform: Platform) -> str:
    """Unit of the readings on the page."""
    return "deg" if platform.legs == "rotary" else platform.unit


def beyond_limits(platform: Platform, pose: Pose, legs: Array) -> Beyond:
    """Compare one pose and its readings (6,) with every limit that the machine states."""
    limits = platform.limits or MachineLimits()
    stroke = outside_stroke(platform, legs)
    parts: list[str] = []
    cones = (limits.base_joint_cone, limits.moving_joint_cone)
    base = moving = near = force = np.zeros(6, bool)
    if limits.leg_radius is not None:
        near, parts = _near(platform, limits, pose)
    parts += _stroke(platform, legs, stroke)
    if any(cone is not None for cone in cones):
        angles = joint_angles(platform, pose)
        base, moving = (_above(a, c) for a, c in zip(angles, cones, strict=True))
        parts += _bent("base", angles[0], cones[0], base)
        parts += _bent("platform", angles[1], cones[1], moving)
    if limits.leg_force is not None:
        forces, (low, high) = payload_forces(platform, pose), limits.leg_force.T
        slack = SLACK * np.max(np.abs(limits.leg_force))
        force = ~((forces >= low - slack) & (forces <= high + slack))
        parts += _beyond_force(forces, force)
    outside = not in_workspace(platform, pose)
    if outside:
        parts.append("outside the stated workspace")
    text = f"Shown beyond its limits: {'; '.join(parts)}." if parts else _kept(platform, limits)
    return Beyond(stroke, base, moving, near, force, outside, text)


def _kept(platform: Platform, limits: MachineLimits) -> str:
    """Sentence of a pose within all limits."""
    cones = limits.base_joint_cone is not None or limits.moving_joint_cone is not None
    stated = {
        "stroke": platform.stroke is not None, "workspace": platform.workspace is not None,
        "joint cones": cones, "clearance": limits.leg_radius is not None,
        "leg forces": limits.leg_force is not None,
    }  # fmt: skip
    names = [name for name, is_stated in stated.items() if is_stated]
    if not names:
        return "The platform states no limits."
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    return f"Within {listed}."


def _stroke(platform: Platform, legs: Array, outside: Legs) -> list[str]:
    """Legs below and above their stroke, with the largest distance to its end."""
    if platform.stroke is None:
        return []
    what, parts = "motor" if platform.legs == "rotary" else "leg", []
    low, high = platform.stroke.T
    for side, miss in (("below", low - legs), ("above", legs - high)):
        which = np.flatnonzero(outside & (miss > 0))
        if len(which):
            most = f"{leg_factor(platform) * miss[which].max():.3g} {leg_unit(platform)}".rstrip()
            limit = "its" if len(which) == 1 else "their"
            most = "up to " * (len(which) > 1) + most
            parts.append(f"{_names(which, what)} {side} {limit} stroke by {most}")
    return parts


def _above(angles: Array, cone: Array | None) -> Legs:
    if cone is None:
        return np.zeros(6, bool)
    return angles > np.radians(cone) + SLACK  # False where there is no angle


def _bent(name: str, angles: Array, cone: Array | None, beyond: Legs) -> list[str]:
    which = np.flatnonzero(beyond)
    if cone is None or not len(which):
        return []
    most = np.max(np.degrees(angles[which]) - cone[which])
    joints = f"{name} joint{'s' * (len(which) > 1)} of {_names(which, 'leg')}"
    return [f"{joints} beyond {'their' if len(which) > 1 else 'its'} cone by {most:.3g} deg"]


def _near(platform: Platform, limits: MachineLimits, pose: Pose) -> tuple[Legs, list[str]]:
    """Legs that touch or miss their clearance, pair by pair."""
    gaps, least = leg_gaps(platform, pose), least_gaps(limits)
    close = (gaps < least - SLACK * platform.size) & ~shared_joints(platform)
    legs, parts = np.zeros(6, bool), []
    for pair in np.flatnonzero(close):
        a, b = PAIRS[pair]
        legs[[a, b]] = True
        gap = gaps[pair] - least[pair] + limits.clearance
        far = f"{gap:.3g} {platform.unit}".rstrip()
        said = "touch" if gap <= 0 else f"are {far} apart, less than the clearance"
        parts.append(f"legs {a + 1} and {b + 1} {said}")
    return legs, parts


def _beyond_force(forces: Array, beyond: Legs) -> list[str]:
    which = np.flatnonzero(beyond)
    if not len(which):
        return []
    if not np.all(np.isfinite(forces)):
        return ["no leg forces hold the payload here"]
    worst = which[np.argmax(np.abs(forces[which]))]
    return [f"{_names(which, 'leg')} beyond the leg force ({forces[worst]:.4g} in leg {worst + 1})"]


def _names(which: NDArray[np.intp], what: str) -> str:
    return f"{what}{'s' * (len(which) > 1)} {', '.join(str(i + 1) for i in which)}"

"""Six legs among bodies and joints, and the platform that they make."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.importers.bodies import WORLD, Joint, Model
from gough.platform import Platform
from gough.pose import Pose
from gough.rotary import RotaryArms

EXACT = 1e-6  # share of the leg's length up to which axes count as meeting, and slides as along it
CLOSE = 1e-3  # up to which the nearest point is taken, with a note
Chain = list[tuple[Joint, bool]]  # from base to platform; True where the child is farther along


@dataclass(frozen=True, eq=False)
class Leg:
    """One leg at home, in world coordinates.

    Attributes:
        drive: its slide or motor.
        onward: True where the drive's child is farther from the base.
        lower, upper: (3,) centres of its two joints; of rotary legs the arm's tip and the
            platform joint.
        axes: how many axes its joints have, the drive's included.
        gap: by how much axes that should meet miss each other, as a share of its length.
    """

    drive: Joint
    onward: bool
    lower: Array
    upper: Array
    axes: int
    gap: float


def find_platform(model: Model) -> tuple[Platform, list[str]]:
    """The platform of a model with six legs, and what was assumed, a sentence each.

    Raises:
        GoughError: the model is no hexapod; the text says why.
    """
    group = _groups(model)
    base, moving, chains = _base_and_platform(model, group)
    legs = [_leg(chain) for chain in chains]
    index = {joint.name: k for k, joint in enumerate(model.joints)}
    ranked = all(leg.drive.rank is not None for leg in legs)
    legs.sort(key=lambda leg: leg.drive.rank if ranked else index[leg.drive.name])  # pyright: ignore
    base_pose = Pose.identity() if base == group.get(WORLD) else model.bodies[base]
    notes = [
        *model.notes,
        f"Base: {base}. Platform: {moving}, whose frame the platform's coordinates are those of.",
        "Legs 1 to 6: " + ", ".join(leg.drive.name for leg in legs) + ".",
        *_leg_notes(legs),
    ]
    inverse, place = base_pose.inverse(), inverse_of(base_pose) @ model.bodies[moving]
    lower, upper = (inverse.apply(np.stack(points)) for points in zip(*((leg.lower, leg.upper)
                    for leg in legs), strict=True))  # fmt: skip
    shift = np.zeros(3) if model.pivot is None else model.pivot
    parts = {
        "moving": place.inverse().apply(upper) + shift,
        "home": Pose(place.position - shift, place.wxyz),
        "pivot": model.pivot,
        "name": model.name,
        "unit": "m",
    }
    if legs[0].drive.kind == "slide":
        return _telescopic(legs, lower, upper, parts, notes), notes
    return _rotary(legs, lower, upper, inverse, parts, notes), notes


def inverse_of(pose: Pose) -> Pose:
    """The inverse, the identity exactly for itself."""
    return pose.inverse() if np.any(pose.matrix != np.eye(4)) else pose


# ---- bodies ---------------------------------------------------------------------------


def _groups(model: Model) -> dict[str, str]:
    """The first body of those that fixed joints make one, by the name of each."""
    first = {name: name for name in model.bodies}

    def root(name: str) -> str:
        while first[name] != name:
            name = first[name]
        return name

    order = list(model.bodies)
    for joint in model.joints:
        if joint.kind == "fixed":
            a, b = root(joint.parent), root(joint.child)
            first[max(a, b, key=order.index)] = min(a, b, key=order.index)
    return {name: root(name) for name in model.bodies}


def _base_and_platform(model: Model, group: dict[str, str]) -> tuple[str, str, list[Chain]]:
    """Names of two bodies that exactly six chains of others join, and the chains."""
    joints = [j for j in model.joints if group[j.parent] != group[j.child]]
    count = dict.fromkeys(group.values(), 0)
    for joint in joints:
        count[group[joint.parent]] += 1
        count[group[joint.child]] += 1
    busy = [name for name, number in count.items() if number >= 6]
    if WORLD in group and group[WORLD] in busy:  # what rests is the base
        busy.sort(key=lambda name: name != group[WORLD])
    most, found = 0, []
    for base, moving in combinations(busy, 2):
        chains = _chains(joints, group, base, moving)
        most = max(most, len(chains))
        if len(chains) == 6:
            found.append((base, moving, chains))
    if len(found) > 1:
        names = "; ".join(f"{base} and {moving}" for base, moving, _ in found)
        raise GoughError(f"several pairs of bodies are joined by six legs: {names}")
    if not found:
        closest = f"; the most are {most}" if most else ""
        raise GoughError(
            "no two bodies are joined by six legs, each a chain of joints of its own, or a tendon "
            f"between two sites{closest}"
        )
    return found[0]


def _chains(joints: list[Joint], group: dict[str, str], base: str, moving: str) -> list[Chain]:
    """The chains of joints through other bodies from one to another."""
    near: dict[str, list[Joint]] = {}
    for joint in joints:
        for body in (group[joint.parent], group[joint.child]):
            near.setdefault(body, []).append(joint)
    chains, seen = [], set()
    for start in near.get(base, []):
        chain: Chain = []
        body, joint = base, start
        while True:
            onward = group[joint.parent] == body
            body = group[joint.child if onward else joint.parent]
            chain.append((joint, onward))
            if body in (base, moving):
                break
            others = [j for j in near[body] if j is not joint]
            if body in seen or len(others) != 1:  # an end, or a branch
                break
            seen.add(body)
            joint = others[0]
        if body == moving:
            chains.append(chain)
    return chains


# ---- legs -----------------------------------------------------------------------------


def _leg(chain: Chain) -> Leg:
    joints = [joint for joint, _ in chain]
    slides = [k for k, joint in enumerate(joints) if joint.kind == "slide"]
    names = ", ".join(joint.name for joint in joints)
    if len(slides) > 1:
        raise GoughError(f"the leg with the joints {names} has several slides; expected one")
    if slides:
        at = slides[0]
        if at == 0 or at == len(joints) - 1:
            where = "base" if at == 0 else "platform"
            raise GoughError(
                f"the slide {joints[at].name} is fixed to the {where}; expected one between two "
                "joints, as in a telescopic leg"
            )
        lower, upper = _centre(joints[:at], names), _centre(joints[at + 1 :], names)
    else:
        at = 0
        if joints[0].kind != "hinge":
            raise GoughError(
                f"the leg with the joints {names} has neither a slide nor a hinge at the base"
            )
        splits = [
            (_centre(joints[1:k], names, strict=False), _centre(joints[k:], names, strict=False))
            for k in range(2, len(joints))
        ]
        if not splits:
            raise GoughError(f"the leg with the joints {names} has no rod between two joints")
        lower, upper = min(splits, key=lambda pair: pair[0][1] + pair[1][1])
    length = float(np.linalg.norm(upper[0] - lower[0]))
    gap = max(lower[1], upper[1]) / length if length > 0 else np.inf
    if not gap <= CLOSE:
        raise GoughError(
            f"the axes of a joint of the leg with the joints {names} miss each other by "
            f"{gap:.2g} of the leg's length; gough's joints turn about points"
        )
    axes = sum({"ball": 3, "universal": 2}.get(joint.kind, 1) for joint in joints)
    leg = Leg(*chain[at], lower[0], upper[0], axes, gap)
    if slides:
        off = np.linalg.norm(np.cross(leg.drive.axes[0], leg.upper - leg.lower)) / length
        if off > CLOSE:
            raise GoughError(
                f"the slide {leg.drive.name} points {np.degrees(np.arcsin(off)):.2g} deg away "
                "from the line through the leg's joints; expected it along the leg"
            )
    return leg


def _centre(joints: list[Joint], names: str, strict: bool = True) -> tuple[Array, float]:
    """The point that joints turn about, and by how much their axes miss it.

    Args:
        strict: refuse joints that have no such point; else their gap is infinite.
    """
    points = np.array([j.point for j in joints if j.kind in ("ball", "universal")])
    hinges = [j for j in joints if j.kind == "hinge"]
    across = [np.eye(3) - np.outer(j.axes[0], j.axes[0]) for j in hinges]
    if len(points):
        centre = points.mean(axis=0)
    else:
        total = sum(across, np.zeros((3, 3)))
        if len(hinges) < 2 or np.linalg.cond(total) > 1e6:
            if strict:
                raise GoughError(
                    f"in the leg with the joints {names}, {', '.join(j.name for j in joints)} "
                    "turns about one direction only; expected a ball or universal joint"
                )
            return np.zeros(3), np.inf
        # from the first hinge's point, so that a common point comes out to the last digit
        start = hinges[0].point
        ways = (m @ (j.point - start) for m, j in zip(across, hinges, strict=True))
        centre = start + np.linalg.solve(total, sum(ways, np.zeros(3)))
    misses = [np.linalg.norm(p - centre) for p in points]
    misses += [np.linalg.norm(m @ (j.point - centre)) for m, j in zip(across, hinges, strict=True)]
    return centre, float(max(misses))


def _leg_notes(legs: list[Leg]) -> Iterable[str]:
    worst = max(leg.gap for leg in legs)
    if worst > EXACT:
        yield (
            f"Axes of a joint miss each other by up to {worst:.2g} of a leg's length; the point "
            "nearest to them is taken."
        )
    least = min(leg.axes for leg in legs)
    if least < 6:
        yield (
            f"Joints and drive of a leg have {least} axes; six are needed to move freely, so the "
            "leg is taken to turn freely about itself."
        )
    if any(leg.drive.rank is None for leg in legs):
        yield "The file names no drives; slides, or the hinges at the base, are taken for them."


# ---- platforms ------------------------------------------------------------------------


def _telescopic(
    legs: list[Leg], lower: Array, upper: Array, parts: dict, notes: list[str]
) -> Platform:
    lengths = np.linalg.norm(upper - lower, axis=-1)
    signs = np.array([np.sign(leg.drive.axes[0] @ (leg.upper - leg.lower)) * (1 if leg.onward
                      else -1) for leg in legs])  # fmt: skip
    gain = signs * [leg.drive.gain for leg in legs]
    zero = lengths - signs * [leg.drive.position for leg in legs]  # length at a reading of 0
    near = 1e-9 * lengths.max()
    counted = np.all(np.abs(zero - lengths) <= near)
    kind = "length_change" if counted else "telescopic"
    offset = zero - lengths if counted else zero
    meaning = "lengths minus those at home" if counted else "lengths"
    notes.append(f"Readings: {meaning}, as the positions of the slides are at home.")
    offset = np.where(np.abs(offset) <= near * 1e-3, 0.0, offset)
    machine = Platform(lower, legs=kind, offset=offset, gain=gain, **parts)
    return _with_stroke(machine, legs, notes)


def _rotary(
    legs: list[Leg], tips: Array, upper: Array, inverse: Pose, parts: dict, notes: list[str]
) -> Platform:
    turned = Pose(np.zeros(3), inverse.wxyz)
    normals = turned.apply(np.stack([leg.drive.axes[0] for leg in legs]))
    normals *= np.array([1.0 if leg.onward else -1.0 for leg in legs])[:, None]
    points = inverse.apply(np.stack([leg.drive.point for leg in legs]))
    along = np.sum((tips - points) * normals, axis=-1, keepdims=True)
    centres = points + along * normals  # where the arms' planes meet their axes
    arms, position = tips - centres, np.array([leg.drive.position for leg in legs])
    arm_length = np.linalg.norm(arms, axis=-1)
    if np.any(arm_length <= EXACT * np.linalg.norm(upper - tips, axis=-1)):
        raise GoughError("the lower joint of a rod is on its motor's axis: the arm has no length")
    ahead = arms / arm_length[:, None]
    left = np.cross(normals, ahead)
    cos, sin = np.cos(position)[:, None], np.sin(position)[:, None]
    x, y = cos * ahead - sin * left, sin * ahead + cos * left
    d = upper - centres
    way = position - np.arctan2(np.sum(d * y, axis=-1), np.sum(d * x, axis=-1))
    branch = np.where(np.sin(way) < 0, -1.0, 1.0)
    rods = np.linalg.norm(upper - tips, axis=-1)
    gain = np.array([leg.drive.gain for leg in legs])
    notes.append("Readings: positions of the hinges [rad].")
    rotary = RotaryArms(arm_length, rods, x, y, branch)
    machine = Platform(centres, legs="rotary", rotary=rotary, gain=gain, **parts)
    return _with_stroke(machine, legs, notes)


def _with_stroke(machine: Platform, legs: list[Leg], notes: list[str]) -> Platform:
    """The machine with the limits of its drives, if they have some."""
    limits = np.array([leg.drive.limits for leg in legs])
    if not np.all(np.isfinite(limits)):
        notes.append("Stroke: none, because not all drives have limits.")
        return machine
    slack = 1e-9 * np.abs(np.ptp(limits, axis=1))  # home may be at an end
    home = machine.home_legs
    low, high = limits.T
    low = np.where(np.abs(low - home) <= slack, np.minimum(low, home), low)
    high = np.where(np.abs(high - home) <= slack, np.maximum(high, home), high)
    return replace(machine, stroke=np.stack([low, high], axis=-1))

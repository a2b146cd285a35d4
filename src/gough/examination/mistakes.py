"""Likely mistakes in a machine's file, each with its evidence."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gough import struts
from gough.checks import Array
from gough.errors import GoughError
from gough.kinematics import home_sign, joint_positions
from gough.limit_rules import legs_in_stroke
from gough.platform import Platform
from gough.platform_file import ANGLE_UNITS, from_dict
from gough.pose import Pose
from gough.units import LENGTHS

PLAUSIBLE = (0.01, 50.0)  # sizes of machines [m]
USUAL = 10.0  # [m] most machines are smaller
EQUAL = 0.02  # relative spread of the legs at home up to which they are meant to be equal
BETTER = 0.05  # share of a spread that another numbering must leave, to be suggested
CLOSE = 0.05  # distance to a singularity below which a remark is made
TURN_SPREAD = 0.5  # of the motors' axes from the vertical, up to which their sense is compared


@dataclass(frozen=True)
class Remark:
    """A sentence about a machine's file or a log.

    Attributes:
        mistake: True for what is probably wrong, False for what is good to know.
        text: what was found, the evidence, and what to do.
    """

    mistake: bool
    text: str


def mistake(text: str) -> Remark:
    """A remark on what is probably wrong."""
    return Remark(True, text)


def note(text: str) -> Remark:
    """A remark that is good to know."""
    return Remark(False, text)


def remarks_on(platform: Platform, legs: Array, nearest: float) -> list[Remark]:
    """Remarks on a machine.

    Args:
        legs: readings (N, 6) of poses of its workspace, NaN where a motor cannot reach.
        nearest: signed distance to a singularity of the most singular pose in it.
    """
    return [
        *_unit(platform), *_senses(platform), *_numbering(platform), *_stroke(platform, legs),
        *_singular(platform, nearest), *_motors(platform, legs),
    ]  # fmt: skip


Found = Iterator[Remark]


def _unit(platform: Platform) -> Found:
    if platform.unit not in LENGTHS:
        named = f"is {platform.unit!r}" if platform.unit else "is not stated"
        yield note(
            f"The unit {named}: logs in another unit cannot be converted. Known units are m, "
            "mm, cm, um, in, ft."
        )
        return
    metres = platform.size * LENGTHS[platform.unit]
    if PLAUSIBLE[0] <= metres <= PLAUSIBLE[1]:
        return
    sizes = {unit: platform.size * LENGTHS[unit] for unit in ("mm", "in", "cm", "m")}
    better = [unit for unit, size in sizes.items() if PLAUSIBLE[0] <= size <= USUAL]
    hint = f"; in {better[0]} it would be {sizes[better[0]]:.3g} m" if better else ""
    yield mistake(
        f"The machine would be {metres:.3g} m large: its farthest joints are {platform.size:.4g} "
        f"{platform.unit} apart. Is the unit right{hint}?"
    )


def _senses(platform: Platform) -> Found:
    """Plates whose joints are counted in opposite directions."""
    plates = platform.base, joint_positions(platform, platform.home)
    senses = [_sense(points) for points in plates]
    if senses[0] * senses[1] < 0:
        words = ["counter-clockwise" if sense > 0 else "clockwise" for sense in senses]
        yield mistake(
            f"Seen from above, joints 1 to 6 go {words[0]} on the base and {words[1]} on the "
            "platform: one of them was drawn from below, or its frame is left-handed. Change the "
            "sign of its y, or renumber it."
        )


def _sense(points: Array) -> int:
    """Turns of points about their centre, seen from +z: +1 counter-clockwise, -1 clockwise."""
    x, y = (points - points.mean(axis=0))[:, :2].T
    angles = np.arctan2(y, x)
    steps = np.diff(np.append(angles, angles[0]))
    return round(float(np.sum(np.arctan2(np.sin(steps), np.cos(steps))) / (2 * np.pi)))


def _numbering(platform: Platform) -> Found:
    """Plates that are numbered from different joints: then the legs at home differ."""
    lengths = platform.home_lengths
    spread = float(np.ptp(lengths) / lengths.mean())
    if platform.rotary is not None or spread < 1e-6:
        return
    orders = {f"from P{k + 1} on": np.roll(np.arange(6), -k) for k in range(1, 6)}
    found = {way: _home_lengths(platform, order) for way, order in orders.items()}
    way, best = min(found.items(), key=lambda item: np.ptp(item[1]))
    if np.ptp(best) / best.mean() <= min(BETTER * spread, EQUAL):
        yield mistake(
            f"The legs differ at home, {shown_range(lengths)}; the platform's joints counted {way} "
            f"make them {shown_range(best)}. Row i of base and of moving must be the two ends of "
            "leg i: are the plates numbered from different joints?"
        )


def shown_range(values: Array) -> str:
    """Lowest and highest of values, or the value that all have."""
    low, high = (f"{value:.5g}" for value in (np.min(values), np.max(values)))
    return low if low == high else f"{low} to {high}"


def _home_lengths(platform: Platform, order: NDArray[np.intp]) -> Array:
    home = platform.home
    pivot = platform.pivot_point
    joints = struts.joints(platform.moving[order], pivot, home.position, home.rotation)
    return np.linalg.norm(joints - platform.base, axis=-1)


def _stroke(platform: Platform, legs: Array) -> Found:
    stroke = platform.stroke
    if stroke is None:
        yield note("No stroke is stated: readings that no leg can have are not noticed.")
        return
    place = (platform.home_legs - stroke[:, 0]) / (stroke[:, 1] - stroke[:, 0])
    if np.all(np.isfinite(place)) and abs(place.mean() - 0.5) > 0.4:
        end = "lower" if place.mean() < 0.5 else "upper"
        yield note(
            f"At home the legs are at the {end} end of their stroke ({100 * place.mean():.0f} % of "
            "it)."
        )
    if platform.workspace is None:
        return
    inside = legs_in_stroke(platform, legs)
    share, worst = float(np.mean(np.all(inside, axis=-1))), int(np.argmin(inside.mean(axis=0)))
    if share < 0.5:
        yield mistake(
            f"The legs reach {100 * share:.0f} % of the workspace only, most often for leg "
            f"{worst + 1}. Is the workspace in the unit of the joints, and its angles in degrees?"
        )


def _singular(platform: Platform, nearest: float) -> Found:
    if not home_sign(platform):
        yield mistake(
            "The home pose is singular: the legs do not hold the platform there. Plates of one "
            "shape, or joints turned by a right angle, do this: check the angles, or choose "
            "another home."
        )
    elif nearest < 0:
        yield mistake(
            "A singularity crosses the workspace; beyond it lies another assembly mode. State a "
            "smaller workspace if the machine does not go there; else check the joints."
        )
    elif nearest < CLOSE:
        yield note(
            f"The workspace comes close to a singularity (distance {nearest:.2g}): there small "
            "errors of readings become large errors of poses."
        )


def _motors(platform: Platform, legs: Array) -> Found:
    arms = platform.rotary
    if arms is None:
        return
    lost = np.isnan(legs)
    share, worst = float(np.mean(np.any(lost, axis=-1))), int(np.argmax(lost.mean(axis=0)))
    if platform.workspace is not None and share > 0:
        yield Remark(
            share > 0.2,
            f"In {100 * share:.1f} % of the workspace an arm with its rod cannot reach, most often "
            f"that of motor {worst + 1}: check arm_length and rod_length, or the workspace.",
        )
    up = np.cross(arms.axis_x, arms.axis_y)[:, 2]
    if np.abs(up).min() > TURN_SPREAD and np.ptp(np.sign(up)) > 0:
        yield mistake(
            "Seen from above, some motors turn counter-clockwise and others clockwise: check "
            "axis_x and axis_y."
        )


# ---- files that are refused -----------------------------------------------------------

Change = tuple[str, Callable[[], Platform], Array]


def cures(text: str) -> list[str]:
    """Changes of a file whose stroke forbids home that allow it, a sentence each.

    Args:
        text: the file's TOML.
    """
    facts = tomllib.loads(text)
    stroke = facts.pop("stroke", None)
    try:
        platform = from_dict(facts)
        factor = ANGLE_UNITS[facts.get("angle_unit", "rad")] if platform.rotary else 1.0
        limits = factor * np.broadcast_to(np.asarray(stroke, dtype=float), (6, 2))
    except (GoughError, ValueError, TypeError):
        return []
    found = []
    for words, change, pairs in _changes(platform, limits):
        try:
            changed = replace(change(), stroke=pairs)
        except GoughError:
            continue
        ends = shown_range(pairs)
        found.append(f"{words}: legs at home {shown_range(changed.home_legs)}, stroke {ends}.")
    return found


def _changes(platform: Platform, limits: Array) -> Iterator[Change]:
    def joints(plane: float = 1.0, order: NDArray[np.intp] | None = None, mirror: float = 1.0):
        scale = np.array([plane, plane, 1.0])
        moving = platform.moving if order is None else platform.moving[order]
        moving = moving * scale * np.array([1.0, mirror, 1.0])
        return lambda: replace(platform, base=platform.base * scale, moving=moving)

    same = joints()
    if platform.rotary is not None:
        yield 'with angle_unit = "deg"', same, np.radians(limits)
        return
    yield "with half of all x and y (diameters for radii?)", joints(0.5), limits
    yield "with twice all x and y (radii for diameters?)", joints(2.0), limits
    for k in range(1, 6):
        order = np.roll(np.arange(6), -k)
        yield f"with the platform's joints counted from P{k + 1} on", joints(order=order), limits
    yield "with the platform's y negative (a left-handed frame?)", joints(mirror=-1.0), limits
    for units, factor in (("mm for m", 1e-3), ("m for mm", 1e3), ("mm for in", 1 / 25.4),
                          ("in for mm", 25.4)):  # fmt: skip
        yield f"with the stroke times {factor:.4g} ({units}?)", same, factor * limits
    if platform.legs == "telescopic":
        yield 'with legs = "length_change"', lambda: replace(platform, legs="length_change"), limits
    home = platform.home
    half = Pose(home.position * [1.0, 1.0, 0.5], home.wxyz)
    yield "with half the height of home", lambda: replace(platform, home=half), limits

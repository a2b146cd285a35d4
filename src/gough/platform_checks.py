"""Checks of a platform's fields, and of the fields against each other."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from gough.checks import Array, frozen, platform_field, platform_numbers
from gough.errors import CONTROL, PlatformError
from gough.frames import Frames
from gough.machine_limits import MachineLimits
from gough.rotary import RotaryArms
from gough.screws import Screws
from gough.workspace import Workspace

if TYPE_CHECKING:
    from gough.platform import Platform

LegKind = Literal["telescopic", "length_change", "rotary"]
COINCIDENT = 1e-9  # joints closer than this share of the platform's size are one point
FARTHEST = 1e7  # [platform size] from the origin, beyond which coordinates have too few digits


def check_text(**fields: object) -> None:
    """Raise unless all values are text that can be printed in a terminal."""
    for name, text in fields.items():
        if not isinstance(text, str):
            raise PlatformError(f"{name}: expected text, found {text!r}")
        if CONTROL.search(text):
            raise PlatformError(f"{name}: holds control characters: {text!r}")


def check_parts(
    legs: str, workspace: object, rotary: object, screw: object, frames: object, limits: object
) -> None:
    """Raise unless the kind of leg is known and the parts are what it needs."""
    if legs not in get_args(LegKind):
        kinds = ", ".join(get_args(LegKind))
        raise PlatformError(f"legs: expected one of {kinds}; found {legs!r}")
    parts = (("rotary", RotaryArms, rotary), ("workspace", Workspace, workspace))
    parts = (*parts, ("screw", Screws, screw), ("frames", Frames, frames))
    parts = (*parts, ("limits", MachineLimits, limits))
    for name, kind, part in parts:
        if part is not None and not isinstance(part, kind):
            raise PlatformError(f"{name}: expected a {kind.__name__}, found {part!r}")
    if (legs == "rotary") != (rotary is not None):
        need = "needs" if legs == "rotary" else "must not have"
        raise PlatformError(f"rotary: a platform with {legs} legs {need} this table")
    if rotary is not None and screw is not None:
        raise PlatformError("screw: a platform with rotary legs must not have this table")


def refuse_screws(platform: Platform) -> None:
    """Raise PlatformError if the screws of a platform's legs turn with them."""
    if platform.screw is not None:
        raise PlatformError(
            "screw: only readings, Solver, solve, Tracker, jacobian and what follows from it know "
            "legs whose screws turn with them; leave the table [screw] out to neglect the turning"
        )


def nonzero(name: str, value: Array) -> Array:
    """Return `value` (6,) if no number in it is 0."""
    if np.any(value == 0):
        leg = int(np.argmin(np.abs(value)))
        raise PlatformError(f"{name}[{leg}]: expected a number other than 0, found 0.0")
    return value


def joints(name: str, value: ArrayLike) -> Array:
    """Return joints as a read-only array (6, 3)."""
    array = platform_numbers(name, value)
    if array.ndim == 2 and array.shape[1] == 3 and len(array) != 6:
        raise PlatformError(f"{name}: expected 6 joints, one for each leg, found {len(array)}")
    return platform_field(name, value, (6, 3))


def check_near_origin(size: float, **points: Array) -> None:
    """Raise if points are so far from the origin that rounding is felt at the platform's size."""
    for name, value in points.items():
        away = float(np.abs(value).max())
        if away > FARTHEST * size:
            raise PlatformError(
                f"{name}: {away:.3g} is {away / size:.1g} times the machine's size {size:.3g}, "
                "which leaves too few digits; state coordinates from an origin near the machine"
            )


def check_joints(base: Array, moving: Array, at_home: Array, size: float, struts: bool) -> None:
    """Raise unless the joints make six different legs of a platform that can be held.

    Args:
        base, moving: joints (6, 3) in their own coordinates [platform unit].
        at_home: platform joints (6, 3) in base coordinates at home.
        size: of the platform.
        struts: True for legs that run from `base` to `at_home`, False for rotary ones.
    """
    for i, j in combinations(range(6), 2):
        gaps = [np.linalg.norm(p[i] - p[j]) for p in (base, moving)]
        if max(gaps) <= COINCIDENT * size:
            raise PlatformError(
                f"base[{i}], base[{j}] and moving[{i}], moving[{j}]: legs {i + 1} and {j + 1} "
                "share both joints, so they are one leg; expected six different legs"
            )
    for name, points in (("base", base), ("moving", moving)):
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if spread[1] <= COINCIDENT * size:
            raise PlatformError(
                f"{name}: all six joints lie on one line, about which the platform would turn "
                "freely; expected joints that span a plane"
            )
    lengths = np.linalg.norm(at_home - base, axis=1)
    if struts and lengths.min() <= COINCIDENT * size:
        i = int(np.argmin(lengths))
        raise PlatformError(
            f"home: leg {i + 1} has length 0 there: base[{i}] and moving[{i}] are at the same "
            f"point {base[i].tolist()}"
        )


def stroke_limits(stroke: ArrayLike | None, legs: LegKind, home_legs: Array) -> Array | None:
    """Return a stroke as (6, 2), if each lowest is below its highest and home between them.

    Args:
        stroke: one pair of readings, six, or None.
        home_legs: readings (6,) at home, which must be finite.
    """
    if not np.all(np.isfinite(home_legs)):
        leg = int(np.argmin(np.isfinite(home_legs)))
        raise PlatformError(
            f"home: the arm and rod of leg {leg + 1} cannot reach the home pose; check home, "
            "rotary.arm_length and rotary.rod_length"
        )
    if stroke is None:
        return None
    limits = platform_numbers("stroke", stroke)
    if limits.shape not in ((2,), (6, 2)):
        raise PlatformError(
            f"stroke: expected [lowest, highest] or six such pairs, got shape {limits.shape}"
        )
    turns = np.isfinite(limits) & (np.abs(limits) > 2 * np.pi)
    if legs == "rotary" and np.any(turns):
        found = limits[turns].flat[0]
        raise PlatformError(
            f"stroke: motor angles are in rad, and {found:g} is more than a turn; if it is "
            f"degrees, write {np.radians(found):.6g}, or angle_unit = 'deg' in the file"
        )
    readings = "motor angles" if legs == "rotary" else "leg readings"
    limits = frozen(np.broadcast_to(limits, (6, 2)) + 0.0)
    for i, ((low, high), home) in enumerate(zip(limits, home_legs, strict=True)):
        if not low < high:
            raise PlatformError(
                f"stroke[{i}]: expected lowest below highest, found [{low}, {high}]"
            )
        if not low <= home <= high:
            raise PlatformError(
                f"stroke[{i}]: forbids the home pose: {readings} at home are {home:.6g}, "
                f"allowed are {low:.6g} to {high:.6g}; change home or stroke"
            )
    return limits

"""What a figure of the workspace may show by colour, and the limits that end it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gough.checks import Array
from gough.errors import GoughError, suggestion
from gough.kinematics import platform_pose, pose_covariance, singularity_distance
from gough.limit_geometry import payload_forces
from gough.margins import limits
from gough.platform import Platform
from gough.plot.style import length_unit
from gough.pose import Pose
from gough.statics import softest_stiffness, top_speeds

# limits with a line of their own in the figure: stroke by leg, workspace as a box, det J = 0
APART = ("stroke", "workspace", "singularity")


@dataclass(frozen=True)
class Quantity:
    """A number for every pose.

    Attributes:
        of: values (...) from platform, poses (...) and the frame whose poses they are.
        label: name and unit.
        high_is_good: False where the large values are those to avoid.
    """

    of: Callable[[Platform, Pose, str | None], Array]
    label: str
    high_is_good: bool = True


def quantity_named(name: str, platform: Platform) -> Quantity:
    """Return a quantity with the units of a platform.

    Raises:
        GoughError: no such quantity, or the platform states no payload for forces.
    """
    unit, rotary = length_unit(platform), platform.rotary is not None
    stated = platform.limits is not None and platform.limits.leg_speed is not None
    per_leg = f"[{unit}/rad of the motors]" if rotary else "[1], of one leg's"
    spring = f"[1/{unit}\N{SUPERSCRIPT TWO}], of one motor's" if rotary else "[1], of one leg's"
    known = {
        "singularity": Quantity(_distance, "distance to singularity [1], 0 is singular"),
        "margin": Quantity(_margin, "share left of the tightest limit [1], 0 at the limit"),
        "force": Quantity(
            _force, f"largest motor torque [N {unit}]" if rotary else "largest leg force [N]", False
        ),
        "stiffness": Quantity(_stiffness, f"stiffness in the softest direction {spring}"),
        "speed": Quantity(
            _speed, f"highest speed {f'[{unit}/s]' if stated else per_leg}"
        ),
        "error": Quantity(
            _error, "largest error of the position / error of readings "
            f"{f'[{unit}/rad]' if rotary else '[1]'}", False,
        ),
    }  # fmt: skip
    if name not in known:
        near = suggestion(name, known)
        raise GoughError(f"no quantity {name!r}{near} there are {', '.join(known)}")
    if name == "force":
        payload_forces(platform, platform.home)  # refused without a payload
    return known[name]


def limit_shares(platform: Platform, pose: Pose) -> dict[str, Array]:
    """What is left (...) of each limit of joints, legs and motors that the platform states."""
    if platform.limits is None:
        return {}
    found = limits(platform, pose)
    return {
        name: found.share[..., k] for k, name in enumerate(found.names) if name not in APART
    }  # fmt: skip


def _distance(platform: Platform, pose: Pose, frame: str | None) -> Array:
    return singularity_distance(platform, platform_pose(platform, pose, frame))


def _margin(platform: Platform, pose: Pose, frame: str | None) -> Array:
    return limits(platform, pose, frame=frame).tightest


def _force(platform: Platform, pose: Pose, frame: str | None) -> Array:
    return np.abs(payload_forces(platform, platform_pose(platform, pose, frame))).max(axis=-1)


def _stiffness(platform: Platform, pose: Pose, frame: str | None) -> Array:
    return softest_stiffness(platform, pose, 1.0, frame)


def _speed(platform: Platform, pose: Pose, frame: str | None) -> Array:
    stated = platform.limits and platform.limits.leg_speed
    return top_speeds(platform, pose, 1.0 if stated is None else stated, frame)[..., 0]


def _error(platform: Platform, pose: Pose, frame: str | None) -> Array:
    """Standard deviation in the worst direction, of readings with standard deviation 1."""
    covariance = pose_covariance(platform, pose, 1.0, frame)[..., :3, :3]
    known = np.all(np.isfinite(covariance), axis=(-2, -1))
    safe = np.where(known[..., None, None], covariance, 0.0)
    return np.where(known, np.sqrt(np.linalg.eigvalsh(safe)[..., -1]), np.nan)

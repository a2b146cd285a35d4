"""A machine's file examined: readings, reach, singularities, modes, and what is odd about them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gough import quaternion
from gough.checks import Array
from gough.examination.mistakes import Remark, remarks_on
from gough.home_mode import sure_workspace
from gough.kinematics import assembly_sign, joint_positions, leg_lengths, singularity_distance
from gough.limit_rules import in_stroke
from gough.margins import AXES, Reach, reach
from gough.modes.assembly import assembly_modes
from gough.modes.choose import choose_mode
from gough.platform import Platform
from gough.pose import Pose
from gough.workspace import Workspace

SAMPLES = 20_000  # poses of the workspace that are looked at
ROUNDS, AROUND = 30, 200  # of the search for the most singular pose
STEP = 0.01  # share of the size by which one leg at a time is moved
ANGLE_STEP = np.radians(5.0)  # the same for motors [rad]


@dataclass(frozen=True, eq=False)
class LegSteps:
    """Motion of the platform when one leg at a time is moved from home.

    Attributes:
        step: how far each leg is moved [platform unit], or [rad] for rotary legs.
        rise: (6, 6) for each leg how far the six platform joints rise along the base's z axis.
        turn: (6,) rotation of the platform about z [rad].
    """

    step: float
    rise: Array
    turn: Array


@dataclass(frozen=True, eq=False)
class Check:
    """Facts about a machine, and remarks on what may be wrong in its file.

    Attributes:
        platform: the machine.
        box: its workspace, or the box about home that was looked at in its place.
        used: (6, 2) lowest and highest reading of each leg in the box, NaN where none is reached.
        within: share of the box that all legs reach, within the stroke where one is stated.
        reach: how far each axis can move from home, one at a time; the workspace is no limit.
        nearest: distance to a singularity of the most singular pose that was found in the box;
            below 0 where its det J has another sign than home's.
        nearest_pose: that pose.
        poses, fitting: poses that the readings at home have, and those that fit the machine (see
            `gough.choose_mode`).
        steps: motion when one leg at a time is moved.
        remarks: what may be wrong.
    """

    platform: Platform
    box: Workspace
    used: Array
    within: float
    reach: Reach
    nearest: float
    nearest_pose: Pose
    poses: int
    fitting: int
    steps: LegSteps | None
    remarks: list[Remark]

    @property
    def ok(self) -> bool:
        """Nothing that looks like a mistake was found."""
        return not any(remark.mistake for remark in self.remarks)

    def reach_rows(self) -> Iterator[tuple[str, Array, Any]]:
        """Axis, reach down and up [platform unit] or [deg], and what ends each, axis by axis."""
        scale = np.repeat([1.0, np.degrees(1.0)], 3)[:, None]
        yield from zip(AXES, scale * self.reach.distance, self.reach.limit, strict=True)

    def to_dict(self) -> dict[str, Any]:
        """Facts and remarks as dicts, lists, numbers and text."""
        platform, steps = self.platform, self.steps
        return {
            "name": platform.name,
            "legs": platform.legs,
            "unit": platform.unit,
            "size": platform.size,
            "home_legs": platform.home_legs,
            "workspace_stated": platform.workspace is not None,
            "readings_used": self.used,
            "stroke": platform.stroke,
            "share_within_stroke": self.within,
            "reach": {
                axis: {"low": -low, "high": high, "low_limit": names[0], "high_limit": names[1]}
                for axis, (low, high), names in self.reach_rows()
            },
            "nearest_singularity": {
                "distance": self.nearest,
                "position": self.nearest_pose.position,
                "euler_deg": np.degrees(self.nearest_pose.euler),
            },
            "modes_at_home": {"poses": self.poses, "fitting": self.fitting},
            "one_leg_at_a_time": steps and {
                "step": steps.step, "rise": steps.rise, "turn_deg": np.degrees(steps.turn),
            },
            "remarks": [vars(remark) for remark in self.remarks],
        }  # fmt: skip


def check(platform: Platform) -> Check:
    """Examine a machine's file: readings, reach, singularities, modes and likely mistakes.

    Samples the stated workspace; a machine that states none is looked at in a box about home in
    which no singularity was found.

    Example:
        >>> found = gough.check(gough.Platform.load("reference"))
        >>> found.ok, found.poses, found.fitting, round(found.nearest, 3)
        (True, 16, 1, 0.007)
    """
    box = platform.workspace or sure_workspace(platform) or Workspace.about_home(0.0, 0.0)
    poses = box.sample(platform.home, SAMPLES, seed=0)
    legs = leg_lengths(platform, poses)
    known = np.all(np.isfinite(legs), axis=-1)
    used = np.full((6, 2), np.nan)
    if known.any():
        used = np.stack([legs[known].min(axis=0), legs[known].max(axis=0)], axis=-1)
    nearest, nearest_pose = most_singular(platform, box, poses)
    choice = choose_mode(modes := assembly_modes(platform, platform.home_legs))
    facts = {
        "platform": platform, "box": box, "used": used,
        "within": float(np.mean(in_stroke(platform, legs) & known)),
        "reach": reach(replace(platform, workspace=None), platform.home),
        "nearest": nearest, "nearest_pose": nearest_pose,
        "poses": len(modes.row), "fitting": int(choice.count), "steps": leg_steps(platform),
    }  # fmt: skip
    return Check(**facts, remarks=remarks_on(platform, legs, nearest))


def most_singular(platform: Platform, box: Workspace, poses: Pose) -> tuple[float, Pose]:
    """Smallest distance to a singularity among poses (N,) of a box, refined, and its pose.

    The distance is negative on the other side of a singularity than home's.
    """

    def signed(pose: Pose) -> Array:
        distance = singularity_distance(platform, pose) * np.sign(assembly_sign(platform, pose))
        return np.where(np.isfinite(distance), distance, np.inf)

    sides = np.vstack([box.translation, np.radians(box.rotation_deg)])
    rng = np.random.default_rng(0)
    found = signed(poses)
    best = int(np.argmin(found))
    value, pose = float(found[best]), poses[best]
    turn = Pose(np.zeros(3), quaternion.product(platform.home.inverse().wxyz, pose.wxyz))
    x = np.concatenate([pose.position - platform.home.position, turn.euler])
    width = (sides[:, 1] - sides[:, 0]) / 4
    for _ in range(ROUNDS):
        tried = np.clip(x + width * rng.uniform(-1, 1, (AROUND, 6)), sides[:, 0], sides[:, 1])
        around = pose_from_home(platform, tried)
        found = signed(around)
        best = int(np.argmin(found))
        if found[best] < value:
            value, pose, x = float(found[best]), around[best], tried[best]
        width = 0.7 * width
    return value, pose


def pose_from_home(platform: Platform, x: Array) -> Pose:
    """Poses (N,) at translations and Euler angles [rad] x (N, 6) from home, as of `Workspace`."""
    turn = quaternion.from_euler(x[..., 3:])
    wxyz = quaternion.product(np.broadcast_to(platform.home.wxyz, turn.shape), turn)
    return Pose.trusted(platform.home.position + x[..., :3], wxyz)


def leg_steps(platform: Platform) -> LegSteps | None:
    """Move one leg at a time from home; None where home is singular."""
    from gough.fk.solve import solve

    step = float(ANGLE_STEP) if platform.rotary else _round(STEP * platform.size)
    if platform.stroke is not None:
        room = np.min(platform.stroke[:, 1] - platform.home_legs)
        step = step if room >= step else _round(room / 2)
    found = solve(platform, platform.home_legs + step * np.eye(6), seed=platform.home)
    if not np.all(found.usable):
        return None
    rest = joint_positions(platform, platform.home)[:, 2]
    rise = joint_positions(platform, found.pose)[..., 2] - rest
    turn = quaternion.product(found.pose.wxyz, quaternion.conjugate(platform.home.wxyz))
    return LegSteps(step, rise, quaternion.to_rotation_vector(turn)[:, 2])


def _round(value: float) -> float:
    """The nearest number of the form 1, 2 or 5 times a power of ten."""
    if not value > 0:
        return float(value)
    power = 10.0 ** np.floor(np.log10(value))
    choices = np.array([1.0, 2.0, 5.0, 10.0]) * power
    return float(choices[np.argmin(np.abs(np.log(choices / value)))])

"""Forward kinematics that stays in its assembly mode: from a pose to the one at other readings.

Newton's method started at the present pose finds *a* pose of the new readings. After a long step
that may be another mode's, so the way from the old readings to the new is halved until every
step is short and none crosses a singularity, or until steps are so small that one must be there.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from gough.checks import Array
from gough.kinematics import assembly_sign
from gough.platform import Platform
from gough.pose import Pose
from gough.status import Outcome, Status

LONGEST = 0.1  # a step moves the plate by at most so much of the platform's size
WIDEST = 0.25  # [rad] and turns it by at most so much
SMALLEST = 1 / 256  # of the way, before it is given up
BLOCKED = (
    "These leg readings have a pose, but on the way to it from the present one lies a singularity, "
    "where the machine could leave its assembly mode: go around, or pick the pose from the list "
    "of all assembly modes."
)


@dataclass(frozen=True)
class Arrival:
    """Where the way led.

    Attributes:
        pose: the pose at the new readings, or None where there is none to go to.
        text: what is known about it, or why there is none.
        residual: largest strut length error [platform unit]: of the pose, or by which the
            nearest that was found misses.
        iterations: Newton steps in all.
        seconds: time taken.
    """

    pose: Pose | None
    text: str
    residual: float
    iterations: int
    seconds: float


def follow(platform: Platform, pose: Pose, legs: Array, target: Array) -> Arrival:
    """The pose at readings `target` (6,) in the assembly mode of a pose with readings `legs`."""
    from gough.fk.solve import solve

    begin = time.perf_counter()
    done, step, iterations = 0.0, 1.0, 0
    text, residual = Status.CONVERGED.text, 0.0
    while done < 1.0:
        reach = min(1.0, done + step)
        found = solve(platform, legs + reach * (target - legs), seed=pose, restarts=0, workers=1)
        iterations += int(found.iterations)
        if _is_next(platform, pose, found.pose, found.status):
            pose, done, step = found.pose, reach, 2 * step
            text, residual = found.status.text, float(found.residual)
            continue
        step /= 2
        if step < SMALLEST or found.status == Status.INVALID_INPUT:
            return _lost(platform, pose, target, iterations, begin)
    return Arrival(pose, text, residual, iterations, time.perf_counter() - begin)


NO_POSE = ("unreachable", "not_converged", "invalid_input")


def has_pose(status: Outcome) -> bool:
    """Return True if a row of this status holds a pose that has the readings."""
    return status.label not in NO_POSE


def _is_next(platform: Platform, old: Pose, new: Pose, status: Status) -> bool:
    """Whether a solution continues the present pose: near, and on its side of singularities."""
    if not has_pose(status):
        return False
    shift, turn = old.distance(new)
    if shift > LONGEST * platform.size or turn > WIDEST:
        return False
    signs = np.array([assembly_sign(platform, old), assembly_sign(platform, new)])
    # NaN: motor arms on their other branch, where the sign is not known
    return bool(np.isnan(signs).any() or signs[0] == signs[1])


def _lost(platform: Platform, pose: Pose, target: Array, iterations: int, begin: float) -> Arrival:
    """Why the way ended: no pose at all, or one beyond a singularity."""
    from gough.fk.solve import solve

    found = solve(platform, target, seed=pose, workers=1)
    text = BLOCKED if has_pose(found.status) else found.status.text
    residual = 0.0 if has_pose(found.status) else float(found.residual)
    iterations += int(found.iterations)
    return Arrival(None, text, residual, iterations, time.perf_counter() - begin)

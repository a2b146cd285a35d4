"""Forward kinematics that stays in its assembly mode: from a pose to the pose at other readings.

Newton's method started at the present pose finds *a* pose with the new readings. After a long
step that may be another mode, so the path from the old readings to the new ones is halved until
every step is short and none crosses a singularity. Where even steps of 1/256 of the path are too
long, a singularity is in the way.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gough.checks import Array
from gough.kinematics import assembly_sign
from gough.platform import Platform
from gough.pose import Pose
from gough.status import Outcome, Status

if TYPE_CHECKING:
    from gough.fk.solve import Solver

LONGEST_STEP = 0.1  # translation of the plate in one step / size
WIDEST_STEP = 0.25  # [rad] rotation of the plate in one step
SHORTEST_STEP = 1 / 256  # of the path; below it the search ends
RESTARTS = 24  # further starts to look for a pose beyond a singularity
BLOCKED = (
    "These readings have a pose, but a singularity lies between it and the present one: take "
    "another path, or pick the pose in the tab Modes."
)
# the sentences of `Status` advise what cannot be done on the page
REFUSED = {
    "unreachable": "No pose has these readings; the closest one misses by the residual.",
    "not_converged": "No pose with these readings was found; the last one misses by the residual.",
    "invalid_input": "A reading is not finite, or a length is not above zero.",
}


@dataclass(frozen=True)
class Arrival:
    """Result of following readings.

    Attributes:
        pose: the pose at the new readings, or None.
        text: the reason why there is none.
        residual: largest strut length error [platform unit], of the pose or of the closest one.
        iterations: Newton steps in all.
        seconds: time taken.
    """

    pose: Pose | None
    text: str
    residual: float
    iterations: int
    seconds: float


def step_solver(platform: Platform) -> Solver:
    """Solver for one step: Newton's method from the present pose alone, on one thread."""
    from gough.fk.solve import Solver  # Numba takes a second, which the first picture need not wait

    return Solver(platform, "home", restarts=0, workers=1)


def follow(solver: Solver, pose: Pose, legs: Array, target: Array) -> Arrival:
    """Find the pose at readings `target` (6,), in the assembly mode of a pose with `legs`.

    Args:
        solver: the `step_solver` of the machine.
    """
    begin = time.perf_counter()
    done, step, iterations, residual = 0.0, 1.0, 0, 0.0
    while done < 1.0:
        goal = min(1.0, done + step)
        found = replace(solver, seed=pose)(legs + goal * (target - legs))
        iterations += int(found.iterations)
        if _is_next(solver.platform, pose, found.pose, found.status):
            pose, done, step, residual = found.pose, goal, 2 * step, float(found.residual)
            continue
        step /= 2
        if step < SHORTEST_STEP or found.status == Status.INVALID_INPUT:
            return _blocked(solver, pose, target, iterations, begin)
    return Arrival(pose, "", residual, iterations, time.perf_counter() - begin)


def has_pose(status: Outcome) -> bool:
    """True if the pose of a row with this status has the readings, usable or not."""
    return status.label not in REFUSED


def _is_next(platform: Platform, old: Pose, new: Pose, status: Status) -> bool:
    """True if a solution continues `old`: it is near, and on the same side of singularities."""
    if not has_pose(status):
        return False
    translation, rotation = old.distance(new)
    if translation > LONGEST_STEP * platform.size or rotation > WIDEST_STEP:
        return False
    signs = np.array([assembly_sign(platform, old), assembly_sign(platform, new)])
    # NaN: motor arms on their other branch, where the sign is not known
    return bool(np.isnan(signs).any() or signs[0] == signs[1])


def _blocked(solver: Solver, pose: Pose, target: Array, iterations: int, begin: float) -> Arrival:
    """Distinguish readings that no pose has from readings with a pose beyond a singularity."""
    found = replace(solver, seed=pose, restarts=RESTARTS)(target)
    beyond = has_pose(found.status)
    text = BLOCKED if beyond else REFUSED[found.status.label]
    residual = 0.0 if beyond else float(found.residual)
    iterations += int(found.iterations)
    return Arrival(None, text, residual, iterations, time.perf_counter() - begin)

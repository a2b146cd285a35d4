"""State of the page: the pose in the picture, the last request, and its result.

A request gives readings, a pose, an assembly mode or a row of a file. One that no pose or no
readings answer leaves the pose in the picture unchanged. A pose beyond its limits is shown, and
the result names the limits.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.kinematics import leg_lengths, singularity_distance, strut_vectors
from gough.limit_rules import in_workspace
from gough.platform import Platform
from gough.pose import Pose, pose_values
from gough.skeleton import outside_stroke
from gough.view.follow import follow, step_solver

if TYPE_CHECKING:
    from gough.fk.solve import Solver

UNCHANGED = "The picture is unchanged; Undo resets the sliders."
SHORTEST_STRUT = 1e-9  # / size; below it a strut has no direction
CLOSE = 0.2  # singularity distance / that of home; less deserves a warning
UNDO_STEPS = 100


@dataclass(frozen=True)
class Answer:
    """Result of the last request.

    Attributes:
        reached: True if the picture shows what was requested.
        text: a sentence: the limits that the pose keeps or exceeds, or why there is no pose.
        how: what was computed: "forward kinematics", "inverse kinematics", "home", ...
        residual: largest strut length error [platform unit], of the pose or of the closest one.
        iterations: Newton steps.
        seconds: time taken.
    """

    reached: bool
    text: str
    how: str
    residual: float = 0.0
    iterations: int = 0
    seconds: float = 0.0


class Model:
    """One machine on the page.

    Attributes:
        pose, legs: the pose in the picture, and its readings (6,).
        numbers: (6,) position [platform unit] and Euler angles [deg], R = Rx Ry Rz, of the last
            request; those of `pose` unless it was not reached.
        asked: (6,) readings of the last request; `legs` unless they were not reached.
        answer: its result.
    """

    def __init__(self, platform: Platform, start: Pose | None = None) -> None:
        """Show the machine at `start`, or at home.

        Raises:
            GoughError: the legs cannot have the pose `start`.
        """
        self.platform = platform
        self._home_distance = float(singularity_distance(platform, platform.home))
        self._earlier: deque[tuple[Pose, Array, Array]] = deque(maxlen=UNDO_STEPS)
        self.home()
        if start is not None:
            self.ask_pose(start)
            if not self.answer.reached:
                raise GoughError(self.answer.text.removesuffix(UNCHANGED).strip())

    # ---- requests ---------------------------------------------------------------------

    def home(self) -> None:
        """Go to the platform's home pose."""
        self._show(self.platform.home, self.platform.home_legs, "home")

    def ask_legs(self, readings: dict[int, float]) -> None:
        """Set some readings, by leg (0 to 5); the pose follows in its assembly mode."""
        target = self.asked.copy()
        target[list(readings)] = list(readings.values())
        found = follow(self.solver, self.pose, self.legs, target)
        known = (found.residual, found.iterations, found.seconds)
        if found.pose is not None:
            self._show(found.pose, target, "forward kinematics", *known)
            return
        self.answer = Answer(False, f"{found.text} {UNCHANGED}", "forward kinematics", *known)
        self.asked, self.numbers = target, pose_values(self.pose, "deg")

    def ask_numbers(self, values: dict[int, float]) -> None:
        """Set some of x, y, z [platform unit] and rx, ry, rz [deg] (0 to 5); legs follow."""
        numbers = self.numbers.copy()
        numbers[list(values)] = list(values.values())
        self.ask_pose(Pose.from_euler(numbers[:3], np.radians(numbers[3:])))
        # as requested: angles read back from the pose may be others of the same rotation
        self.numbers = numbers

    def ask_pose(self, pose: Pose) -> None:
        """Go to a pose; the legs follow by inverse kinematics."""
        begin = time.perf_counter()
        legs = leg_lengths(self.platform, pose)
        seconds = time.perf_counter() - begin
        problem = _problem(self.platform, pose, legs)
        if not problem:
            self._show(pose, legs, "inverse kinematics", seconds=seconds)
            return
        self.answer = Answer(False, f"{problem} {UNCHANGED}", "inverse kinematics", seconds=seconds)
        self.numbers, self.asked = pose_values(pose, "deg"), self.legs.copy()

    def pick(self, pose: Pose, residual: float) -> None:
        """Take another assembly mode with the present readings."""
        self._show(pose, self.legs, "assembly mode", residual)

    def show(self, pose: Pose, legs: Array, answer: Answer) -> None:
        """Take a row of a file with its result; one without a pose leaves the picture as it is."""
        if answer.reached:
            self._take(pose, legs)
        else:
            self.reset_sliders()
        self.answer = answer

    def remember(self) -> None:
        """Keep the present pose for `undo`."""
        self._earlier.append((self.pose, self.legs, self.numbers))

    def undo(self) -> None:
        """Drop a request that was not reached, or go back to the pose before the last move."""
        if not self.answer.reached:
            self.reset_sliders()
            return
        while self._earlier:
            pose, legs, numbers = self._earlier.pop()
            if pose is not self.pose:
                self._show(pose, legs, "undone")
                self.numbers = numbers
                return

    def reset_sliders(self) -> None:
        """Set all sliders to the pose in the picture."""
        self._show(self.pose, self.legs, "present pose")

    # ---- state ------------------------------------------------------------------------

    @cached_property
    def solver(self) -> Solver:
        """Solver of the machine, made once; see `step_solver`."""
        return step_solver(self.platform)

    @property
    def singularity(self) -> float:
        """Distance to a singularity, 0 to about 1, see `gough.singularity_distance`; may be NaN."""
        return float(singularity_distance(self.platform, self.pose))

    @property
    def singularity_share(self) -> float:
        """`singularity` / that of home; NaN where either is unknown, or home is singular."""
        return self.singularity / self._home_distance if self._home_distance else np.nan

    @property
    def within_limits(self) -> bool:
        """True if the pose in the picture keeps the stated stroke and workspace."""
        inside = bool(in_workspace(self.platform, self.pose))
        return inside and not outside_stroke(self.platform, self.legs).any()

    # ---- parts ------------------------------------------------------------------------

    def _show(
        self, pose: Pose, legs: Array, how: str, residual=0.0, iterations=0, seconds=0.0
    ) -> None:
        self._take(pose, legs)
        text = limits_text(self.platform, pose, legs)
        if self.singularity_share < CLOSE:
            text += " Close to a singularity: small reading errors become large pose errors."
        self.answer = Answer(True, text, how, residual, iterations, seconds)

    def _take(self, pose: Pose, legs: Array) -> None:
        self.pose, self.legs = pose, legs
        self.numbers, self.asked = pose_values(pose, "deg"), legs.copy()


def leg_factor(platform: Platform) -> float:
    """Factor from readings to the numbers on the page, where motor angles are in degrees."""
    return 180 / np.pi if platform.legs == "rotary" else 1.0


def leg_unit(platform: Platform) -> str:
    """Unit of the readings on the page."""
    return "deg" if platform.legs == "rotary" else platform.unit


def limits_text(platform: Platform, pose: Pose, legs: Array) -> str:
    """Sentence that names the stated limits which a pose keeps, or those that it exceeds."""
    beyond = _beyond_stroke(platform, legs)
    if not in_workspace(platform, pose):
        beyond.append("outside the stated workspace")
    if beyond:
        return f"Shown beyond its limits: {'; '.join(beyond)}."
    stated = {"stroke": platform.stroke, "workspace": platform.workspace}
    names = [name for name, limit in stated.items() if limit is not None]
    return f"Within {' and '.join(names)}." if names else "The platform states no limits."


def _beyond_stroke(platform: Platform, legs: Array) -> list[str]:
    """Legs below and above their stroke, with the largest distance to its end."""
    if platform.stroke is None:
        return []
    what = "motor" if platform.legs == "rotary" else "leg"
    outside, parts = outside_stroke(platform, legs), []
    low, high = platform.stroke.T
    for side, miss in (("below", low - legs), ("above", legs - high)):
        which = np.flatnonzero(outside & (miss > 0))
        if len(which):
            names = f"{what}{'s' * (len(which) > 1)} {', '.join(str(i + 1) for i in which)}"
            most = f"{leg_factor(platform) * miss[which].max():.3g} {leg_unit(platform)}".rstrip()
            limit = "its" if len(which) == 1 else "their"
            parts.append(f"{names} {side} {limit} stroke by {'up to ' * (len(which) > 1)}{most}")
    return parts


def _problem(platform: Platform, pose: Pose, legs: Array) -> str:
    """Reason why a pose cannot be shown; empty if it can."""
    if not np.all(np.isfinite(pose.position)):
        return "A number is not finite."
    missing = np.flatnonzero(~np.isfinite(legs))
    if len(missing):
        motors = ", ".join(str(i + 1) for i in missing)
        return f"Arm and rod are too short for this pose: motor {motors}."
    length = np.linalg.norm(strut_vectors(platform, pose), axis=-1)
    short = np.flatnonzero(length <= SHORTEST_STRUT * platform.size)
    return f"Leg {short[0] + 1} would have no length." if len(short) else ""

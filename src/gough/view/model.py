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
from gough.platform import Platform
from gough.pose import Pose, pose_values
from gough.view.beyond import Beyond, beyond_limits
from gough.view.follow import follow, step_solver

if TYPE_CHECKING:
    from gough.fk.solve import Solver
    from gough.margins import Reach
    from gough.modes.result import AssemblyModes

UNCHANGED = "The picture is unchanged; Undo resets the sliders."
SHORTEST_STRUT = 1e-9  # / size; below it a strut has no direction
SAME_POSE = 1e-7  # translation / size + rotation [rad] below which a mode is the picture's pose
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
        pose, legs: the platform's pose in the picture, and its readings (6,).
        view: the frame whose pose the page shows, such as "tool in work"; None for the platform.
        numbers: (6,) position [platform unit] and Euler angles [deg], R = Rx Ry Rz, of the last
            request, of the frame; those of `pose` unless it was not reached.
        beyond: the limits that the pose in the picture exceeds.
        asked: (6,) readings of the last request; `legs` unless they were not reached.
        answer: its result.
    """

    def __init__(
        self, platform: Platform, start: Pose | None = None, frame: str | None = None
    ) -> None:
        """Show the machine at the platform's pose `start`, or at home.

        Args:
            frame: whose pose the page shows; the platform's unless given.

        Raises:
            GoughError: the legs cannot have the pose `start`, or there is no such frame.
        """
        self.platform = platform
        self.view = platform.frame(frame) if frame else None
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
        self.asked, self.numbers = target, self.values(self.pose)

    def ask_numbers(self, values: dict[int, float]) -> None:
        """Set some of x, y, z [platform unit] and rx, ry, rz [deg] (0 to 5); legs follow."""
        numbers = self.numbers.copy()
        numbers[list(values)] = list(values.values())
        pose = Pose.from_euler(numbers[:3], np.radians(numbers[3:]))
        self.ask_pose(pose if self.view is None else self.view.platform_pose(pose))
        # as requested: angles read back from the pose may be others of the same rotation
        self.numbers = numbers

    def ask_pose(self, pose: Pose) -> None:
        """Go to a pose of the platform; the legs follow by inverse kinematics."""
        begin = time.perf_counter()
        legs = leg_lengths(self.platform, pose)
        seconds = time.perf_counter() - begin
        problem = _problem(self.platform, pose, legs)
        if not problem:
            self._show(pose, legs, "inverse kinematics", seconds=seconds)
            return
        self.answer = Answer(False, f"{problem} {UNCHANGED}", "inverse kinematics", seconds=seconds)
        self.numbers, self.asked = self.values(pose), self.legs.copy()

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

    # ---- compiled on first use --------------------------------------------------------

    def compile(self) -> None:
        """Compile, or load from disk, what the requests and the bars need."""
        home, legs = self.platform.home, self.platform.home_legs
        nowhere = np.full(6, 1e3 * self.platform.size)  # no pose has these: all restarts
        for target in (legs, nowhere):
            follow(self.solver, home, legs, target)
        self.reach(home)

    def reach(self, pose: Pose) -> Reach:
        """Calculate how far each axis of the page's frame can still move from a pose."""
        from gough.margins import reach

        shown = pose if self.view is None else self.view.of(pose)
        return reach(self.platform, shown, frame=self.frame or None)

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
    def frame(self) -> str:
        """Name of the frame whose pose the page shows; "" for the platform's own."""
        return "" if self.view is None else self.view.name

    def mode(self, modes: AssemblyModes | None) -> int | None:
        """Index of the assembly mode in the picture, or None."""
        if modes is None or not len(modes.row):
            return None
        translation, rotation = modes.platform_pose.distance(self.pose)
        gap = translation / self.platform.size + rotation
        best = int(np.argmin(gap))
        return best if gap[best] < SAME_POSE else None

    def values(self, pose: Pose) -> Array:
        """Position and Euler angles [deg], (..., 6), that the page shows for poses (...)."""
        return pose_values(pose if self.view is None else self.view.of(pose), "deg")

    # ---- parts ------------------------------------------------------------------------

    def _show(
        self, pose: Pose, legs: Array, how: str, residual=0.0, iterations=0, seconds=0.0
    ) -> None:
        self._take(pose, legs)
        text = self.beyond.text
        if self.singularity_share < CLOSE:
            text += " Close to a singularity: small reading errors become large pose errors."
        self.answer = Answer(True, text, how, residual, iterations, seconds)

    def _take(self, pose: Pose, legs: Array) -> None:
        self.pose, self.legs = pose, legs
        self.numbers, self.asked = self.values(pose), legs.copy()
        self.beyond: Beyond = beyond_limits(self.platform, pose, legs)


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

"""The state behind the page: the pose in the picture, what was asked for, and what is known.

It changes in four ways: by leg readings, by a pose, by a mode picked from a list, by a row of a
file. Whatever is asked for and cannot be reached leaves the pose in the picture as it is.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from gough.checks import Array
from gough.kinematics import leg_lengths, singularity_distance, strut_vectors
from gough.limit_rules import pose_status
from gough.platform import Platform
from gough.pose import Pose
from gough.status import InverseStatus
from gough.view import colors
from gough.view.follow import follow

STAYS = "The picture stays where it was."
NO_LENGTH = 1e-9  # a strut shorter than this share of the size points nowhere


@dataclass(frozen=True)
class Answer:
    """What became of the last thing that was asked for.

    Attributes:
        reached: the picture shows it.
        text: the status sentence.
        how: what was computed: "forward kinematics", "inverse kinematics", "home", ...
        residual: largest strut length error [platform unit]; of a miss, the nearest one's.
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
    """One machine on the screen.

    Attributes:
        pose, legs: what the picture shows, and its readings (6,).
        numbers: (6,) the pose that was asked for last: position [platform unit], then Euler
            angles [deg], R = Rx Ry Rz. Those of `pose` wherever that was reached.
        asked: (6,) readings that were asked for last; `legs` wherever they were reached.
        answer: what is known about it.
    """

    def __init__(self, platform: Platform) -> None:
        self.platform = platform
        self._home_distance = float(singularity_distance(platform, platform.home))
        self.pose, self.legs = platform.home, platform.home_legs
        self.home()

    # ---- asked for by a person --------------------------------------------------------

    def home(self) -> None:
        """Back to the platform's home pose."""
        self._take(self.platform.home, self.platform.home_legs)
        self.answer = Answer(True, self._placed(self.pose, self.legs), "home")

    def ask_legs(self, readings: dict[int, float]) -> None:
        """Set some readings, by leg (0 to 5); the pose follows in its assembly mode."""
        target = self.asked.copy()
        target[list(readings)] = list(readings.values())
        found = follow(self.platform, self.pose, self.legs, target)
        known = (found.residual, found.iterations, found.seconds)
        reached = found.pose is not None
        text = found.text if reached else f"{found.text} {STAYS}"
        self.answer = Answer(reached, text, "forward kinematics", *known)
        if found.pose is not None:
            self._take(found.pose, target)
        else:
            self.asked, self.numbers = target, pose_numbers(self.pose)

    def ask_numbers(self, values: dict[int, float]) -> None:
        """Set some of x, y, z [platform unit] and rx, ry, rz [deg] (0 to 5); legs follow."""
        numbers = self.numbers.copy()
        numbers[list(values)] = list(values.values())
        pose = Pose.from_euler(numbers[:3], np.radians(numbers[3:]))
        self.ask_pose(pose)
        # as asked: angles read back from the pose may be others of the same rotation
        self.numbers = numbers

    def ask_pose(self, pose: Pose) -> None:
        """Go to a pose; the legs follow by inverse kinematics."""
        begin = time.perf_counter()
        with np.errstate(invalid="ignore"):
            legs = leg_lengths(self.platform, pose)
        seconds = time.perf_counter() - begin
        trouble = self._trouble(pose, legs)
        if trouble:
            self.answer = Answer(False, f"{trouble} {STAYS}", "inverse kinematics", seconds=seconds)
            self.numbers, self.asked = pose_numbers(pose), self.legs
            return
        self._take(pose, legs)
        text = self._placed(pose, legs)
        self.answer = Answer(True, text, "inverse kinematics", seconds=seconds)

    def pick(self, pose: Pose, residual: float, name: str) -> None:
        """Take another assembly mode of the present readings."""
        self._take(pose, self.legs)
        text = "This pose has the same leg readings as before."
        self.answer = Answer(True, text, name, residual)

    def show(self, pose: Pose, legs: Array, answer: Answer) -> None:
        """Take a row of a file with what is known about it; a row without a pose moves nothing."""
        if answer.reached:
            self._take(pose, legs)
        else:
            self.forget()
        self.answer = answer

    def forget(self) -> None:
        """Drop what was asked for and not reached: all numbers are the picture's again."""
        self._take(self.pose, self.legs)

    # ---- seen -------------------------------------------------------------------------

    @property
    def singularity(self) -> float:
        """Distance to a singularity, 0 to about 1, see `gough.singularity_distance`; may be NaN."""
        return float(singularity_distance(self.platform, self.pose))

    @property
    def singularity_share(self) -> float:
        """The same as a share of that at home; may be NaN."""
        return self.singularity / self._home_distance

    @property
    def out_of_stroke(self) -> bool:
        """Whether a leg is beyond its limits."""
        return bool(colors.out_of_stroke(self.platform, self.legs).any())

    # ---- inside -----------------------------------------------------------------------

    def _take(self, pose: Pose, legs: Array) -> None:
        self.pose, self.legs = pose, legs
        self.numbers, self.asked = pose_numbers(pose), legs.copy()

    def _placed(self, pose: Pose, legs: Array) -> str:
        return InverseStatus(int(pose_status(self.platform, pose, legs))).text

    def _trouble(self, pose: Pose, legs: Array) -> str | None:
        """Why a pose cannot be shown; None if it can."""
        stuck = np.flatnonzero(~np.isfinite(legs))
        if len(stuck):
            which = ", ".join(str(i + 1) for i in stuck)
            return f"{self._placed(pose, legs)} It is out of reach of motor {which}."
        length = np.linalg.norm(strut_vectors(self.platform, pose), axis=-1)
        short = np.flatnonzero(length <= NO_LENGTH * self.platform.size)
        if len(short):
            return f"Leg {short[0] + 1} would have no length there."
        return None


def pose_numbers(pose: Pose) -> Array:
    """x, y, z and Euler angles [deg] of poses, (..., 6)."""
    return np.concatenate([pose.position, np.degrees(pose.euler)], axis=-1)

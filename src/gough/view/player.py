"""The player of a file: the row shown, and the clock that posts the next ones."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from gough.view.trajectory import Trajectory

FRAME = 1 / 60  # [s] between rows of a file


class Player:
    """Row of a file in the picture, and whether it is playing.

    Attributes:
        row: the row shown.
        playing: True between `run` and the last row, or until it is set to False.
        speed: file's seconds in a second.
    """

    def __init__(self, trajectory: Trajectory | None) -> None:
        self._trajectory = trajectory
        self.row, self.playing, self.speed = 0, False, 1.0

    def run(self, post: Callable[[str, dict], None]) -> None:
        """Post rows at the speed of the player, until the last."""
        assert self._trajectory is not None
        times = self._trajectory.time
        if self.row >= len(times) - 1:
            self.row = 0
        now, last = float(times[self.row]), time.monotonic()
        while self.playing and now < times[-1]:
            time.sleep(FRAME)
            begin, last = last, time.monotonic()
            now += self.speed * (last - begin)
            if self.playing:
                row = int(np.searchsorted(times, now, side="right")) - 1
                post("tick", {"row": max(0, row)})
        post("pause", {})

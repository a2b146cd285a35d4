"""First guesses: anything that turns leg readings into poses can start the refinement."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from gough.checks import Array
from gough.platform import Platform
from gough.pose import Pose


class Seed(Protocol):
    """A first guess. Networks, polynomials and constants all look like this to the solver."""

    name: str

    def guess(self, legs: Array) -> Pose:
        """Poses, batch (N,), for readings (N, 6); finite for finite readings."""
        ...


class HomeSeed:
    """Every row starts at the platform's home pose."""

    name = "home"

    def __init__(self, platform: Platform) -> None:
        self._home = platform.home

    def guess(self, legs: Array) -> Pose:
        count = len(legs)
        return Pose(
            np.broadcast_to(self._home.position, (count, 3)),
            np.broadcast_to(self._home.wxyz, (count, 4)),
        )


class PoseSeed:
    """Rows start at given poses: last cycle's, a neighbouring reading's, a sensor's."""

    name = "poses"

    def __init__(self, pose: Pose) -> None:
        self._pose = pose

    def guess(self, legs: Array) -> Pose:
        count = len(legs)
        return Pose(
            np.broadcast_to(self._pose.position, (count, 3)),
            np.broadcast_to(self._pose.wxyz, (count, 4)),
        )

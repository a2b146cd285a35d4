"""Placements of an instrument: where its frame, targets or stations are.

These numbers are unknown unless the frames are known, and are fitted beside the machine's. Twists
act from the left, as in `gough.calibration.residuals`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gough.calibration.arrays import Array
from gough.calibration.residuals import Rigid, exp_rotation


@dataclass(frozen=True)
class Frames:
    """The measuring frame (base to measuring) and the tool (platform to tool): 12 numbers."""

    frame: Rigid
    tool: Rigid
    count = 12

    def moved(self, step: Array) -> Frames:
        """After a step (12,)."""
        twist = step.reshape(2, 6)
        turn = exp_rotation(twist[:, 3:])
        frame, tool = self.frame, self.tool
        return type(self)(
            Rigid(turn[0] @ frame.R, frame.t + twist[0, :3]),
            Rigid(turn[1] @ tool.R, tool.t + twist[1, :3]),
        )


class Rotations(Frames):
    """Frames of which only the rotations matter: 6 numbers."""

    count = 6

    def moved(self, step: Array) -> Frames:
        whole = np.zeros((2, 6))
        whole[:, 3:] = step.reshape(2, 3)
        return super().moved(whole.ravel())


@dataclass(frozen=True)
class Targets:
    """The measuring frame, and targets (k, 3) in platform coordinates: 6 + 3 k numbers."""

    frame: Rigid
    points: Array

    @property
    def count(self) -> int:
        return 6 + self.points.size

    def moved(self, step: Array) -> Targets:
        return Targets(
            self.frame.moved(step[:6]), self.points + step[6:].reshape(self.points.shape)
        )


@dataclass(frozen=True)
class Bars:
    """Stations (k, 3) in base and targets (k, 3) in platform coordinates: 6 k numbers."""

    stations: Array
    points: Array

    @property
    def count(self) -> int:
        return 2 * self.points.size

    def moved(self, step: Array) -> Bars:
        a, b = step.reshape(2, *self.points.shape)
        return Bars(self.stations + a, self.points + b)


@dataclass(frozen=True)
class Level:
    """The vertical in base coordinates and the instrument's axes on the platform: 5 numbers."""

    up: Array  # (3,)
    mount: Array  # (3, 3): instrument to platform
    count = 5

    def tangents(self) -> Array:
        """Two directions (2, 3) in which the vertical can lean."""
        return np.linalg.svd(self.up[None])[2][1:]

    def moved(self, step: Array) -> Level:
        up = self.up + step[:2] @ self.tangents()
        return Level(up / np.linalg.norm(up), exp_rotation(step[2:]) @ self.mount)

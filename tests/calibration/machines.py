"""Machines whose truth is known, and measurements of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gough import Platform, Pose, leg_lengths
from gough.calibration.parameters import Parameters
from gough.calibration.placements import Frames
from gough.calibration.residuals import Rigid, exp_rotation

TRACKER = (0.01, float(np.radians(0.002)))  # [mm], [rad]
LEG = 0.003  # [mm]
MILLIMETRE = {"mm": 1.0, "m": 1e-3, "": 1 / 25.4}


@dataclass(frozen=True)
class Truth:
    """A machine as drawn, as it is, and where the instrument and the tool stand."""

    drawing: Platform
    platform: Platform
    values: Any
    frames: Frames
    mm: float

    def poses(self, count: int, seed: int) -> Pose:
        """Poses within stroke (count,)."""
        pose = self.drawing.sample_poses(12 * count, seed)
        legs = leg_lengths(self.platform, pose)
        good = np.all(np.isfinite(legs), axis=1)
        if self.drawing.stroke is not None:
            low, high = self.drawing.stroke.T
            good &= np.all((legs >= low) & (legs <= high), axis=1)
        return pose[np.flatnonzero(good)[:count]]

    def seen(self, pose: Pose) -> Rigid:
        """The tool in the measuring frame."""
        body = Rigid.of(pose, self.drawing.pivot_point)
        return self.frames.frame @ body @ self.frames.tool.inverse()


def truth(name: str, seed: int = 0, tolerance: float = 0.5, gains: float = 0.0) -> Truth:
    """A catalog machine with joints off by `tolerance` [mm], measured from anywhere."""
    drawing = Platform.load(name)
    mm = MILLIMETRE[drawing.unit]
    rng = np.random.default_rng(seed)
    layout = Parameters(drawing, tolerance * mm, gains > 0)
    off = rng.normal(size=layout.drawn.shape) * layout.tolerance
    if gains:
        off[:, -1] = rng.normal(0, gains, 6)
    values = layout.drawn + off
    frame = Rigid(exp_rotation(rng.normal(size=3)), rng.uniform(-1000, 1000, 3) * mm)
    tool = Rigid(exp_rotation(rng.normal(0, 0.1, 3)), rng.normal(0, 10, 3) * mm)
    return Truth(drawing, layout.platform(values), values, Frames(frame, tool), mm)


def measure(
    known: Truth, pose: Pose, seed: int = 0, sigma: tuple[float, float] = TRACKER,
    leg: float = LEG,
) -> tuple[Any, Pose]:  # fmt: skip
    """Noisy readings (n, 6) and noisy measured poses (n)."""
    rng = np.random.default_rng(seed)
    legs = leg_lengths(known.platform, pose)
    seen = known.seen(pose)
    n = len(legs)
    noisy = Rigid(
        exp_rotation(rng.normal(0, sigma[1], (n, 3))) @ seen.R,
        seen.t + rng.normal(0, sigma[0] * known.mm, (n, 3)),
    )
    return legs + rng.normal(0, leg * known.mm, legs.shape), noisy.pose()


def options(known: Truth, sigma: tuple[float, float] = TRACKER, leg: float = LEG) -> dict[str, Any]:
    """Options of `calibrate` that state the noise."""
    return {
        "sigma": (sigma[0] * known.mm, sigma[1]), "leg_sigma": leg * known.mm,
        "tolerance": 0.5 * known.mm,
    }  # fmt: skip

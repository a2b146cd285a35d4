"""Rigid bodies and joints of a model at home, whatever the format of its file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from gough.checks import Array
from gough.pose import Pose

WORLD = "world"  # the body that rests, where the file has one
FARTHEST = 1e100  # numbers beyond it have squares that overflow
Kind = Literal["hinge", "slide", "ball", "universal", "fixed"]


@dataclass(frozen=True, eq=False)
class Joint:
    """Joint between two bodies, with its place in world coordinates at home.

    Attributes:
        parent, child: names of bodies; a positive motion is the child's against the parent.
        point: (3,) on the joint's axes.
        axes: (k, 3) unit vectors: one of hinges and slides, two of universal joints, else none.
        position: of hinges [rad] and slides [m] at home.
        gain: position for one unit of the reading.
        limits: lowest and highest reading, infinite where there is none.
        rank: place among the drives; None for joints without one.
    """

    name: str
    kind: Kind
    parent: str
    child: str
    point: Array
    axes: Array = field(default_factory=lambda: np.zeros((0, 3)))
    position: float = 0.0
    gain: float = 1.0
    limits: tuple[float, float] = (-np.inf, np.inf)
    rank: int | None = None


@dataclass(frozen=True, eq=False)
class Model:
    """Bodies and joints of a file.

    Attributes:
        bodies: their poses in the world at home, by name, in the order of the file.
        pivot: (3,) in platform coordinates, what the file says poses are about.
        notes: what was assumed when it was read, a sentence each.
    """

    name: str
    bodies: dict[str, Pose]
    joints: list[Joint]
    notes: list[str]
    pivot: Array | None = None

"""The tracker from NumPy: allocate, call, say how paths ended."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gough.kernel.paths import FINITE, track
from gough.modes.study import Complex

SHARE = 0.4  # of the series' radius of convergence per step: fewest passes, see docs/proofs.md


@dataclass(frozen=True, eq=False)
class Parameters:
    """What the leg equations depend on, in normalised units.

    Attributes:
        base: (6, 3) complex base joints.
        moving: (6, 3) complex platform joints.
        squares: (6,) complex squared strut lengths.
    """

    base: Complex
    moving: Complex
    squares: Complex


@dataclass(frozen=True, eq=False)
class Ends:
    """Where the paths from P start solutions to N targets ended.

    Attributes:
        e, t: (N, P, 4), (N, P, 3) complex.
        ends: (N, P) uint8: FINITE, STUCK or LOST.
        passes: (N, P) int32, evaluations of the equations.
    """

    e: Complex
    t: Complex
    ends: NDArray[np.uint8]
    passes: NDArray[np.int32]

    def finite(self, row: int = 0) -> tuple[Complex, Complex]:
        """The poses of one target whose paths arrived."""
        good = self.ends[row] == FINITE
        return self.e[row][good], self.t[row][good]


def follow(
    start: tuple[Complex, Complex],
    at: Parameters,
    squares: Complex,
    base: Complex | None = None,
    share: float = SHARE,
) -> Ends:
    """Track solutions to other squared lengths, and other base joints if given.

    Args:
        start: (P, 4), (P, 3) solutions at `at`.
        squares: (N, 6) of the targets.
        base: (N, 6, 3) or (1, 6, 3) of the targets.
        share: of the series' radius of convergence that a step may take.
    """
    e, t = start
    count, paths = len(squares), len(e)
    ends = np.zeros((count, paths), np.uint8)
    passes = np.zeros((count, paths), np.int32)
    out_e = np.zeros((count, paths, 4), complex)
    out_t = np.zeros((count, paths, 3), complex)
    rates = np.zeros((1, 6, 3), complex) if base is None else base - at.base
    if paths and count:
        track(
            np.ascontiguousarray(at.moving, complex),
            np.ascontiguousarray(e, complex), np.ascontiguousarray(t, complex),
            np.ascontiguousarray(at.base, complex), np.ascontiguousarray(rates, complex),
            np.ascontiguousarray(at.squares, complex),
            np.ascontiguousarray(squares - at.squares, complex),
            base is not None, share, out_e, out_t, ends, passes,
        )  # fmt: skip
    return Ends(out_e, out_t, ends, passes)

"""Many rows at once: chunks on all cores, open rows handed to the row solver."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import GoughError
from gough.kernel import constants as geometry
from gough.kernel import layout
from gough.kernel.block import UNSETTLED, solve_rows
from gough.kernel.rescue import rescue_rows
from gough.kernel.threads import in_parts
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.polynomial import Polynomial, constant
from gough.workspace import Workspace

SWEEPS = 10  # of a block, before its open rows go to the row solver
NO_POSES = np.empty((0, 7))


@dataclass(frozen=True, eq=False)
class Rows:
    """Where results go: one entry a row."""

    position: Array  # (N, 3) [platform unit]
    wxyz: Array  # (N, 4)
    residual: Array  # (N,) [platform unit]
    iterations: NDArray[np.int32]  # (N,)
    status: NDArray[np.uint8]  # (N,) of Status, or of a block verdict while solving

    @classmethod
    def empty(cls, count: int) -> Rows:
        """Room for `count` rows."""
        return cls(
            np.empty((count, 3)), np.empty((count, 4)), np.empty(count),
            np.empty(count, np.int32), np.empty(count, np.uint8),
        )  # fmt: skip

    def arrays(self) -> tuple:
        """As the compiled code takes them."""
        return self.position, self.wxyz, self.residual, self.iterations, self.status


@dataclass(frozen=True)
class Settings:
    """How hard to try; see `gough.solve`."""

    tol: float = 1e-12
    max_iterations: int = 60
    restarts: int = 24
    singular: float = geometry.SINGULAR
    workers: int | None = None

    def __post_init__(self) -> None:
        limits = {"tol": 1.0, "max_iterations": 10_000, "restarts": 10_000, "singular": 1.0}
        for name, high in limits.items():
            value = getattr(self, name)
            if not 0 <= value <= high:
                raise GoughError(f"{name}: expected 0 to {high:g}, found {value!r}")


def newton(
    platform: Platform, legs: Array, start: Array | Polynomial, settings: Settings
) -> tuple[Rows, int]:
    """Plain Newton on all rows of legs (N, 6), from internal poses (N, 7) or a polynomial.

    Returns:
        The rows, whose statuses of 100 and more are block verdicts, for `rescue`; and how many
        are open or invalid.
    """
    rows = Rows.empty(len(legs))
    out = rows.arrays()
    constants = geometry.constants(platform, settings.singular)
    sweeps = min(settings.max_iterations, SWEEPS)
    if isinstance(start, Polynomial):
        poses, polynomial = NO_POSES, start.arrays()
    else:
        poses, polynomial = start, constant(platform).arrays()

    def work(first: int, last: int) -> int:
        return solve_rows(
            constants, legs, poses, polynomial, settings.tol, sweeps, first, last, out
        )

    return rows, in_parts(work, len(legs), settings.workers)


def rescue(
    platform: Platform,
    legs: Array,
    rows: Rows,
    chosen: NDArray[np.intp],
    guess: Array,
    starts: Array,
    settings: Settings,
) -> None:
    """Solve the `chosen` rows (K,) one by one, from guess (K, 7) and then from starts (S, 7)."""
    out = rows.arrays()
    constants = geometry.constants(platform, settings.singular)

    def work(first: int, last: int) -> int:
        part = slice(first, last)
        return rescue_rows(
            constants, legs, chosen[part], guess[part], starts, settings.tol,
            settings.max_iterations, settings.singular, out,
        )  # fmt: skip

    in_parts(work, len(chosen), settings.workers, chunk=64, serial=64)


def evaluate(platform: Platform, polynomial: Polynomial, legs: Array) -> Pose:
    """The poses that a polynomial gives for readings (N, 6), batch (N,)."""
    rows, _ = newton(platform, legs, polynomial, Settings(max_iterations=0))
    return Pose.trusted(rows.position, rows.wxyz)


@lru_cache(maxsize=64)
def other_starts(platform: Platform, count: int) -> Array:
    """Internal poses (count, 7) to try when the seed fails: home, then poses about it."""
    box = platform.workspace or Workspace.about_home(0.2 * platform.size, 40.0)
    about = box.sample(platform.home, max(count - 1, 0), seed=1)
    position = np.concatenate([platform.home.position[None], about.position])
    wxyz = np.concatenate([platform.home.wxyz[None], about.wxyz])
    constants = geometry.constants(platform)
    return geometry.to_internal(constants, Pose.trusted(position, wxyz))[:count]


def open_rows(rows: Rows) -> NDArray[np.intp]:
    """Rows that plain Newton left open."""
    return np.flatnonzero(rows.status >= layout.OPEN)


def is_unsettled(status: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Whether Newton failed on the row, rather than ended somewhere to be looked at."""
    return status == UNSETTLED

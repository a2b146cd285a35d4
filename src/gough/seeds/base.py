"""First guesses: anything that turns leg readings into poses can start the refinement."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds import cache, polynomial
from gough.seeds.taylor import TaylorSeed

DEGREE = 3  # fast to evaluate, and the first degree that seldom leads to another mode


class Seed(Protocol):
    """A first guess. Networks, given poses and constants all look like this to the solver."""

    @property
    def name(self) -> str:
        """What messages call it."""
        ...

    def guess(self, legs: Array) -> Pose:
        """Poses, batch (N,), for readings (N, 6); finite for finite readings."""
        ...


class PolynomialSeed:
    """Poses as a polynomial of the readings, fitted for a platform and its workspace.

    The solver evaluates it inside its compiled loop; `guess` gives the same poses outside.
    Degree 0 is the platform's home pose, whatever the readings.
    """

    def __init__(self, platform: Platform, degree: int = DEGREE) -> None:
        """Fits the polynomial, or takes it from the cache on disk.

        Raises:
            GoughError: a degree that is not 0 to 7, or a workspace that cannot be reached.
            PlatformError: the platform states no workspace.
        """
        if degree not in range(8):
            raise GoughError(f"degree: expected 0 to 7, found {degree!r}")
        self.platform, self.degree = platform, degree
        self.polynomial = fitted(platform, degree)

    @property
    def name(self) -> str:
        """As `solve` takes it."""
        return f"polynomial-{self.degree}" if self.degree else "home"

    def guess(self, legs: Array) -> Pose:
        """Poses, batch (N,), for readings (N, 6)."""
        from gough.fk.bulk import evaluate

        return evaluate(self.platform, self.polynomial, legs)


class PoseSeed:
    """Rows start at given poses: last cycle's, a neighbouring reading's, a sensor's."""

    name = "poses"

    def __init__(self, pose: Pose) -> None:
        self._pose = pose

    def guess(self, legs: Array) -> Pose:
        """The poses themselves; one pose serves all rows.

        Raises:
            GoughError: neither one pose nor one for each row.
        """
        count = len(legs)
        if self._pose.batch not in ((), (count,), (1,)):
            raise GoughError(
                f"seed: expected one pose or {count}, one for each row; got batch "
                f"{self._pose.batch}"
            )
        return Pose(
            np.broadcast_to(self._pose.position, (count, 3)),
            np.broadcast_to(self._pose.wxyz, (count, 4)),
        )


@lru_cache(maxsize=64)
def fitted(platform: Platform, degree: int) -> polynomial.Polynomial:
    """The polynomial of a platform: from memory, from disk, or fitted now and kept."""
    if degree == 0:
        return polynomial.constant(platform)
    return cache.remember(platform, degree, lambda: polynomial.fit(platform, degree))


def find_seed(platform: Platform, seed: str | Seed | Pose) -> Seed:
    """The seed that `solve` was asked for.

    Raises:
        GoughError: a name that is none; the text lists those there are.
        PlatformError: a polynomial for a platform without workspace.
    """
    if isinstance(seed, Pose):
        return PoseSeed(seed)
    if isinstance(seed, str):
        return _named(platform, seed)
    if not callable(getattr(seed, "guess", None)):
        raise GoughError(f"seed: expected a name, a Pose or an object with guess(); got {seed!r}")
    return seed


def _named(platform: Platform, name: str) -> Seed:
    kind, _, degree = name.partition("-")
    if name == "auto":
        return _polynomial(platform, DEGREE if platform.workspace else 0)
    if name == "home":
        return _polynomial(platform, 0)
    if kind == "polynomial" and (degree == "" or degree.isdecimal()):
        return _polynomial(platform, int(degree or DEGREE))
    if kind == "taylor" and (degree == "" or degree.isdecimal()):
        return TaylorSeed(platform, int(degree or 2))
    if name == "universal":
        return _universal(platform)
    return _network(platform, name)


def _network(platform: Platform, name: str) -> Seed:
    """A trained network, by path or by the name of one that comes with the package."""
    from gough.seeds.network import find_network, shipped_names

    ours = shipped_names(platform)
    if name in ours:
        return _shipped(platform, name)
    if Path(name).exists() or Path(name).suffix or len(Path(name).parts) > 1:
        return find_network(platform, name)
    raise GoughError(
        f"seed: unknown name {name!r}; expected auto, home, universal, taylor-ORDER, "
        "polynomial-DEGREE, the path of a trained network, or one that comes with gough for "
        f"platform {platform.name!r} as it is now "
        f"({', '.join(ours) or 'there is none: see gough train'})"
    )


@lru_cache(maxsize=64)
def _polynomial(platform: Platform, degree: int) -> Seed:
    return PolynomialSeed(platform, degree)


@lru_cache(maxsize=64)
def _universal(platform: Platform) -> Seed:
    from gough.seeds.universal import UniversalSeed

    return UniversalSeed(platform)


@lru_cache(maxsize=8)
def _shipped(platform: Platform, name: str) -> Seed:
    from gough.seeds.network import NetworkSeed

    return NetworkSeed.shipped(platform, name)

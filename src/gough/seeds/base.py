"""First guesses: anything that turns leg readings into poses can start the refinement."""

from __future__ import annotations

import re
import reprlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.kernel import layout
from gough.kernel.constants import kernel_constants, to_internal
from gough.kinematics import singularity_distance
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.polynomial import DEGREE, Polynomial, PolynomialSeed, fitted
from gough.seeds.taylor import SINGULAR, TaylorSeed
from gough.workspace import Workspace


class Seed(Protocol):
    """A first guess. Networks, given poses and polynomials all look like this to the solver."""

    @property
    def name(self) -> str:
        """Name for messages."""
        ...

    def guess(self, legs: Array) -> Pose:
        """Poses, batch (N,), for readings (N, 6); finite for finite readings."""
        ...


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


@dataclass(frozen=True, eq=False)
class Start:
    """First guesses for a batch, in the compiled code's form.

    Attributes:
        legs: readings (N, 6).
        poses: (N, 7) internal poses; None where the compiled code evaluates the polynomial.
        polynomial: what it evaluates then.
    """

    legs: Array
    poses: Array | None
    polynomial: Polynomial

    def of(self, rows: Any) -> Array:
        """Return internal poses (K, 7) of some rows, a slice or indices (K,)."""
        return self.polynomial(self.legs[rows]) if self.poses is None else self.poses[rows]


def starting_poses(platform: Platform, seed: Seed, legs: Array) -> Start:
    """Return the internal poses that readings (N, 6) start from, or the polynomial of them.

    Poses that are not finite become home.
    """
    if isinstance(seed, PolynomialSeed) and seed.platform == platform:
        return Start(legs, None, seed.polynomial)
    constants = kernel_constants(platform)
    poses = to_internal(constants, seed.guess(legs))
    bad = ~np.all(np.isfinite(poses), axis=-1)
    poses[bad] = constants[layout.HOME_POSE :][:7]
    return Start(legs, np.ascontiguousarray(poses), fitted(platform, 0))


def find_seed(platform: Platform, seed: str | Seed | Pose, *, guess_only: bool = False) -> Seed:
    """Return the seed that an argument of `gough.solve` stands for.

    Args:
        guess_only: the guess is the result, so "auto" is the universal network.

    Raises:
        GoughError: an unknown name; the text lists those there are.
        PlatformError: a polynomial for a platform without workspace.
    """
    if isinstance(seed, Pose):
        return PoseSeed(seed)
    if seed == "auto" and guess_only and singularity_distance(platform, platform.home) > SINGULAR:
        return _universal(platform)
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
    if kind in ("polynomial", "taylor") and re.fullmatch(r"[0-9]{0,3}", degree):
        if kind == "taylor":
            return TaylorSeed(platform, int(degree or 2))
        return _polynomial(platform, int(degree or DEGREE))
    if name == "universal":
        return _universal(platform)
    return _network(platform, name)


def _network(platform: Platform, name: str) -> Seed:
    """A trained network, by path or by the name of one that comes with the package."""
    from gough.seeds.network import find_network, shipped_names

    ours = shipped_names(platform)
    if name in ours:
        return _shipped(platform, name)
    if _may_be_path(name):
        return find_network(platform, name)
    raise GoughError(
        f"seed: unknown name {reprlib.repr(name)}; expected auto, home, universal, taylor-ORDER, "
        "polynomial-DEGREE, the path of a trained network, or one that comes with gough for "
        f"platform {platform.name!r} as it is now "
        f"({', '.join(ours) or 'there is none: see gough train'})"
    )


def _may_be_path(name: str) -> bool:
    try:
        return Path(name).exists() or bool(Path(name).suffix) or len(Path(name).parts) > 1
    except OSError:  # longer than names of files may be
        return False


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


@lru_cache(maxsize=64)
def further_starts(platform: Platform, count: int) -> Array:
    """Internal poses (count, 7) to try when the seed fails: home, then poses about it."""
    box = platform.workspace or Workspace.about_home(0.2 * platform.size, 40.0)
    about = box.sample(platform.home, max(count - 1, 0), seed=1)
    position = np.concatenate([platform.home.position[None], about.position])
    wxyz = np.concatenate([platform.home.wxyz[None], about.wxyz])
    return to_internal(kernel_constants(platform), Pose.trusted(position, wxyz))[:count]

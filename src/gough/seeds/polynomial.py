"""The polynomial first guess: least squares over a platform's workspace.

It is fitted in well under a second and kept on disk under the platform's digest. The monomials
and their order are fixed here; `gough.kernel.polynomial` evaluates them.
"""

from __future__ import annotations

import os
import zipfile
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import combinations_with_replacement
from math import comb
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gough import quaternion
from gough.checks import Array
from gough.errors import GoughError
from gough.kernel import layout
from gough.kernel.constants import from_internal, kernel_constants, to_internal
from gough.kernel.lanes import LANES
from gough.kernel.polynomial import MONOMIAL, evaluate
from gough.kinematics import assembly_sign, leg_lengths
from gough.platform import Platform
from gough.pose import Pose
from gough.whole_file import replacing

DEGREE = 3  # fast to evaluate, and the first degree that seldom leads to another mode
DEGREES = range(8)
SAMPLES_PER_MONOMIAL = 100
MINIMUM_SAMPLES = 20_000
CHUNK = 4096  # samples whose terms are in memory at a time
LARGEST_SINE = np.sin(np.radians(85))  # of a fitted rotation, up to which its sine is fitted
VERSION = 3  # of the fit: raise it when polynomials on disk are no longer right


class PolynomialSeed:
    """Poses as a polynomial of the readings, fitted for a platform and its workspace.

    Degree 0 is the platform's home pose, whatever the readings.

    Example:
        >>> seed = gough.PolynomialSeed(gough.Platform.load("reference"), 5)
        >>> seed.name, seed.polynomial.coefficients.shape
        ('polynomial-5', (462, 6))
    """

    def __init__(self, platform: Platform, degree: int = DEGREE) -> None:
        """Fit the polynomial, or take it from the cache on disk.

        Raises:
            GoughError: a degree that is not 0 to 7, or a workspace that cannot be reached.
            PlatformError: the platform states no workspace.
        """
        if degree not in DEGREES:
            raise GoughError(f"degree: expected 0 to 7, found {degree!r}")
        self.platform, self.degree = platform, degree
        self.polynomial = fitted(platform, degree)

    @property
    def name(self) -> str:
        """Name that `gough.solve` takes."""
        return f"polynomial-{self.degree}" if self.degree else "home"

    def guess(self, legs: Array) -> Pose:
        """Poses, batch (N,), for readings (N, 6)."""
        return from_internal(kernel_constants(self.platform), self.polynomial(legs))


@dataclass(frozen=True, eq=False)
class Polynomial:
    """Poses as a polynomial of the readings.

    Attributes:
        coefficients: (M, 6) of internal position and rotation, in the order of `monomials`.
            With u the last three values, (turn[4] + sqrt(1 - u.u), u) is along the quaternion of
            the rotation from turn[:4], in base coordinates. So turn[4] = 1 means that u is sin(a)
            times the axis of a rotation by a, turn[4] = 0 that it is sin(a / 2) times the axis.
        scaling: (2, 6) centre and inverse half range of the readings.
        turn: (5,) the reference quaternion and the number above.
        degree: total degree.
    """

    coefficients: Array
    scaling: Array
    turn: Array
    degree: int

    def __call__(self, legs: Array) -> Array:
        """Internal poses (N, 7) for readings (N, 6)."""
        if not (legs.flags.c_contiguous and legs.flags.writeable):
            legs = legs.copy()  # compiled code is made for such arrays alone
        out = np.empty((len(legs), 7))
        evaluate(*self.arrays, legs, self.scratch(), out)
        return out

    @cached_property
    def arrays(self) -> tuple[Array, NDArray[np.int64]]:
        """Arguments of the compiled code; see `gough.kernel.polynomial`."""
        flat = np.concatenate([self.scaling.ravel(), self.turn, self.coefficients.ravel()])
        return flat, np.stack(monomials(self.degree), axis=1)[1:].copy()

    def scratch(self) -> Array:
        """Return an array for the compiled code to work in."""
        return np.empty((MONOMIAL + len(self.coefficients)) * LANES)


def count(degree: int) -> int:
    """Return how many monomials of six variables there are up to `degree`: 1, 7, 28, 84, ..."""
    return comb(6 + degree, 6)


@lru_cache
def monomials(degree: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All monomials of six variables up to `degree`, degree by degree.

    Returns:
        parent (M,): the monomial, one degree lower, that each is a multiple of; variable (M,):
        by which of the six. The first is 1, and has none.
    """
    parent, variable = [0], [0]
    level: dict[tuple[int, ...], int] = {(): 0}  # of one degree, and where each is
    for total in range(1, degree + 1):
        factors = list(combinations_with_replacement(range(6), total))
        places = {e: len(parent) + i for i, e in enumerate(factors)}
        parent += [level[e[:-1]] for e in factors]
        variable += [e[-1] for e in factors]
        level = places
    return np.array(parent, np.int64), np.array(variable, np.int64)


@lru_cache(maxsize=64)
def fitted(platform: Platform, degree: int) -> Polynomial:
    """Return the polynomial of a platform: from memory, from disk, or fitted now and kept."""
    if degree == 0:
        return constant(platform)
    path = cache_folder() / f"polynomial-{VERSION}-{degree}-{platform.digest}.npz"
    found = _read(path, degree)
    if found is None:
        found = fit(platform, degree)
        _write(path, found)
    return found


def constant(platform: Platform) -> Polynomial:
    """Degree 0: home, whatever the readings."""
    home = kernel_constants(platform)[layout.HOME_POSE :][:7]
    coefficients = np.zeros((1, 6))
    coefficients[0, :3] = home[:3]
    scaling = np.stack([platform.home_legs, np.ones(6)])
    return Polynomial(coefficients, scaling, np.append(home[3:], 1.0), 0)


def fit(platform: Platform, degree: int, seed: int = 0) -> Polynomial:
    """Least squares over poses drawn from the platform's workspace.

    Poses beyond a singularity (det J not of home's sign) or out of a motor's reach are left
    out: the machine cannot be there.

    Raises:
        PlatformError: the platform states no workspace.
        GoughError: too few of its poses can be reached.
    """
    drawn = max(MINIMUM_SAMPLES, SAMPLES_PER_MONOMIAL * count(degree))
    pose = platform.sample_poses(drawn, seed)
    legs = leg_lengths(platform, pose)
    good = np.all(np.isfinite(legs), axis=-1) & (assembly_sign(platform, pose) > 0)
    if np.sum(good) < 5 * count(degree):
        raise GoughError(
            f"workspace: only {np.sum(good)} of {drawn} sampled poses can be reached without "
            "crossing a singularity; state a smaller workspace"
        )
    legs, pose = legs[good], pose[good]
    wanted, offset = _outputs(platform, pose)
    low, high = legs.min(axis=0), legs.max(axis=0)
    scaling = np.stack([(low + high) / 2, 2 / np.where(high > low, high - low, 2.0)])
    coefficients = _least_squares((legs - scaling[0]) * scaling[1], wanted, degree)
    return Polynomial(coefficients, scaling, np.append(platform.home.wxyz, offset), degree)


def _outputs(platform: Platform, pose: Pose) -> tuple[Array, float]:
    """Values (N, 6) to fit to poses (N,), and the last number of `Polynomial.turn`.

    The sine of the rotation is the antisymmetric part of its matrix, and fits better than the
    quaternion or the Gibbs vector; beyond a right angle it is not unique, and the quaternion's
    vector part takes its place.
    """
    internal = to_internal(kernel_constants(platform), pose)
    back = platform.home.inverse().wxyz
    turn = quaternion.product(pose.wxyz, np.broadcast_to(back, pose.wxyz.shape))
    turn = np.where(turn[:, :1] < 0, -turn, turn)
    w, v = turn[:, :1], turn[:, 1:]
    sine = 2 * w * v
    small = np.all(w * w > 0.5) and np.all(np.sum(sine**2, axis=-1) < LARGEST_SINE**2)
    return np.concatenate([internal[:, :3], sine if small else v], axis=-1), float(small)


def _least_squares(u: Array, wanted: Array, degree: int) -> Array:
    """Coefficients (M, 6) by normal equations, refined once by their own residual.

    Monomials of readings in -1..1 are far from orthogonal, but up to degree 7 the refinement
    leaves a fit as good as an orthogonal factorisation's, at a tenth of its time.
    """
    parts = [slice(i, i + CHUNK) for i in range(0, len(u), CHUNK)]
    terms = [_terms(u[part], degree) for part in parts]
    gram = np.sum([t.T @ t for t in terms], axis=0)
    used = np.flatnonzero(np.diagonal(gram) > 0)
    gram = gram[np.ix_(used, used)]
    gram[np.diag_indices_from(gram)] *= 1 + 1e-14
    coefficients = np.zeros((terms[0].shape[1], wanted.shape[1]))
    for _ in range(2):
        residual = [wanted[part] - t @ coefficients for part, t in zip(parts, terms, strict=True)]
        right = sum(t[:, used].T @ r for t, r in zip(terms, residual, strict=True))
        coefficients[used] += np.linalg.solve(gram, right)
    return coefficients


def _terms(u: Array, degree: int) -> Array:
    """Values of all monomials, (N, M)."""
    parent, variable = monomials(degree)
    terms = np.ones((len(u), len(parent)))
    for m in range(1, len(parent)):
        np.multiply(terms[:, parent[m]], u[:, variable[m]], out=terms[:, m])
    return terms


# ---- fits on disk: a convenience, never a need ----------------------------------------


def cache_folder() -> Path:
    """Return the folder of fits: $GOUGH_CACHE_DIR, else one in the user's cache folder."""
    chosen = os.environ.get("GOUGH_CACHE_DIR")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gough"


def _read(path: Path, degree: int) -> Polynomial | None:
    """The polynomial in a file; None where there is none, or it is damaged."""
    try:
        # opened here, since np.load leaves a damaged file open
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            arrays = file["coefficients"], file["scaling"], file["turn"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    if [a.shape for a in arrays] != [(count(degree), 6), (2, 6), (5,)]:
        return None
    return Polynomial(*arrays, degree) if all(np.all(np.isfinite(a)) for a in arrays) else None


def _write(path: Path, made: Polynomial) -> None:
    """Keep a polynomial; a read-only or full disk costs the next process a second, no more."""
    with suppress(OSError, GoughError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            np.savez(file, coefficients=made.coefficients, scaling=made.scaling, turn=made.turn)

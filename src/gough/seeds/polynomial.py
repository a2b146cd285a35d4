"""The polynomial first guess: least squares over a platform's workspace.

It is fitted in well under a second and kept on disk under the platform's digest. Which
monomials there are, and in what order, is fixed here; `polynomial_kernel.py` evaluates them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement
from math import comb

import numpy as np

from gough import quaternion
from gough.checks import Array
from gough.errors import GoughError
from gough.kernel import constants as geometry
from gough.kernel import layout
from gough.kinematics import assembly_sign, leg_lengths
from gough.platform import Platform
from gough.pose import Pose

SAMPLES_PER_MONOMIAL = 100
MINIMUM_SAMPLES = 20_000
CHUNK = 4096  # samples whose terms are in memory at a time


@dataclass(frozen=True, eq=False)
class Polynomial:
    """Poses as a polynomial of the readings.

    Attributes:
        coefficients: (M, 6) of internal position and Gibbs vector of the turn from the anchor,
            in the order of `monomials`.
        scaling: (2, 6) centre and inverse half range of the readings.
        anchor: (4,) the quaternion from which turns are counted.
        degree: total degree.
    """

    coefficients: Array
    scaling: Array
    anchor: Array
    degree: int

    def arrays(self) -> tuple:
        """What the compiled code takes; see `polynomial_kernel.guess_block`."""
        parent, variable, starts = monomials(self.degree)
        w, x, y, z = (float(v) for v in self.anchor)
        return self.coefficients, parent, variable, self.scaling, starts, (w, x, y, z)


def count(degree: int) -> int:
    """How many monomials of six variables there are up to `degree`: 1, 7, 28, 84, 210, ..."""
    return comb(6 + degree, 6)


@lru_cache
def monomials(degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All monomials of six variables up to `degree`, degree by degree.

    Returns:
        parent (M,): which monomial of the degree below each is a multiple of, counted within
        that degree; variable (M,): by which of the six; starts (degree + 2,): where each degree
        begins, and the end. The compiled loop takes two at a time, so a degree with an odd
        number of monomials is padded by one, whose coefficient is zero.
    """
    parent, variable, starts = [0, 0], [0, 0], [0, 2]
    level: list[tuple[int, ...]] = [()]
    for total in range(1, degree + 1):
        index = {e: i for i, e in enumerate(level)}
        level = list(combinations_with_replacement(range(6), total))
        padding = [0] * (len(level) % 2)
        parent += [index[e[:-1]] for e in level] + padding
        variable += [e[-1] for e in level] + padding
        starts.append(len(parent))
    return np.array(parent), np.array(variable), np.array(starts)


def constant(platform: Platform) -> Polynomial:
    """Degree 0: home, whatever the readings."""
    start = geometry.constants(platform)[layout.START :][:7]
    coefficients = np.zeros((2, 6))
    coefficients[0, :3] = start[:3]
    scaling = np.stack([platform.home_legs, np.ones(6)])
    return Polynomial(coefficients, scaling, start[3:].copy(), 0)


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
    legs, wanted = legs[good], _outputs(platform, pose[good])
    low, high = legs.min(axis=0), legs.max(axis=0)
    scaling = np.stack([(low + high) / 2, 2 / np.where(high > low, high - low, 2.0)])
    coefficients = _least_squares((legs - scaling[0]) * scaling[1], wanted, degree)
    return Polynomial(coefficients, scaling, platform.home.wxyz, degree)


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
    """Values of all monomials, (N, M); the padding is zero."""
    parent, variable, starts = monomials(degree)
    terms = np.zeros((len(u), len(parent)))
    terms[:, 0] = 1.0
    for d in range(1, degree + 1):
        below, first = starts[d - 1], starts[d]
        for m in range(first, first + comb(5 + d, d)):
            np.multiply(terms[:, below + parent[m]], u[:, variable[m]], out=terms[:, m])
    return terms


def _outputs(platform: Platform, pose: Pose) -> Array:
    """Internal position and Gibbs vector of the turn from home, (N, 6)."""
    internal = geometry.to_internal(geometry.constants(platform), pose)
    back = platform.home.inverse().wxyz
    turn = quaternion.product(pose.wxyz, np.broadcast_to(back, pose.wxyz.shape))
    return np.concatenate([internal[:, :3], turn[:, 1:] / turn[:, :1]], axis=-1)

"""The least-squares polynomial: the first guess that a network has to beat.

All monomials of the six scaled readings up to a total degree, times a matrix found in closed
form from samples. The papers on learned forward kinematics do not compare with it.
"""

from __future__ import annotations

import time
from itertools import combinations_with_replacement

import numpy as np

from gough import quaternion
from gough.checks import Array
from gough.errors import GoughError
from gough.learn.data import DatasetSpec, dataset
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.network import nearest_rotations

CHUNK = 4096
SAMPLES_PER_MONOMIAL = 20
MOST = 8


class PolynomialGuess:
    """A polynomial fitted to one platform's workspace; a `gough.seeds.base.Seed`.

    Args:
        degree: total degree, 0 to 8; there are comb(6 + degree, 6) monomials.
        samples: how many poses to fit to; 20 per monomial, at least 20,000, unless given.
        same_assembly: only poses with det J of home's sign.

    Attributes:
        parameters: numbers stored, 12 per monomial.
        seconds: time that the fit took.
    """

    def __init__(self, platform: Platform, degree: int = 7, *, seed: int = 0,
                 samples: int | None = None, same_assembly: bool = False) -> None:  # fmt: skip
        if not 0 <= degree <= MOST:
            raise GoughError(f"degree: expected 0 to {MOST}, got {degree}")
        began = time.perf_counter()
        self.name = f"polynomial-{degree}"
        self._platform, self._degree = platform, degree
        monomials = len(_steps(degree)[0])
        count = samples or max(20_000, SAMPLES_PER_MONOMIAL * monomials)
        pose, legs = dataset(platform, DatasetSpec(count, seed, same_assembly))
        low, high = legs.min(axis=0), legs.max(axis=0)
        self._middle, self._half = (low + high) / 2, np.maximum((high - low) / 2, 1e-12)
        self._matrix = self._fit(legs, _targets(platform, pose))
        self.parameters = self._matrix.size
        self.seconds = time.perf_counter() - began

    def guess(self, legs: Array) -> Pose:
        """Poses (N,) for readings (N, 6)."""
        parts = [self._terms(legs[i : i + CHUNK]) @ self._matrix
                 for i in range(0, len(legs), CHUNK)]  # fmt: skip
        raw = np.concatenate(parts) if parts else np.zeros((0, 12))
        turn = Pose.from_rotation(np.zeros(3), nearest_rotations(raw[:, 3:].reshape(-1, 3, 3)))
        home = self._platform.home
        return Pose(home.position + raw[:, :3], quaternion.product(home.wxyz, turn.wxyz))

    def _fit(self, legs: Array, wanted: Array) -> Array:
        """Normal equations, then one step of refinement by the residual."""
        parts = [slice(i, i + CHUNK) for i in range(0, len(legs), CHUNK)]
        size = len(_steps(self._degree)[0])
        gram, right = np.zeros((size, size)), np.zeros((size, wanted.shape[1]))
        for part in parts:
            terms = self._terms(legs[part])
            gram += terms.T @ terms
            right += terms.T @ wanted[part]
        gram[np.diag_indices(size)] *= 1 + 1e-14
        matrix = np.linalg.solve(gram, right)
        rest = np.zeros_like(right)
        for part in parts:
            terms = self._terms(legs[part])
            rest += terms.T @ (wanted[part] - terms @ matrix)
        return matrix + np.linalg.solve(gram, rest)

    def _terms(self, legs: Array) -> Array:
        """All monomials, (N, M), each the product of an earlier one and a reading."""
        u = ((legs - self._middle) / self._half).T
        parent, variable = _steps(self._degree)
        terms = np.empty((len(parent), u.shape[1]))
        terms[0] = 1.0
        for i in range(1, len(parent)):
            np.multiply(terms[parent[i]], u[variable[i]], out=terms[i])
        return terms.T


def _steps(degree: int) -> tuple[list[int], list[int]]:
    """For every monomial the earlier one and the variable that it is the product of."""
    index: dict[tuple[int, ...], int] = {(): 0}
    parent, variable = [0], [0]
    for total in range(1, degree + 1):
        for monomial in combinations_with_replacement(range(6), total):
            index[monomial] = len(parent)
            parent.append(index[monomial[:-1]])
            variable.append(monomial[-1])
    return parent, variable


def _targets(platform: Platform, pose: Pose) -> Array:
    """Shift and rotation matrix relative to home, (N, 12)."""
    turn = quaternion.product(platform.home.inverse().wxyz, pose.wxyz)
    relative = Pose(pose.position - platform.home.position, turn)
    return np.concatenate([relative.position, relative.rotation.reshape(-1, 9)], axis=-1)

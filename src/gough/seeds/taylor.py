"""The inverse Taylor series about home: a first guess in closed form, for any kind of leg.

Along the ray s d, 0 <= s <= 1, from home's strut lengths to the measured ones, the pose is a
power series in s. Its terms follow one from another, each at the cost of one product with the
inverse Jacobian at home. With the twist x = (t, w), where w is twice the Gibbs vector of the
rotation and t the translation of the platform joints' centre, joint r_i moves by

    delta_i = t + (w x r_i + w x (w x r_i) / 2) / (1 + |w|^2 / 4),

and its strut d_i, of length l_i, changes by |d_i + delta_i| - l_i. Comparing powers of s gives
J x_1 = d and J x_k = -(what x_1 to x_(k-1) contribute at order k).

`cross`, `series` and `struts_at` use operators alone: they take NumPy arrays and torch tensors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gough import quaternion
from gough.checks import Array
from gough.errors import GoughError
from gough.kinematics import equivalent_struts
from gough.platform import Platform
from gough.pose import Pose

HIGHEST = 6  # beyond it the series gains nothing where it converges, and diverges faster elsewhere
SINGULAR = 1e-12  # reciprocal condition of the Jacobian below which home is singular
CHUNK = 4096  # rows in memory at a time

NEXT, LAST = [1, 2, 0], [2, 0, 1]


def cross(a: Any, b: Any) -> Any:
    """Return a x b over the first axis, (3, ...)."""
    return a[NEXT] * b[LAST] - a[LAST] * b[NEXT]


def series(base: Any, joints: Any, inverse: Any, change: Any, order: int) -> list[Any]:
    """Terms of the inverse Taylor series, in leg space: term k is J x_k.

    Args:
        base, joints: ends of the struts at home, (M, 6, 3), from the platform joints' centre.
        inverse: inverse of the Jacobian at home, (M, 6, 6).
        change: strut lengths minus those at home, (M, 6, N).
        order: number of terms, 1 or more.

    Returns:
        `order` arrays (M, 6, N). The inverse Jacobian times their sum is the twist.
    """
    strut, r = by_component(joints - base), by_component(joints)  # (3, M, 6, 1)
    length = (strut * strut).sum(0) ** 0.5
    # coefficient k of: w; w x r; numerator of delta - t; delta; |w|^2 / 4; 1 / (1 + |w|^2 / 4)
    w: list[Any] = [0.0]
    wr, top, delta, square, factor = list(w), list(w), list(w), [0.0, 0.0], [1.0, 0.0]
    terms = [change]
    for k in range(1, order + 1):
        turned = sum(cross(w[j], wr[k - j]) for j in range(1, k)) / 2
        if k > 1:
            square.append(sum((w[j] * w[k - j]).sum(0) for j in range(1, k)) / 4)
            factor.append(-sum(square[j] * factor[k - j] for j in range(2, k + 1)))
        # what lower orders contribute; factor 1 is zero
        rest = turned + sum(top[i] * factor[k - i] for i in range(1, k - 1))
        if k > 1:
            twice = 2 * (strut * rest).sum(0)
            twice = twice + sum((delta[j] * delta[k - j]).sum(0) for j in range(1, k))
            terms.append((change * change * (k == 2) - twice) / (2 * length))
        x = (inverse @ terms[-1]).swapaxes(0, 1)[:, :, None]  # (6, M, 1, N)
        w.append(x[3:])
        wr.append(cross(w[k], r))
        top.append(wr[k] + turned)
        delta.append(x[:3] + wr[k] + rest)
    return terms


def by_component(points: Any) -> Any:
    """Points (M, 6, 3) as components (3, M, 6, 1)."""
    return points.swapaxes(-1, -2).swapaxes(0, 1)[..., None]


@dataclass(frozen=True, eq=False)
class HomeStruts:
    """Readings as changes of a telescopic hexapod at home, in units of its size.

    Points count from the centre of the platform joints at home. A rotary platform is another
    telescopic one for each reading, since its motors move the lower ends of the struts: M is 1
    or the number of readings, and M N is that number.

    Attributes:
        base, joints: ends of the struts, (M, 6, 3).
        inverse: inverse of the Jacobian, rows (n_i, r_i x n_i), (M, 6, 6).
        change: strut lengths minus those at home, (M, 6, N).
        lengths: strut lengths, (M, 6, N).
        side: sign of det J at the platform's home.
    """

    base: Array
    joints: Array
    inverse: Array
    change: Array
    lengths: Array
    side: float

    @classmethod
    def of(cls, platform: Platform, legs: Array) -> HomeStruts:
        """Struts for readings (N, 6).

        Raises:
            GoughError: home is singular.
        """
        lower, lengths = equivalent_struts(platform, legs)
        many = platform.rotary is not None
        base, joints = _ends_at_home(platform, lower if many else lower[:1])
        home = np.linalg.norm(joints - base, axis=-1)
        lengths = lengths / platform.size
        lengths = lengths[..., None] if many else lengths.T[None]
        inverse = _inverses(platform, _home_jacobian(base, joints))
        change = lengths - home[..., None]
        return cls(base, joints, inverse, change, lengths, _home_side(platform))

    def pick(self, chosen: NDArray[np.bool_]) -> HomeStruts:
        """The chosen (M, N) of the readings."""
        if len(self.base) == 1:
            rows = chosen[0]
            return replace(self, change=self.change[..., rows], lengths=self.lengths[..., rows])
        names = ("base", "joints", "inverse", "change", "lengths")
        return replace(self, **{name: getattr(self, name)[chosen[:, 0]] for name in names})

    def twist(self, changes: Array) -> Array:
        """Twists (6, M, N) that change the strut lengths by (M, 6, N), to first order."""
        return np.swapaxes(self.inverse @ changes, 0, 1)

    def pose(self, platform: Platform, t: Array, wxyz: Array) -> Pose:
        """Poses (N,) after translations (3, M, N) and rotations (4, M, N) from home."""
        moved = platform.size * (t + self.arm(platform, wxyz)).reshape(3, -1).T
        wxyz = wxyz.reshape(4, -1).T
        _, centre = _joints_at_home(platform)
        turned = quaternion.product(wxyz, np.broadcast_to(platform.home.wxyz, wxyz.shape))
        return Pose(moved + centre - platform.pivot_point, turned)

    def arm(self, platform: Platform, wxyz: Array) -> Array:
        """Vectors (3, M, N) from the joints' centre to the pivot after rotations (4, M, N)."""
        _, centre = _joints_at_home(platform)
        r = (platform.home.position + platform.pivot_point - centre) / platform.size
        turned = cross(wxyz[1:], r[:, None, None])
        return r[:, None, None] + 2 * (wxyz[0] * turned + cross(wxyz[1:], turned))


class TaylorSeed:
    """Poses by the inverse Taylor series about home: nothing is fitted, no workspace is needed.

    Args:
        order: number of terms, 1 to 6; 1 is the linear guess.
    """

    def __init__(self, platform: Platform, order: int = 2) -> None:
        if order not in range(1, HIGHEST + 1):
            raise GoughError(f"taylor: expected an order of 1 to {HIGHEST}, found {order!r}")
        self.platform, self.order = platform, order

    @property
    def name(self) -> str:
        """Name that `gough.solve` takes."""
        return f"taylor-{self.order}"

    def guess(self, legs: Array) -> Pose:
        """Poses (N,) for readings (N, 6)."""
        return in_chunks(self._guess, legs)

    def _guess(self, legs: Array) -> Pose:
        struts = HomeStruts.of(self.platform, legs)
        terms = series(struts.base, struts.joints, struts.inverse, struts.change, self.order)
        x = struts.twist(np.sum(terms, axis=0))
        return struts.pose(self.platform, x[:3], gibbs_quaternion(x[3:]))


def in_chunks(guess: Callable[[Array], Pose], legs: Array) -> Pose:
    """Apply a guess for readings (n, 6) to any number of them, with bounded memory."""
    parts = [guess(legs[i : i + CHUNK]) for i in range(0, len(legs), CHUNK)]
    position = np.concatenate([np.zeros((0, 3)), *(p.position for p in parts)])
    return Pose.trusted(position, np.concatenate([np.zeros((0, 4)), *(p.wxyz for p in parts)]))


def jacobian(struts: Array, arms: Array) -> Array:
    """Rows (n_i, r_i x n_i), (M, N, 6, 6), of struts and levers by components (3, M, 6, N)."""
    n = struts / np.sqrt(np.sum(struts * struts, axis=0))
    return np.moveaxis(np.concatenate([n, cross(arms, n)]), (0, 2), (-1, -2))


def _inverses(platform: Platform, rows: Array) -> Array:
    """Inverse Jacobians at home, (M, 6, 6); the pseudo-inverse where one of many is singular."""
    if len(rows) and SINGULAR * np.linalg.cond(rows[0]) > 1:
        raise GoughError(
            f"home: platform {platform.name!r} is singular there, so no series starts from it; "
            "choose another home or another seed"
        )
    try:
        return np.linalg.inv(rows).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        return np.linalg.pinv(rows).astype(np.float64, copy=False)


def gibbs_quaternion(w: Array) -> Array:
    """Unit quaternions (4, ...) of rotations whose Gibbs vectors are w / 2, (3, ...)."""
    wxyz = np.concatenate([np.ones_like(w[:1]), w / 2])
    return wxyz / np.sqrt(np.sum(wxyz * wxyz, axis=0))


def _ends_at_home(platform: Platform, lower: Array) -> tuple[Array, Array]:
    """Lower ends (M, 6, 3) and platform joints at home, from their centre, in sizes."""
    joints, centre = _joints_at_home(platform)
    base = (lower - centre) / platform.size
    return base, np.broadcast_to(joints / platform.size, base.shape)


def _home_jacobian(base: Array, joints: Array) -> Array:
    """Rows (n_i, r_i x n_i) at home, (M, 6, 6)."""
    return jacobian(by_component(joints - base), by_component(joints))[:, 0]


def _home_side(platform: Platform) -> float:
    """Sign of det J at home."""
    lower, _ = equivalent_struts(platform, platform.home_legs[None])
    rows = _home_jacobian(*_ends_at_home(platform, lower))
    return float(np.linalg.slogdet(rows)[0][0])


def _joints_at_home(platform: Platform) -> tuple[Array, Array]:
    """Platform joints at home from their centre, and the centre, in base coordinates."""
    pivot = platform.pivot_point
    joints = platform.home.apply(platform.moving - pivot) + pivot
    centre = joints.mean(axis=0)
    return joints - centre, centre

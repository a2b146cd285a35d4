"""Damped Newton steps for many poses at once in NumPy, and what remains after them.

They polish a guess that a network or a series made. A step solves (J^T J + mu I) x = J^T e for the
strut errors e, with mu their mean square (Levenberg-Marquardt; Fan and Yuan, Computing 74, 2005):
next to nothing where Newton's method converges, which leaves it quadratic, and short steps near
singularities. The next step, with the same matrix, is not taken: it predicts the error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gough import quaternion
from gough.checks import Array
from gough.seeds.taylor import HomeStruts, by_component, cross, gibbs_quaternion, jacobian

FAR = 1e-3  # predicted error [share of the size, rad] above which a row gets further steps,
FURTHER = 3  # at most so many


@dataclass(frozen=True, eq=False)
class Polished:
    """Poses from home by components, and the next step (6, M, N): the error predicted of them.

    Attributes:
        t, wxyz: translation (3, M, N) of the platform joints' centre and rotation (4, M, N).
    """

    t: Array
    wxyz: Array
    step: Array


def polish(home: HomeStruts, t: Array, wxyz: Array) -> Polished:
    """Take one step from each pose, and up to three more where the predicted error is large.

    Poses that are not finite become home, with an infinite error.
    """
    finite = np.isfinite(t).all(0) & np.isfinite(wxyz).all(0)
    t = np.where(finite, t, 0.0)
    wxyz = np.where(finite, wxyz, np.array([1.0, 0, 0, 0])[:, None, None])
    found = _step(home, t, wxyz)
    found.step[:, ~finite] = np.inf
    for _ in range(FURTHER):
        far = finite & (np.max(np.abs(found.step), axis=0) > FAR)
        if not far.any():
            break
        part = home.pick(far)
        shape = part.lengths[:, 0].shape  # (M, N) of the chosen rows
        start = (value[:, far].reshape(-1, *shape) for value in (found.t, found.wxyz))
        again = _step(part, *start)
        for name in ("t", "wxyz", "step"):
            getattr(found, name)[:, far] = getattr(again, name).reshape(-1, np.sum(far))
    return found


def _step(home: HomeStruts, t: Array, wxyz: Array) -> Polished:
    """One step, where it lessens the largest strut error, and the next."""
    lever, strut, miss = _struts(home, t, wxyz)
    gain = _gain(strut, lever, miss)
    step = gain(miss)
    turn = np.moveaxis(gibbs_quaternion(step[3:]), 0, -1)
    turned = np.moveaxis(quaternion.product(turn, np.moveaxis(wxyz, 0, -1)), -1, 0)
    moved = t + step[:3]
    left = _struts(home, moved, turned)[2]
    better = np.max(np.abs(left), axis=1) < np.max(np.abs(miss), axis=1)
    return Polished(
        np.where(better, moved, t), np.where(better, turned, wxyz),
        np.where(better, gain(left), step),
    )  # fmt: skip


def _struts(home: HomeStruts, t: Array, wxyz: Array) -> tuple[Array, Array, Array]:
    """Levers and struts by components (3, M, 6, N), and measured lengths minus theirs (M, 6, N)."""
    r, u, w = by_component(home.joints), wxyz[1:, :, None], wxyz[0, :, None]
    turned = cross(u, r)
    lever = r + 2 * (w * turned + cross(u, turned))
    strut = lever + t[:, :, None] - by_component(home.base)
    return lever, strut, home.lengths - np.sqrt(np.sum(strut * strut, axis=0))


def _gain(strut: Array, lever: Array, miss: Array) -> Callable[[Array], Array]:
    """Map of strut errors (M, 6, N) to steps (6, M, N), with the matrix of these struts."""
    J = jacobian(strut, lever)  # (M, N, 6, 6)
    back = np.swapaxes(J, -1, -2)
    damping = np.mean(miss * miss, axis=1) + np.finfo(float).eps
    matrix = np.linalg.solve(back @ J + damping[..., None, None] * np.eye(6), back)

    def gain(errors: Array) -> Array:
        return np.moveaxis((matrix @ np.swapaxes(errors, 1, 2)[..., None])[..., 0], -1, 0)

    return gain

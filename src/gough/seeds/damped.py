"""Damped Newton steps for many poses at once in NumPy, and what remains after them.

They polish a guess that a network or a series made. A step solves (J^T J + mu I) x = J^T e for the
strut errors e, with mu their mean square (Levenberg-Marquardt; Fan and Yuan, Computing 74, 2005):
next to nothing where Newton's method converges, which leaves it quadratic, and short steps near
singularities. The next step, with the same matrix, is not taken: it predicts the error.

Steps can end beyond a singularity, where det J has not home's sign: at the twin of the pose that is
looked for. Two poses with the same readings meet where J is singular, one on either side. Let sigma
be the least singular value of J, u and v its vectors, and c = u . d2 l / ds2 the curvature of the
strut lengths along v. Moving by s v changes them along u by sigma s + c s^2 / 2, which is nothing
at s = 0 and at the other twin, s = -2 sigma / c. The steps go on from there. Where they end beyond
the singularity again, the distance between the twins is the error predicted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gough import quaternion
from gough.checks import Array
from gough.seeds.taylor import HomeStruts, by_component, cross, gibbs_quaternion, jacobian

FAR = 1e-3  # predicted error [share of the size, rad] above which a row gets further steps,
FURTHER = 3  # at most so many
WIDEST = 1.0  # [share of the size, rad] largest move to a twin


@dataclass(frozen=True, eq=False)
class Polished:
    """Poses from home by components, and the next step (6, M, N): the error predicted of them.

    Attributes:
        t, wxyz: translation (3, M, N) of the platform joints' centre and rotation (4, M, N).
    """

    t: Array
    wxyz: Array
    step: Array


def polish(home: HomeStruts, *guesses: Array) -> Polished:
    """Take one step from each guess, and up to three more where the predicted error is large.

    Poses beyond a singularity are exchanged for their twins on home's side.

    Args:
        guesses: twists (6, M, N) from home; w is twice the Gibbs vector. Rows whose predicted
            error stays large start from the next guess too, and the better end counts. Guesses
            that are not finite are home, with an infinite error.
    """
    found = _ended(home, guesses[0])
    for guess in guesses[1:]:
        far = _size(found) > FAR
        if not far.any():
            break
        before, again = _taken(found, far), _ended(home.pick(far), _picked(guess, far))
        _put(found, far, _better(before, again))
    return found


def _better(before: Polished, again: Polished) -> Polished:
    """The ends with the smaller predicted errors; with the larger ones where neither is small."""
    better = _size(again) < _size(before)
    larger = np.where(better, before.step, again.step)
    step = np.where(_size(again) < FAR, again.step, larger)
    return Polished(
        np.where(better, again.t, before.t), np.where(better, again.wxyz, before.wxyz), step
    )


PARTS = ("t", "wxyz", "step")


def _size(found: Polished) -> Array:
    """Largest number of the next step, (M, N)."""
    return np.max(np.abs(found.step), axis=0)


def _ended(home: HomeStruts, twist: Array) -> Polished:
    """End of the steps from a guess, on home's side if they can."""
    finite = np.isfinite(twist).all(0)
    twist = np.where(finite, twist, 0.0)
    found = _steps(home, twist[:3], gibbs_quaternion(twist[3:]))
    found.step[:, ~finite] = np.inf
    beyond = finite & (_side(home, found) != home.side)
    if beyond.any():
        _put(found, beyond, _crossed(home.pick(beyond), _taken(found, beyond)))
    return found


def _steps(home: HomeStruts, t: Array, wxyz: Array) -> Polished:
    """One step from each pose, and more where the predicted error is large."""
    found = _step(home, t, wxyz)
    for _ in range(FURTHER):
        far = _size(found) > FAR
        if not far.any():
            break
        start = _taken(found, far)
        _put(found, far, _step(home.pick(far), start.t, start.wxyz))
    return found


def _picked(values: Array, chosen: NDArray[np.bool_]) -> Array:
    """The chosen (M, N) of values (k, M, N), in the shape of `HomeStruts.pick`."""
    count = int(chosen.sum())
    return values[:, chosen].reshape(-1, *((1, count) if len(chosen) == 1 else (count, 1)))


def _taken(found: Polished, chosen: NDArray[np.bool_]) -> Polished:
    return Polished(*(_picked(getattr(found, name), chosen) for name in PARTS))


def _put(found: Polished, chosen: NDArray[np.bool_], new: Polished) -> None:
    """Replace the chosen (M, N) poses."""
    for name in PARTS:
        value = getattr(new, name)
        getattr(found, name)[:, chosen] = value.reshape(len(value), -1)


def _side(home: HomeStruts, found: Polished) -> Array:
    """Sign of det J (M, N)."""
    lever, strut, _ = _struts(home, found.t, found.wxyz)
    return np.linalg.slogdet(jacobian(strut, lever))[0]


def _crossed(home: HomeStruts, found: Polished) -> Polished:
    """Poses on home's side of the singularity, from their twins beyond it."""
    move = _to_twin(home, found)
    again = _steps(home, *_moved(found.t, found.wxyz, move))
    right = (_side(home, again) == home.side) & np.isfinite(again.step).all(0)
    unsure = np.where(np.abs(found.step) > np.abs(move), found.step, move)
    return Polished(
        np.where(right, again.t, found.t), np.where(right, again.wxyz, found.wxyz),
        np.where(right, again.step, unsure),
    )  # fmt: skip


def _to_twin(home: HomeStruts, found: Polished) -> Array:
    """Twists (6, M, N) to the twins on the other side of the nearest singularity."""
    lever, strut, _ = _struts(home, found.t, found.wxyz)
    u, sigma, v = np.linalg.svd(jacobian(strut, lever))
    along = np.moveaxis(v[..., -1, :], -1, 0)  # (6, M, N)
    w = along[3:, :, None]
    turned = cross(w, lever)
    speed, length = along[:3, :, None] + turned, np.sqrt(np.sum(strut * strut, axis=0))
    n = strut / length
    bend = (np.sum(speed * speed, axis=0) - np.sum(n * speed, axis=0) ** 2) / length
    bend = bend + np.sum(n * cross(w, turned), axis=0)  # d2 l / ds2, (M, 6, N)
    curvature = np.sum(np.moveaxis(u[..., -1], -1, 1) * bend, axis=1)
    return np.clip(-2 * sigma[..., -1] / curvature, -WIDEST, WIDEST) * along


def _moved(t: Array, wxyz: Array, step: Array) -> tuple[Array, Array]:
    """Translations and rotations after steps (6, M, N)."""
    turn = np.moveaxis(gibbs_quaternion(step[3:]), 0, -1)
    turned = np.moveaxis(quaternion.product(turn, np.moveaxis(wxyz, 0, -1)), -1, 0)
    return t + step[:3], turned


def _step(home: HomeStruts, t: Array, wxyz: Array) -> Polished:
    """One step, where it lessens the largest strut error, and the next."""
    lever, strut, miss = _struts(home, t, wxyz)
    gain = _gain(strut, lever, miss)
    step = gain(miss)
    moved, turned = _moved(t, wxyz, step)
    left = _struts(home, moved, turned)[2]
    better = np.max(np.abs(left), axis=1) < np.max(np.abs(miss), axis=1)
    ahead = np.where(better, gain(left), step)
    remaining = np.max(np.abs(np.where(better[:, None], left, miss)), axis=1)
    return Polished(
        np.where(better, moved, t), np.where(better, turned, wxyz), _at_least(ahead, remaining)
    )


def _at_least(step: Array, miss: Array) -> Array:
    """A step (6, M, N) as long as strut errors (M, N) need it; damping makes it shorter.

    A strut changes by |v| + r |w| at most, under 3 times the largest number of the step.
    """
    size = np.max(np.abs(step), axis=0)
    return step * np.fmax(1.0, miss / (3 * size + np.finfo(float).tiny))


def strut_errors(home: HomeStruts, twist: Array) -> Array:
    """Measured strut lengths minus those after twists (6, M, N) from home, (M, 6, N)."""
    return _struts(home, twist[:3], gibbs_quaternion(twist[3:]))[2]


def _struts(home: HomeStruts, t: Array, wxyz: Array) -> tuple[Array, Array, Array]:
    """Levers and struts by components (3, M, 6, N), and measured lengths minus theirs (M, 6, N)."""
    r, u, w = by_component(home.joints), wxyz[1:, :, None], wxyz[0, :, None]
    turned = cross(u, r)
    lever = r + 2 * (w * turned + cross(u, turned))
    strut = lever + t[:, :, None] - by_component(home.base)
    return lever, strut, home.lengths - np.sqrt(np.sum(strut * strut, axis=0))


def _gain(strut: Array, lever: Array, miss: Array) -> Callable[[Array], Array]:
    """Map of strut errors (M, 6, N) to steps (6, M, N), with the matrix of these struts.

    The matrices are factored all at once, L D L^T by columns: LAPACK takes one at a time.
    """
    J = np.moveaxis(jacobian(strut, lever), (-1, -2), (0, 2))  # (6, M, legs, N)
    matrix = np.einsum("amin,bmin->abmn", J, J)
    least = np.finfo(float).eps
    damping = np.mean(miss * miss, axis=1) + least
    pivots, columns = [], []
    for k in range(6):
        pivots.append(np.maximum(matrix[0, 0] + damping, least))
        columns.append(matrix[1:, 0] / pivots[k])
        matrix = matrix[1:, 1:] - columns[k][:, None] * matrix[0, 1:]

    def gain(errors: Array) -> Array:
        x = np.sum(J * errors, axis=2)
        for k, column in enumerate(columns):
            x[k + 1 :] -= column * x[k]
        for k in reversed(range(6)):
            x[k] = x[k] / pivots[k] - np.sum(columns[k] * x[k + 1 :], axis=0)
        return x

    return gain

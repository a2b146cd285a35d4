"""By how much struts at measured poses are too long, and what that depends on.

A measured pose M maps tool coordinates to those of the measuring frame. With the frame F (base to
measuring coordinates) and the tool H (platform to tool coordinates), the platform is at
X = F^-1 M H, and strut i of a leg whose lower end is s_i and whose length is l_i has the error

    e_i = |R_M (R_H p_i + t_H) + t_M - (R_F s_i + t_F)| - l_i .

With n_i the unit vector along the strut in the measuring frame, q_i the platform joint seen from
the tool's origin, and twists (v, w) that act from the left (t -> t + v, R -> exp(w) R),

    de_i = n_i . dv_M + (q_i x n_i) . dw_M                         the measured pose
         - n_i . dv_F - (R_F s_i x n_i) . dw_F                     the measuring frame
         + m_i . dv_H + (R_H p_i x m_i) . dw_H,   m_i = R_M^T n_i  the tool
         - (R_F^T n_i) . ds_i + (R_H^T m_i) . dp_i - dl_i .

The struts themselves are those of `gough.struts`, with which the tests compare them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gough import quaternion
from gough.calibration.arrays import Array
from gough.calibration.parameters import ARM, BASE, MOVING, OFFSET, ROD, TILT, Parameters
from gough.frames import about_origin
from gough.pose import Pose


def exp_rotation(vector: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3)."""
    exact = np.asarray(vector, dtype=np.float64)
    return quaternion.to_matrix(quaternion.from_rotation_vector(exact))


@dataclass(frozen=True)
class Rigid:
    """Rigid motions x -> R x + t as arrays (..., 3, 3) and (..., 3)."""

    R: Array
    t: Array

    @classmethod
    def identity(cls) -> Rigid:
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def of(cls, pose: Pose, pivot: Array | float = 0.0) -> Rigid:
        """The motion that a pose stands for, given the point it rotates about."""
        whole = about_origin(pose, np.zeros(3) + pivot)
        return cls(whole.rotation, whole.position)

    def pose(self) -> Pose:
        """Return a pose without pivot."""
        return Pose.from_rotation(self.t, self.R)

    def __matmul__(self, other: Rigid) -> Rigid:
        return Rigid(self.R @ other.R, (self.R @ other.t[..., None])[..., 0] + self.t)

    def __getitem__(self, rows) -> Rigid:
        return Rigid(self.R[rows], self.t[rows])

    def inverse(self) -> Rigid:
        back = np.swapaxes(self.R, -1, -2)
        return Rigid(back, -(back @ self.t[..., None])[..., 0])

    def moved(self, twist: Array) -> Rigid:
        """After twists (..., 6) from the left: t + v, exp(w) R."""
        return Rigid(exp_rotation(twist[..., 3:]) @ self.R, self.t + twist[..., :3])


@dataclass(frozen=True)
class Struts:
    """Errors of struts and their derivatives, for n poses.

    Attributes:
        errors: (n, 6) by how much a strut is too long [platform unit].
        legs: (n, 6, K) d errors / d parameters of the leg.
        reading: (n, 6) d errors / d reading.
        n, m: (n, 6, 3) directions of the struts in the measuring frame and in tool coordinates.
        lever: (n, 6, 3) platform joints from the tool's origin, in the measuring frame.
        base: (n or 1, 6, 3) lower ends from the frame's origin, in the measuring frame.
        moving: (6, 3) platform joints from the platform's origin, in tool coordinates.
    """

    errors: Array
    legs: Array
    reading: Array
    n: Array
    m: Array
    lever: Array
    base: Array
    moving: Array

    @cached_property
    def twist(self) -> Array:
        """(n, 6, 6) d errors / d twist of the measured pose."""
        return _screws(self.n, self.lever)

    @property
    def frame(self) -> Array:
        """(n, 6, 6) d errors / d twist of F."""
        return -_screws(self.n, self.base)

    @property
    def tool(self) -> Array:
        """(n, 6, 6) d errors / d twist of H."""
        return _screws(self.m, self.moving)


def _screws(direction: Array, point: Array) -> Array:
    """Rows (..., 6) of lines through points (..., 3): direction, and point x direction."""
    out = np.empty((*direction.shape[:-1], 6))
    out[..., :3] = direction
    _cross(point, direction, out[..., 3:])
    return out


def struts(
    parameters: Parameters, values: Array, legs: Array, pose: Rigid, frame: Rigid, tool: Rigid
) -> Struts:
    """Struts of a machine with `values` (6, K) at readings (n, 6) and measured poses (n)."""
    low, length, own, reading = _lower_ends(parameters, values, legs)
    base = low @ frame.R.T
    moving = values[:, MOVING] @ tool.R.T
    lever = (moving + tool.t) @ np.swapaxes(pose.R, -1, -2)
    vector = lever - base
    vector += (pose.t - frame.t)[:, None]
    now = np.sqrt(np.einsum("nli,nli->nl", vector, vector))
    n = vector / now[..., None]
    m = n @ pose.R
    nb = n @ frame.R
    out = np.empty((*n.shape[:2], parameters.count))
    np.negative(nb, out=out[..., BASE])
    out[..., MOVING] = m @ tool.R
    for column, derivative in own:
        out[..., column] = derivative(nb)
    return Struts(now - length, out, reading(nb), n, m, lever, base, moving)


def _cross(a: Array, b: Array, out: Array | None = None) -> Array:
    """a x b for (..., 3), without the checks that make `np.cross` slow on many small ones."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape)) if out is None else out
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out


def _lower_ends(parameters: Parameters, values: Array, legs: Array):
    """Lower ends and lengths of the struts; the derivatives that depend on the kind of leg.

    Returns:
        Points (n or 1, 6, 3); lengths (n, 6) or (6,); pairs of a column and a function of the
        strut's direction (n, 6, 3) in base axes that gives d errors / d column; and the same for
        the reading.
    """
    travel = legs - parameters.rest
    gain = parameters.gain(values)
    true = values[:, OFFSET] + gain * travel
    last = [(-1, lambda nb: slope(nb) * travel)] if parameters.gains else []
    if not parameters.rotary:
        slope = lambda nb: np.broadcast_to(-1.0, legs.shape)  # noqa: E731
        low, length, own = values[None, :, BASE], true, [(OFFSET, slope)]
    else:
        arm = values[:, ARM]
        x, y = parameters.axes(values)
        cos, sin = np.cos(true)[..., None], np.sin(true)[..., None]
        u, rate = cos * x + sin * y, arm[:, None] * (cos * y - sin * x)
        slope = lambda nb: -np.sum(nb * rate, axis=-1)  # noqa: E731
        drawn = parameters.drawing.rotary
        assert drawn is not None

        axes = _turning_axes(drawn.axis_x, drawn.axis_y, values[:, TILT])

        def tilt(nb: Array) -> Array:
            moment = -arm[:, None] * _cross(u, nb)
            return np.stack([np.sum(moment * a, -1) for a in axes], -1)

        low, length = values[:, BASE] + arm[:, None] * u, values[:, ROD]
        own = [
            (OFFSET, slope),
            (ARM, lambda nb: -np.sum(nb * u, axis=-1)),
            (ROD, lambda nb: np.broadcast_to(-1.0, legs.shape)),
            (TILT, tilt),
        ]
    return low, length, [*own, *last], lambda nb: slope(nb) * gain


def _turning_axes(x: Array, y: Array, tilt: Array) -> list[Array]:
    """Axes (6, 3) about which the arms rotate as each of the two tilts (6, 2) grows.

    The left Jacobian of the rotation vector, to third order: tilts are small.
    """
    w = tilt[:, :1] * x + tilt[:, 1:] * y
    once = [_cross(w, axis) for axis in (x, y)]
    return [a + b / 2 + _cross(w, b) / 6 for a, b in zip((x, y), once, strict=True)]


def forward(
    parameters: Parameters, values: Array, legs: Array, start: Rigid, iterations: int = 12
) -> tuple[Rigid, Struts]:
    """Poses (n) that have the readings (n, 6), by Newton's method from poses close by.

    Steps of more than half a radian or a third of the machine are shortened; rows that do not
    converge end where they were last.

    Returns:
        The poses in base coordinates, and the struts there.
    """
    at, none = start, Rigid.identity()
    size = parameters.drawing.size
    found = struts(parameters, values, legs, at, none, none)
    for _ in range(iterations):
        found = struts(parameters, values, legs, at, none, none)
        largest = np.max(np.abs(found.errors), initial=0.0)
        if not largest > 1e-12 * size:
            break
        step = -np.linalg.solve(found.twist, found.errors[..., None])[..., 0]
        far = np.linalg.norm(step[:, :3], axis=1) / (size / 3)
        turned = np.linalg.norm(step[:, 3:], axis=1) / 0.5
        at = at.moved(step / np.maximum(1.0, np.maximum(far, turned))[:, None])
        if largest < 1e-6 * size:  # quadratic: the next error is at rounding
            found = struts(parameters, values, legs, at, none, none)
            break
    return at, found

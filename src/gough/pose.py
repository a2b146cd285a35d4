"""Poses: a position and a unit quaternion (w, x, y, z), with any leading batch axes.

A pose maps platform coordinates p to base coordinates R p + t. Rotations act on column
vectors; Euler angles are the paper's, R = Rx(a) Ry(b) Rz(c).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from gough.checks import LARGEST, Array, as_batch
from gough.errors import GoughError

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

    from gough.columns import Angles
    from gough.tables import Kind, Table

CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])  # times a quaternion: the inverse rotation
SERIES_ANGLE = 0.3  # [rad] below it, series whose first dropped term is under 1e-15


@dataclass(frozen=True, eq=False, init=False)
class Pose:
    """Rigid-body poses.

    Attributes:
        position: (..., 3) in the platform's length unit.
        wxyz: (..., 4) unit quaternion, scalar first.

    Rows that a solver could not fill are NaN throughout; nothing else is.
    """

    position: Array
    wxyz: Array

    def __init__(self, position: ArrayLike, wxyz: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> None:
        """Broadcasts the two against each other and normalises the quaternion.

        Raises:
            GoughError: wrong shapes, or a quaternion of length zero or beyond 1e+-100.
        """
        t = as_batch("position", position, (3,))
        q = as_batch("wxyz", wxyz, (4,))
        with np.errstate(over="ignore"):
            norm = np.linalg.norm(q, axis=-1, keepdims=True)
        if np.any((norm < 1 / LARGEST) | (norm > LARGEST)):
            raise GoughError(_no_rotation(q, norm[..., 0]))
        # rows of unit length to rounding stay as they are: making a pose twice changes no bit
        q = q / np.where(np.abs(norm - 1) < 1e-15, 1.0, norm)
        batch = np.broadcast_shapes(t.shape[:-1], q.shape[:-1])
        object.__setattr__(self, "position", np.broadcast_to(t, (*batch, 3)))
        object.__setattr__(self, "wxyz", np.broadcast_to(q, (*batch, 4)))

    @classmethod
    def trusted(cls, position: Array, wxyz: Array) -> Pose:
        """From arrays known to be right -- equal batch axes, unit quaternions -- unchecked."""
        pose = object.__new__(cls)
        object.__setattr__(pose, "position", position)
        object.__setattr__(pose, "wxyz", wxyz)
        return pose

    # ---- made from --------------------------------------------------------------------

    @classmethod
    def identity(cls, batch: tuple[int, ...] = ()) -> Pose:
        """The pose that moves nothing, with batch axes `batch`."""
        return cls(np.zeros((*batch, 3)))

    @classmethod
    def from_rotation(cls, position: ArrayLike, rotation: ArrayLike) -> Pose:
        """From (..., 3) and rotation matrices (..., 3, 3)."""
        return cls(position, matrix_to_wxyz(as_batch("rotation", rotation, (3, 3))))

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Pose:
        """From homogeneous matrices (..., 4, 4)."""
        m = as_batch("matrix", matrix, (4, 4))
        return cls.from_rotation(m[..., :3, 3], m[..., :3, :3])

    @classmethod
    def from_euler(cls, position: ArrayLike, angles: ArrayLike) -> Pose:
        """From (..., 3) and Euler angles (..., 3) [rad], R = Rx(a) Ry(b) Rz(c)."""
        half = as_batch("angles", angles, (3,)) / 2
        (ca, cb, cc), (sa, sb, sc) = (
            np.moveaxis(np.cos(half), -1, 0),
            np.moveaxis(np.sin(half), -1, 0),
        )
        w = ca * cb * cc - sa * sb * sc
        x = sa * cb * cc + ca * sb * sc
        y = ca * sb * cc - sa * cb * sc
        z = ca * cb * sc + sa * sb * cc
        return cls(position, np.stack([w, x, y, z], axis=-1))

    @classmethod
    def from_rotation_vector(cls, position: ArrayLike, vector: ArrayLike) -> Pose:
        """From (..., 3) and rotation vectors (..., 3) [rad] (axis times angle)."""
        return cls(position, rotation_vector_to_wxyz(as_batch("vector", vector, (3,))))

    @classmethod
    def exp(cls, twist: ArrayLike) -> Pose:
        """SE(3) exponential of twists (..., 6) = (rho [unit], omega [rad]).

        Source: Sola, Deray, Atchuthan, A micro Lie theory (2018), eq. 172-174.
        """
        xi = as_batch("twist", twist, (6,))
        rho, omega = xi[..., :3], xi[..., 3:]
        a, b = _left_jacobian_terms(np.linalg.norm(omega, axis=-1)[..., None])
        once = np.cross(omega, rho)
        position = rho + a * once + b * np.cross(omega, once)
        return cls(position, rotation_vector_to_wxyz(omega))

    @classmethod
    def from_rpy(cls, position: ArrayLike, angles: ArrayLike) -> Pose:
        """From (..., 3) and roll, pitch, yaw (..., 3) [rad], R = Rz(yaw) Ry(pitch) Rx(roll).

        That is a turn about the fixed x, then y, then z axis: what ROS, URDF and most vehicles
        mean by it. It is not `from_euler`, whose turns come in the other order.
        """
        rpy = as_batch("angles", angles, (3,))
        mirrored = cls.from_euler(np.zeros(3), -rpy)  # Rx(-r) Ry(-p) Rz(-y), the inverse
        return cls(position, mirrored.wxyz * CONJUGATE)

    @classmethod
    def from_scipy(cls, position: ArrayLike, rotation: Rotation) -> Pose:
        """From (..., 3) and a `scipy.spatial.transform.Rotation`, one or as many as positions."""
        return cls(position, np.roll(rotation.as_quat(), 1, axis=-1))

    @classmethod
    def from_frame(cls, frame: Table) -> Pose:
        """From a pandas, polars, pyarrow or other Arrow table, batch (N,).

        Columns x, y, z and qw, qx, qy, qz, or rx, ry, rz [rad], or rx_deg, ry_deg, rz_deg
        (R = Rx Ry Rz); others are ignored. Rows with absent values, or whose quaternion's length
        is off by more than 0.001, are NaN throughout.

        Raises:
            GoughError: no table. InputError: other columns, or no numbers in them.
        """
        from gough.tables import as_pose

        return as_pose(frame)

    # ---- seen as ----------------------------------------------------------------------

    @property
    def rotation(self) -> Array:
        """Rotation matrices (..., 3, 3)."""
        return wxyz_to_matrix(self.wxyz)

    @property
    def matrix(self) -> Array:
        """Homogeneous matrices (..., 4, 4)."""
        m = np.zeros((*self.batch, 4, 4))
        m[..., :3, :3] = self.rotation
        m[..., :3, 3] = self.position
        m[..., 3, 3] = 1.0
        return m

    @property
    def euler(self) -> Array:
        """Euler angles (..., 3) [rad] with R = Rx(a) Ry(b) Rz(c), b in [-pi/2, pi/2].

        From half the sum and half the difference of a and c, so that the angles describe the
        rotation to rounding at b = +-pi/2 too, where only one of the two is determined
        (Bernardes and Viollet 2022).
        """
        w, x, y, z = np.moveaxis(self.wxyz, -1, 0)
        plus, minus = np.arctan2(x + z, w + y), np.arctan2(x - z, w - y)
        b = 2 * np.arctan2(np.hypot(w + y, x + z), np.hypot(w - y, x - z)) - np.pi / 2
        a, c = (
            angle - 2 * np.pi * np.round(angle / (2 * np.pi))
            for angle in (plus + minus, plus - minus)
        )
        return np.stack([a, b, c], axis=-1)

    @property
    def rpy(self) -> Array:
        """Roll, pitch, yaw (..., 3) [rad], R = Rz(yaw) Ry(pitch) Rx(roll), pitch within +-pi/2.

        At pitch +-pi/2 only the sum or the difference of the others is determined; the angles
        describe the rotation there, too.
        """
        return -Pose(np.zeros(3), self.wxyz * CONJUGATE).euler

    def as_scipy(self) -> Rotation:
        """The rotations as a `scipy.spatial.transform.Rotation`; the position is not in it.

        Raises:
            GoughError: a row of NaN, which SciPy has no rotation for.
        """
        from scipy.spatial.transform import Rotation

        if np.any(np.isnan(self.wxyz)):
            raise GoughError(
                "pose: has rows of NaN, which are no rotations; take the others, such as "
                "solution.pose[solution.usable]"
            )
        return Rotation.from_quat(np.roll(self.wxyz, -1, axis=-1))

    @property
    def rotation_vector(self) -> Array:
        """Rotation vectors (..., 3) [rad], angle in [0, pi]."""
        q = np.where(self.wxyz[..., :1] < 0, -self.wxyz, self.wxyz)
        sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
        angle = 2 * np.arctan2(sine, q[..., :1])
        small = sine < 1e-8  # there angle / sine is 2 to rounding
        return q[..., 1:] * np.where(small, 2.0, angle / np.where(small, 1.0, sine))

    def log(self) -> Array:
        """SE(3) logarithm: twists (..., 6) = (rho [unit], omega [rad]); inverse of `exp`."""
        omega = self.rotation_vector
        angle = np.linalg.norm(omega, axis=-1)[..., None]
        second = _inverse_left_jacobian_term(angle)
        once = np.cross(omega, self.position)
        rho = self.position - once / 2 + second * np.cross(omega, once)
        return np.concatenate([rho, omega], axis=-1)

    # ---- worked with ------------------------------------------------------------------

    @property
    def batch(self) -> tuple[int, ...]:
        """The batch axes."""
        return self.position.shape[:-1]

    def __len__(self) -> int:
        if not self.batch:
            raise TypeError("a single pose has no length; its batch axes are ()")
        return self.batch[0]

    def __getitem__(self, index: Any) -> Pose:
        if not self.batch:
            raise IndexError("a single pose has no rows; its batch axes are ()")
        rows = index if isinstance(index, tuple) else (index,)
        if not any(i is Ellipsis for i in rows):
            rows = (*rows, ...)
        return Pose(self.position[(*rows, slice(None))], self.wxyz[(*rows, slice(None))])

    def apply(self, points: ArrayLike) -> Array:
        """R p + t for points (..., 3); the batch axes broadcast against the points' own."""
        p = as_batch("points", points, (3,))
        return (self.rotation @ p[..., None])[..., 0] + self.position

    def to_frame(self, kind: Kind | None = None, *, angles: Angles | None = None) -> Table:
        """A table with a row for each pose; `from_frame` reads it.

        Args:
            kind: "pandas", "polars" or "pyarrow"; pandas unless given.
            angles: "deg" or "rad": Euler angles, rx_deg to rz_deg or rx to rz (R = Rx Ry Rz), in
                place of the quaternion.

        Raises:
            GoughError: another kind or angle, or a library that is not installed.
        """
        from gough.tables import make_frame, pose_table

        return make_frame(pose_table(self, angles), kind)

    def copy(self) -> Pose:
        """A pose with arrays of its own."""
        return Pose.trusted(self.position.copy(), self.wxyz.copy())

    def inverse(self) -> Pose:
        """The pose that undoes this one."""
        conj = self.wxyz * CONJUGATE
        return Pose(-(wxyz_to_matrix(conj) @ self.position[..., None])[..., 0], conj)

    def __matmul__(self, other: Pose) -> Pose:
        """First `other`, then this one."""
        return Pose(self.apply(other.position), wxyz_product(self.wxyz, other.wxyz))

    def distance(self, other: Pose) -> tuple[Array, Array]:
        """Distance of positions (...) [unit] and angle between orientations (...) [rad]."""
        shift = np.linalg.norm(self.position - other.position, axis=-1)
        turn = wxyz_product(self.wxyz * CONJUGATE, other.wxyz)
        return shift, 2 * np.arctan2(np.linalg.norm(turn[..., 1:], axis=-1), np.abs(turn[..., 0]))

    def __repr__(self) -> str:
        if self.batch:
            return f"Pose(batch {self.batch})"
        numbers = [", ".join(f"{v:.9g}" for v in row) for row in (self.position, self.wxyz)]
        return f"Pose(position=({numbers[0]}), wxyz=({numbers[1]}))"

    def _repr_html_(self) -> str:
        from gough.html import page, pose_cells, pose_heads, rows_of

        count = "one pose" if not self.batch else f"{len(self.position.reshape(-1, 3)):,} poses"
        rows = rows_of(self.batch, lambda i: pose_cells(self[i] if i else self))
        return page(f"Pose: {count}", pose_heads(self.batch, ""), rows)


def _no_rotation(wxyz: Array, norm: Array) -> str:
    if np.any(norm == 0):
        return "wxyz: a quaternion of zeros is no rotation"
    found = wxyz[(norm < 1 / LARGEST) | (norm > LARGEST)][0].tolist()
    return f"wxyz: expected a quaternion of about unit length, found {found}"


def wxyz_product(a: Array, b: Array) -> Array:
    """Hamilton product of quaternions (..., 4)."""
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    scalar = aw * bw - np.sum(av * bv, axis=-1, keepdims=True)
    return np.concatenate([scalar, aw * bv + bw * av + np.cross(av, bv)], axis=-1)


def wxyz_to_matrix(wxyz: Array) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    w, x, y, z = np.moveaxis(wxyz, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def matrix_to_wxyz(rotation: Array) -> Array:
    """Unit quaternions (..., 4), w >= 0, of rotation matrices (..., 3, 3).

    The largest of the four squared components is the divisor, so no case loses digits
    (Shepperd 1978).
    """
    m = rotation
    trace = np.trace(m, axis1=-2, axis2=-1)
    diagonal = np.diagonal(m, axis1=-2, axis2=-1)
    # four times the squares of w, x, y, z
    squares = np.concatenate([(1 + trace)[..., None], 1 + 2 * diagonal - trace[..., None]], -1)
    a, b, c = m[..., 2, 1], m[..., 0, 2], m[..., 1, 0]
    d, e, f = m[..., 1, 2], m[..., 2, 0], m[..., 0, 1]
    s0, s1, s2, s3 = np.moveaxis(squares, -1, 0)
    candidates = np.stack(
        [
            np.stack([s0, a - d, b - e, c - f], axis=-1),
            np.stack([a - d, s1, c + f, b + e], axis=-1),
            np.stack([b - e, c + f, s2, a + d], axis=-1),
            np.stack([c - f, b + e, a + d, s3], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(squares, axis=-1)[..., None, None]
    q = np.take_along_axis(candidates, best, axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., :1] < 0, -q, q)


def rotation_vector_to_wxyz(vector: Array) -> Array:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) [rad]."""
    half = np.linalg.norm(vector, axis=-1, keepdims=True) / 2
    # np.sinc(x) is sin(pi x) / (pi x) and is exact at zero
    return np.concatenate([np.cos(half), vector / 2 * np.sinc(half / np.pi)], axis=-1)


def _left_jacobian_terms(angle: Array) -> tuple[Array, Array]:
    """(1 - cos) / angle^2 and (angle - sin) / angle^3, neither losing digits near zero."""
    small = angle < SERIES_ANGLE
    t, t2 = np.where(small, 1.0, angle), angle * angle
    series = 1 / 6 - t2 / 120 * (1 - t2 / 42 * (1 - t2 / 72 * (1 - t2 / 110)))
    b = np.where(small, series, (t - np.sin(t)) / t**3)
    return np.sinc(angle / (2 * np.pi)) ** 2 / 2, b


def _inverse_left_jacobian_term(angle: Array) -> Array:
    """(1 - (angle / 2) cot(angle / 2)) / angle^2, which tends to 1/12."""
    small = angle < SERIES_ANGLE
    t, t2 = np.where(small, 1.0, angle), angle * angle
    series = 1 / 12 + t2 / 720 * (1 + t2 / 42 * (1 + t2 / 40 * (1 + t2 * 30240 / 1197504)))
    return np.where(small, series, (1 - t / 2 / np.tan(t / 2)) / t**2)

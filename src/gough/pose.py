"""Poses: a position and a unit quaternion (w, x, y, z), with any leading batch axes.

A pose maps platform coordinates p to base coordinates R p + t. Rotations act on column
vectors; Euler angles are the paper's, R = Rx(a) Ry(b) Rz(c).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from gough import quaternion, tables
from gough.checks import LARGEST, Array, as_batch
from gough.columns import AXES_AT_REST, IN_DEGREES, QUATERNION, Angles, in_degrees, pose_names
from gough.errors import GoughError
from gough.tables import Kind, Table
from gough.text import number, page, pose_heads, rows_of

if TYPE_CHECKING:
    import pyarrow as pa
    from scipy.spatial.transform import Rotation

ROTATION = 1e-6  # how far R R^T of a matrix may be from 1
UNIT_LENGTH = 1e-3  # a quaternion whose length is farther from 1 is taken for a mistake


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
        """Broadcast the two against each other and normalise the quaternion.

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
        batch = _common_batch("wxyz", t.shape[:-1], q.shape[:-1])
        object.__setattr__(self, "position", np.broadcast_to(t, (*batch, 3)))
        object.__setattr__(self, "wxyz", np.broadcast_to(q, (*batch, 4)))

    @classmethod
    def trusted(cls, position: Array, wxyz: Array) -> Pose:
        """Make poses from arrays of equal batch axes and unit quaternions, without checks."""
        pose = object.__new__(cls)
        object.__setattr__(pose, "position", position)
        object.__setattr__(pose, "wxyz", wxyz)
        return pose

    # ---- made from --------------------------------------------------------------------

    @classmethod
    def identity(cls, batch: tuple[int, ...] = ()) -> Pose:
        """Identity pose, with batch axes `batch`."""
        return cls(np.zeros((*batch, 3)))

    @classmethod
    def from_rotation(cls, position: ArrayLike, rotation: ArrayLike) -> Pose:
        """Make poses from positions (..., 3) and rotation matrices (..., 3, 3).

        Raises:
            GoughError: a matrix that is not a rotation to 1e-6: scaled, mirrored, or all zeros.
        """
        matrices = as_batch("rotation", rotation, (3, 3))
        _check_rotations(matrices)
        return cls(position, quaternion.from_matrix(matrices))

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Pose:
        """Make poses from homogeneous matrices (..., 4, 4), with the position in the last column.

        Raises:
            GoughError: a last row that is not 0, 0, 0, 1, or a part that is not a rotation.
        """
        m = as_batch("matrix", matrix, (4, 4))
        wrong = np.any(np.abs(m[..., 3, :] - [0.0, 0.0, 0.0, 1.0]) > 1e-9, axis=-1)
        if np.any(wrong):
            raise GoughError(
                f"matrix: expected a last row 0, 0, 0, 1, found {m[wrong][0, 3].tolist()}; is the "
                "matrix transposed?"
            )
        return cls.from_rotation(m[..., :3, 3], m[..., :3, :3])

    @classmethod
    def from_euler(cls, position: ArrayLike, angles: ArrayLike) -> Pose:
        """Make poses from positions and Euler angles (..., 3) [rad], R = Rx(a) Ry(b) Rz(c)."""
        return cls(position, quaternion.from_euler(as_batch("angles", angles, (3,))))

    @classmethod
    def from_rotation_vector(cls, position: ArrayLike, vector: ArrayLike) -> Pose:
        """Make poses from positions and rotation vectors (..., 3), axis times angle [rad]."""
        return cls(position, quaternion.from_rotation_vector(as_batch("vector", vector, (3,))))

    @classmethod
    def exp(cls, twist: ArrayLike) -> Pose:
        """SE(3) exponential of twists (..., 6) = (rho [unit], omega [rad]).

        Source: Sola, Deray, Atchuthan, A micro Lie theory (2018), eq. 172-174.
        """
        xi = as_batch("twist", twist, (6,))
        rho, omega = xi[..., :3], xi[..., 3:]
        a, b = quaternion.left_jacobian_terms(np.linalg.norm(omega, axis=-1)[..., None])
        once = np.cross(omega, rho)
        position = rho + a * once + b * np.cross(omega, once)
        return cls(position, quaternion.from_rotation_vector(omega))

    @classmethod
    def from_rpy(cls, position: ArrayLike, angles: ArrayLike) -> Pose:
        """Make poses from positions (..., 3) and roll, pitch, yaw (..., 3) [rad].

        R = Rz(yaw) Ry(pitch) Rx(roll): rotations about the fixed x, then y, then z axis, the
        convention of ROS, URDF and most vehicles. `from_euler` takes the other order.
        """
        rpy = as_batch("angles", angles, (3,))
        inverse = quaternion.from_euler(-rpy)  # Rx(-r) Ry(-p) Rz(-y)
        return cls(position, quaternion.conjugate(inverse))

    @classmethod
    def from_scipy(cls, position: ArrayLike, rotation: Rotation) -> Pose:
        """Make poses from positions (..., 3) and a `scipy.spatial.transform.Rotation`."""
        return cls(position, np.roll(rotation.as_quat(), 1, axis=-1))

    @classmethod
    def from_frame(cls, frame: Table) -> Pose:
        """Make poses from a pandas, polars, pyarrow or other Arrow table, batch (N,).

        Columns x, y, z and qw, qx, qy, qz, or rx, ry, rz [rad], or rx_deg, ry_deg, rz_deg
        (R = Rx Ry Rz), or as makers write them (see `to_frame`); others are ignored. Rows with
        absent values, or whose quaternion's length is off by more than 0.001, are NaN throughout.

        Raises:
            GoughError: no table. InputError: other columns, or no numbers in them.
        """
        return as_pose(frame)

    # ---- seen as ----------------------------------------------------------------------

    @property
    def rotation(self) -> Array:
        """Rotation matrices (..., 3, 3)."""
        return quaternion.to_matrix(self.wxyz)

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
        """Euler angles (..., 3) [rad] with R = Rx(a) Ry(b) Rz(c), b in [-pi/2, pi/2]."""
        return quaternion.to_euler(self.wxyz)

    @property
    def rpy(self) -> Array:
        """Roll, pitch, yaw (..., 3) [rad], R = Rz(yaw) Ry(pitch) Rx(roll), pitch within +-pi/2.

        At pitch +-pi/2 only the sum or the difference of the others is determined; the angles
        describe the rotation there, too.
        """
        return -quaternion.to_euler(quaternion.conjugate(self.wxyz))

    def as_scipy(self) -> Rotation:
        """Return the rotations as a `scipy.spatial.transform.Rotation`, without the positions.

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
        return quaternion.to_rotation_vector(self.wxyz)

    def log(self) -> Array:
        """SE(3) logarithm: twists (..., 6) = (rho [unit], omega [rad]); inverse of `exp`."""
        omega = self.rotation_vector
        angle = np.linalg.norm(omega, axis=-1)[..., None]
        second = quaternion.inverse_left_jacobian_term(angle)
        once = np.cross(omega, self.position)
        rho = self.position - once / 2 + second * np.cross(omega, once)
        return np.concatenate([rho, omega], axis=-1)

    # ---- worked with ------------------------------------------------------------------

    @property
    def batch(self) -> tuple[int, ...]:
        """Batch axes."""
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
        """Map points (..., 3) to R p + t; the batch axes broadcast against the points' own."""
        p = as_batch("points", points, (3,))
        return (self.rotation @ p[..., None])[..., 0] + self.position

    def to_frame(self, kind: Kind | None = None, *, angles: Angles | None = None) -> Table:
        """Return a table with a row for each pose, which `from_frame` reads.

        Args:
            kind: "pandas", "polars" or "pyarrow"; pandas unless given.
            angles: instead of the quaternion Euler angles: "deg" or "rad" (rx_deg to rz_deg or rx
                to rz, R = Rx Ry Rz), or as makers write them: "uvw" (PI: U, V, W [deg], R = Rx Ry
                Rz), "abc" (LinuxCNC: A, B, C [deg], R = Rz Ry Rx) or "rpy" (ROS: roll, pitch, yaw
                [rad], R = Rz Ry Rx).

        Raises:
            GoughError: another kind or angle, or a library that is not installed.
        """
        return tables.make_frame(pose_table(self, angles), kind)

    def copy(self) -> Pose:
        """Copy that shares no memory with this pose."""
        return Pose.trusted(self.position.copy(), self.wxyz.copy())

    def inverse(self) -> Pose:
        """Inverse poses: `pose @ pose.inverse()` is the identity."""
        wxyz = quaternion.conjugate(self.wxyz)
        return Pose(-(quaternion.to_matrix(wxyz) @ self.position[..., None])[..., 0], wxyz)

    def __matmul__(self, other: Pose) -> Pose:
        """Composition: `other` first, then this pose."""
        _common_batch("other", self.batch, other.batch)
        return Pose(self.apply(other.position), quaternion.product(self.wxyz, other.wxyz))

    def distance(self, other: Pose) -> tuple[Array, Array]:
        """Distance of positions (...) [platform unit] and angle between orientations (...) [rad].

        Raises:
            GoughError: batch axes that do not fit each other.

        Example:
            >>> from gough import Pose
            >>> length, angle = Pose((0, 0, 3)).distance(Pose((0, 4, 0)))
            >>> float(length), float(angle)
            (5.0, 0.0)
        """
        _common_batch("other", self.batch, other.batch)
        length = np.linalg.norm(self.position - other.position, axis=-1)
        return length, quaternion.angle_between(self.wxyz, other.wxyz)

    def __repr__(self) -> str:
        if self.batch:
            return f"Pose(batch {self.batch})"
        numbers = [", ".join(f"{v:.9g}" for v in row) for row in (self.position, self.wxyz)]
        return f"Pose(position=({numbers[0]}), wxyz=({numbers[1]}))"

    def _repr_html_(self) -> str:
        count = "one pose" if not self.batch else f"{len(self.position.reshape(-1, 3)):,} poses"
        rows = rows_of(self.batch, lambda i: pose_cells(self[i] if i else self))
        return page(f"Pose: {count}", pose_heads(self.batch, ""), rows)


def _common_batch(name: str, a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    """Batch axes that two arrays broadcast to; GoughError where they do not fit."""
    try:
        return np.broadcast_shapes(a, b)
    except ValueError:
        raise GoughError(f"{name}: batch axes {b} do not fit those of the pose, {a}") from None


def _check_rotations(matrices: Array) -> None:
    """Raise GoughError unless matrices (..., 3, 3) are rotations to 1e-6; rows of NaN pass."""
    square = matrices @ np.swapaxes(matrices, -1, -2)
    skewed = np.any(np.abs(square - np.eye(3)) > ROTATION, axis=(-2, -1))
    mirrored = np.linalg.det(np.where(np.isfinite(matrices), matrices, np.eye(3))) < 0
    if np.any(skewed):
        raise GoughError(
            "rotation: expected matrices with R R^T = 1, found "
            f"{matrices[skewed][0].round(6).tolist()}; is there a scale factor in it?"
        )
    if np.any(mirrored):
        raise GoughError(
            "rotation: expected right-handed matrices, det R = 1; found a mirrored one (det -1): "
            f"{matrices[mirrored][0].round(6).tolist()}"
        )


def _no_rotation(wxyz: Array, norm: Array) -> str:
    if np.any(norm == 0):
        return "wxyz: a quaternion of zeros is no rotation"
    found = wxyz[(norm < 1 / LARGEST) | (norm > LARGEST)][0].tolist()
    return f"wxyz: expected a quaternion of about unit length, found {found}"


def as_pose(pose: Pose | Table) -> Pose:
    """Return poses as they are, or read them from a table: columns as in `gough.files`, batch (N,).

    Rows with absent values, or whose quaternion is not of unit length, are NaN throughout.

    Raises:
        GoughError: neither poses nor a table. InputError: other columns, or no numbers in them.
    """
    if isinstance(pose, Pose):
        return pose
    return poses_from_columns(*tables.read_pose_columns(pose))[0]


def poses_from_columns(values: Array, names: Sequence[str]) -> tuple[Pose, Callable[[int], str]]:
    """Poses, NaN where a row is invalid, and a function that describes the fault of row i.

    Args:
        values: (N, 6) or (N, 7): position, then a quaternion or Euler angles.
        names: the columns' names, which say what the values mean.
    """
    rotation = tuple(names[3:])
    valid = np.all(np.isfinite(values), axis=-1)
    if rotation == QUATERNION:
        with np.errstate(over="ignore", invalid="ignore"):
            length = np.linalg.norm(values[:, 3:], axis=-1)
        valid &= np.abs(length - 1) <= UNIT_LENGTH

    def reason(i: int) -> str:
        for name, value in zip(names, values[i], strict=True):
            if not np.isfinite(value):
                found = "empty or not a number" if np.isnan(value) else value
                return f"{name} is {found}, expected a finite number"
        length = np.linalg.norm(values[i, 3:])
        return f"the quaternion's length is {length:.6g}, expected 1"

    clean = np.where(valid[:, None], values, np.nan)
    position, turn = clean[:, :3], clean[:, 3:]
    if rotation == QUATERNION:
        return Pose(position, turn), reason
    turn = np.radians(turn) if rotation in IN_DEGREES else turn
    make = Pose.from_rpy if rotation in AXES_AT_REST else Pose.from_euler
    return make(position, turn), reason


def pose_values(pose: Pose, angles: Angles | None) -> Array:
    """Values of the columns `pose_names(angles)`, (..., 7) or (..., 6)."""
    return np.concatenate([pose.position, _rotation_values(pose, angles)], axis=-1)


def pose_table(pose: Pose, angles: Angles | None) -> dict[str, pa.Array]:
    """Columns of poses by name, batch axes flattened."""
    names = pose_names(angles)
    position, rotation = pose.position.reshape(-1, 3), _rotation_values(pose, angles)
    columns = [*position.T, *rotation.reshape(-1, rotation.shape[-1]).T]
    return dict(zip(names, map(tables.number_column, columns), strict=True))


def _rotation_values(pose: Pose, angles: Angles | None) -> Array:
    names = pose_names(angles)[3:]
    rotation = pose.rpy if names in AXES_AT_REST else pose.euler if angles else pose.wxyz
    return np.degrees(rotation) if in_degrees(angles) else rotation


def pose_cells(pose: Pose) -> list[str]:
    """Position and Euler angles of one pose as text, R = Rx Ry Rz, the angles in degrees."""
    digits = (".7g", ".7g", ".7g", ".4f", ".4f", ".4f")
    return list(map(number, pose_values(pose, "deg"), digits))

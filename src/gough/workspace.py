"""The box of poses that a machine is meant for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough import quaternion
from gough.checks import Array, platform_field, platform_numbers
from gough.errors import GoughError, PlatformError
from gough.pose import Pose

GRID = 25  # rotations along each axis at which `Workspace.seen_at` looks


@dataclass(frozen=True, eq=False, init=False)
class Workspace:
    """Box of poses about home that a machine is meant for.

    A pose is inside when its position minus home's is within `translation` and the
    Euler angles of home's inverse rotation times its own, Rx Ry Rz, are within `rotation_deg`.

    Attributes:
        translation: (3, 2) lowest and highest x, y, z from home [platform unit].
        rotation_deg: (3, 2) lowest and highest Euler angles from home [deg].

    Raises:
        PlatformError: naming the field, what was found and what was expected.
    """

    translation: Array
    rotation_deg: Array

    def __init__(self, translation: ArrayLike, rotation_deg: ArrayLike) -> None:
        for name, given in (("translation", translation), ("rotation_deg", rotation_deg)):
            box = platform_field(f"workspace.{name}", given, (3, 2))
            if np.any(box[:, 0] > box[:, 1]):
                axis = int(np.argmax(box[:, 0] > box[:, 1]))
                raise PlatformError(
                    f"workspace.{name}[{axis}]: expected [lowest, highest], "
                    f"found {box[axis].tolist()}"
                )
            object.__setattr__(self, name, box)
        if np.max(np.abs(self.rotation_deg[1])) >= 90:
            raise PlatformError(
                "workspace.rotation_deg[1]: the second Euler angle must stay within 90 deg of "
                f"home, found {self.rotation_deg[1].tolist()}"
            )

    @classmethod
    def about_home(cls, translation: ArrayLike, rotation_deg: ArrayLike) -> Workspace:
        """Make a workspace from boxes (3, 2) or half widths [platform unit], [deg]."""
        boxes = [
            platform_numbers("workspace.translation", translation),
            platform_numbers("workspace.rotation_deg", rotation_deg),
        ]
        return cls(*(np.tile([-b, b], (3, 1)) if b.ndim == 0 else b for b in boxes))

    def seen_at(self, home: Pose, point: Array) -> Workspace:
        """Box for the positions of another point of the platform that holds all poses of this one.

        A point moves when the platform rotates, so poses of this box have positions of the point
        that fill no box: the new one holds others, too. It is the smallest to a thousandth of the
        lever.

        Args:
            home: the pose at rest.
            point: (3,) from the point that positions refer to now, in platform coordinates.
        """
        axes = [np.linspace(low, high, GRID) for low, high in np.radians(self.rotation_deg)]
        angles = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        turned = quaternion.to_matrix(quaternion.from_euler(angles)) @ point - point
        shift = turned @ home.rotation.T
        # where a component is largest between points of the grid its first derivatives vanish
        # along the free angles, and its second ones are at most the lever
        step = np.radians(np.ptp(self.rotation_deg, axis=1)) / (GRID - 1)
        spare = np.linalg.norm(point) * np.sum(step / 2) ** 2 / 2
        ends = np.stack([shift.min(axis=0) - spare, shift.max(axis=0) + spare], axis=-1)
        return Workspace(self.translation + ends, self.rotation_deg)

    def sample(self, home: Pose, count: int, seed: int) -> Pose:
        """Draw poses evenly from the box, batch (count,); one seed always gives the same poses.

        Raises:
            GoughError: a count or a seed that is not a whole number of 0 or more.
        """
        for name, value in (("count", count), ("seed", seed)):
            if not isinstance(value, (int, np.integer)) or value < 0:
                raise GoughError(f"{name}: expected a whole number of 0 or more, found {value!r}")
        return self.draw(home, count, np.random.default_rng(seed))

    def draw(self, home: Pose, count: int, rng: np.random.Generator) -> Pose:
        """Draw the next poses of a random generator, batch (count,)."""
        translation = rng.uniform(*self.translation.T, size=(count, 3))
        return self._placed(home, translation, rng.uniform(*self.rotation_deg.T, size=(count, 3)))

    def at(self, home: Pose, shares: Array) -> Pose:
        """Return poses (...) at shares (..., 6) of the box: 0 its lowest, 1 its highest values."""
        low, high = np.concatenate([self.translation, self.rotation_deg]).T
        values = low + shares * (high - low)
        return self._placed(home, values[..., :3], values[..., 3:])

    def _placed(self, home: Pose, translation: Array, angles_deg: Array) -> Pose:
        rotation = quaternion.from_euler(np.radians(angles_deg))
        return Pose(home.position + translation, quaternion.product(home.wxyz, rotation))

    def contains(self, home: Pose, pose: Pose, length: float, angle: float) -> NDArray[np.bool_]:
        """Test poses (...) against the box widened by `length` [platform unit], `angle` [rad]."""
        conjugate = home.inverse().wxyz
        turn = Pose(pose.position - home.position, quaternion.product(conjugate, pose.wxyz))
        inside = np.ones(pose.batch, dtype=bool)
        for value, box, slack in (
            (turn.position, self.translation, length),
            (turn.euler, np.radians(self.rotation_deg), angle),
        ):
            inside &= np.all((value >= box[:, 0] - slack) & (value <= box[:, 1] + slack), axis=-1)
        return inside

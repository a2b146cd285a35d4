"""The poses a machine is meant for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough import quaternion
from gough.checks import Array, platform_field, platform_numbers
from gough.errors import PlatformError
from gough.pose import Pose


@dataclass(frozen=True, eq=False)
class Workspace:
    """The poses a machine is meant for: a box about home.

    A pose is inside when its position minus home's is within `translation` and the
    Euler angles of home's inverse rotation times its own, Rx Ry Rz, are within `rotation_deg`.

    Attributes:
        translation: (3, 2) lowest and highest x, y, z from home [platform unit].
        rotation_deg: (3, 2) lowest and highest Euler angles from home [deg].
    """

    translation: Array
    rotation_deg: Array

    if TYPE_CHECKING:

        def __init__(self, translation: ArrayLike, rotation_deg: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        for name in ("translation", "rotation_deg"):
            box = platform_field(f"workspace.{name}", getattr(self, name), (3, 2))
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
        """From boxes (3, 2), or one number each: as far on every axis and to both sides."""
        boxes = [
            platform_numbers("workspace.translation", translation),
            platform_numbers("workspace.rotation_deg", rotation_deg),
        ]
        return cls(*(np.tile([-b, b], (3, 1)) if b.ndim == 0 else b for b in boxes))

    def sample(self, home: Pose, count: int, seed: int) -> Pose:
        """Poses drawn evenly from the box, batch (count,); the same seed, the same poses."""
        rng = np.random.default_rng(seed)
        shift = rng.uniform(*self.translation.T, size=(count, 3))
        angles = np.radians(rng.uniform(*self.rotation_deg.T, size=(count, 3)))
        turn = Pose.from_euler(np.zeros(3), angles).wxyz
        return Pose(home.position + shift, quaternion.product(home.wxyz, turn))

    def contains(self, home: Pose, pose: Pose, length: float, angle: float) -> NDArray[np.bool_]:
        """Whether poses (...) are in the box widened by `length` [unit] and `angle` [rad]."""
        conjugate = home.inverse().wxyz
        turn = Pose(pose.position - home.position, quaternion.product(conjugate, pose.wxyz))
        inside = np.ones(pose.batch, dtype=bool)
        for value, box, slack in (
            (turn.position, self.translation, length),
            (turn.euler, np.radians(self.rotation_deg), angle),
        ):
            inside &= np.all((value >= box[:, 0] - slack) & (value <= box[:, 1] + slack), axis=-1)
        return inside

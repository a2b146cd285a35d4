"""Results of a batch, as compiled code writes them, row by row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough.checks import Array
from gough.fk.solution import Solution
from gough.kernel.layout import OPEN
from gough.kinematics import pose_covariance
from gough.platform import Platform
from gough.pose import Pose
from gough.status import Status
from gough.tables import TableInfo


@dataclass(frozen=True, eq=False)
class Rows:
    """Arrays that the compiled code writes its results to, one entry a row."""

    position: Array  # (N, 3) [platform unit]
    wxyz: Array  # (N, 4)
    residual: Array  # (N,) [platform unit]
    iterations: NDArray[np.int32]  # (N,)
    status: NDArray[np.uint8]  # (N,) of Status, or OPEN

    @classmethod
    def empty(cls, count: int) -> Rows:
        """Return arrays for `count` rows, all of them open."""
        return cls(
            np.empty((count, 3)), np.empty((count, 4)), np.empty(count),
            np.empty(count, np.int32), np.full(count, OPEN, np.uint8),
        )  # fmt: skip

    def arrays(self) -> tuple:
        """Arguments of the compiled code."""
        return self.position, self.wxyz, self.residual, self.iterations, self.status

    def put(self, chosen: NDArray[np.intp], found: Solution) -> None:
        """Set chosen rows (K,) to the results of K rows."""
        self.position[chosen], self.wxyz[chosen] = found.pose.position, found.pose.wxyz
        self.residual[chosen], self.status[chosen] = found.residual, found.status
        self.iterations[chosen] += found.iterations

    def fill_invalid_with_nan(self) -> None:
        """Set all results of invalid rows to NaN."""
        invalid = self.status == Status.INVALID_INPUT
        for array in (self.position, self.wxyz, self.residual):
            array[invalid] = np.nan
        self.iterations[invalid] = 0

    def solution(
        self,
        platform: Platform,
        batch: tuple[int, ...],
        radius: Array | None,
        leg_noise: ArrayLike | None,
        source: TableInfo | None,
    ) -> Solution:
        """Return the rows as a solution with batch axes `batch`; see there for the rest."""
        pose = Pose.trusted(self.position.reshape(*batch, 3), self.wxyz.reshape(*batch, 4))
        return Solution(
            pose,
            self.status.reshape(batch) if batch else Status(int(self.status[0])),
            self.residual.reshape(batch),
            self.iterations.reshape(batch),
            None if leg_noise is None else pose_covariance(platform, pose, leg_noise),
            None if radius is None else radius.reshape(batch),
            unit=platform.unit,
            table=source,
        )

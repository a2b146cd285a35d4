"""What is known about each solved row."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.columns import Angles
from gough.pose import Pose
from gough.tables import Kind, Origin, Table, make_frame


class Status(IntEnum):
    """The outcome of one row; `text` is a sentence that says what to do."""

    CONVERGED = 0
    OUTSIDE_STROKE = 1
    NEAR_SINGULARITY = 2
    OUTSIDE_WORKSPACE = 3
    UNREACHABLE = 4
    NOT_CONVERGED = 5
    INVALID_INPUT = 6
    CERTIFIED = 7
    AMBIGUOUS = 8

    @property
    def text(self) -> str:
        """A sentence a user can act on."""
        return _TEXTS[self]

    @property
    def label(self) -> str:
        """The word written to files, such as "outside_stroke"."""
        return self.name.lower()

    @property
    def usable(self) -> bool:
        """The pose has these legs and is, as far as is known, the machine's own."""
        return self in USABLE


USABLE = (
    Status.CONVERGED, Status.OUTSIDE_STROKE, Status.NEAR_SINGULARITY, Status.CERTIFIED,
)  # fmt: skip

_TEXTS = {
    Status.CONVERGED: "The pose has these leg readings to within the tolerance.",
    Status.OUTSIDE_STROKE: (
        "The pose has these leg readings, but a reading is outside the stroke limits: check the "
        "sensor's zero, the unit, or the limits in the platform file."
    ),
    Status.NEAR_SINGULARITY: (
        "The pose has these leg readings, but is close to a singularity, where small reading "
        "errors become large pose errors: treat its last digits with care, or move away."
    ),
    Status.OUTSIDE_WORKSPACE: (
        "A pose has these leg readings, but it is outside the stated workspace or beyond a "
        "singularity, so it is probably another assembly mode: pass a seed near the true pose, "
        "or widen the workspace."
    ),
    Status.UNREACHABLE: (
        "No pose was found that has these leg readings; the residual says by how much the "
        "nearest misses: check the readings' unit, order and zero, and the platform's joints."
    ),
    Status.NOT_CONVERGED: (
        "The iteration limit was reached before the tolerance: allow more iterations, pass a "
        "seed closer to the pose, or ask for a wider tolerance."
    ),
    Status.INVALID_INPUT: (
        "A reading is not a finite number, or a length is not above zero: correct the row."
    ),
    Status.CERTIFIED: (
        "Proven: exactly one pose with these leg readings lies within the stated radius of this "
        "one."
    ),
    Status.AMBIGUOUS: (
        "Another pose has these leg readings too, inside the workspace and the stroke and on "
        "home's side of the singularities: readings alone cannot tell which is the machine's; use "
        "a seed near the true pose, or another sensor (see gough.choose_mode)."
    ),
}


@dataclass(frozen=True, eq=False)
class Solution:
    """Poses with what is known about each.

    Attributes:
        pose: batch axes (...) as the legs had; NaN where the input was invalid.
        status: (...) uint8, to be compared with `Status` members; a `Status` for a single row.
        residual: (...) largest difference between a strut's length at the pose and the length
            that its reading asks for [platform unit]; NaN where the input was invalid.
        iterations: (...) int32, Newton steps taken, over all starts that were tried.
        covariance: (..., 6, 6) pose covariance, see `gough.pose_covariance`, or None.
        radius: (...) radius of uniqueness [platform unit], see `gough.Certificate`, 0 where
            nothing is proven; None unless certificates were asked for.
        unit: name of the platform's length unit, a label.
        origin: the table that the readings came in, if they did; see `to_frame`.
    """

    pose: Pose
    status: Any  # NDArray[np.uint8] | Status: the union would make every use of it a cast
    residual: Array
    iterations: NDArray[np.int32]
    covariance: Array | None = None
    radius: Array | None = None
    unit: str = ""
    origin: Origin | None = None

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Rows (...) whose pose has these legs and is, as far as is known, the machine's."""
        return np.isin(self.status, USABLE)

    def counts(self) -> dict[Status, int]:
        """How many rows have each status that occurs, in the order of `Status`."""
        numbers = np.bincount(np.ravel(self.status), minlength=len(Status))
        return {s: int(numbers[s]) for s in Status if numbers[s]}

    def __getitem__(self, index: Any) -> Solution:
        if isinstance(self.status, Status):
            raise IndexError("the solution of a single row has no rows")
        covariance = None if self.covariance is None else self.covariance[index]
        radius = None if self.radius is None else self.radius[index]
        return Solution(
            self.pose[index], self.status[index], self.residual[index], self.iterations[index],
            covariance, radius, self.unit, self.origin and self.origin.at(index),
        )  # fmt: skip

    def to_frame(self, kind: Kind | None = None, *, angles: Angles | None = None) -> Table:
        """A table with a row for each pose, in order: the columns that `gough solve` writes.

        x, y, z [platform unit], qw, qx, qy, qz, status (a word), residual [platform unit],
        iterations; with a covariance the standard deviations std_x, std_y, std_z [platform
        unit], std_rx, std_ry, std_rz [rad]; with certificates radius [platform unit].

        Args:
            kind: "pandas", "polars" or "pyarrow"; unless given, as the table of readings was,
                else pandas. A pandas table has the row labels of that of the readings.
            angles: "deg" or "rad": Euler angles, rx_deg to rz_deg or rx to rz (R = Rx Ry Rz), in
                place of the quaternion.

        Raises:
            GoughError: another kind or angle, or a library that is not installed.
        """
        from gough.fk.frame import solution_columns

        return make_frame(solution_columns(self, angles), kind, self.origin)

    def __repr__(self) -> str:
        if not self.pose.batch:
            return (
                f"Solution({Status(int(self.status)).label}, {self.pose!r}, "
                f"residual={float(self.residual):.3g}, iterations={int(self.iterations)})"
            )
        found = ", ".join(f"{s.label}: {n}" for s, n in self.counts().items())
        return f"Solution(batch {self.pose.batch}; {found})"

    def _repr_html_(self) -> str:
        from gough.html import length_head, number, page, pose_cells, pose_heads, rows_of

        def cells(i: tuple[int, ...]) -> list[str]:
            at = self[i] if i else self
            radius = [] if at.radius is None else [number(at.radius, ".3g")]
            last = [number(at.residual, ".2g"), str(int(at.iterations))]
            return [*pose_cells(at.pose), Status(int(at.status)).label, *last, *radius]

        heads = [*pose_heads(self.pose.batch, self.unit), "status"]
        heads += [length_head("residual", self.unit), "iterations"]
        heads += [] if self.radius is None else [length_head("radius", self.unit)]
        notes = []
        for status, times in self.counts().items():
            first = np.argwhere(np.asarray(self.status) == status)[0].tolist()
            where = f", first in row {', '.join(map(str, first))}" if first else ""
            notes.append(f"{times:,} {status.label}{where}: {status.text}")
        rows = rows_of(self.pose.batch, cells)
        return page(f"Solution of {np.size(self.status):,}", heads, rows, notes)

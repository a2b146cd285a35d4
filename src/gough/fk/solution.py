"""The result of forward kinematics: poses, the status of each, and both as named columns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.columns import Angles, in_degrees, solution_names
from gough.errors import GoughError
from gough.platform import Platform
from gough.pose import Pose, pose_cells, pose_table
from gough.status import USABLE, Event, Status
from gough.tables import Kind, Table, TableInfo, label_column, make_frame, number_column
from gough.text import number, page, pose_heads, rows_of, with_unit

if TYPE_CHECKING:
    import pyarrow as pa

    from gough.margins import Limits

LABELS = tuple(status.label for status in Status)
EVENTS = tuple(event.label for event in Event)
NEW = tuple(event for event in Event if event.usable)  # events that give a new pose


@dataclass(frozen=True, eq=False)
class Solution:
    """Poses of a batch of readings, with status and accuracy of each.

    Attributes:
        pose: batch axes (...) as the legs had; NaN in rows without a pose.
        status: (...) uint8, to be compared with `Status` members; a `Status` for a single row.
        residual: (...) largest difference between a strut's length at the pose and the length
            that its reading stands for [platform unit]; NaN where the input was invalid.
        iterations: (...) int32, Newton steps taken, over all starts that were tried.
        covariance: (..., 6, 6) pose covariance, see `gough.pose_covariance`, or None.
        radius: (...) radius of uniqueness [platform unit], see `gough.Certificate`, 0 where
            nothing is proven; None without `certify=True`.
        unit: name of the platform's length unit, a label.
        frame: whose poses these are, such as "tool in work"; "" for those of the platform.
        table: library and row labels of the table of readings, if they came in one.
        event: (N,) uint8, to be compared with `Event` members, if rows were followed one after
            another; else None.
        limits: margins (...) of the poses to what their machine allows, see `gough.limits`; None
            without `limits=True`.
    """

    pose: Pose
    status: Any  # NDArray[np.uint8] | Status: the union would make every use of it a cast
    residual: Array
    iterations: NDArray[np.int32]
    covariance: Array | None = None
    radius: Array | None = None
    unit: str = ""
    frame: str = ""
    table: TableInfo | None = None
    event: NDArray[np.uint8] | None = None
    limits: Limits | None = None

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Rows (...) whose pose has these legs and is, as far as is known, the machine's."""
        usable = np.isin(self.status, USABLE)
        return usable if self.event is None else usable & np.isin(self.event, NEW)

    def counts(self) -> dict[Status, int]:
        """Return the number of rows of each status that occurs, in the order of `Status`."""
        numbers = np.bincount(np.ravel(self.status), minlength=len(Status))
        return {s: int(numbers[s]) for s in Status if numbers[s]}

    def __getitem__(self, index: Any) -> Solution:
        if isinstance(self.status, Status):
            raise IndexError("the solution of a single row has no rows")
        covariance = None if self.covariance is None else self.covariance[index]
        radius = None if self.radius is None else self.radius[index]
        return Solution(
            self.pose[index], self.status[index], self.residual[index], self.iterations[index],
            covariance, radius, self.unit, self.frame, self.table and self.table.at(index),
            None if self.event is None else self.event[index],
            self.limits and self.limits[index],
        )  # fmt: skip

    def with_limits(self, platform: Platform, *, workers: int | None = None) -> Solution:
        """Return the solution with the margins of its poses; see `gough.limits`."""
        from gough.margins import limits

        frame = self.frame or None
        return replace(self, limits=limits(platform, self.pose, workers=workers, frame=frame))

    def in_frame(self, platform: Platform, name: str) -> Solution:
        """Return the solution with poses of a frame of the platform, and their covariance.

        Raises:
            GoughError: no such frame, or poses that are those of a frame already.
        """
        if self.frame:
            raise GoughError(f"frame: these are the poses of {self.frame!r} already")
        view, covariance = platform.frame(name), self.covariance
        if covariance is not None:
            matrix = view.twist_matrix(self.pose)
            covariance = matrix @ covariance @ np.swapaxes(matrix, -1, -2)
        return replace(self, pose=view.of(self.pose), covariance=covariance, frame=name)

    def to_frame(self, kind: Kind | None = None, *, angles: Angles | None = None) -> Table:
        """A table with a row for each pose, in order: the columns that `gough solve` writes.

        x, y, z [platform unit], qw, qx, qy, qz, status (a word), residual [platform unit],
        iterations; with a covariance the standard deviations std_x, std_y, std_z [platform
        unit], std_rx, std_ry, std_rz [rad], or std_rx_deg to std_rz_deg [deg] if the angles are in
        degrees; with certificates radius [platform unit]; with limits margin (the share of the
        tightest limit that is left, negative beyond it) and limit (its name).

        Args:
            kind: "pandas", "polars" or "pyarrow"; unless given, as the table of readings was,
                else pandas. A pandas table has the row labels of that of the readings.
            angles: Euler angles instead of the quaternion: "deg", "rad", "uvw", "abc" or "rpy",
                see `Pose.to_frame`.

        Raises:
            GoughError: another kind or angle, or a library that is not installed.
        """
        return make_frame(solution_columns(self, angles), kind, self.table)

    def __repr__(self) -> str:
        if not self.pose.batch:
            return (
                f"Solution({Status(int(self.status)).label}, {self.pose!r}, "
                f"residual={float(self.residual):.3g}, iterations={int(self.iterations)})"
            )
        found = ", ".join(f"{s.label}: {n}" for s, n in self.counts().items())
        return f"Solution(batch {self.pose.batch}; {found})"

    def _repr_html_(self) -> str:
        def cells(i: tuple[int, ...]) -> list[str]:
            at = self[i] if i else self
            radius = [] if at.radius is None else [number(at.radius, ".3g")]
            last = [number(at.residual, ".2g"), str(int(at.iterations))]
            return [*pose_cells(at.pose), Status(int(at.status)).label, *last, *radius]

        heads = [*pose_heads(self.pose.batch, self.unit), "status"]
        heads += [with_unit("residual", self.unit), "iterations"]
        heads += [] if self.radius is None else [with_unit("radius", self.unit)]
        notes = []
        for status, times in self.counts().items():
            first = np.argwhere(np.asarray(self.status) == status)[0].tolist()
            where = f", first in row {', '.join(map(str, first))}" if first else ""
            notes.append(f"{times:,} {status.label}{where}: {status.text}")
        rows = rows_of(self.pose.batch, cells)
        return page(f"Solution of {np.size(self.status):,}", heads, rows, notes)


def solution_columns(solution: Solution, angles: Angles | None) -> dict[str, pa.Array]:
    """The columns of `solution_names`, each with a value for every row, batch axes flattened.

    Args:
        angles: Euler angles in these units instead of the quaternion.

    Raises:
        GoughError: angles of another name.
    """
    optional = [part is not None for part in (solution.covariance, solution.radius, solution.event)]
    numbers = [np.ravel(solution.residual), np.ravel(solution.iterations)]
    if solution.covariance is not None:
        variances = np.diagonal(solution.covariance, axis1=-2, axis2=-1)
        deviations = np.sqrt(variances).reshape(-1, 6)
        if in_degrees(angles):
            deviations[:, 3:] = np.degrees(deviations[:, 3:])
        numbers += list(deviations.T)
    if solution.radius is not None:
        numbers.append(np.ravel(solution.radius))
    limits = _limit_columns(solution.limits)
    status = label_column(np.ravel(solution.status), LABELS)
    columns = [*pose_table(solution.pose, angles).values(), status, *map(number_column, numbers)]
    if solution.event is not None:
        columns.append(label_column(solution.event, EVENTS))
    names = solution_names(angles, *optional, limits=bool(limits))
    return dict(zip(names, [*columns, *limits], strict=True))


def _limit_columns(limits: Limits | None) -> list[pa.Array]:
    """Share and name of the tightest limit of each row."""
    if limits is None:
        return []
    from gough.margins import TEXTS

    return [
        number_column(np.ravel(limits.tightest)),
        label_column(np.ravel(limits.tightest_part), TEXTS.tolist()),
    ]

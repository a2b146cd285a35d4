"""The result of `assembly_modes`: poses, certificates and counts, also as a table."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gough.certificate import Certificate
from gough.checks import Array
from gough.columns import RADIUS, RESIDUAL, STATUS, Angles
from gough.kinematics import assembly_sign, joint_positions, singularity_distance
from gough.platform import Platform
from gough.pose import Pose, pose_cells, pose_table
from gough.status import ModesStatus
from gough.tables import Kind, Table, TableInfo, label_column, make_frame, number_column
from gough.text import number, page, pose_heads, rows_of, with_unit

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True, eq=False)
class AssemblyModes:
    """Every real pose of one set of readings, or of a batch (...) of sets.

    The M poses of all sets follow one another, set after set, the pose nearest to home first in
    each; `row` names the set of each pose, counted through all batch axes. `modes[i]` are the
    poses of one set or of a smaller batch, and iterating goes along the first batch axis.

    Attributes:
        platform: the machine.
        legs: (..., 6) the readings.
        platform_pose: batch (M,), the poses of the platform.
        row: (M,) the set of readings that a pose belongs to; 0 for a single set.
        multiplicity: (M,) 1 for a regular pose, above 1 where several solutions meet (a
            singular pose), 0 for a sample of a curve of poses.
        certificate: see `gough.certify`; batch (M,).
        status: (...) uint8, to be compared with `ModesStatus` members.
        paths: (..., 4): how many of the complex solutions are real, are complex, went to
            infinity, met in multiple ones.
        solutions: complex solutions that this machine has for general readings.
        struts: lower ends (N, 6, 3), or (1, 6, 3) if they never move, and lengths (N, 6) of the
            struts that the N sets of readings stand for [platform unit].
        table: library and row labels of the table of readings, if they came in one.
        frame: whose poses `pose` holds, such as "tool in work"; "" for those of the platform.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> modes = gough.assembly_modes(platform, [platform.home_legs, platform.home_legs + 1])
        >>> modes.counts, modes[0].complete
        (array([16, 16]), array(True))
    """

    platform: Platform
    legs: Array
    platform_pose: Pose
    row: NDArray[np.int64]
    multiplicity: NDArray[np.int32]
    certificate: Certificate
    status: NDArray[np.uint8]
    paths: NDArray[np.int32]
    solutions: int
    struts: tuple[Array, Array]
    table: TableInfo | None = None
    frame: str = ""

    @cached_property
    def pose(self) -> Pose:
        """Poses (M,), of `frame` if there is one."""
        own = self.platform_pose
        return self.platform.frame(self.frame).of(own) if self.frame else own

    @cached_property
    def residual(self) -> Array:
        """(M,) largest difference between a strut's length and its reading's [platform unit]."""
        base, lengths = struts_of_sets(self.struts, self.row)
        struts = joint_positions(self.platform, self.platform_pose) - base
        return np.abs(np.linalg.norm(struts, axis=-1) - lengths).max(axis=-1, initial=0.0)

    @cached_property
    def singularity_distance(self) -> Array:
        """(M,) see `gough.singularity_distance`; rotary poses that the motors reach only."""
        return singularity_distance(self.platform, self.platform_pose)

    @cached_property
    def sign(self) -> Array:
        """(M,) sign of the Jacobian's determinant times that at home."""
        return assembly_sign(self.platform, self.platform_pose)

    @property
    def certified(self) -> NDArray[np.bool_]:
        """(M,) exactly one pose with these readings lies within the certificate's radius."""
        return self.certificate.certified

    @property
    def readings(self) -> Array:
        """(M, 6) the readings that each pose belongs to."""
        return self.legs.reshape(-1, 6)[self.row]

    @property
    def complete(self) -> NDArray[np.bool_]:
        """(...) no pose is missing."""
        return np.isin(self.status, (ModesStatus.COMPLETE, ModesStatus.SINGULAR))

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """(...) how many poses there are."""
        batch = self.legs.shape[:-1]
        return np.bincount(self.row, minlength=math.prod(batch)).reshape(batch)

    def __len__(self) -> int:
        """Length of a batch's first axis, or number of poses of a single set."""
        return len(self.legs) if self.legs.ndim > 1 else len(self.row)

    def __getitem__(self, index: Any) -> AssemblyModes:
        batch = self.legs.shape[:-1]
        if not batch:
            raise IndexError("these are the modes of one set of readings; use .pose[index]")
        sets = np.arange(math.prod(batch)).reshape(batch)[index]
        flat, count = np.ravel(sets), np.ravel(self.counts[index])
        row = np.repeat(np.arange(len(flat)), count)
        # poses of a set follow one another: its first, and how far behind it each is
        behind = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
        mine = np.repeat(np.searchsorted(self.row, flat), count) + behind
        return replace(
            self, legs=self.legs[index], platform_pose=self.platform_pose[mine], row=row,
            multiplicity=self.multiplicity[mine], certificate=self.certificate[mine],
            status=self.status[index], paths=self.paths[index],
            struts=struts_of_sets(self.struts, flat),
            table=self.table and self.table.at(flat[row]),
        )  # fmt: skip

    def __iter__(self) -> Iterator[AssemblyModes]:
        return (self[k] for k in range(len(self)))

    def to_frame(self, kind: Kind | None = None, *, angles: Angles | None = None) -> Table:
        """A table with a row for each of the M poses, set after set, nearest to home first.

        row (the set of readings, from 0, counted through all batch axes), x, y, z [platform
        unit], qw, qx, qy, qz, status (a word), residual [platform unit], multiplicity,
        certified, radius, error [platform unit], sigma_min (see `singularity_distance`), sign.

        Args:
            kind: "pandas", "polars" or "pyarrow"; unless given, as the table of readings was,
                else pandas. A pandas table has the row labels of that of the readings, each as
                often as its readings have poses.
            angles: Euler angles instead of the quaternion: "deg", "rad", "uvw", "abc" or "rpy",
                see `Pose.to_frame`.

        Raises:
            GoughError: another kind or angle, or a library that is not installed.
        """
        source = self.table
        if source is not None and self.legs.ndim > 1:
            source = source.at(self.row)
        return make_frame(mode_columns(self, angles), kind, source)

    def __repr__(self) -> str:
        if self.legs.ndim == 1:
            label = ModesStatus(int(self.status)).label
            return f"AssemblyModes({len(self.row)} poses, {label})"
        sets = math.prod(self.legs.shape[:-1])
        return f"AssemblyModes({len(self.row)} poses of {sets} sets of readings)"

    def _repr_html_(self) -> str:
        def cells(i: tuple[int, ...]) -> list[str]:
            k = i[0]
            one = self.certificate[k]
            proof = number(one.radius) if one.certified else "not proven"
            known = [number(self.residual[k], ".2g"), proof, number(self.singularity_distance[k])]
            return [*([str(self.row[k])] if several else []), *pose_cells(self.pose[k]), *known]

        several, unit = self.legs.ndim > 1, self.platform.unit
        first, *heads = pose_heads((len(self.row),), unit)
        heads = [first, *(["set"] if several else []), *heads, with_unit("residual", unit)]
        heads += [with_unit("radius", unit), "to singularity"]
        codes, times = np.unique(self.status, return_counts=True)
        notes = [
            f"{n:,} {ModesStatus(s).label}: {ModesStatus(s).text}"
            for s, n in zip(codes.tolist(), times.tolist(), strict=True)
        ]
        title = f"{self!r} of {self.platform.name}"
        return page(title, heads, rows_of((len(self.row),), cells), notes)


def struts_of_sets(struts: tuple[Array, Array], sets: NDArray[np.int64]) -> tuple[Array, Array]:
    """Lower ends and lengths of the struts of some sets, by their numbers."""
    base, lengths = struts
    return base if len(base) == 1 else base[sets], lengths[sets]


def mode_columns(modes: AssemblyModes, angles: Angles | None) -> dict[str, pa.Array]:
    """The columns of `AssemblyModes.to_frame`."""
    labels = [status.label for status in ModesStatus]
    proof = modes.certificate
    return {
        "row": number_column(modes.row),
        **pose_table(modes.pose, angles),
        STATUS: label_column(np.ravel(modes.status)[modes.row], labels),
        RESIDUAL: number_column(modes.residual),
        "multiplicity": number_column(modes.multiplicity),
        "certified": number_column(modes.certified),
        RADIUS: number_column(proof.radius),
        "error": number_column(proof.error),
        "sigma_min": number_column(modes.singularity_distance),
        "sign": number_column(modes.sign),
    }

"""Solved rows as named columns: what files and tables of poses hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gough.columns import Angles, pose_names, solution_names
from gough.fk.status import Solution, Status
from gough.tables import pose_values

if TYPE_CHECKING:
    import pyarrow as pa

LABELS = tuple(status.label for status in Status)


def solution_columns(solution: Solution, angles: Angles | None) -> dict[str, pa.Array]:
    """The columns of `solution_names`, each with a value for every row, batch axes flattened.

    Args:
        angles: Euler angles in these units in place of the quaternion.

    Raises:
        GoughError: angles of another name.
    """
    from gough.arrow import label_column, number_column

    with_covariance, with_radius = solution.covariance is not None, solution.radius is not None
    numbers = list(pose_values(solution.pose, angles).T)
    numbers += [np.ravel(solution.residual), np.ravel(solution.iterations)]
    if solution.covariance is not None:
        variances = np.diagonal(solution.covariance, axis1=-2, axis2=-1)
        numbers += list(np.sqrt(variances).reshape(-1, 6).T)
    if solution.radius is not None:
        numbers.append(np.ravel(solution.radius))
    columns = [number_column(values) for values in numbers]
    columns.insert(len(pose_names(angles)), label_column(np.ravel(solution.status), LABELS))
    return dict(zip(solution_names(angles, with_covariance, with_radius), columns, strict=True))

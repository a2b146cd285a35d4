"""The words of an outcome, and solutions as rows."""

from __future__ import annotations

import numpy as np
import pytest

from gough import Pose
from gough.fk.solution import Solution
from gough.status import USABLE, Status


@pytest.mark.parametrize("status", Status)
def test_every_status_is_a_sentence_a_user_can_act_on(status: Status) -> None:
    assert status.text[0].isupper()
    assert status.text.endswith(".")
    assert status.label == status.name.lower()
    advice = status is Status.CONVERGED or ":" in status.text
    assert advice, "it says what to do"


def test_only_poses_that_can_be_relied_on_are_usable() -> None:
    assert {s for s in Status if s.usable} == set(USABLE)
    assert Status.OUTSIDE_WORKSPACE.usable
    assert not Status.OTHER_MODE.usable
    assert not Status.UNREACHABLE.usable


def _solution(*statuses: Status) -> Solution:
    count = len(statuses)
    return Solution(
        Pose(np.arange(3.0 * count).reshape(count, 3)),
        np.array(statuses, dtype=np.uint8),
        np.arange(count, dtype=np.float64) * 1e-12,
        np.arange(count, dtype=np.int32),
        np.zeros((count, 6, 6)),
    )


def test_counts_tell_each_status_that_occurs() -> None:
    found = _solution(Status.UNREACHABLE, Status.CONVERGED, Status.UNREACHABLE)
    assert found.counts() == {Status.CONVERGED: 1, Status.UNREACHABLE: 2}
    assert found.usable.tolist() == [False, True, False]
    assert _solution(*Status).usable.tolist() == [s.usable for s in Status]
    assert repr(found) == "Solution(batch (3,); converged: 1, unreachable: 2)"


def test_a_row_is_a_solution_of_its_own() -> None:
    found = _solution(Status.CONVERGED, Status.INVALID_INPUT)
    row = found[1]
    assert (row.status, row.residual, row.iterations) == (Status.INVALID_INPUT, 1e-12, 1)
    assert row.covariance is not None
    assert row.covariance.shape == (6, 6)
    assert repr(row) == (
        "Solution(invalid_input, Pose(position=(3, 4, 5), wxyz=(1, 0, 0, 0)), "
        "residual=1e-12, iterations=1)"
    )
    assert found[found.usable].status.tolist() == [Status.CONVERGED]

"""Forward kinematics: poses from leg readings."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gough.checks import Array
from gough.fk import bulk
from gough.fk.solution import Solution
from gough.kernel import constants as geometry
from gough.kernel.threads import in_parts
from gough.kinematics import pose_covariance
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.base import PolynomialSeed, PoseSeed, Seed, find_seed
from gough.seeds.polynomial import Polynomial
from gough.status import USABLE, Status
from gough.tables import Table, TableInfo, as_readings, table_info


def solve(
    platform: Platform,
    legs: ArrayLike | Table,
    *,
    seed: str | Seed | Pose = "auto",
    tol: float = 1e-12,
    max_iterations: int = 60,
    restarts: int = 24,
    singular: float = geometry.SINGULAR,
    leg_noise: ArrayLike | None = None,
    certify: bool = False,
    ambiguous: bool = False,
    workers: int | None = None,
) -> Solution:
    """Poses that have the given leg readings, each with what is known about it.

    Plain Newton runs on all rows at once; rows that do not settle, or settle outside the
    workspace, are then tried one by one with a damped method and from other starts.

    Args:
        legs: readings (..., 6): lengths, length changes [platform unit] or motor angles [rad];
            or a pandas, polars, pyarrow or other Arrow table with columns leg_1 to leg_6. Rows
            that hold NaN, nothing or impossible numbers get status INVALID_INPUT.
        seed: the first guess. "auto" (polynomial where the platform states a workspace, else
            home), "home", "polynomial", "polynomial-5" (another degree), "disgnet" or another
            network that comes with the package, the path of a trained one or of its run's
            folder, a `Pose` (one, or one a row), or any object with `guess(legs) -> Pose`.
        tol: largest strut length error of a converged row, as a share of the platform's size
            (rounding alone leaves about 2e-15).
        max_iterations: Newton steps from each start; 0 returns the guess itself.
        restarts: other starts to try before a row is given up; unless 0, the best of them is
            followed for longer in the end, to tell a miss from a slow approach.
        singular: distance to singularity (see `singularity_distance`) below which a row is
            reported as near one.
        leg_noise: standard deviation of the readings, a number or (6,), or their covariance
            (6, 6): asks for `Solution.covariance`.
        certify: prove each usable pose: where it succeeds, CONVERGED becomes CERTIFIED and
            `Solution.radius` says how far around no other pose has these legs.
        ambiguous: look for every other pose with the same readings (see `assembly_modes`; it
            takes hundreds of times as long) and call a usable row AMBIGUOUS where one of them
            could be the machine's too: in workspace and stroke, with home's sign of det J.
        workers: threads; all cores unless given.

    Returns:
        Solution: batch axes as those of `legs`; (N,) for a table.

    Raises:
        GoughError: legs of another shape, an option out of range, an unknown seed.
        InputError: a table without these columns, or with something else than numbers there.
        PlatformError: a polynomial seed for a platform without workspace.
    """
    readings = as_readings(legs)
    settings = bulk.Settings(tol, max_iterations, restarts, singular, workers)
    flat = np.ascontiguousarray(readings.reshape(-1, 6))
    found = find_seed(platform, seed)
    start = _start(platform, found, flat)
    rows, troubled = bulk.newton(platform, flat, start, settings)
    if troubled:
        # a given pose says which assembly mode is meant: where Newton went from it stands
        _finish(platform, flat, rows, start, isinstance(found, PoseSeed), settings)
        _blank_invalid(rows)
    radius = _certify(platform, flat, rows, settings) if certify else None
    if ambiguous:
        _doubt(platform, flat, rows)
    return _solution(platform, rows, radius, readings.shape[:-1], leg_noise, table_info(legs))


def _start(platform: Platform, seed: Seed, legs: Array) -> Array | Polynomial:
    """What the block solver starts from: a polynomial it evaluates, or internal poses (N, 7)."""
    if isinstance(seed, PolynomialSeed):
        return seed.polynomial
    internal = geometry.to_internal(geometry.constants(platform), seed.guess(legs))
    bad = ~np.all(np.isfinite(internal), axis=-1)
    internal[bad] = bulk.other_starts(platform, 1)[0]
    return np.ascontiguousarray(internal)


def _finish(
    platform: Platform,
    legs: Array,
    rows: bulk.Rows,
    start: Array | Polynomial,
    stay: bool,
    settings: bulk.Settings,
) -> None:
    """Give every row that is still open a status, solving it again where need be.

    Args:
        stay: leave rows that converged where they are, even outside the workspace.
    """
    chosen = bulk.open_rows(rows)
    constants = geometry.constants(platform)
    unsettled = bulk.is_unsettled(rows.status[chosen])
    guess = np.empty((len(chosen), 7))
    settled = chosen[~unsettled]
    at = Pose.trusted(rows.position[settled], rows.wxyz[settled])
    guess[~unsettled] = geometry.to_internal(constants, at)
    again = chosen[unsettled]
    if isinstance(start, Polynomial):
        pose = bulk.evaluate(platform, start, legs[again])
        guess[unsettled] = geometry.to_internal(constants, pose)
    else:
        guess[unsettled] = start[again]
    starts = bulk.other_starts(platform, settings.restarts if settings.max_iterations else 0)
    none = bulk.other_starts(platform, 0)
    alone = ~unsettled & stay
    for part, others in ((alone, none), (~alone, starts)):
        bulk.rescue(platform, legs, rows, chosen[part], guess[part], others, settings)


def _certify(platform: Platform, legs: Array, rows: bulk.Rows, settings: bulk.Settings) -> Array:
    """Radii of uniqueness (N,) [platform unit], 0 where unproven; promotes converged rows."""
    from gough.certificate import certify

    radius = np.zeros(len(legs))

    def work(first: int, last: int) -> int:
        part = slice(first, last)
        pose = Pose.trusted(rows.position[part], rows.wxyz[part])
        radius[part] = certify(platform, legs[part], pose).radius
        return 0

    in_parts(work, len(legs), settings.workers)
    proven = radius > 0
    rows.status[proven & (rows.status == Status.CONVERGED)] = Status.CERTIFIED
    return radius


def _doubt(platform: Platform, legs: Array, rows: bulk.Rows) -> None:
    """Call usable rows ambiguous whose readings more than one pose could have."""
    from gough.modes.choose import ambiguous

    usable = np.flatnonzero(np.isin(rows.status, USABLE))
    if len(usable):
        rows.status[usable[ambiguous(platform, legs[usable])]] = Status.AMBIGUOUS


def _solution(
    platform: Platform,
    rows: bulk.Rows,
    radius: Array | None,
    batch: tuple[int, ...],
    leg_noise: ArrayLike | None,
    source: TableInfo | None,
) -> Solution:
    pose = Pose.trusted(rows.position.reshape(*batch, 3), rows.wxyz.reshape(*batch, 4))
    return Solution(
        pose,
        rows.status.reshape(batch) if batch else Status(int(rows.status[0])),
        rows.residual.reshape(batch),
        rows.iterations.reshape(batch),
        None if leg_noise is None else pose_covariance(platform, pose, leg_noise),
        None if radius is None else radius.reshape(batch),
        platform.unit,
        source,
    )


def _blank_invalid(rows: bulk.Rows) -> None:
    """Rows without a question get no answer: NaN throughout."""
    invalid = rows.status == Status.INVALID_INPUT
    for array in (rows.position, rows.wxyz, rows.residual):
        array[invalid] = np.nan
    rows.iterations[invalid] = 0

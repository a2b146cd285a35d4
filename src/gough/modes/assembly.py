"""Every assembly mode of a hexapod: all real poses that six readings allow."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough.certificate import certify
from gough.checks import Array
from gough.kernel.paths import FINITE, LOST
from gough.kernel.threads import cores
from gough.kinematics import equivalent_struts
from gough.modes.finish import DOUBTFUL, REAL, SAME, finish_rows, is_far
from gough.modes.follow import SHARE, Ends, follow
from gough.modes.frames import Frames
from gough.modes.result import AssemblyModes
from gough.modes.singular import Problem, classify, curve_of_poses, gather, merge
from gough.modes.starts import SEED, Start, start_of
from gough.modes.study import distinct
from gough.platform import Platform
from gough.status import ModesStatus
from gough.tables import Table, TableInfo, as_readings, table_info

CHUNK = 128  # sets of readings per task
# What readings whose paths do not all arrive apart are tried with: the share of the radius of
# convergence that a step takes, and which of the machine's start systems.
AGAIN = ((0.2, 0), (0.3, 1), (0.3, 2), (0.1, 3))
DISTANT = 1e3  # normalised: starts beyond belong to no pose, where the base joints are fixed
TOLERANCE = 1e-11  # normalised: largest |l^2 - d.d| / 2 of a pose that has the legs


def assembly_modes(
    platform: Platform, legs: ArrayLike | Table, *, threads: int | None = None
) -> AssemblyModes:
    """All real poses for leg readings, each with a certificate, and whether the list is complete.

    All complex solutions are tracked from the machine's start system (found on its first use,
    some hundredths of a second), so nothing depends on a guess. The same call gives the same
    bits, whatever the number of threads and whatever other readings are beside.

    Args:
        legs: readings (6,) or (N, 6) of any kind of leg, or a table as for `solve`.
        threads: at most so many; all the process may use if None.

    Raises:
        GoughError: legs of another shape, or not numbers. Rows with NaN or infinity are
            answered with no poses and the status INVALID_INPUT.
    """
    readings = as_readings(legs)
    rows = readings.reshape(-1, 6)
    start = start_of(platform)
    base, lengths = equivalent_struts(platform, rows)
    valid = np.all(np.isfinite(rows), axis=1) & np.all(lengths > 0, axis=1)
    work = _Work(platform, start, base if platform.rotary is not None else base[:1], lengths)
    outcome = _Outcome.empty(len(rows))
    outcome.status[~valid] = ModesStatus.INVALID_INPUT
    todo = np.flatnonzero(valid)
    if start.singular:
        _curves(platform, work, todo, outcome)
    else:
        _run(work, todo, outcome, threads)
    return _assemble(platform, readings, start, outcome, table_info(legs))


@dataclass(frozen=True, eq=False)
class _Work:
    """Readings in the platform's units, to be tracked from `start`."""

    platform: Platform
    start: Start
    base: Array  # (N or 1, 6, 3)
    lengths: Array  # (N, 6)

    def normalised(self, rows: NDArray[np.int64]) -> tuple[Array, Array]:
        """Base joints (n or 1, 6, 3) and squared lengths (n, 6) of some rows."""
        frames: Frames = self.start.frames
        base = self.base if len(self.base) == 1 else self.base[rows]
        return frames.base(base), frames.squares(self.lengths[rows])


@dataclass(frozen=True, eq=False)
class _Outcome:
    """Per row: status, counts of paths. Poses come in blocks, in any order of rows.

    Attributes:
        status: (N,); paths: (N, 4) real, complex, at infinity, singular.
        blocks: rows (M,), normalised real poses (M, 4) and (M, 3), multiplicities (M,).
    """

    status: NDArray[np.uint8]
    paths: NDArray[np.int32]
    blocks: list[tuple[NDArray[np.int64], Array, Array, NDArray[np.int32]]]

    @classmethod
    def empty(cls, count: int) -> _Outcome:
        nothing = np.zeros(0, np.int64), np.zeros((0, 4)), np.zeros((0, 3)), np.zeros(0, np.int32)
        return cls(np.zeros(count, np.uint8), np.zeros((count, 4), np.int32), [nothing])

    def add(self, rows: NDArray[np.int64], e: Array, t: Array, multiple: NDArray[np.int32]) -> None:
        """Poses of some rows; a row's poses must come in one call."""
        self.blocks.append((rows, e, t, multiple))


def _run(work: _Work, rows: NDArray[np.int64], outcome: _Outcome, threads: int | None) -> None:
    """Fill `outcome` for `rows`, in chunks on threads; rows that are not clean are done again."""
    chunks = [rows[k : k + CHUNK] for k in range(0, len(rows), CHUNK)]
    workers = min(len(chunks), threads or cores())

    def run(chunk: NDArray[np.int64]) -> NDArray[np.int64]:
        return _solve(work, chunk, outcome)

    if workers <= 1:
        left = [run(chunk) for chunk in chunks]
    else:
        with ThreadPoolExecutor(workers) as pool:
            left = list(pool.map(run, chunks))
    for row in np.concatenate([*left, np.zeros(0, np.int64)]).astype(int):
        _solve_again(work, row, outcome)


def _track(work: _Work, rows: NDArray[np.int64], start: Start, share: float) -> _Tracked:
    """Paths from `start` to some rows, and their real ends."""
    base, squares = work.normalised(rows)
    moves = base.astype(complex) if start.base_moves else None
    ends = follow((start.e, start.t), start.at, squares.astype(complex), moves, share=share)
    shape = ends.ends.shape
    e, t, kind = np.zeros((*shape, 4)), np.zeros((*shape, 3)), np.zeros(shape, np.uint8)
    away, clean = np.zeros(shape, np.bool_), np.zeros(len(rows), np.bool_)
    distant = np.abs(start.t).max(axis=1, initial=0.0) > DISTANT
    finish_rows(
        start.frames.moving, np.ascontiguousarray(base), np.ascontiguousarray(squares), ends.e,
        ends.t, ends.ends, distant & (not start.base_moves), share < SHARE, TOLERANCE,
        e, t, kind, away, clean,
    )  # fmt: skip
    return _Tracked(start, ends, e, t, kind, away, clean)


@dataclass(frozen=True, eq=False)
class _Tracked:
    """Ends of the P paths of n rows, and what `finish_rows` makes of them."""

    start: Start
    ends: Ends
    e: Array  # (n, P, 4) the real poses
    t: Array
    kind: NDArray[np.uint8]  # (n, P)
    away: NDArray[np.bool_]
    clean: NDArray[np.bool_]  # (n,)

    def record(self, outcome: _Outcome, rows: NDArray[np.int64]) -> None:
        """Poses of the clean rows, with mirror images; `rows` (n,) are their places among all."""
        start, good = self.start, self.clean
        real = (self.kind == REAL) & good[:, None]
        where, e, t = np.broadcast_to(rows[:, None], real.shape)[real], self.e[real], self.t[real]
        count, away = real.sum(axis=1), self.away.sum(axis=1)
        if start.paired:
            mirrored = start.frames.reflect(e, t)
            where = np.concatenate([where, where])
            e, t = np.concatenate([e, mirrored[0]]), np.concatenate([t, mirrored[1]])
            count, away = 2 * count, 2 * away
        outcome.add(where, e, t, np.ones(len(e), np.int32))
        paths = [count, start.count - count - away, away, 0 * away]
        outcome.paths[rows[good]] = np.stack(paths, axis=1)[good]
        outcome.status[rows[good]] = ModesStatus.COMPLETE

    def beyond(self, squares: Array) -> NDArray[np.bool_]:
        """(P,) paths of the only row that did not arrive, and are far beyond any pose."""
        far = np.array([bool(is_far(t, squares)) for t in self.ends.t[0]])
        return far & (self.ends.ends[0] != FINITE)


def _solve(work: _Work, rows: NDArray[np.int64], outcome: _Outcome) -> NDArray[np.int64]:
    """Track a chunk; returns the rows that were not clean."""
    tracked = _track(work, rows, work.start, SHARE)
    tracked.record(outcome, rows)
    return rows[~tracked.clean]


def _solve_again(work: _Work, row: int, outcome: _Outcome) -> None:
    """Shorter steps, then another start; what is still not clean is singular."""
    tries = []
    for share, number in AGAIN:
        tracked = _track(work, np.array([row]), start_of(work.platform, number), share)
        if tracked.clean[0]:
            tracked.record(outcome, np.array([row]))
            return
        tries.append(tracked)
    # a solution far beyond any pose is believed to be lost if every route loses one there
    squares = work.normalised(np.array([row]))[1][0]
    gone = [one.beyond(squares) for one in tries]
    if all(
        np.all(far | (one.ends.ends[0] == FINITE)) for far, one in zip(gone, tries, strict=True)
    ):
        for far, one in zip(gone, tries, strict=True):
            one.away[0] = far
    best = max(tries, key=lambda one: np.sum(one.ends.ends == FINITE))
    _record_singular(work, row, outcome, best)


def _record_singular(work: _Work, row: int, outcome: _Outcome, tracked: _Tracked) -> None:
    """Regular poses, and those that the paths which came together were heading for."""
    start, ends = tracked.start, tracked.ends
    e, t, kind, far = tracked.e[0], tracked.t[0], tracked.kind[0], tracked.away[0]
    base, squares = work.normalised(np.array([row]))
    how, real = ends.ends[0], kind == REAL
    open_ends = ~far & ((how != FINITE) | (kind == DOUBTFUL))
    problem = Problem(start.frames.moving, base[0], squares[0], TOLERANCE)
    lost = int(np.sum((how == LOST) & ~far))
    stopped = ends.e[0][open_ends], ends.t[0][open_ends]
    e, t, paths = gather(problem, (e[real], t[real]), stopped)
    if start.paired:
        mirrored = start.frames.reflect(e, t)  # a flat pose is its own mirror image
        both = np.concatenate([e, mirrored[0]]), np.concatenate([t, mirrored[1]])
        e, t, paths = merge(*both, np.concatenate([paths, paths]))
    found = classify(problem, e, t, paths)
    e, t, multiple = found.e, found.t, found.paths
    jumped = len(distinct(ends.e[0], ends.t[0], SAME)) < len(how)
    away = int(np.sum(far)) * (2 if start.paired else 1)
    doubtful = found.unresolved + lost + jumped > 0
    regular, meet = int(np.sum(multiple == 1)), int(multiple[multiple > 1].sum())
    outcome.add(np.full(len(e), row), e, t, multiple)
    outcome.paths[row] = regular, max(0, start.count - regular - meet - away), away, meet
    if found.curve:
        outcome.status[row] = ModesStatus.SELF_MOTION
    elif doubtful:
        outcome.status[row] = ModesStatus.INCOMPLETE
    elif meet:
        outcome.status[row] = ModesStatus.SINGULAR
    else:
        outcome.status[row] = ModesStatus.COMPLETE


def _curves(platform: Platform, work: _Work, rows: NDArray[np.int64], outcome: _Outcome) -> None:
    """Samples of a curve of poses for each row of an architecturally singular machine."""
    frames = work.start.frames
    home = frames.normal(platform.home)
    for row in rows:
        base, squares = work.normalised(np.array([row]))
        problem = Problem(frames.moving, base[0], squares[0], TOLERANCE)
        e, t = curve_of_poses(problem, home, SEED)
        outcome.add(np.full(len(e), row), e, t, np.zeros(len(e), np.int32))
        outcome.status[row] = ModesStatus.ALWAYS_SINGULAR


def _assemble(
    platform: Platform, legs: Array, start: Start, outcome: _Outcome, source: TableInfo | None
) -> AssemblyModes:
    """Poses in the platform's coordinates, certified, nearest to home first in each row."""
    row, e, t, multiple = (np.concatenate(parts) for parts in zip(*outcome.blocks, strict=True))
    pose = start.frames.pose(e, t)
    shift, turn = pose.distance(platform.home)
    order = np.lexsort((shift / platform.size + turn, row))
    row, pose, multiple = row[order], pose[order], multiple[order]
    rows = legs.reshape(-1, 6)
    proof = certify(platform, rows[row], pose)
    _settle_doubts(outcome, row, multiple, proof.certified, start.count)
    return AssemblyModes(
        platform=platform, legs=legs, pose=pose, row=row, multiplicity=multiple,
        certificate=proof, status=outcome.status.reshape(legs.shape[:-1]),
        paths=outcome.paths.reshape(*legs.shape[:-1], 4), solutions=start.count,
        table=source,
    )  # fmt: skip


def _settle_doubts(
    outcome: _Outcome,
    row: NDArray[np.int64],
    multiple: NDArray[np.int32],
    certified: NDArray[np.bool_],
    solutions: int,
) -> None:
    """Poses that looked multiple but are proven to be alone are regular after all."""
    for k in np.flatnonzero(outcome.status == ModesStatus.SINGULAR):
        mine = row == k
        multiple[mine & certified] = 1
        regular, meet = np.sum(multiple[mine] == 1), np.sum(multiple[mine & (multiple > 1)])
        away = outcome.paths[k, 2]
        outcome.paths[k] = regular, solutions - regular - away - meet, away, meet
        if not meet:
            outcome.status[k] = ModesStatus.COMPLETE

"""Every assembly mode of a hexapod: all real poses that six readings allow.

    start_system -> track_paths -> refine_real_ends -> resolve_singular -> certify -> AssemblyModes

All steps between the readings and the certificate work on one normalised `Problem`. Sets of
readings whose paths all arrive apart are done after `refine_real_ends`; the others are tracked
again, and what still does not arrive belongs to singular poses.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough.certificate import certify_struts
from gough.checks import Array
from gough.kernel.ends import BEYOND, DOUBTFUL, OPEN, REAL, SAME, SCRATCH, refine_ends
from gough.kernel.paths import LOST, SHARE, STUCK, Ends, track_paths
from gough.kernel.threads import cores
from gough.kinematics import equivalent_struts
from gough.modes.frames import Problem, distinct
from gough.modes.result import AssemblyModes, struts_of_sets
from gough.modes.singular import Legs, classify, curve_of_poses, merge, poses_near
from gough.modes.starts import SEED, StartSystem, start_system
from gough.platform import Platform, as_platform
from gough.status import ModesStatus
from gough.tables import Table, as_readings, table_info

CHUNK = 128  # sets of readings per task
# Tries for readings whose paths do not all arrive apart: the share of the radius of convergence
# that a step takes, and which of the machine's start systems.
AGAIN = ((0.2, 0), (0.3, 1), (0.3, 2), (0.1, 3))
DISTANT = 1e3  # normalised: starts beyond belong to no pose, where the base joints are fixed


def assembly_modes(
    platform: Platform | str | Path,
    legs: ArrayLike | Table,
    *,
    workers: int | None = None,
    frame: str | None = None,
) -> AssemblyModes:
    """All real poses for leg readings, each with a certificate, and whether the list is complete.

    All complex solutions are tracked from the machine's start system (found on its first use,
    some hundredths of a second), so nothing depends on a guess. The same call gives the same
    bits, whatever the number of workers and whatever other readings are beside.

    Args:
        legs: readings (..., 6) of any kind of leg, or a table as for `solve`.
        workers: number of threads; all cores unless given.
        frame: whose poses are returned, such as "tool in work" (see `Platform.frame`); those of the
            platform unless given.

    Returns:
        The poses of all sets of readings. Sets with NaN, infinity or a length not above 0 have
        no poses and the status INVALID_INPUT.

    Raises:
        GoughError: legs of another shape, or not numbers, or an unknown frame.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("dietmaier")
        >>> gough.assembly_modes(platform, platform.home_legs)
        AssemblyModes(40 poses, complete)
    """
    platform = as_platform(platform)
    if frame is not None:
        platform.frame(frame)  # refused before any work
    readings = as_readings(legs)
    base, lengths = equivalent_struts(platform, readings.reshape(-1, 6))
    struts = base if platform.rotary is not None else platform.base[None], lengths
    start = start_system(platform)
    problem = Problem.of(start.frames, *struts)
    sets = np.flatnonzero(problem.valid)
    if start.singular:
        home = start.frames.normalise(platform.home)
        answers = [sample_curve(problem, k, home) for k in sets.tolist()]
    else:
        answers = find_poses(platform, problem, sets, workers)
    found = Answer.join(len(lengths), answers)
    pose = start.frames.denormalise(found.poses)
    translation, rotation = pose.distance(platform.home)
    order = np.lexsort((translation / platform.size + rotation, found.row))
    row, pose = found.row[order], pose[order]
    proof = certify_struts(platform, *struts_of_sets(struts, row), pose)
    status, paths, multiplicity = settle_doubts(found, order, proof.certified, start.count)
    batch = readings.shape[:-1]
    return AssemblyModes(
        platform=platform, legs=readings, platform_pose=pose, row=row, multiplicity=multiplicity,
        certificate=proof, status=status.reshape(batch), paths=paths.reshape(*batch, 4),
        solutions=start.count, struts=struts, table=table_info(legs),
        frame=frame or "",
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Answer:
    """Real poses of n sets of readings, M in all.

    Attributes:
        sets: (n,) the numbers of the sets.
        status: (n,) of `ModesStatus`.
        paths: (n, 4): how many of the complex solutions are real, are complex, went to
            infinity, met in multiple ones.
        row: (M,) the set that a pose belongs to.
        poses: (M, 7) normalised, see `gough.modes.frames`.
        multiplicity: (M,) 1, or more where solutions meet, or 0 on a curve of poses.
    """

    sets: NDArray[np.int64]
    status: NDArray[np.uint8]
    paths: NDArray[np.int32]
    row: NDArray[np.int64]
    poses: Array
    multiplicity: NDArray[np.int32]

    @classmethod
    def one(
        cls, k: int, status: int, paths: list[int], poses: Array, multiplicity: NDArray[np.int32]
    ) -> Answer:
        """The answer for set k."""
        row = np.full(len(poses), k)
        return cls(np.array([k]), np.array([status]), np.array([paths]), row, poses, multiplicity)

    @classmethod
    def join(cls, count: int, answers: list[Answer]) -> Answer:
        """The answer for all of `count` sets; sets without one are invalid."""
        status = np.full(count, ModesStatus.INVALID_INPUT, np.uint8)
        paths = np.zeros((count, 4), np.int32)
        for one in answers:
            status[one.sets], paths[one.sets] = one.status, one.paths
        row = np.concatenate([np.zeros(0, np.int64), *(one.row for one in answers)])
        poses = np.concatenate([np.zeros((0, 7)), *(one.poses for one in answers)])
        multiplicity = np.concatenate([np.zeros(0, np.int32), *(a.multiplicity for a in answers)])
        return cls(np.arange(count), status, paths, row, poses, multiplicity)


def find_poses(
    platform: Platform, problem: Problem, sets: NDArray[np.int64], workers: int | None
) -> list[Answer]:
    """Answers for some sets of a problem, on threads."""
    start = start_system(platform)

    def run(chunk: NDArray[np.int64]) -> tuple[Answer, NDArray[np.int64]]:
        ends = refine_real_ends(problem[chunk], start, SHARE, careful=False)
        return ends.regular(chunk), chunk[~ends.clean]

    chunks = [sets[k : k + CHUNK] for k in range(0, len(sets), CHUNK)]
    workers = min(len(chunks), workers or cores())
    if workers <= 1:
        done = [run(chunk) for chunk in chunks]
    else:
        with ThreadPoolExecutor(workers) as pool:
            done = list(pool.map(run, chunks))
    answers = [answer for answer, _ in done]
    return answers + [track_again(platform, problem, k) for _, left in done for k in left.tolist()]


@dataclass(frozen=True, eq=False)
class RealEnds:
    """Ends of the P paths to n sets of readings, and the real poses among them.

    Attributes:
        start: where the paths began.
        ends: where they ended.
        poses: (n, P, 7) the real poses, where `kind` is REAL.
        kind: (n, P) see `gough.kernel.ends`.
        away: (n, P) paths that went to infinity.
        clean: (n,) all other paths arrived, apart from each other and without doubt.
    """

    start: StartSystem
    ends: Ends
    poses: Array
    kind: NDArray[np.uint8]
    away: NDArray[np.bool_]
    clean: NDArray[np.bool_]

    def regular(self, sets: NDArray[np.int64]) -> Answer:
        """The answer for the clean ones of the sets (n,), mirror images included."""
        start, clean = self.start, self.clean
        real = (self.kind == REAL) & clean[:, None]
        row, poses = np.broadcast_to(sets[:, None], real.shape)[real], self.poses[real]
        count, away = real.sum(axis=1), self.away.sum(axis=1)
        if start.paired:
            row, poses = np.concatenate([row, row]), with_mirror_images(start, poses)
            count, away = 2 * count, 2 * away
        paths = np.stack([count, start.count - count - away, away, 0 * away], axis=1)
        complete = np.full(clean.sum(), ModesStatus.COMPLETE)
        return Answer(sets[clean], complete, paths[clean], row, poses, np.ones(len(row), np.int32))


def refine_real_ends(
    problem: Problem, start: StartSystem, share: float, *, careful: bool
) -> RealEnds:
    """Track all solutions to each set of readings, and refine the real ones among their ends.

    Args:
        share: of the radius of convergence that a step takes.
        careful: steps are short, so that a path that ends far away was meant to.
    """
    base = problem.base.astype(complex) if start.base_moves else None
    ends = track_paths(start.poses, start.at, problem.squares.astype(complex), base, share)
    shape = ends.how.shape
    poses, kind = np.zeros((*shape, 7)), np.zeros(shape, np.uint8)
    shared = np.zeros(len(problem.squares), np.bool_)
    refine_ends(
        problem.moving, problem.base, problem.squares, ends.pose, ends.how,
        poses, kind, shared, np.zeros(SCRATCH),
    )  # fmt: skip
    # starts so far away that their paths lead to no pose
    lost = (np.abs(start.poses[:, :3]).max(axis=1, initial=0.0) > DISTANT) & (not start.base_moves)
    if careful:
        lost = lost | ((kind == BEYOND) & (ends.how == STUCK))
    away = (kind >= OPEN) & lost
    clean = ~shared & np.all((kind < DOUBTFUL) | away, axis=1)
    return RealEnds(start, ends, poses, kind, away, clean)


def track_again(platform: Platform, problem: Problem, k: int) -> Answer:
    """The answer for set k from shorter steps and other starts; else it is singular."""
    one = problem[np.array([k])]
    tries = []
    for share, number in AGAIN:
        ends = refine_real_ends(one, start_system(platform, number), share, careful=True)
        if ends.clean[0]:
            return ends.regular(np.array([k]))
        tries.append(ends)
    # a solution far beyond any pose is believed to be lost if every route loses one there
    if not any(np.any(ends.kind == OPEN) for ends in tries):
        tries = [replace(ends, away=ends.kind == BEYOND) for ends in tries]
    return resolve_singular(one, max(tries, key=lambda ends: np.sum(ends.kind < OPEN)), k)


def resolve_singular(problem: Problem, found: RealEnds, k: int) -> Answer:
    """The answer for set k, some of whose paths came together or did not arrive.

    Args:
        problem: of this set alone.
        found: the ends of its paths.
    """
    start, legs = found.start, Legs.of(problem, 0)
    ends, how, kind, away = found.ends.pose[0], found.ends.how[0], found.kind[0], found.away[0]
    near = poses_near(legs, ends[(kind >= DOUBTFUL) & ~away])
    poses = np.concatenate([found.poses[0][kind == REAL], near])
    poses, counts = merge(poses, np.ones(len(poses), np.int32))
    if start.paired:  # a flat pose is its own mirror image
        poses, counts = merge(with_mirror_images(start, poses), np.concatenate([counts, counts]))
    met = classify(legs, poses, counts)
    regular = int(np.sum(met.multiplicity == 1))
    multiple = int(met.multiplicity[met.multiplicity > 1].sum())
    gone = int(np.sum(away)) * (2 if start.paired else 1)
    if met.curve:
        status = ModesStatus.SELF_MOTION
    elif met.unresolved or np.any((how == LOST) & ~away) or len(distinct(ends, SAME)) < len(ends):
        status = ModesStatus.INCOMPLETE
    else:
        status = ModesStatus.SINGULAR if multiple else ModesStatus.COMPLETE
    paths = [regular, max(0, start.count - regular - multiple - gone), gone, multiple]
    return Answer.one(k, status, paths, met.poses, met.multiplicity)


def sample_curve(problem: Problem, k: int, home: Array) -> Answer:
    """The answer for set k of an architecturally singular machine: samples of a curve of poses."""
    poses = curve_of_poses(Legs.of(problem, k), home, SEED)
    none = np.zeros(len(poses), np.int32)
    return Answer.one(k, ModesStatus.ALWAYS_SINGULAR, [0, 0, 0, 0], poses, none)


def with_mirror_images(start: StartSystem, poses: Array) -> Array:
    """Poses (M, 7) of a planar machine, then the mirror image of each."""
    return np.concatenate([poses, start.frames.reflect(poses)])


def settle_doubts(
    found: Answer, order: NDArray[np.int64], certified: NDArray[np.bool_], solutions: int
) -> tuple[NDArray[np.uint8], NDArray[np.int32], NDArray[np.int32]]:
    """Status, counts of paths and multiplicities, given which poses are proven to be alone.

    A pose that looked multiple but is alone is regular after all.

    Args:
        order: the order in which poses were certified.
        solutions: complex solutions of the machine.
    """
    status, paths = found.status, found.paths
    row, multiplicity = found.row[order], found.multiplicity[order]
    for k in np.flatnonzero(status == ModesStatus.SINGULAR):
        mine = row == k
        multiplicity[mine & certified] = 1
        regular, multiple = np.sum(multiplicity[mine] == 1), multiplicity[mine & (multiplicity > 1)]
        gone, meet = paths[k, 2], np.sum(multiple)
        paths[k] = regular, solutions - regular - gone - meet, gone, meet
        if not meet:
            status[k] = ModesStatus.COMPLETE
    return status, paths, multiplicity

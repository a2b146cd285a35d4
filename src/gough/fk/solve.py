"""Forward kinematics: poses from leg readings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough import limit_rules
from gough.checks import Array, as_number, as_whole
from gough.errors import GoughError
from gough.fk.rows import Rows
from gough.fk.screws import readings_without_turning, without_turning
from gough.fk.solution import Solution
from gough.kernel.constants import SINGULAR, kernel_constants, to_internal
from gough.kernel.layout import COMPONENTS, OPEN, WIDTH
from gough.kernel.rows import STEPS, settle_rows, solve_rows
from gough.kernel.threads import in_parts
from gough.kinematics import home_sign, leg_lengths, screw_lengths
from gough.platform import Platform, as_platform
from gough.platform_checks import refuse_screws
from gough.pose import Pose
from gough.seeds.base import PoseSeed, Seed, Start, find_seed, further_starts, starting_poses
from gough.status import USABLE, Status
from gough.tables import Table, as_readings, table_info

if TYPE_CHECKING:
    from gough.fk.tracker import Tracker

FEW = 1_024  # rows that are taken one by one: the code for blocks compiles longer
PART = 64  # open rows that a thread takes at a time
NO_POSES = np.empty((0, 7))
MOST_STEPS, MOST_STARTS, MOST_WORKERS = 10_000, 10_000, 10_000


def solve(
    platform: Platform | str | Path,
    legs: ArrayLike | Table,
    *,
    seed: str | Seed | Pose = "auto",
    tolerance: float = 1e-12,
    max_iterations: int = 60,
    restarts: int = 24,
    singular: float = SINGULAR,
    workers: int | None = None,
    frame: str | None = None,
    leg_noise: ArrayLike | None = None,
    certify: bool = False,
    ambiguous: bool = False,
    follow: bool = False,
    limits: bool = False,
) -> Solution:
    """Poses that have the given leg readings, each with a status.

    Calls a `gough.Solver` made with these settings; see there for `seed` to `frame`, and
    `Solver.__call__` for the rest and what is raised.

    Args:
        platform: the machine; a name in the catalog or the path of a .toml file will do.
        follow: rows (N, 6) are consecutive: each starts at the pose before, as in a
            `gough.Tracker` with its usual limits, and `Solution.event` says of each what
            `Tracker.event` does. A `seed` that is a pose is the machine's before the first row.
            For other limits call `Tracker.follow`.

    Example:
        >>> platform = gough.Platform.load("reference")
        >>> gough.solve(platform, platform.home_legs).status
        <Status.CONVERGED: 0>
    """
    platform = as_platform(platform)
    if follow:
        if certify or ambiguous:
            raise GoughError("follow: certify and ambiguous look at each row alone; leave them out")
        tracker = make_tracker(platform, seed, frame, tolerance=tolerance, singular=singular)
        return tracker.follow(legs, leg_noise=leg_noise, limits=limits)
    solver = Solver(platform, seed, tolerance, max_iterations, restarts, singular, workers, frame)
    return solver(legs, leg_noise=leg_noise, certify=certify, ambiguous=ambiguous, limits=limits)


def make_tracker(
    platform: Platform, seed: str | Seed | Pose, frame: str | None, **limits: float | None
) -> Tracker:
    """Return a tracker for consecutive rows.

    Args:
        seed: the machine's pose before the first row, or "auto" to find it from that row.
        frame: whose poses are returned, and given as seed.
        limits: arguments of `gough.Tracker`.

    Raises:
        GoughError: another seed.
    """
    from gough.fk.tracker import Tracker

    given = isinstance(seed, Pose) and not seed.batch
    if not given and seed not in ("auto", "home"):
        raise GoughError("seed: rows that follow each other start at one pose, or at auto or home")
    start = seed if isinstance(seed, Pose) else None
    if seed == "home":
        start = platform.frame(frame).of(platform.home) if frame else platform.home
    return Tracker(platform, start=start, frame=frame, **limits)  # pyright: ignore[reportArgumentType]


@dataclass(frozen=True)
class Solver:
    """Forward kinematics of one platform with fixed settings.

    Make it once and call it on as many batches as needed: names of seeds are read, and networks
    opened, when it is made.

    Attributes:
        seed: the first guess. "auto" (the universal network if `max_iterations` is 0, else the
            polynomial where the platform states a workspace, else home), "home", "universal",
            "taylor-2", "polynomial", "polynomial-5" (another degree), "disgnet" or another
            network that comes with the package, the path of a trained one or of its run's
            folder, a `Pose` (one, or one a row), or any object with `guess(legs) -> Pose`.
            Held as such an object.
        tolerance: largest strut error of a converged row, as a share of the platform's size
            (rounding alone leaves about 2e-15).
        max_iterations: Newton steps from each start; 0 returns the guess itself.
        restarts: further starts to try before a row counts as unsolved; unless 0, the best of
            them is followed for longer in the end, to tell a miss from a slow approach.
        singular: distance to singularity (see `singularity_distance`) below which a row is
            reported as near one.
        workers: threads; as many as there are cores unless given.
        frame: whose poses are returned, such as "tool in work" (see `Platform.frame`); a pose
            given as seed is one of that frame, too. Those of the platform unless given.

    Raises:
        GoughError: an option out of range, an unknown seed or frame.
        PlatformError: a polynomial seed for a platform without workspace.

    Example:
        >>> solver = gough.Solver(gough.Platform.load("reference"), tolerance=1e-10)
        >>> solver(solver.platform.home_legs).usable
        array(True)
    """

    platform: Platform
    seed: Seed = "auto"  # pyright: ignore[reportAssignmentType] - a name, until it is read
    tolerance: float = 1e-12
    max_iterations: int = 60
    restarts: int = 24
    singular: float = SINGULAR
    workers: int | None = None
    frame: str | None = None

    if TYPE_CHECKING:  # what may be passed is wider than what is held

        def __init__(
            self,
            platform: Platform,
            seed: str | Seed | Pose = "auto",
            tolerance: float = 1e-12,
            max_iterations: int = 60,
            restarts: int = 24,
            singular: float = SINGULAR,
            workers: int | None = None,
            frame: str | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        given = vars(self)  # a frozen dataclass is set through its dictionary
        given["platform"] = as_platform(self.platform)
        for name in ("tolerance", "singular"):
            given[name] = as_number(name, given[name], low=0.0, high=1.0)
        for name, most in (("max_iterations", MOST_STEPS), ("restarts", MOST_STARTS)):
            given[name] = as_whole(name, given[name], low=0, high=most)
        if self.workers is not None:
            given["workers"] = as_whole("workers", self.workers, low=1, high=MOST_WORKERS)
        seed: str | Seed | Pose = self.seed
        if self.frame is not None:
            view = self.platform.frame(self.frame)
            seed = view.platform_pose(seed) if isinstance(seed, Pose) else seed
        machine = self.platform
        if machine.screw is not None:
            machine = without_turning(machine)
        given["seed"] = find_seed(machine, seed, guess_only=not self.max_iterations)

    def __call__(
        self,
        legs: ArrayLike | Table,
        *,
        leg_noise: ArrayLike | None = None,
        certify: bool = False,
        ambiguous: bool = False,
        limits: bool = False,
    ) -> Solution:
        """Solve every row of readings.

        Large batches go through plain Newton in blocks, small ones row by row; rows that do not
        settle there, or settle outside the workspace, are then solved with a damped method, and
        from further starts where that fails, too.

        Args:
            legs: readings (..., 6): lengths, length changes [platform unit] or motor angles
                [rad]; or a pandas, polars, pyarrow or other Arrow table with columns leg_1 to
                leg_6. Rows that hold NaN, nothing or impossible numbers get INVALID_INPUT.
            leg_noise: standard deviation of the readings, a number or (6,), or their covariance
                (6, 6): fills `Solution.covariance`.
            certify: prove each usable pose: where that succeeds, CONVERGED becomes CERTIFIED and
                `Solution.radius` is the distance within which no other pose has these legs.
            ambiguous: look for every other pose with the same readings (see `assembly_modes`; it
                takes hundreds of times as long) and call a usable row AMBIGUOUS where one of
                them could be the machine's too: in the workspace, with home's sign of det J.
                Done for every row where home is singular, since nothing else tells then.
            limits: fill `Solution.limits` with the margins of the poses; see `gough.limits`.

        Returns:
            Solution: batch axes as those of `legs`; (N,) for a table.

        Raises:
            GoughError: legs of another shape, a seed that gives another number of poses.
            InputError: a table without these columns, or with something else than numbers there.
        """
        readings = as_readings(legs)
        flat = readings.reshape(-1, 6)
        if self.platform.screw is not None:
            if certify or ambiguous or limits:
                refuse_screws(self.platform)
            rows, batch = self._solve_turning(flat), readings.shape[:-1]
            found = rows.solution(self.platform, batch, None, leg_noise, table_info(legs))
            return found if self.frame is None else found.in_frame(self.platform, self.frame)
        if not (flat.flags.c_contiguous and flat.flags.writeable):
            flat = flat.copy()  # compiled code is made for such arrays alone
        rows = Rows.empty(len(flat))
        start = starting_poses(self.platform, self.seed, flat)
        if len(flat) <= FEW:
            troubled = self._settle_rows(flat, start, rows)
        else:
            troubled = self._solve_blocks(flat, start, rows)
            if troubled and self._has_no_box:
                self._accept_reached(flat, rows)
        if troubled:
            self._solve_rows(flat, np.flatnonzero(rows.status == OPEN), start, rows)
            rows.fill_invalid_with_nan()
        if ambiguous or self._is_unsure:
            self._consult_modes(flat, rows)
        radius = self._certify(flat, rows) if certify else None
        batch = readings.shape[:-1]
        found = rows.solution(self.platform, batch, radius, leg_noise, table_info(legs))
        if limits:
            found = found.with_limits(self.platform, workers=self.workers)
        return found if self.frame is None else found.in_frame(self.platform, self.frame)

    def compile(self, count: int = 1, *, certify: bool = False, limits: bool = False) -> None:
        """Compile, or load from disk, all that a batch of `count` rows may need.

        The first call compiles what its rows need, and the first row that Newton's method does
        not settle the rest; a program that cannot wait for it then calls this before.
        """
        if self.platform.screw is not None:
            machine = without_turning(self.platform)
            replace(self, platform=machine, frame=None).compile(count)
            return
        legs = np.tile(self.platform.home_legs, (min(count, FEW + 1), 1))
        solver = replace(self, seed="home")
        solver(legs, certify=certify, limits=limits)
        start, rows = starting_poses(self.platform, solver.seed, legs), Rows.empty(1)
        solver._solve_rows(legs, np.arange(1), start, rows)
        if len(legs) > FEW and self._has_no_box:
            rows.status[:] = OPEN
            solver._accept_reached(legs[:1], rows)

    def _solve_turning(self, legs: Array) -> Rows:
        """Solve readings (N, 6) of legs whose screws turn with them."""
        platform = self.platform
        solver = replace(self, platform=without_turning(platform), frame=None)
        count = (len(legs), 1)
        home = Pose(np.tile(platform.home.position, count), np.tile(platform.home.wxyz, count))
        first = solver(legs - screw_lengths(platform, home) / platform.gain)
        found = solver(readings_without_turning(platform, legs, first.pose))
        rows = Rows.empty(len(legs))
        rows.iterations[:] = first.iterations
        rows.put(np.arange(len(legs)), found)
        with np.errstate(invalid="ignore"):
            errors = platform.gain * (leg_lengths(platform, found.pose) - legs)
        rows.residual[:] = np.max(np.abs(errors), axis=-1, initial=0.0)
        missed = found.usable & ~(rows.residual <= self.tolerance * platform.size)
        rows.status[missed] = Status.NOT_CONVERGED
        beyond = np.isin(rows.status, (Status.CONVERGED, Status.OUTSIDE_WORKSPACE))
        beyond &= ~limit_rules.in_stroke(platform, legs)
        rows.status[beyond] = Status.OUTSIDE_STROKE
        return rows

    @property
    def _is_unsure(self) -> bool:
        """True where det J cannot tell modes apart, and no given pose does."""
        given = isinstance(self.seed, PoseSeed) or not self.max_iterations
        return not given and not home_sign(self.platform)

    def _consult_modes(self, legs: Array, rows: Rows) -> None:
        """Set usable rows to AMBIGUOUS whose readings another pose of the machine could have.

        Where home is singular, the pose of each becomes the mode that fits best.
        """
        from gough.modes.assembly import assembly_modes
        from gough.modes.choose import ambiguous, choose_mode

        usable = np.flatnonzero(np.isin(rows.status, USABLE))
        if not len(usable):
            return
        modes = assembly_modes(self.platform, legs[usable], workers=self.workers)
        if self._is_unsure:
            best = choose_mode(modes).best
            chosen = usable[modes.row[best]]
            rows.put(chosen, replace(self, seed=modes.pose[best], frame=None)(legs[chosen]))
        pose = Pose.trusted(rows.position[usable], rows.wxyz[usable])
        unknown = ambiguous(modes, ~self.platform.in_workspace(pose))
        if self._is_unsure:
            unknown |= ~modes.complete
        rows.status[usable[unknown]] = Status.AMBIGUOUS

    def _solve_blocks(self, legs: Array, start: Start, rows: Rows) -> int:
        """Take plain Newton steps on all rows; return how many are open or invalid."""
        from gough.kernel.block import solve_blocks

        constants, out = kernel_constants(self.platform, self.singular), rows.arrays()
        steps = min(self.max_iterations, int(STEPS))
        polynomial = start.polynomial

        def work(first: int, last: int) -> int:
            scratch = np.zeros(COMPONENTS * WIDTH), np.empty(6 * WIDTH), np.empty(WIDTH)
            guess = NO_POSES if start.poses is None else start.poses[first:last]
            return solve_blocks(
                constants, legs, guess, polynomial.arrays, self.tolerance, steps, first, last,
                (*scratch, polynomial.scratch()), out,
            )  # fmt: skip

        return in_parts(work, len(legs), self.workers)

    @property
    def _has_no_box(self) -> bool:
        """True where the status of a solved pose depends on the way to it from home alone."""
        platform, steps = self.platform, self.max_iterations
        return platform.workspace is None and platform.rotary is None and steps > 0

    def _accept_reached(self, legs: Array, rows: Rows) -> None:
        """Give solved rows whose pose is reached from home their status."""
        from gough.kernel.ways import accept_reached

        constants = kernel_constants(self.platform, self.singular)
        solved = rows.residual <= self.tolerance * self.platform.size
        chosen = np.flatnonzero((rows.status == OPEN) & solved)
        poses = to_internal(constants, Pose.trusted(rows.position[chosen], rows.wxyz[chosen]))

        def work(first: int, last: int) -> int:
            scratch = np.zeros(COMPONENTS * WIDTH), np.empty(7 * WIDTH), *np.empty((2, WIDTH))
            return accept_reached(constants, legs, chosen, poses, first, last, scratch, rows.status)

        in_parts(work, len(chosen), self.workers)

    def _settle_rows(self, legs: Array, start: Start, rows: Rows) -> int:
        """Take plain Newton steps on a few rows; return how many are open or invalid."""
        constants, out = kernel_constants(self.platform, self.singular), rows.arrays()
        steps = min(self.max_iterations, int(STEPS))

        def work(first: int, last: int) -> int:
            guess, buffer = start.of(slice(first, last)), np.zeros(COMPONENTS)
            return settle_rows(
                constants, legs, guess, self.tolerance, steps, first, last, buffer, out
            )

        return in_parts(work, len(legs), self.workers, chunk=256, serial=256)

    def _solve_rows(self, legs: Array, chosen: NDArray[np.intp], start: Start, rows: Rows) -> None:
        """Solve chosen rows (K,) one by one, from further starts where need be."""
        constants, out = kernel_constants(self.platform, self.singular), rows.arrays()
        starts = further_starts(self.platform, self.restarts if self.max_iterations else 0)
        # a given pose says which assembly mode is meant
        stays = float(isinstance(self.seed, PoseSeed))
        settings = np.array([self.tolerance, self.max_iterations, self.singular, stays], float)

        def work(first: int, last: int) -> int:
            some = chosen[first:last]
            scratch = np.zeros(COMPONENTS), np.zeros(COMPONENTS), np.zeros((4, 6, 6))
            return solve_rows(constants, legs, some, start.of(some), starts, settings, scratch, out)

        in_parts(work, len(chosen), self.workers, chunk=PART, serial=PART)

    def _certify(self, legs: Array, rows: Rows) -> Array:
        """Radii of uniqueness (N,) [platform unit], 0 where unproven; promote converged rows."""
        from gough.certificate import certify

        radius = np.zeros(len(legs))

        def work(first: int, last: int) -> int:
            part = slice(first, last)
            pose = Pose.trusted(rows.position[part], rows.wxyz[part])
            radius[part] = certify(self.platform, legs[part], pose).radius
            return 0

        in_parts(work, len(legs), self.workers)
        rows.status[(radius > 0) & (rows.status == Status.CONVERGED)] = Status.CERTIFIED
        return radius

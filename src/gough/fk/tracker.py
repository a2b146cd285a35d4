"""Forward kinematics in a control loop: one reading in, one pose out, every cycle."""

from __future__ import annotations

import reprlib
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from gough import quaternion, velocities
from gough.checks import Array, as_number, as_whole
from gough.errors import GoughError
from gough.fk.rows import Rows
from gough.fk.screws import readings_without_turning, without_turning
from gough.fk.solution import Solution
from gough.fk.solve import Solver
from gough.kernel import layout
from gough.kernel.constants import SINGULAR, kernel_constants, to_internal
from gough.kernel.cycle import (
    BAD_READING,
    CROSSED,
    FAILED,
    LAST_POSITION,
    LAST_WXYZ,
    OURS,
    SIGN,
    STATE,
    cycle,
)
from gough.kinematics import assembly_sign, pose_covariance
from gough.limit_rules import in_stroke
from gough.platform import Platform, as_platform
from gough.pose import Pose, pose_cells
from gough.status import Event, Status
from gough.tables import Table, as_readings, is_arrow, table_info
from gough.text import page, pose_heads

PLAIN = (np.ndarray, list, tuple)  # readings without names, recognised quickly


class Tracker:
    """Follows a platform from reading to reading.

    Each cycle starts Newton's method at the last pose. A pose too far from it, or beyond a
    singularity, is not taken at once: the last good pose is held and the event says so. If
    `confirm` readings in a row lead to the same new place, it is taken, so that nothing can
    keep the tracker from following good readings again.

    Use one tracker from one thread; different trackers may run in different threads.

    Attributes:
        pose: the present pose. The same object every cycle, overwritten by the next `update`
            (so that a cycle allocates nothing); `pose.copy()` keeps one.
        frame: whose pose that is, such as "tool in work"; "" for the platform's.
        status: `Status` of the last reading.
        event: `Event` of the last cycle.

    `twist` gives the velocity: from the rates passed to the last `update`, else from the last two
    poses.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> tracker = gough.Tracker(platform, start=platform.home)
        >>> tracker.update(platform.home_legs + 0.5).position.round(4)
        array([  0.    ,   0.    , 600.5462])
    """

    def __init__(
        self,
        platform: Platform | str | Path,
        *,
        start: Pose | None = None,
        max_shift: float | None = None,
        max_turn: float = 0.1,
        confirm: int = 3,
        tolerance: float = 1e-12,
        singular: float = SINGULAR,
        period: float = 1.0,
        frame: str | None = None,
    ) -> None:
        """Compile or load what a cycle needs, so that the first `update` is as quick as others.

        Args:
            start: the pose of the platform, or of `frame`; found from the first reading unless
                given.
            max_shift: largest translation of the pose's position (the pivot, where the platform
                has one) in one cycle [platform unit]; 2 % of the platform's size unless given.
            max_turn: largest rotation in one cycle [rad].
            confirm: how many readings must agree on a place too far away before it is taken.
            tolerance, singular: as for `gough.solve`.
            period: time of one cycle [s], for `twist`; unless given, rates are per cycle.
            frame: whose poses and twists are given and returned, such as "tool in work" (see
                `Platform.frame`); the limits stay those of the platform's own pose.

        Raises:
            GoughError: a limit that is not above zero, a start that is not one pose, or an unknown
                frame.
        """
        platform = as_platform(platform)
        self.platform, self.frame = platform, frame or ""
        self._view = platform.frame(frame) if frame else None
        self._solver = Solver(platform, tolerance=tolerance, singular=singular, workers=1)
        shift = 0.02 * platform.size if max_shift is None else max_shift
        self._max_shift = as_number("max_shift", shift, above=0.0)
        self._max_turn = as_number("max_turn", max_turn, above=0.0)
        self._confirm = as_whole("confirm", confirm, low=1)
        self._period = as_number("period", period, above=0.0)
        if start is not None:
            _check_start(start)
            start = start if self._view is None else self._view.platform_pose(start)
        # legs whose screws turn with them are followed as legs that do not turn
        machine = platform if platform.screw is None else without_turning(platform)
        self._constants = kernel_constants(machine, self._solver.singular)
        self._limits = np.array([self._solver.tolerance, self._solver.singular, 0.0, 0.0])
        self._legs = machine.home_legs[None].copy()
        self._reading = self._legs[0]
        self._state = np.zeros((1, STATE))
        self._buffer, self._work = np.zeros(layout.COMPONENTS), np.zeros((4, 6, 6))
        self._position, self._wxyz = np.zeros((1, 3)), np.zeros((1, 4))
        self._elapsed = 1  # cycles since the last pose
        self._rates: ArrayLike | None = None
        self._missed, self._agreeing = 0, 0
        self._miss = (
            np.nan,
            0,
        )  # residual and iterations of the last reading that was not followed
        self._candidate: Pose | None = None
        self._own = self.pose = Pose.trusted(self._position[0], self._wxyz[0])
        if self._view is not None:
            self.pose = Pose.trusted(np.zeros(3), np.zeros(4))
        self._code, self.event = int(Status.CONVERGED), Event.FOUND
        self._set_pose(platform.home)
        self._run_cycle()  # these compile what a cycle may need, if it is not yet on disk
        self._solver.compile()
        self._lost = start is None
        self._set_pose(platform.home if start is None else start)
        self._show_pose()

    @property
    def status(self) -> Status:
        """Status of the last reading."""
        return Status(self._code)

    @property
    def twist(self) -> Array:
        """Twist (6,) of the platform in the last cycle, in base coordinates; or of `frame`.

        Velocity of the pose's position [platform unit / s] and angular velocity [rad / s]; per
        cycle unless `period` was given. At the pose itself if the last `update` was given the rates
        of its readings, else the mean between the last two poses. NaN after a cycle that did not
        follow its reading.
        """
        if self.event != Event.FOLLOWED:
            return np.full(6, np.nan)
        if self._rates is not None:
            return velocities.twist(self.platform, self.pose, self._rates, self.frame or None)
        last = Pose.trusted(self._state[0, LAST_POSITION:LAST_WXYZ], self._state[0, LAST_WXYZ:])
        last = last if self._view is None else self._view.of(last)
        turn = quaternion.product(self.pose.wxyz, quaternion.conjugate(last.wxyz))
        moved = self.pose.position - last.position
        motion = np.concatenate([moved, quaternion.to_rotation_vector(turn)])
        return motion / (self._period * self._elapsed)

    def update(self, legs: ArrayLike | Table, leg_rates: ArrayLike | None = None) -> Pose:
        """Return the pose at the next reading (6,); `status` and `event` say how good it is.

        A row of a pandas table is a reading, too: it is read by its labels, leg_1 to leg_6.

        Args:
            leg_rates: (6,) rates of the readings [1 / s], for `twist`.

        Raises:
            GoughError: not six numbers. A reading that is NaN or impossible raises nothing.
        """
        if type(legs) not in PLAIN and is_arrow(legs):
            legs = as_readings(legs)
        try:
            if len(legs) != 6:  # type: ignore[arg-type]
                raise GoughError(f"legs: expected (6,), got {np.shape(legs)}")
            self._legs[0] = legs
        except (TypeError, ValueError) as error:
            raise GoughError(f"legs: expected six numbers, found {reprlib.repr(legs)}") from error
        self._rates, self._elapsed = leg_rates, self._missed + 1
        turning = self.platform.screw is not None
        if turning:
            self._reading = self._legs[0].copy()
            present = Pose.trusted(self._position, self._wxyz)
            self._legs = readings_without_turning(self.platform, self._legs, present)
        code = FAILED if self._lost else self._run_cycle()
        if turning and code in (Status.CONVERGED, Status.OUTSIDE_WORKSPACE):
            code = code if in_stroke(self.platform, self._reading) else int(Status.OUTSIDE_STROKE)
        if code >= layout.OPEN:
            self._recover(code)
        else:
            self._code, self.event = code, Event.FOLLOWED
            if self._missed:
                self._reset_missed()
        self._show_pose()
        return self.pose

    def follow(
        self,
        legs: ArrayLike | Table,
        *,
        leg_noise: ArrayLike | None = None,
        limits: bool = False,
    ) -> Solution:
        """Follow consecutive readings, row by row as `update` does, in compiled code.

        Another call goes on where this one ended, so that a long series may come in parts.

        Args:
            legs: readings (N, 6), or a table with columns leg_1 to leg_6.
            leg_noise, limits: as for `gough.solve`.

        Returns:
            Solution: batch (N,); `Solution.event` is the `Event` of each row, and rows whose
            event is HELD, JUMPED or MODE_CHANGED have no pose.

        Raises:
            GoughError: legs of another shape, or a table without these columns.
        """
        from gough.kernel.follow import follow

        readings = as_readings(legs)
        if readings.ndim != 2:
            raise GoughError(f"legs: expected consecutive rows (N, 6), got {readings.shape}")
        flat, rows = np.array(readings, order="C"), Rows.empty(len(readings))
        events = np.full(len(flat), Event.FOLLOWED, np.uint8)
        row = 0
        while row < len(flat):
            if not self._lost and not self._missed and self.platform.screw is None:
                row = follow(
                    self._constants, flat, row, self._legs, self._state, self._limits, self._buffer,
                    self._work, self._position, self._wxyz, rows.arrays(),
                )  # fmt: skip
                if row == len(flat):
                    self._rates, self._elapsed = None, 1
                    self._code, self.event = int(rows.status[-1]), Event.FOLLOWED
                    break
            self.update(flat[row])
            self._put(rows, row)
            events[row] = self.event
            row += 1
        pose = Pose.trusted(rows.position, rows.wxyz)
        covariance = None if leg_noise is None else pose_covariance(self.platform, pose, leg_noise)
        self._show_pose()
        found = Solution(
            pose, rows.status, rows.residual, rows.iterations, covariance,
            unit=self.platform.unit, table=table_info(legs), event=events,
        )  # fmt: skip
        found = found.with_limits(self.platform) if limits else found
        return found.in_frame(self.platform, self.frame) if self.frame else found

    def _put(self, rows: Rows, row: int) -> None:
        """Copy the last cycle's results; a row whose pose was not taken has none."""
        new = self.event.usable
        rows.position[row] = self._position[0] if new else np.nan
        rows.wxyz[row] = self._wxyz[0] if new else np.nan
        rows.status[row] = self._code
        rows.residual[row], rows.iterations[row] = self._miss
        if self.event == Event.FOLLOWED:
            rows.residual[row] = self._buffer[layout.RESIDUAL] * self.platform.size
            rows.iterations[row] = int(self._buffer[layout.COUNT])

    def __repr__(self) -> str:
        state = f"{self.event.name.lower()}, {self.status.label}"
        return f"Tracker({self.platform.name!r}, {state}, {self.pose!r})"

    def _repr_html_(self) -> str:
        heads = [*pose_heads((), self.platform.unit), "event", "status"]
        cells = ["", *pose_cells(self.pose), self.event.name.lower(), self.status.label]
        notes = [self.event.text] + [self.status.text] * (self.event != Event.FOLLOWED)
        return page(f"Tracker of {self.platform.name}", heads, [cells], notes)

    # ---- a cycle that went well -------------------------------------------------------

    def _run_cycle(self) -> int:
        return cycle(
            self._constants, self._legs, self._state, self._limits, self._buffer, self._work,
            self._position, self._wxyz,
        )  # fmt: skip

    def _show_pose(self) -> None:
        """Set `pose` to the frame's; the platform's is set by the compiled cycle itself."""
        if self._view is not None:
            shown = self._view.of(self._own)
            self.pose.position[:], self.pose.wxyz[:] = shown.position, shown.wxyz

    def _reset_missed(self) -> None:
        """Forget missed cycles: one cycle's motion is the limit again."""
        self._missed, self._agreeing, self._candidate = 0, 0, None
        self._set_limits()

    def _set_limits(self) -> None:
        """Allow one cycle's motion, and one more for each missed cycle."""
        cycles = 1 + self._missed
        turn = min(self._max_turn * cycles, np.pi)
        self._limits[2] = (self._max_shift * cycles) ** 2
        self._limits[3] = np.sin(turn / 2) ** 2

    def _set_pose(self, pose: Pose, *, trusted: bool = True) -> None:
        """Make a pose the present one.

        Args:
            trusted: its assembly mode is the machine's.
        """
        self._state[0, :7] = to_internal(self._constants, pose)
        home = self._constants[layout.HOME_SIGN]
        self._state[0, SIGN] = float(assembly_sign(self.platform, pose)) * home
        self._state[0, OURS] = float(trusted)
        self._position[0], self._wxyz[0] = pose.position, pose.wxyz
        self._reset_missed()

    # ---- a cycle that did not ---------------------------------------------------------

    def _recover(self, code: int) -> None:
        """Hold the pose, and take another place once enough readings agree on it."""
        self._missed += 1
        self._set_limits()
        self._miss = (np.nan, 0)
        if code == BAD_READING:
            self._code, self.event = int(Status.INVALID_INPUT), Event.HELD
            return
        found = self._solver(self._reading)
        self._code, usable = int(found.status), bool(found.usable)
        self._miss = float(found.residual), int(found.iterations)
        if not usable and self._code not in (Status.OTHER_MODE, Status.AMBIGUOUS):
            self.event = Event.HELD
            return
        self._agreeing = self._agreeing + 1 if self._agrees(found.pose) else 1
        self._candidate = found.pose
        if (self._lost and usable) or self._agreeing >= self._confirm:
            self._set_pose(found.pose, trusted=usable)
            self._lost, self.event = False, Event.FOUND
            return
        held = Event.HELD if self._lost else Event.JUMPED
        self.event = Event.MODE_CHANGED if code == CROSSED else held

    def _agrees(self, pose: Pose) -> bool:
        """Return whether a pose is within one cycle's motion of the candidate."""
        if self._candidate is None:
            return False
        translation, rotation = self._candidate.distance(pose)
        return bool(translation <= self._max_shift and rotation <= self._max_turn)


def _check_start(start: Pose) -> None:
    """Raise GoughError unless `start` is one pose of finite numbers."""
    if not isinstance(start, Pose) or start.batch:
        found = f"batch {start.batch}" if isinstance(start, Pose) else reprlib.repr(start)
        raise GoughError(f"start: expected one Pose, found {found}")
    if not np.all(np.isfinite(start.position)) or not np.all(np.isfinite(start.wxyz)):
        raise GoughError("start: expected a pose of finite numbers; leave it out if it is unknown")

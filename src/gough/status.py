"""Every status of the package: a number for arrays, a word for files, a sentence for people."""

from __future__ import annotations

from enum import IntEnum


class Outcome(IntEnum):
    """Base of the status enums.

    A member is declared as `NAME = number, text` or `NAME = number, text, False`, where False
    marks rows whose result must not be used. Arrays and compiled code hold the number.

    Example:
        >>> Status(4).label, Status.UNREACHABLE.usable
        ('unreachable', False)
    """

    text: str  # a sentence that a user can act on
    usable: bool  # the result of a row with this status can be used

    def __new__(cls, number: int, text: str = "", usable: bool = True) -> Outcome:
        member = int.__new__(cls, number)
        member._value_ = number
        member.text, member.usable = text, usable
        return member

    @property
    def label(self) -> str:
        """The word written to files, such as "outside_stroke"."""
        return self.name.lower()


INVALID_READING = (
    "A reading is not a finite number, or a length is not above zero: correct the row."
)


# fmt: off
class Status(Outcome):
    """Outcome of forward kinematics for one row of readings.

    `usable` is True where the pose has these readings and is, as far as is known, the machine's.
    """

    CONVERGED = 0, "The pose has these leg readings to within the tolerance."
    OUTSIDE_STROKE = 1, (
        "The pose has these leg readings, but a reading is outside the stroke limits: check the "
        "sensor's zero, the unit, or the limits in the platform file."
    )
    NEAR_SINGULARITY = 2, (
        "The pose has these leg readings, but is close to a singularity, where small reading "
        "errors become large pose errors: treat its last digits with care, or move away."
    )
    OUTSIDE_WORKSPACE = 3, (
        "The pose has these leg readings and is in home's assembly mode, but is outside the "
        "stated workspace: widen the workspace if the machine really goes there."
    )
    UNREACHABLE = 4, (
        "No pose matches these leg readings; the closest one misses by the residual: check the "
        "readings' unit, order and zero, and the platform's joints."
    ), False
    NOT_CONVERGED = 5, (
        "The iteration limit was reached before the tolerance: allow more iterations, pass a "
        "seed closer to the pose, or choose a wider tolerance."
    ), False
    INVALID_INPUT = 6, INVALID_READING, False
    CERTIFIED = 7, (
        "Proven: exactly one pose with these leg readings lies within the stated radius of "
        "this one."
    )
    AMBIGUOUS = 8, (
        "Another pose has these leg readings too, and could be the machine's as well: use a seed "
        "near the true pose, or another sensor (see gough.choose_mode)."
    ), False
    OTHER_MODE = 9, (
        "A pose has these leg readings, but a singularity lies between home and it, so it is "
        "probably another assembly mode than the machine's: pass a seed near the true pose, or "
        "follow the rows from a known pose."
    ), False


class Event(Outcome):
    """Effect of one control cycle on the pose that a `Tracker` holds."""

    FOLLOWED = 0, "The pose followed the reading from the last one."
    FOUND = 1, (
        "The pose was found anew, without the last one's help: at the start, or after enough "
        "readings in a row agreed on a pose far from it."
    )
    HELD = 2, (
        "The reading is invalid or no pose matches it, and the last good pose is held: see the "
        "status for the reason. Tracking goes on with the next good reading."
    ), False
    JUMPED = 3, (
        "The reading leads to a pose too far away for one cycle, and the last good pose is held: "
        "check the sensor, or allow a larger max_shift or max_turn."
    ), False
    MODE_CHANGED = 4, (
        "The reading leads across a singularity, so the assembly mode may have changed, and the "
        "last good pose is held: stop, and check the pose by other means."
    ), False


class InverseStatus(Outcome):
    """Outcome of inverse kinematics for one row of poses."""

    OK = 0, "The legs have this pose."
    OUTSIDE_STROKE = 1, "A reading is outside the stroke limits: out of reach."
    OUTSIDE_WORKSPACE = 2, "The pose is outside the stated workspace."
    UNREACHABLE = 3, "A motor's arm and rod cannot reach the pose.", False
    INVALID_INPUT = 4, "The row is not a pose: correct it.", False
    OTHER_MODE = 5, (
        "A singularity lies between home and the pose, so it is probably in another assembly mode "
        "than the machine."
    ), False


class ModesStatus(Outcome):
    """Outcome of the search for every assembly mode of one set of readings."""

    COMPLETE = 0, "Every complex solution was found, and all differ: no pose is missing."
    SINGULAR = 1, (
        "At least one pose is singular: several solutions meet there, so the readings fix it "
        "poorly, and it cannot be certified; every pose was found."
    )
    SELF_MOTION = 2, (
        "The platform can move with these legs locked: the rows of multiplicity 0 are samples"
        " of that curve of poses."
    )
    ALWAYS_SINGULAR = 3, (
        "The legs of this machine are dependent at every pose (it is architecturally "
        "singular), so readings never fix one: rows are samples of a curve of poses, if any "
        "pose has these readings at all. Change the joints."
    )
    INCOMPLETE = 4, (
        "Some solutions could not be followed to these readings, so a pose may be missing: "
        "the readings are very close to a singularity."
    )
    INVALID_INPUT = 5, INVALID_READING, False


class NewtonStatus(Outcome):
    """Outcome of the batched Newton method of `gough.learn.newton` for one row."""

    CONVERGED = 0, "The last step was below gamma."
    NOT_CONVERGED = 1, (
        "The last of z_max steps was not below gamma: give a guess closer to the pose, or a gamma "
        "that the dtype can resolve."
    ), False
    SINGULAR = 2, (
        "The inverse of the Jacobian did not converge within f_max iterations: the row came to a "
        "pose at or near a singularity; raise f_max, set scaled=True, or give another guess."
    ), False
    DIVERGED = 3, (
        "The row went far beyond the machine's size: give another guess."
    ), False
    INVALID_INPUT = 4, (
        "The reading or the guess holds a number that is not finite, or a length is not above zero."
    ), False
# fmt: on

USABLE = tuple(status for status in Status if status.usable)

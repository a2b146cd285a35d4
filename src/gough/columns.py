"""Names of the columns of files and tables, and the choice among those found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from gough.errors import GoughError, InputError, suggestion

LEGS = tuple(f"leg_{i}" for i in range(1, 7))
POSITION = ("x", "y", "z")
MAKERS_POSITION = ("X", "Y", "Z")
QUATERNION = ("qw", "qx", "qy", "qz")
EULER = ("rx", "ry", "rz")  # [rad], R = Rx Ry Rz
EULER_DEG = ("rx_deg", "ry_deg", "rz_deg")
PI_UVW = ("U", "V", "W")  # [deg], R = Rx Ry Rz: about axes that turn along
LINUXCNC_ABC = ("A", "B", "C")  # [deg], R = Rz Ry Rx: about axes at rest, x first
ROS_RPY = ("roll", "pitch", "yaw")  # [rad], as A, B, C
ROTATIONS = (QUATERNION, EULER, EULER_DEG, PI_UVW, LINUXCNC_ABC, ROS_RPY)
IN_DEGREES = (EULER_DEG, PI_UVW, LINUXCNC_ABC)
AXES_AT_REST = (LINUXCNC_ABC, ROS_RPY)
ROTATION_TEXT = (
    "qw, qx, qy, qz | rx, ry, rz [rad] | rx_deg, ry_deg, rz_deg | U, V, W | A, B, C | roll, pitch, "
    "yaw [rad]"
)
STATUS, RESIDUAL, ITERATIONS, RADIUS = "status", "residual", "iterations", "radius"
EVENT = "event"
MARGIN, LIMIT = "margin", "limit"  # of the tightest limit
DEVIATIONS = ("std_x", "std_y", "std_z", "std_rx", "std_ry", "std_rz")
Angles = Literal["deg", "rad", "uvw", "abc", "rpy"]
WRITTEN: dict[Angles | None, tuple[str, ...]] = {
    None: POSITION + QUATERNION,
    "deg": POSITION + EULER_DEG,
    "rad": POSITION + EULER,
    "uvw": MAKERS_POSITION + PI_UVW,
    "abc": MAKERS_POSITION + LINUXCNC_ABC,
    "rpy": POSITION + ROS_RPY,
}


def leg_columns(where: str, found: Sequence[str], *, cure: str = "") -> tuple[str, ...]:
    """The six leg columns of a file or table whose columns are `found`.

    Args:
        where: the file or table, for messages.
        found: names of its columns.
        cure: advice to add where columns are missing.

    Raises:
        InputError: some are missing or occur twice; the message lists those found.
    """
    missing = [name for name in LEGS if name not in found]
    if missing:
        some = f"no column {', '.join(missing)}" if len(missing) < 6 else "no leg columns"
        raise InputError(
            f"{where}: {some}; expected leg_1 to leg_6, found {_list(found)}; "
            f"{_rename(missing, found)}{cure}"
        )
    return checked(where, found, LEGS)


def file_leg_columns(where: str, found: Sequence[str]) -> tuple[str, ...]:
    """`leg_columns` of a file, whose columns can be named on the command line."""
    return leg_columns(where, found, cure=", or name those of legs 1 to 6: --columns A,B,C,D,E,F")


def pose_columns(where: str, found: Sequence[str]) -> tuple[str, ...]:
    """Position and rotation columns: the first complete set of `ROTATIONS`.

    Raises:
        InputError: some are missing or occur twice; the message lists those found.
    """
    position = position_columns(found)
    if position is None:
        missing = [name for name in POSITION if name not in found]
        raise InputError(
            f"{where}: no column {', '.join(missing)}; expected x, y, z and one of "
            f"{ROTATION_TEXT}; found {_list(found)}; {_rename(missing, found)}"
        )
    return (*checked(where, found, position), *rotation_columns(where, found))


def position_columns(found: Sequence[str]) -> tuple[str, ...] | None:
    """x, y, z, or else X, Y, Z, if all three are in `found`."""
    return next((p for p in (POSITION, MAKERS_POSITION) if all(n in found for n in p)), None)


def rotation_columns(where: str, found: Sequence[str]) -> tuple[str, ...]:
    """Rotation columns: the first complete set of `ROTATIONS`.

    Raises:
        InputError: none is complete, or a column occurs twice; the message lists those found.
    """
    rotation = next((r for r in ROTATIONS if all(name in found for name in r)), None)
    if rotation is None:
        raise InputError(
            f"{where}: no whole set of rotation columns; expected one of {ROTATION_TEXT}; found "
            f"{_list(found)}; {_rename([], found)}"
        )
    return checked(where, found, rotation)


def pose_or_leg_columns(where: str, found: Sequence[str]) -> tuple[str, ...]:
    """The columns of a pose, or LEGS of a file that holds none.

    Raises:
        InputError: some are missing or occur twice; the message lists those found.
    """
    has_legs = any(name in found for name in LEGS)
    if not has_legs and not any(n in found for n in POSITION + MAKERS_POSITION):
        raise InputError(
            f"{where}: holds neither legs nor poses; expected columns leg_1 to leg_6, or x, y, z "
            f"and one of {ROTATION_TEXT}; found {_list(found)}"
        )
    try:
        return pose_columns(where, found)
    except InputError:
        if not has_legs:
            raise
        return file_leg_columns(where, found)


def pose_names(angles: Angles | None) -> tuple[str, ...]:
    """The columns of a written pose: with Euler angles in this form, or with a quaternion.

    Raises:
        GoughError: angles of another name.
    """
    if angles not in WRITTEN:
        known = ", ".join(repr(name) for name in WRITTEN if name)
        raise GoughError(f"angles: expected one of {known}, found {angles!r}")
    return WRITTEN[angles]


def in_degrees(angles: Angles | None) -> bool:
    """True for angles that are written in degrees."""
    return pose_names(angles)[3:] in IN_DEGREES


def deviation_names(angles: Angles | None) -> tuple[str, ...]:
    """The columns of standard deviations of a pose, of angles in their unit, else in rad."""
    ending = "_deg" if in_degrees(angles) else ""
    return DEVIATIONS[:3] + tuple(name + ending for name in DEVIATIONS[3:])


def solution_names(
    angles: Angles | None,
    covariance: bool,
    radius: bool,
    event: bool = False,
    limits: bool = False,
) -> tuple[str, ...]:
    """The columns of solved rows in files and tables."""
    optional = deviation_names(angles) * covariance + (RADIUS,) * radius + (EVENT,) * event
    optional += (MARGIN, LIMIT) * limits
    return (*pose_names(angles), STATUS, RESIDUAL, ITERATIONS, *optional)


def checked(where: str, found: Sequence[str], wanted: Sequence[str]) -> tuple[str, ...]:
    """Return `wanted` if each of its names is in `found` exactly once.

    Raises:
        InputError: naming the column that is missing or occurs twice.
    """
    for name in wanted:
        if name not in found:
            near = suggestion(name, found)
            raise InputError(f"{where}: no column {name!r}{near} the columns are {_list(found)}")
        if list(found).count(name) > 1:
            raise InputError(f"{where}: two columns are called {name!r}; rename or remove one")
    return tuple(wanted)


def check_kept(keep: Sequence[str], written: Sequence[str]) -> None:
    """Raise if a kept column has the name of a column that is written.

    Raises:
        InputError: naming the column.
    """
    for name in keep:
        if name in written:
            raise InputError(
                f"--keep {name}: the output has a column of that name already; rename yours"
            )


def _rename(missing: Sequence[str], found: Sequence[str]) -> str:
    """The advice for missing columns; it names the one most like the first of them."""
    from difflib import get_close_matches

    known = {name for names in (LEGS, POSITION, MAKERS_POSITION, *ROTATIONS) for name in names}
    others = {name.strip().lower(): name for name in reversed(found) if name not in known}
    for name in missing:
        near = get_close_matches(name, others, n=1, cutoff=0.7)
        if near:
            return f"rename the columns (is {others[near[0]]!r} meant as {name}?)"
    return "rename the columns"


def _list(names: Sequence[str]) -> str:
    shown = [name if name.strip() == name and name else repr(name) for name in names[:12]]
    more = f", ... ({len(names)} in all)" if len(names) > 12 else ""
    return (", ".join(shown) + more) or "no columns"

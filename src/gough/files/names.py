"""Names of the columns, and which of a file's columns are meant."""

from __future__ import annotations

from collections.abc import Sequence

from gough.errors import InputError, suggestion

LEGS = tuple(f"leg_{i}" for i in range(1, 7))
POSITION = ("x", "y", "z")
QUATERNION = ("qw", "qx", "qy", "qz")
EULER = ("rx", "ry", "rz")  # [rad], R = Rx Ry Rz
EULER_DEG = ("rx_deg", "ry_deg", "rz_deg")
ROTATIONS = (QUATERNION, EULER, EULER_DEG)
DEVIATIONS = ("std_x", "std_y", "std_z", "std_rx", "std_ry", "std_rz")
STATUS = "status"


def leg_columns(where: str, found: Sequence[str]) -> tuple[str, ...]:
    """The six leg columns of a file whose columns are `found`.

    Raises:
        InputError: some are missing or occur twice; the text lists what there is.
    """
    missing = [name for name in LEGS if name not in found]
    if missing:
        some = f"no column {', '.join(missing)}" if len(missing) < 6 else "no leg columns"
        raise InputError(
            f"{where}: {some}; expected leg_1 to leg_6, found {_list(found)}; rename the columns"
        )
    return checked(where, found, LEGS)


def pose_columns(where: str, found: Sequence[str]) -> tuple[str, ...]:
    """Position and rotation columns, the first of qw.., rx.., rx_deg.. that is there whole.

    Raises:
        InputError: some are missing or occur twice; the text lists what there is.
    """
    missing = [name for name in POSITION if name not in found]
    rotation = next((r for r in ROTATIONS if all(name in found for name in r)), None)
    if missing or rotation is None:
        what = f"column {', '.join(missing)}" if missing else "whole set of rotation columns"
        raise InputError(
            f"{where}: no {what}; expected x, y, z and one of qw, qx, qy, qz | rx, ry, rz [rad] | "
            f"rx_deg, ry_deg, rz_deg; found {_list(found)}; rename the columns"
        )
    return checked(where, found, (*POSITION, *rotation))


def checked(where: str, found: Sequence[str], wanted: Sequence[str]) -> tuple[str, ...]:
    """`wanted`, each of which is in `found` exactly once.

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
    """Kept columns must not carry the name of a column that is written.

    Raises:
        InputError: naming the column.
    """
    for name in keep:
        if name in written:
            raise InputError(
                f"--keep {name}: the output has a column of that name already; rename yours"
            )


def _list(names: Sequence[str]) -> str:
    shown = [name if name.strip() == name and name else repr(name) for name in names[:12]]
    more = f", ... ({len(names)} in all)" if len(names) > 12 else ""
    return (", ".join(shown) + more) or "no columns"

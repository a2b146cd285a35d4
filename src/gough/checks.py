"""Arrays from a caller, checked once at the edge; one way of wording what is wrong."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough.errors import GoughError, PlatformError

Array = NDArray[np.float64]


def as_batch(name: str, value: ArrayLike, trailing: tuple[int, ...]) -> Array:
    """`value` as a float64 array whose last axes are `trailing`, any axes before them."""
    array = _to_float(name, value)
    n = len(trailing)
    if array.ndim < n or array.shape[array.ndim - n :] != trailing:
        wanted = ", ".join(["...", *map(str, trailing)])
        raise GoughError(f"{name}: expected ({wanted}), got {array.shape}")
    return array


def _to_float(name: str, value: ArrayLike) -> Array:
    if isinstance(value, np.ndarray) and value.dtype == np.float64:
        return value
    try:
        array = np.asarray(value)
    except ValueError:
        raise GoughError(f"{name}: rows of unequal length; {_ragged(value)}") from None
    if array.dtype.kind in "fiu":
        return array.astype(np.float64)
    place, found = _first_non_number(value)
    raise GoughError(f"{name}{place}: expected a number, found {found!r}")


def _ragged(value: object) -> str:
    rows = list(value) if isinstance(value, (list, tuple)) else []
    widths = [len(r) if isinstance(r, (list, tuple)) else "a number" for r in rows]
    return f"their lengths are {widths}"


def _first_non_number(value: object, place: str = "") -> tuple[str, object]:
    """Index path and content of the first entry that is not a real number."""
    if isinstance(value, (list, tuple, np.ndarray)):
        for i, item in enumerate(value):
            where, found = _first_non_number(item, f"{place}[{i}]")
            if where:
                return where, found
        return ("", value) if place == "" else ("", None)
    is_number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    if is_number and not isinstance(value, (complex, np.complexfloating)):
        return "", None
    return place or " ", value


def platform_numbers(name: str, value: ArrayLike) -> Array:
    """`value` as a float64 array of any shape, for a field of a platform."""
    try:
        array = as_batch(name, value, ())
    except GoughError as error:
        raise PlatformError(str(error)) from None
    place, found = _first_non_number(value)  # NumPy takes [0, True] for two numbers
    if place:
        raise PlatformError(f"{name}{place}: expected a number, found {found!r}")
    return array


def platform_field(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """A frozen copy of `value`, which must have `shape` and hold no NaN or infinity."""
    array = np.array(platform_numbers(name, value))
    if array.shape != shape:
        raise PlatformError(f"{name}: expected shape {shape}, got {array.shape}")
    if not np.all(np.isfinite(array)):
        place = "".join(f"[{i}]" for i in np.argwhere(~np.isfinite(array))[0])
        found = array[~np.isfinite(array)].flat[0]
        raise PlatformError(f"{name}{place}: expected a finite number, found {found}")
    array.flags.writeable = False
    return array

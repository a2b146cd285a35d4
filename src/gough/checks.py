"""Checks of arrays that a caller passes, made once where they enter, with uniform messages."""

from __future__ import annotations

import reprlib

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough.errors import GoughError, PlatformError

Array = NDArray[np.float64]
LARGEST = 1e100  # products of a few numbers below it do not overflow


def as_batch(name: str, value: ArrayLike, trailing: tuple[int, ...]) -> Array:
    """Return `value` as a float64 array whose last axes are `trailing`, masked entries NaN."""
    array = _to_float(name, value)
    n = len(trailing)
    if array.ndim < n or array.shape[array.ndim - n :] != trailing:
        wanted = ", ".join(["...", *map(str, trailing)])
        raise GoughError(f"{name}: expected ({wanted}), got {array.shape}")
    return array


def as_number(
    name: str, value: object, *, above: float = -np.inf, low: float = -np.inf, high: float = np.inf
) -> float:
    """Return one real number as a float.

    Args:
        above, low, high: it must be greater than the first, and from the second to the third.

    Raises:
        GoughError: something else.
    """
    if _is_number(value) and (value > above) & (low <= value) & (value <= high):  # pyright: ignore
        return float(value)  # pyright: ignore[reportArgumentType]
    wanted = f"a number above {above:g}" if above > -np.inf else "a number"
    wanted = f"{low:g} to {high:g}" if abs(low) < np.inf and abs(high) < np.inf else wanted
    raise GoughError(f"{name}: expected {wanted}, found {reprlib.repr(value)}")


def as_whole(name: str, value: object, *, low: int, high: int | None = None) -> int:
    """Return one whole number as an int; 3.0 is one.

    Raises:
        GoughError: something else, or a number below `low` or above `high`.
    """
    good = _is_number(value) and value == value // 1 and value >= low  # pyright: ignore
    if good and (high is None or value <= high):  # pyright: ignore[reportOperatorIssue]
        return int(value)  # pyright: ignore[reportArgumentType]
    wanted = f"of at least {low}" if high is None else f"from {low} to {high:,}"
    raise GoughError(f"{name}: expected a whole number {wanted}, found {reprlib.repr(value)}")


def frozen(array: Array) -> Array:
    """Make an array read-only and return it."""
    array.flags.writeable = False
    return array


def _to_float(name: str, value: ArrayLike) -> Array:
    if isinstance(value, np.ma.MaskedArray):
        return np.where(np.ma.getmaskarray(value), np.nan, _to_float(name, value.data))
    if isinstance(value, np.ndarray) and value.dtype == np.float64:
        return value
    try:
        array = np.asarray(value)
    except ValueError:  # rows of unequal length, or nested deeper than NumPy goes
        array = None
    if array is not None and array.dtype.kind in "fiu":
        return array.astype(np.float64)
    _refuse_non_numbers(name, value)
    try:
        return np.asarray(value, dtype=np.float64)
    except ValueError:
        raise GoughError(f"{name}: rows of unequal length{_row_lengths(value)}") from None


def _row_lengths(value: object) -> str:
    rows = list(value) if isinstance(value, (list, tuple)) else []
    widths = [len(r) if isinstance(r, (list, tuple)) else "a number" for r in rows]
    return f"; their lengths are {widths}" if len(set(widths)) > 1 else ""


def _refuse_non_numbers(name: str, value: object) -> None:
    """Raise GoughError with the index of the first entry that is not a real number."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        for i, item in enumerate(value):
            _refuse_non_numbers(f"{name}[{i}]", item)
    elif not _is_number(value):
        raise GoughError(f"{name}: expected a number, found {reprlib.repr(value)}")


def _is_number(value: object) -> bool:
    if isinstance(value, (bool, np.bool, np.complexfloating)):
        return False
    if isinstance(value, int):  # Python's have no largest; float64's have
        return abs(value) < LARGEST
    return isinstance(value, (float, np.number))


def platform_numbers(name: str, value: ArrayLike) -> Array:
    """Return `value` as a float64 array of any shape, for a field of a platform."""
    try:
        array = as_batch(name, value, ())
        _refuse_non_numbers(name, value)  # NumPy takes [0, True] for two numbers
    except GoughError as error:
        raise PlatformError(str(error)) from None
    return array


def _count(shape: tuple[int, ...]) -> str:
    """Shape of an array in words, as far as words are clearer."""
    if len(shape) == 1:
        return "1 number in a list" if shape == (1,) else f"{shape[0]} numbers"
    return f"shape {shape}" if shape else "one number"


def platform_field(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Return a read-only copy of `value`, which must have `shape` and be finite."""
    array = np.array(platform_numbers(name, value) + 0.0)  # a copy, without negative zeros
    if array.shape != shape:
        raise PlatformError(f"{name}: expected {_count(shape)}, found {_count(array.shape)}")
    usable = np.abs(array) < LARGEST
    if not np.all(usable):
        place = "".join(f"[{i}]" for i in np.argwhere(~usable)[0]) if shape else ""
        found = array[~usable].flat[0]
        wanted = f"a number below {LARGEST:g}" if np.isfinite(found) else "a finite number"
        raise PlatformError(f"{name}{place}: expected {wanted}, found {found}")
    return frozen(array)


def one_or_six(name: str, value: ArrayLike) -> Array:
    """A field of a platform that is one number for all legs, or six: as a frozen array (6,)."""
    array = platform_numbers(name, value)
    if array.shape not in ((), (6,)):
        raise PlatformError(
            f"{name}: expected one number, or six for the six legs, got shape {array.shape}"
        )
    return platform_field(name, np.broadcast_to(array, 6), (6,))

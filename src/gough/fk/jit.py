"""Numba's decorator, set up once: compiled code is cached where a folder can be written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable)

# Reordering and fused multiply-add are allowed; assuming that NaN and infinity do not occur
# is not, since invalid readings must stay visible.
FAST = {"contract", "reassoc", "arcp", "nsz"}


def jit(*, fast: bool = True, cache: bool = True, **options) -> Callable[[Function], Function]:
    """`numba.njit` with nogil, the safe fast-math flags and an on-disk cache if there is room.

    Args:
        fast: allow reassociation; off where the order of operations carries meaning.
        cache: keep the compiled code on disk. Where neither the package's folder nor the
            user's cache folder can be written (and NUMBA_CACHE_DIR names no other), Numba
            cannot cache; the code is then compiled anew in every process.
    """
    settings: dict[str, Any] = {
        "nogil": True,
        "fastmath": FAST if fast else False,
        "error_model": "numpy",
    }

    def decorate(function: Function) -> Function:
        try:
            return numba.njit(cache=cache, **settings, **options)(function)  # pyright: ignore[reportReturnType]
        except RuntimeError as error:
            if "no locator" not in str(error):
                raise
            return numba.njit(**settings, **options)(function)  # pyright: ignore[reportReturnType]

    return decorate

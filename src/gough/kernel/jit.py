"""Numba's decorator, set up once: safe fast-math, no GIL, and a cache that notices changes.

Compiling is reported to `gough.compiling`.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import llvmlite.binding as llvm
import numba
from numba.core import event
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.runtime.nrt import rtsys

from gough import compiling, home_mode, status

Function = TypeVar("Function", bound=Callable)

# Reordering and fused multiply-add are allowed; assuming that NaN and infinity do not occur
# is not, since invalid readings must stay visible. Mind that Numba's isfinite(x) is
# x - x == 0, which these flags fold to True: compare abs(x) < inf instead.
FAST = {"contract", "reassoc", "arcp", "nsz"}
_kept: list[Any] = []  # functions whose compiled code is kept on disk
_lost: list[str] = []  # names of those whose code no folder takes


def jit(*, fast: bool = True, cache: bool = True, **options) -> Callable[[Function], Function]:
    """`numba.njit` with nogil, the flags above and compiled code kept on disk if there is room.

    Args:
        fast: allow reassociation; off where the order of operations carries meaning.
        cache: keep the compiled code on disk. Where neither the package's folder nor the
            user's cache folder can be written (and NUMBA_CACHE_DIR names no other), Numba
            cannot cache; the code is then compiled anew in every process.
        options: passed on to `numba.njit`.
    """
    settings: dict[str, Any] = {"nogil": True, "error_model": "numpy", "pipeline_class": _Compiler}
    settings["fastmath"] = FAST if fast else False

    def decorate(function: Function) -> Function:
        try:
            compiled = numba.njit(cache=cache, **settings, **options)(function)
        except RuntimeError as error:
            if "no locator" not in str(error):
                raise
            _lost.append(function.__name__)
            return numba.njit(**settings, **options)(function)  # pyright: ignore
        if cache:
            _kept.append(compiled)
            compiled._cache.__class__ = _Cache  # pyright: ignore
            _expire_with_sources(compiled, Path(inspect.getfile(function)).parent)
        return compiled  # pyright: ignore[reportReturnType]

    return decorate


def inner(function: Callable | None = None, *, fast: bool = True, inline: bool = False) -> Any:
    """Compile a function that only compiled code calls, for use as `@inner`.

    It gets no entry from Python and no cache file, which saves half of its compile time: it
    becomes part of its callers, and those are cached.

    Args:
        fast: as in `jit`.
        inline: always put its instructions into the caller, as vector loops need.
    """
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    if inline:
        options["forceinline"] = True
    decorate = jit(fast=fast, cache=False, **options)
    return decorate if function is None else decorate(function)


def inline(function: Callable) -> Any:
    """Compile a function into its compiled callers, for use as `@inline`; see `inner`."""
    return inner(function, inline=True)


def cache_folders() -> tuple[list[str], list[str]]:
    """Return the folders in which compiled code is kept, and functions whose code cannot be."""
    return sorted({function.stats.cache_path for function in _kept}), _lost


class _Cache(FunctionCache):
    """Numba's cache of compiled code, loaded without what only compiling needs.

    Numba's own `load_overload` first imports all that it can compile, SciPy's linear algebra and
    cffi among it, which takes longer than all else that a short command does. The compiler does
    the same again where something must be compiled after all.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


class _Library(JITCodeLibrary):
    """Compiled code that calls its own copies of inner functions.

    Otherwise a process that compiles would call the copies that were made of each inner function
    alone, and one that loads the code from disk those within it: optimised in other surroundings,
    they may round differently in the last bit.
    """

    def _finalize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.linkonce_odr:
                function.linkage = "internal"
        super()._finalize_final_module()


class _Compiler(Compiler):
    """Numba's compiler, into a `_Library`."""

    def compile_extra(self, func: Callable) -> Any:
        codegen = self.state.targetctx.codegen()  # pyright: ignore
        library = _Library(codegen, func.__qualname__)
        library.enable_object_caching()
        self.state.library = library  # pyright: ignore
        return super().compile_extra(func)


class _Compiling(event.Listener):
    """Passes on when compiling begins and ends."""

    def on_start(self, event: Any) -> None:
        compiling.clock.begin(event.data["dispatcher"].py_func.__name__)

    def on_end(self, event: Any) -> None:
        compiling.clock.end()


event.register("numba:compile", _Compiling())


def _expire_with_sources(compiled, folder: Path) -> None:
    """Let cached code expire when a source that may be compiled into it changes.

    Those are the sources beside the function, those of this folder, the numbers of the statuses
    and the steps of `home_mode`. Numba itself looks at the function's own file only; a change in a
    function that was compiled into it (`equations.py`, say) would go unnoticed and old code would
    run on.
    """
    file = compiled._cache._cache_file
    paths = folder, Path(__file__).parent, *(Path(inspect.getfile(m)) for m in (status, home_mode))
    file._source_stamp = (file._source_stamp, *map(_digest, paths))


@lru_cache
def _digest(path: Path) -> str:
    """SHA-256 of a file, or of all sources in a folder."""
    digest = hashlib.sha256()
    for source in sorted(path.glob("*.py")) if path.is_dir() else [path]:
        digest.update(source.read_bytes())
    return digest.hexdigest()

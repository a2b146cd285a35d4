"""gough warmup: compile beforehand what first answers would wait for."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gough.platform import Platform


def run() -> int:
    """Compile the solver, the tracker, the modes, the certificate and the limits.

    The first call of each compiles it otherwise. Compiled code is kept on disk, in
    $NUMBA_CACHE_DIR if that is set: run this where an image is built, or after an installation,
    as the user who will run gough.

    Exit code 0: later processes load what was compiled; 2: it cannot be kept.
    """
    from gough import compiling
    from gough.commands.show import console
    from gough.errors import GoughError
    from gough.kernel.jit import cache_folders
    from gough.platform import Platform

    screen, machine, total = console(), Platform.load("rubin_camera"), 0.0
    for title, work in _jobs().items():
        before = compiling.seconds()
        work(machine)
        took = compiling.seconds() - before
        total += took
        screen.print(f"{title}: " + (f"compiled in {took:.1f} s" if took else "there already"))
    folders, uncached = cache_folders()
    if uncached:
        raise GoughError(
            f"compiled code cannot be kept ({', '.join(uncached)}), so every process would compile "
            "anew; set NUMBA_CACHE_DIR to a folder that can be written"
        )
    for folder in folders:
        screen.print(f"kept in {folder}", soft_wrap=True, markup=False)
    return 0


def _jobs() -> dict[str, Callable[[Platform], object]]:
    """Return small jobs that between them run all that is compiled."""
    from dataclasses import replace

    import numpy as np

    import gough

    def many_rows(machine: Platform) -> None:
        machine = replace(machine, workspace=None)  # which needs all that others need, and more
        gough.Solver(machine).compile(2_000, certify=True)

    def follow(machine: Platform) -> None:
        tracker = gough.Tracker(machine)
        tracker.update(machine.home_legs)
        tracker.follow(np.tile(machine.home_legs, (2, 1)))

    def limits(machine: Platform) -> None:
        gough.limits(machine, machine.home)
        gough.reach(machine, machine.home)

    return {
        "few rows": lambda machine: gough.Solver(machine).compile(),
        "assembly modes": lambda machine: gough.assembly_modes(machine, machine.home_legs),
        "tracker": follow,
        "many rows": many_rows,
        "limits": limits,
    }

"""Complete a set of solutions by carrying it round closed loops of the parameters.

The poses of a hexapod and the squared lengths they have form one irreducible variety (a graph
over the group of motions), so loops in the complex squared lengths lead from any regular
solution to every other: a set that many random loops map to itself has them all.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gough.modes.follow import Parameters, follow
from gough.modes.study import Complex, distinct

APART = 1e-6  # of two solutions that are different, see `distances`
CAREFUL = 0.3  # share of the radius of convergence where time does not matter

Corner = Callable[[np.random.Generator], tuple[Complex, Complex]]  # squares (6,), base (6, 3)


def gaussian(rng: np.random.Generator, *shape: int) -> Complex:
    """Complex normal numbers of mean square 1."""
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2)


def around(
    start: tuple[Complex, Complex], at: Parameters, corner: Corner, rng: np.random.Generator
) -> tuple[Complex, Complex]:
    """Solutions at `at` carried round a random triangle: where the paths that arrive end."""
    here, solutions = at, start
    for squares, base in [corner(rng), corner(rng), (at.squares, at.base)]:
        ends = follow(solutions, here, squares[None], base[None], share=CAREFUL)
        solutions, here = ends.finite(), Parameters(base, at.moving, squares)
    return solutions


def fill_up(
    start: tuple[Complex, Complex],
    at: Parameters,
    corner: Corner,
    rng: np.random.Generator,
    quiet: int,
) -> tuple[tuple[Complex, Complex], list[int]]:
    """All solutions that loops reach from `start`, until `quiet` loops bring nothing new.

    Returns:
        The solutions, and how many there were after each loop.
    """
    e, t = start
    idle, history = 0, [len(e)]
    while idle < quiet:
        new_e, new_t = around((e, t), at, corner, rng)
        both = np.concatenate([e, new_e]), np.concatenate([t, new_t])
        kept = distinct(*both, APART)
        e, t = both[0][kept], both[1][kept]
        idle = idle + 1 if len(e) == history[-1] else 0
        history.append(len(e))
    return (e, t), history

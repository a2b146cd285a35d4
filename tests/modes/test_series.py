"""The leg equations, their Taylor series, and the vector arithmetic under them."""

from __future__ import annotations

import numpy as np
import pytest
from modes.poses import poses_of

import gough
from gough.kernel.jit import jit
from gough.kernel.lanes import LANES, SLOT, get, get_real, larger, put, put_real, reciprocal, root
from gough.kernel.paths import FINITE, STUCK
from gough.kernel.series import (  # fmt: skip
    BASE,
    BASE_RATE,
    L2,
    L2_RATE,
    ORDER,
    SER,
    SIZE,
    STEP,
    E,
    T,
    advance,
    evaluate,
    expand,
    factorise,
    substitute,
)
from gough.modes.finish import repeated
from gough.modes.follow import Parameters, follow
from gough.modes.monodromy import gaussian
from gough.modes.starts import start_of
from gough.modes.study import distances, distinct, inverse, product, rotation, squared_lengths


@jit(cache=False)
def arithmetic(z):
    a, b = get(z, 0), get(z, 1)
    put(z, 2, a * b + a * 2.0 - b * (1.0 + 2.0j))
    put(z, 3, reciprocal(a))
    x, y = get_real(z, 0), get_real(z, 1)
    put_real(z, 8, larger(x, y) / (1.0 + root(x * x)))


def test_lanes_are_complex_numbers():
    rng = np.random.default_rng(0)
    z = rng.normal(size=5 * SLOT)
    a, b = (z[k * SLOT :][:LANES] + 1j * z[k * SLOT + LANES :][:LANES] for k in range(2))
    x, y = z[:LANES].copy(), z[LANES : 2 * LANES].copy()
    arithmetic(z)
    c, d = (z[k * SLOT :][:LANES] + 1j * z[k * SLOT + LANES :][:LANES] for k in (2, 3))
    assert np.allclose(c, a * b + 2 * a - (1 + 2j) * b)
    assert np.allclose(d, 1 / a)
    assert np.allclose(z[8 * LANES : 9 * LANES], np.maximum(x, y) / (1 + np.abs(x)))


@jit(cache=False)
def one_step(z, p, base_moves):
    evaluate(z, p)
    factorise(z)
    substitute(z, SER)
    for n in range(1, ORDER + 1):
        expand(z, n, base_moves)
    advance(z)


def fill(z, slot, values):
    for k, value in enumerate(np.ravel(values)):
        first = (slot + k) * SLOT
        z[first : first + LANES] = value.real
        z[first + LANES : first + SLOT] = value.imag


def values(z, slot, count):
    rows = z.reshape(-1, 2, LANES)[slot : slot + count]
    return rows[:, 0, 0] + 1j * rows[:, 1, 0]


@pytest.mark.parametrize("base_moves", [False, True])
def test_taylor_series_follows_the_path_to_its_order(base_moves):
    """Halving the step divides the error by 2^(ORDER + 1)."""
    rng = np.random.default_rng(3)
    p, base, e, t = gaussian(rng, 6, 3), gaussian(rng, 6, 3), gaussian(rng, 4), gaussian(rng, 3)
    squares = squared_lengths(e, t, base, p)
    rate, speed = gaussian(rng, 6), gaussian(rng, 6, 3) * base_moves
    errors = []
    for h in (0.05, 0.025):
        z = np.zeros(SIZE)
        for slot, value in ((E, e), (T, t), (BASE, base), (BASE_RATE, speed), (L2, squares),
                            (L2_RATE, rate), (STEP, np.array([h]))):  # fmt: skip
            fill(z, slot, np.asarray(value, dtype=complex))
        one_step(z, p, base_moves)
        there = squared_lengths(values(z, E, 4), values(z, T, 3), base + h * speed, p)
        errors.append(np.abs(there - squares - h * rate).max())
    order = np.log2(errors[0] / errors[1])
    assert errors[0] < 1e-2
    assert ORDER + 0.5 < order < ORDER + 1.6


def test_newton_step_is_quadratic():
    rng = np.random.default_rng(4)
    p, base, e, t = gaussian(rng, 6, 3), gaussian(rng, 6, 3), gaussian(rng, 4), gaussian(rng, 3)
    squares = squared_lengths(e, t, base, p)
    errors = []
    for off in (1e-3, 1e-4):
        z = np.zeros(SIZE)
        start = ((E, e + off), (T, t - off), (BASE, base), (L2, squares))
        for slot, value in start:
            fill(z, slot, np.asarray(value, dtype=complex))
        one_step(z, p, False)
        there = squared_lengths(values(z, E, 4), values(z, T, 3), base, p)
        errors.append(np.abs(there - squares).max())
    assert errors[1] < errors[0] / 50


def test_there_and_back_again():
    """A path, and the same path backwards, return every solution to itself."""
    rng = np.random.default_rng(5)
    p, base, e, t = (
        gaussian(rng, 6, 3),
        gaussian(rng, 6, 3),
        gaussian(rng, 1, 4),
        gaussian(rng, 1, 3),
    )
    here = Parameters(base, p, squared_lengths(e, t, base, p)[0])
    squares, joints = gaussian(rng, 6) * 3, gaussian(rng, 6, 3)
    away = follow((e, t), here, squares[None], joints[None])
    back = follow(away.finite(), Parameters(joints, p, squares), here.squares[None], base[None])
    assert distances((e, t), back.finite()).max() < 1e-8


def test_complex_rotations_preserve_dots():
    e = gaussian(np.random.default_rng(6), 4)
    r = rotation(e)
    assert np.allclose(r @ r.T, np.eye(3))
    f = gaussian(np.random.default_rng(7), 4)
    assert np.allclose(rotation(product(e, f)), r @ rotation(f))


def test_inverse_exchanges_base_and_platform():
    rng = np.random.default_rng(8)
    p, base, e, t = gaussian(rng, 6, 3), gaussian(rng, 6, 3), gaussian(rng, 4), gaussian(rng, 3)
    assert np.allclose(squared_lengths(e, t, base, p), squared_lengths(*inverse(e, t), p, base))


def test_steps_far_too_long_are_taken_back():
    """Even at 1.5 radii of convergence a step, paths arrive, and none jumps to another's end."""
    platform = gough.Platform.load("dietmaier")
    start = start_of(platform)
    legs = gough.leg_lengths(platform, poses_of(platform, 60))
    squares = start.frames.squares(legs).astype(complex)
    ends = follow((start.e, start.t), start.at, squares, share=1.5)
    assert np.mean(ends.ends == FINITE) > 0.99
    for k in range(60):
        e, t = ends.finite(k)
        assert len(distinct(e, t, 1e-6)) == len(e)


def test_shared_ends_are_seen():
    rng = np.random.default_rng(9)
    e, t = gaussian(rng, 5, 4), gaussian(rng, 5, 3)
    arrived = np.full(5, FINITE, np.uint8)
    assert not repeated(e, t, arrived)
    e[3], t[3] = e[1] * (0.3 - 2.0j), t[1] + 1e-9  # a quaternion's factor does not matter
    assert repeated(e, t, arrived)
    arrived[3] = STUCK
    assert not repeated(e, t, arrived)

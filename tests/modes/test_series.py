"""The leg equations, their Taylor series, and the vector arithmetic under them."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from modes.poses import poses_of

import gough
from gough import quaternion
from gough.kernel import series
from gough.kernel.ends import SCRATCH, leg_equations, refine_ends
from gough.kernel.jit import jit
from gough.kernel.lanes import LANES, SLOT, Complexes, Reals, compiled, larger, loop
from gough.kernel.paths import FINITE, STUCK, LegEquations, track_paths
from gough.kernel.series import (  # fmt: skip
    AT,
    BASE,
    BASE_RATE,
    L2,
    L2_RATE,
    ORDER,
    SLOTS,
    STEP,
    T,
    X,
    advance,
    expand,
    newton,
)
from gough.kinematics import equivalent_struts, strut_vectors
from gough.modes.frames import (
    Frames,
    Problem,
    distances,
    distinct,
    inverse,
    rotation,
    squared_lengths,
)
from gough.modes.starts import gaussian, start_system


def run(code, z, shared):
    """Call a function made by `compiled`."""
    jit(cache=False)(lambda z, shared: code(z, shared))(z, shared)
    return z


def complex_arithmetic(z, shared):
    a, b = z[0], z[1]
    z[2] = a * b + a * 2.0 - b * shared[0] + 0.0 * b
    z[3] = 1.0 / a - b + a.real
    for k in loop(z, 2):
        z[4 + k] = 2.0 * z[2 * k + 1] * shared[k]


def real_arithmetic(z, shared):
    a, b = z[0], z[1]
    z[2] = larger(a, b) / (1.0 + np.sqrt(a * a)) - abs(b) * shared[1]
    z[3] = 1.0 - a / shared[0] - -b


@pytest.mark.parametrize(
    ("code", "kind"), [(complex_arithmetic, Complexes), (real_arithmetic, Reals)]
)
def test_traced_code_calculates_what_numpy_does(code, kind):
    rng = np.random.default_rng(0)
    size = SLOT if kind is Complexes else LANES
    z, shared = rng.normal(size=8 * size), rng.normal(size=4)
    numbers = z.view(complex) if kind is Complexes else z
    if kind is Complexes:
        parts = z.reshape(8, 2, LANES)
        numbers, joints = list(parts[:, 0] + 1j * parts[:, 1]), shared.view(complex)
    else:
        numbers, joints = list(z.reshape(8, LANES).copy()), shared
    code(numbers, joints)
    out = run(compiled(code, kind), z.copy(), shared).reshape(8, -1, LANES)
    found = out[:, 0] + 1j * out[:, 1] if kind is Complexes else out[:, 0]
    assert np.allclose(found, numbers, rtol=1e-14, atol=1e-14)


ZERO = np.zeros((), complex)


def problem(seed, moves=True):
    """Joints, a pose, squared lengths, and rates of change of lengths and base joints."""
    rng = np.random.default_rng(seed)
    p, base, pose = gaussian(rng, 6, 3), gaussian(rng, 6, 3), gaussian(rng, 7)
    squares = squared_lengths(pose, base, p)
    return p, base, pose, squares, gaussian(rng, 6), gaussian(rng, 6, 3) * moves


def slots(pose, base, squares, rate=ZERO, speed=ZERO, step=0.0):
    z: list = [np.zeros(1, complex) for _ in range(SLOTS)]
    for slot, values in ((T, pose), (BASE, base), (L2, squares), (L2_RATE, np.full(6, rate)),
                         (BASE_RATE, np.full((6, 3), speed)), (STEP, [step])):  # fmt: skip
        for k, value in enumerate(np.ravel(values)):
            z[slot + k] = np.array([value], complex)
    return z


def reached(z):
    return np.array(z[T : T + 7])[:, 0]


@pytest.mark.parametrize("moves", [False, True])
def test_taylor_series_follows_the_path_to_its_order(moves):
    """Halving the step divides the error by 2^(ORDER + 1)."""
    p, base, pose, squares, rate, speed = problem(3, moves)
    errors = []
    for h in (0.05, 0.025):
        z = slots(pose, base, squares, rate, speed, h)
        newton(z, np.ravel(p))
        expand(z, np.ravel(p), moves)
        advance(z, np.ravel(p))
        there = squared_lengths(reached(z), base + h * speed, p)
        errors.append(np.abs(there - squares - h * rate).max())
    order = np.log2(errors[0] / errors[1])
    assert errors[0] < 1e-2
    assert ORDER + 0.5 < order < ORDER + 1.6


def test_newton_step_is_quadratic():
    p, base, pose, squares, *_ = problem(4)
    errors = []
    for off in (1e-3, 1e-4):
        z = slots(pose + off * np.array([-1, -1, -1, 1, 1, 1, 1]), base, squares)
        newton(z, np.ravel(p))
        advance(z, np.ravel(p))
        errors.append(np.abs(squared_lengths(reached(z), base, p) - squares).max())
    assert errors[1] < errors[0] / 50


@pytest.mark.parametrize("moves", [False, True])
def test_compiled_step_is_the_one_in_numpy(moves):
    """The same functions, traced into vector instructions, at parameters half way along."""
    p, base, pose, squares, rate, speed = problem(11, moves)
    z = slots(pose, base, squares, rate, speed, 0.01)
    z[AT] = np.array([0.5 + 0j])
    flat = np.repeat(np.array(z)[:, 0].view(float), LANES)
    for function in (newton, partial(expand, base_moves=moves), advance):
        function(z, np.ravel(p))
        flat = run(compiled(function, Complexes), flat, np.ravel(p).view(float))
    found = flat.reshape(-1, 2, LANES)
    expected = np.array(z)[: X + 6]
    assert np.allclose(found[: X + 6, 0] + 1j * found[: X + 6, 1], expected, rtol=1e-9, atol=1e-9)


def test_there_and_back_again():
    """A path, and the same path backwards, return every solution to itself."""
    rng = np.random.default_rng(5)
    p, base, pose = gaussian(rng, 6, 3), gaussian(rng, 6, 3), gaussian(rng, 1, 7)
    here = LegEquations(base, p, squared_lengths(pose, base, p)[0])
    squares, joints = gaussian(rng, 6) * 3, gaussian(rng, 6, 3)
    away = track_paths(pose, here, squares[None], joints[None])
    there = LegEquations(joints, p, squares)
    back = track_paths(away.finite(), there, here.squares[None], base[None])
    assert distances(pose, back.finite()).max() < 1e-8


def test_complex_rotations_preserve_dots():
    a, b = gaussian(np.random.default_rng(6), 2, 7)
    r = rotation(a)
    assert np.allclose(r @ r.T, np.eye(3))
    both = np.append(np.zeros(3), quaternion.product(a[3:], b[3:]))
    assert np.allclose(rotation(both), r @ rotation(b))


def test_inverse_exchanges_base_and_platform():
    p, base, pose, *_ = problem(8)
    assert np.allclose(squared_lengths(pose, base, p), squared_lengths(inverse(pose), p, base))


@pytest.mark.parametrize("name", ["rubin_simulink", "reachy_mini", "nasa_msfc"])
def test_leg_equations_are_the_struts(name):
    """Compare the struts of the compiled code with those of `gough.struts`."""
    platform = gough.Platform.load(name)
    pose = poses_of(platform, 1)
    frames = Frames.of(platform)
    legs = gough.leg_lengths(platform, pose)
    one = Problem.of(frames, *equivalent_struts(platform, legs))
    a, x = np.empty((6, 6)), np.empty(6)
    worst = leg_equations(one.moving, one.base[0], one.squares[0], frames.normalise(pose)[0], a, x)
    assert worst == np.abs(x).max() < 1e-13
    rods = (
        strut_vectors(platform, pose)[0] + platform.base - equivalent_struts(platform, legs)[0][0]
    )
    assert np.allclose(
        np.linalg.norm(a[:, :3], axis=1), np.linalg.norm(rods, axis=1) / frames.scale
    )
    back = frames.denormalise(frames.normalise(pose))
    assert np.allclose(back.matrix, pose.matrix, atol=1e-12 * platform.size)


def test_steps_far_too_long_are_taken_back():
    """Even at 1.5 radii of convergence a step, paths arrive, and none jumps to another's end."""
    platform = gough.Platform.load("dietmaier")
    start = start_system(platform)
    legs = gough.leg_lengths(platform, poses_of(platform, 60))
    squares = start.frames.squares(legs).astype(complex)
    ends = track_paths(start.poses, start.at, squares, share=1.5)
    assert np.mean(ends.how == FINITE) > 0.99
    for k in range(60):
        poses = ends.finite(k)
        assert len(distinct(poses, 1e-6)) == len(poses)


def test_shared_ends_are_seen():
    rng = np.random.default_rng(9)
    ends, how = gaussian(rng, 1, 5, 7), np.full((1, 5), FINITE, np.uint8)
    joints = rng.normal(size=(2, 6, 3))

    def shared():
        found = np.zeros(1, bool)
        refine_ends(
            joints[0], joints[1:], np.ones((1, 6)), ends, how, np.zeros((1, 5, 7)),
            np.zeros((1, 5), np.uint8), found, np.zeros(SCRATCH),
        )  # fmt: skip
        return found[0]

    assert not shared()
    ends[0, 3, 3:] = ends[0, 1, 3:] * (0.3 - 2.0j)  # a quaternion's factor does not matter
    ends[0, 3, :3] = ends[0, 1, :3] + 1e-9
    assert shared()
    how[0, 3] = STUCK
    assert not shared()


def test_series_needs_no_compiler():
    """The mathematics is plain Python: no decorator of Numba stands in its module."""
    assert not any(hasattr(value, "py_func") for value in vars(series).values())

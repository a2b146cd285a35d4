"""The inverse Taylor series about home: right to its order, for any kind of leg and any frame."""

from __future__ import annotations

import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st
from machines import permuted, random_platform
from support import moved, random_platforms

import gough
from gough.seeds.base import find_seed
from gough.seeds.taylor import TaylorSeed
from gough.units import scaled

few = support.at_most(20)
ORDERS = (1, 2, 3, 4)


@few
@given(random_platforms, st.integers(0, 10**6), st.sampled_from(ORDERS))
def test_error_falls_with_the_next_power(platform, seed, order):
    """Halving the way from home divides the error of a series of order k by 2^(k + 1)."""
    twist = np.random.default_rng(seed).uniform(-1, 1, 6) * np.repeat([platform.size, 1.0], 3)
    errors = []
    for way in (0.02, 0.01):
        pose = moved(platform.home, way * twist[None])
        guess = TaylorSeed(platform, order).guess(gough.leg_lengths(platform, pose))
        away, turned = guess.distance(pose)
        errors.append(away[0] / platform.size + turned[0])
    assert errors[0] < 0.2
    assert errors[0] / errors[1] > 2 ** (order + 1) / 2


@few
@given(random_platforms)
def test_first_order_is_the_inverse_jacobian(platform):
    legs = platform.home_legs + 1e-6 * (platform.size if platform.legs != "rotary" else 1.0)
    step = np.linalg.solve(gough.jacobian(platform, platform.home), legs - platform.home_legs)
    guess = TaylorSeed(platform, 1).guess(legs[None])
    away, turned = guess.distance(moved(platform.home, step[None]))
    assert away[0] < 1e-10 * platform.size
    assert turned[0] < 1e-10


@few
@given(st.integers(0, 10**6), st.sampled_from(["telescopic", "length_change", "rotary"]))
def test_unit_and_numbering_do_not_matter(seed, kind):
    platform = random_platform(seed, kind)
    legs = gough.leg_lengths(platform, platform.sample_poses(5, seed=1))
    guess = TaylorSeed(platform, 3).guess(legs)
    order = np.random.default_rng(seed).permutation(6)
    other = TaylorSeed(permuted(platform, order), 3).guess(legs[:, order])
    np.testing.assert_allclose(other.matrix, guess.matrix, rtol=0, atol=1e-9 * platform.size)
    unit = 1e3
    longer = legs if kind == "rotary" else legs * unit
    far = TaylorSeed(scaled(platform, unit), 3).guess(longer)
    np.testing.assert_allclose(
        far.position, guess.position * unit, atol=1e-9 * platform.size * unit
    )


def test_known_errors():
    """Mean translation error [% of the size] found before with finite differences."""
    for name, share in (("reference", 0.87), ("nasa_msfc", 0.55), ("linuxcnc_genhex", 0.50)):
        platform = gough.Platform.load(name)
        wide = platform.with_workspace(0.08 * platform.size, 30)
        pose = wide.sample_poses(5000)
        guess = find_seed(wide, "taylor-2").guess(gough.leg_lengths(wide, pose))
        error = guess.distance(pose)[0].mean() / platform.size
        assert 100 * error == pytest.approx(share, abs=0.02)


def test_a_singular_home_is_refused():
    base = np.array([[np.cos(a), np.sin(a), 0] for a in np.radians([0, 10, 120, 130, 240, 250])])
    flat = gough.Platform(base, 0.5 * base, home=(0, 0, 1))  # legs meet in one point
    with pytest.raises(gough.GoughError, match="singular"):
        TaylorSeed(flat).guess(flat.home_legs[None])


def test_an_unknown_order_is_refused():
    with pytest.raises(gough.GoughError, match="1 to 6"):
        find_seed(gough.Platform.load("reference"), "taylor-9")

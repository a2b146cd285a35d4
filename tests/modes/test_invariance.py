"""What must not matter: where frames are, how legs are numbered, what a length is called."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from modes.machines import random_platform

import gough
from gough import quaternion

SEEDS = st.integers(0, 10**6)
few = settings(max_examples=15, deadline=None)


def same(modes: gough.AssemblyModes, other: gough.AssemblyModes, pose: gough.Pose) -> bool:
    """Whether each of `pose`, batch (M,), is one of `other`'s, and there are as many."""
    if len(modes) != len(other):
        return False
    size = other.platform.size
    return all(
        np.min(sum(np.array(pose[k].distance(other.pose)) / [[size], [1]])) < 1e-6
        for k in range(len(modes))
    )


@few
@given(SEEDS)
def test_rigid_motion_of_both_frames(seed):
    platform = random_platform(seed)
    rng = np.random.default_rng(seed)
    a, b = (gough.Pose(rng.normal(size=3), rng.normal(size=4)) for _ in range(2))
    moved = gough.Platform(
        a.apply(platform.base), b.apply(platform.moving), home=a @ platform.home @ b.inverse()
    )
    modes = gough.assembly_modes(platform, platform.home_legs)
    other = gough.assembly_modes(moved, platform.home_legs)
    first = quaternion.product(np.broadcast_to(a.wxyz, (len(modes), 4)), modes.pose.wxyz)
    turned = quaternion.product(first, b.inverse().wxyz)
    seen = gough.Pose(a.apply(modes.pose.apply(b.inverse().position)), turned)
    assert same(modes, other, seen)


@few
@given(SEEDS, st.permutations(range(6)))
def test_order_of_legs(seed, order):
    platform = random_platform(seed)
    shuffled = gough.Platform(platform.base[order], platform.moving[order], home=platform.home)
    modes = gough.assembly_modes(platform, platform.home_legs)
    other = gough.assembly_modes(shuffled, platform.home_legs[order])
    assert same(modes, other, modes.pose)


@few
@given(SEEDS, st.sampled_from([1e-6, 1e-3, 1e3, 1e6]))
def test_unit_of_length(seed, unit):
    platform = random_platform(seed)
    home = gough.Pose(platform.home.position * unit, platform.home.wxyz)
    scaled = gough.Platform(platform.base * unit, platform.moving * unit, home=home)
    modes = gough.assembly_modes(platform, platform.home_legs)
    other = gough.assembly_modes(scaled, platform.home_legs * unit)
    assert same(modes, other, gough.Pose(modes.pose.position * unit, modes.pose.wxyz))
    assert np.allclose(other.certificate.radius, modes.certificate.radius * unit, rtol=1e-6)


@few
@given(SEEDS)
def test_base_and_platform_exchanged(seed):
    platform = random_platform(seed)
    swapped = gough.Platform(platform.moving, platform.base, home=platform.home.inverse())
    modes = gough.assembly_modes(platform, platform.home_legs)
    other = gough.assembly_modes(swapped, platform.home_legs)
    assert same(modes, other, modes.pose.inverse())


@few
@given(SEEDS)
def test_planar_platforms_have_mirror_images(seed):
    platform = random_platform(seed, planar=True)
    modes = gough.assembly_modes(platform, platform.home_legs)
    flip = np.array([1.0, -1.0, -1.0, 1.0])
    mirrored = gough.Pose(modes.pose.position * [1, 1, -1], modes.pose.wxyz * flip)
    assert same(modes, modes, mirrored)


@few
@given(SEEDS)
def test_complex_solutions_come_in_pairs(seed):
    """Of 40, an even number is real."""
    platform = random_platform(seed)
    modes = gough.assembly_modes(platform, platform.home_legs)
    real, other, away, meet = modes.paths
    assert (real + other, real % 2, away, meet) == (40, 0, 0, 0)
    assert len(modes) >= 2

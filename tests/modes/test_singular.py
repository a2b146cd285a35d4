"""Platforms and readings where solutions meet, or a curve of poses has the same legs."""

from __future__ import annotations

import time

import numpy as np
import pytest
from machines import griffis_duffy

import gough
from gough.status import ModesStatus


def similar_hexagons() -> gough.Platform:
    base = gough.Platform.load("reference").base
    return gough.Platform(base, 0.4 * base, home=(0, 0, 600))


@pytest.mark.parametrize("platform", [griffis_duffy(), similar_hexagons()])
def test_architecturally_singular_machines_are_named(platform):
    began = time.perf_counter()
    modes = gough.assembly_modes(platform, platform.home_legs)
    assert time.perf_counter() - began < 10
    assert modes.status == ModesStatus.ALWAYS_SINGULAR
    assert not modes.certified.any()
    assert np.all(modes.multiplicity == 0)
    assert modes.residual.max() < 1e-9 * platform.size
    assert np.ptp(modes.pose.position, axis=0).max() > 0.1 * platform.size  # a curve, not a dot


def test_architecturally_singular_machine_whose_legs_fit_no_pose():
    platform = griffis_duffy()
    modes = gough.assembly_modes(platform, platform.home_legs * [1, 1.1, 1, 1, 1, 1])
    assert modes.status == ModesStatus.ALWAYS_SINGULAR
    assert len(modes) == 0


def test_self_motion_of_an_ordinary_machine():
    """Parallel legs of equal length between congruent joints carry the platform in a circle."""
    rng = np.random.default_rng(4)
    joints = rng.normal(size=(6, 3))
    platform = gough.Platform(joints, joints.copy(), home=(0.3, 0.2, 2.0))
    modes = gough.assembly_modes(platform, platform.home_legs)
    assert modes.status in (ModesStatus.SELF_MOTION, ModesStatus.ALWAYS_SINGULAR)
    assert modes.residual.max() < 1e-9 * platform.size


def singular_reference() -> tuple[gough.Platform, float]:
    """The reference machine, and the turn [rad] about its axis at which it is singular."""
    return gough.Platform.load("reference"), np.pi / 2


@pytest.mark.parametrize("off", [0.0, 1e-8])
def test_double_solutions_are_one_pose_that_is_not_certified(off):
    platform, turn = singular_reference()
    turn += off
    pose = gough.Pose(platform.home.position, [np.cos(turn / 2), 0, 0, np.sin(turn / 2)])
    modes = gough.assembly_modes(platform, gough.leg_lengths(platform, pose))
    assert modes.status == ModesStatus.SINGULAR
    shift, angle = modes.pose.distance(pose)
    k = int(np.argmin(shift))
    assert shift[k] < 1e-5 * platform.size
    assert angle[k] < 1e-5
    assert modes.multiplicity[k] == 2
    assert not modes.certified[k]
    assert modes.complete


def test_just_beside_a_singularity_both_poses_are_told_apart():
    platform, turn = singular_reference()
    turn += 1e-3
    pose = gough.Pose(platform.home.position, [np.cos(turn / 2), 0, 0, np.sin(turn / 2)])
    modes = gough.assembly_modes(platform, gough.leg_lengths(platform, pose))
    assert modes.status == ModesStatus.COMPLETE
    assert modes.certified.all()
    assert np.min(modes.pose.distance(pose)[1]) < 1e-9


def test_flat_pose_is_its_own_mirror_image():
    platform = gough.Platform.load("matlab_stewart")
    pose = gough.Pose([0.3, 0.1, 0.0], [1, 0, 0, 0.3])
    modes = gough.assembly_modes(platform, gough.leg_lengths(platform, pose))
    assert modes.status != ModesStatus.COMPLETE
    assert np.min(modes.pose.distance(pose)[0]) < 1e-4
    assert not modes.certified.any()

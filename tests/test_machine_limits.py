"""The table [limits] of a platform: read, written, refused."""

from __future__ import annotations

from dataclasses import replace

import machines
import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import MachineLimits, Platform, PlatformError
from gough.platform_file import from_toml

REFERENCE = Platform.load("reference")
TABLE = """
[limits]
base_joint_cone = 25
moving_joint_axis = [[0,0,1],[0,0,1],[0,0,1],[0,0,1],[0,0,1],[0,0,-2]]
moving_joint_cone = [50, 50, 50, 50, 50, 45]
leg_radius = 12.5
clearance = 2
leg_force = [-400, 900]
leg_speed = 100
leg_acceleration = 2000

[limits.payload]
mass = 30
centre = [0, 0, 80]
"""


def refused(message: str, **limits) -> None:
    with pytest.raises(PlatformError, match=message):
        replace(REFERENCE, limits=MachineLimits(**limits))


def test_a_file_states_limits() -> None:
    platform = from_toml(REFERENCE.to_toml() + TABLE)
    limits = platform.limits
    assert limits is not None
    assert limits.payload is not None
    assert limits.base_joint_cone is not None
    np.testing.assert_array_equal(limits.base_joint_cone, [25.0] * 6)
    np.testing.assert_array_equal(limits.payload.gravity, [0, 0, -9.80665])
    again = from_toml(platform.to_toml())
    assert again == platform
    assert platform.limits.to_dict() == again.limits.to_dict()  # pyright: ignore
    text = platform.to_toml()
    assert "base_joint_cone = 25.0" in text
    assert "leg_force = [-400.0, 900.0]" in text


@support.at_most(20)
@given(support.random_platforms, support.seeds)
def test_limits_go_to_toml_and_back(platform: Platform, seed: int) -> None:
    limited = machines.limited(platform, seed)
    again = from_toml(limited.to_toml())
    assert again == limited
    assert limited.limits is not None
    assert again.limits is not None
    for name, value in vars(limited.limits).items():
        if name != "payload":
            np.testing.assert_array_equal(value, getattr(again.limits, name))


@given(st.sampled_from(Platform.catalog()))
def test_limits_change_neither_digest_nor_readings(name: str) -> None:
    """Networks and seeds of a platform stay valid when its owner states limits."""
    platform = Platform.load(name)
    assert "limits" not in platform.to_dict()
    limited = machines.limited(platform)
    assert limited.digest == platform.digest
    assert limited != platform
    assert limited != machines.limited(platform, 1)


@pytest.mark.parametrize(("table", "message"), [
    ("leg_radii = 3", r"limits\.leg_radii: unknown field; did you mean 'leg_radius'\? fields are "),
    ("payload = { mas = 3 }", r"limits\.payload\.mas: unknown field; did you mean 'mass'"),
    ("payload = { centre = [0, 0, 1] }", r"limits\.payload\.mass: missing"),
    ("payload = 3", r"limits\.payload: expected a table with mass, centre, gravity; found 3"),
    ("payload = { mass = -3 }", r"limits\.payload\.mass: expected 0 or more, found -3"),
    ("leg_force = [-1, 1]", r"limits\.leg_force: means nothing without payload"),
    ("clearance = 3", r"limits\.clearance: means nothing without leg_radius"),
    ("base_joint_cone = [1, 2]", r"limits\.base_joint_cone: expected one number, or six"),
    ("base_joint_cone = 200", r"limits\.base_joint_cone\[0\]: expected .* at most 180, found 200"),
    ("leg_speed = 0", r"limits\.leg_speed\[0\]: expected a number above 0, found 0"),
    ("leg_force = 3\npayload = { mass = 1 }", r"limits\.leg_force: expected \[lowest, highest\]"),
    ("leg_force = [3, 3]\npayload = { mass = 1 }", r"limits\.leg_force\[0\]: expected lowest"),
    ("base_joint_cone = 10\nbase_joint_axis = [[0,0,1],[0,0,0],[0,0,1],[0,0,1],[0,0,1],[0,0,1]]",
     r"limits\.base_joint_axis\[1\]: expected a direction"),
])  # fmt: skip
def test_a_wrong_table_is_named(table: str, message: str) -> None:
    with pytest.raises(PlatformError, match=message):
        from_toml(f"{REFERENCE.to_toml()}\n[limits]\n{table}\n")


def test_limits_that_home_breaks_are_refused() -> None:
    vertical = np.tile([0.0, 0.0, 1.0], (6, 1))
    refused(
        r"limits\.base_joint_cone\[\d\]: forbids the home pose: there leg \d is 23\.\d+ deg",
        base_joint_cone=20, base_joint_axis=vertical,
    )  # fmt: skip
    refused(
        r"limits\.moving_joint_cone\[\d\]: forbids the home pose.* change home, moving_joint_axis",
        moving_joint_cone=20, moving_joint_axis=vertical,
    )  # fmt: skip
    refused(r"limits\.leg_radius: forbids .* axes of legs . and . are 102\.606", leg_radius=52)
    refused(
        r"limits\.leg_force\[0\]: forbids .* leg 1 pushes with 53\.57\d*",
        leg_force=(-50, 50), payload={"mass": 30, "centre": [0, 0, 80]},
    )  # fmt: skip
    with pytest.raises(PlatformError, match="limits: expected a MachineLimits"):
        replace(REFERENCE, limits={"clearance": 3})


def test_an_axis_and_its_opposite_are_one() -> None:
    up = np.tile([0.0, 0.0, 1.0], (6, 1))
    angles = [
        gough.joint_angles(
            replace(REFERENCE, limits=MachineLimits(base_joint_cone=60, base_joint_axis=axes)),
            REFERENCE.home,
        )[0]
        for axes in (up, -3 * up)
    ]
    np.testing.assert_array_equal(angles[0], angles[1])


def test_a_moved_origin_moves_the_payload() -> None:
    platform = machines.limited(REFERENCE)
    moved = platform.with_origin_at((0, 10, 50))
    np.testing.assert_allclose(
        gough.payload_forces(moved, moved.home), gough.payload_forces(platform, platform.home)
    )


def test_forces_need_a_payload() -> None:
    with pytest.raises(PlatformError, match=r"limits\.payload: the platform states none"):
        gough.payload_forces(REFERENCE, REFERENCE.home)

"""Every platform of the tests that is not in the catalog, and the same platform seen otherwise."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from gough import (
    MachineLimits,
    Payload,
    Platform,
    Pose,
    RotaryArms,
    Workspace,
    leg_gaps,
    payload_forces,
    singularity_distance,
)
from gough.limit_geometry import shared_joints

Floats = NDArray[np.floating]

TELESCOPIC = ("dietmaier", "linuxcnc_genhex", "matlab_stewart", "nasa_msfc", "reference")
ALL = (*TELESCOPIC, "reachy_mini", "rubin_camera", "rubin_simulink")


# ---- random ---------------------------------------------------------------------------


def random_platform(seed: int, legs: str = "telescopic", sensors: bool = False) -> Platform:
    """A hexapod a little off the regular shape, with every optional field, far from singular.

    Args:
        sensors: legs read through an offset and a gain of their own; rotary legs have arms and
            rods of different lengths, too.
    """
    rng = np.random.default_rng(seed)
    size = 10 ** rng.uniform(-3, 3)
    base = _ring(rng, radius=1.0, first=-20.0, half_gap=20.0)
    moving = np.roll(_ring(rng, radius=0.5, first=40.0, half_gap=20.0), 1, axis=0)
    tilt = Pose.from_rotation_vector(rng.uniform(-0.1, 0.1, 3), rng.uniform(-0.1, 0.1, 3))
    home = Pose(size * (tilt.position + np.array([0.0, 0.0, 1.2])), tilt.wxyz)
    arms = _arms(base, size) if legs == "rotary" else None
    platform = Platform(
        size * base,
        size * moving,
        home,
        unit=str(rng.choice(["mm", "m", "", 'the "foot" \\ é'])),
        name=f"random {seed}",
        legs=legs,  # pyright: ignore[reportArgumentType]
        pivot=size * rng.uniform(-0.2, 0.2, 3) if rng.random() < 0.5 else None,
        workspace=Workspace.about_home(0.05 * size, 5.0),
        rotary=arms,
    )
    if sensors:
        unit = 1.0 if legs == "rotary" else size
        platform = replace(
            platform,
            offset=rng.uniform(-0.1, 0.1, 6) * unit,
            gain=rng.choice([-1.0, 1.0], 6) * rng.uniform(0.5, 2.0, 6),
            rotary=arms and _uneven(arms, rng),
        )
    reach = 0.5 if legs == "rotary" else 0.5 * size
    reach = np.abs(reach / platform.gain)[:, None] * [-1.0, 1.0]
    return replace(platform, stroke=platform.home_legs[:, None] + reach)


def _uneven(arms: RotaryArms, rng: np.random.Generator) -> RotaryArms:
    """Arms and rods whose lengths differ by up to a hundredth."""
    spread = 1 + rng.uniform(-0.01, 0.01, (2, 6))
    return replace(
        arms, arm_length=spread[0] * arms.arm_length, rod_length=spread[1] * arms.rod_length
    )


def _ring(rng: np.random.Generator, radius: float, first: float, half_gap: float) -> Floats:
    """Three pairs of joints on a circle, each moved by a few hundredths, (6, 3)."""
    middles = np.repeat([0.0, 120.0, 240.0], 2) + first + half_gap
    turn = np.radians(middles + np.tile([-half_gap, half_gap], 3))
    circle = radius * np.stack([np.cos(turn), np.sin(turn), np.zeros(6)], axis=-1)
    return circle + rng.uniform(-0.03, 0.03, (6, 3))


def _arms(base: Floats, size: float) -> RotaryArms:
    """Arms that swing up and along the ring, with rods that reach home at about level."""
    along = np.cross([0.0, 0.0, 1.0], base)
    along[:, 2] = 0.0
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    sign = np.tile([1.0, -1.0], 3)
    up = np.broadcast_to([0.0, 0.0, 1.0], (6, 3))
    return RotaryArms(0.5 * size, 1.35 * size, sign[:, None] * along, up, -np.ones(6))


def general_platform(
    seed: int,
    base: Iterable[int] = range(6),
    moving: Iterable[int] = range(6),
    planar: bool = False,
) -> Platform:
    """A hexapod with joints anywhere, possibly near a singularity; equal indices share a joint."""
    rng = np.random.default_rng(seed)
    joints = [rng.normal(size=(6, 3)) for _ in range(2)]
    if planar:
        for points in joints:
            points[:, 2] = 0.0
    return Platform(joints[0][list(base)], joints[1][list(moving)], home=(0.1, 0.2, 2.0))


def regular_platform(seed: int) -> Platform:
    """A hexapod with joints anywhere, near two planes, that is far from singular at home."""
    rng = np.random.default_rng(seed)
    while True:
        base = rng.normal(size=(6, 3)) * [1.0, 1.0, 0.1]
        moving = rng.normal(size=(6, 3)) * [0.5, 0.5, 0.05]
        platform = Platform(base, moving, (0, 0, 1.5), workspace=Workspace.about_home(0.03, 3))
        if singularity_distance(platform, platform.home) > 0.2:
            return platform


# ---- special --------------------------------------------------------------------------


def griffis_duffy() -> Platform:
    """Type I: equilateral triangles, vertices joined to midpoints of edges and back."""

    def triangle(radius: float) -> Floats:
        angles = np.radians([90.0, 210.0, 330.0])
        return radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)

    large, small = triangle(2.0), triangle(1.0)
    base, moving = [], []
    for k in range(3):
        n = (k + 1) % 3
        base += [large[k], (large[k] + large[n]) / 2]
        moving += [(small[k] + small[n]) / 2, small[n]]
    return Platform(np.array(base), np.array(moving), home=(0, 0, 1.5))


def with_some_workspace(platform: Platform) -> Platform:
    """The platform itself, or with a small workspace if it states none."""
    return platform if platform.workspace else platform.with_workspace(0.02 * platform.size, 5)


def limited(platform: Platform, seed: int | None = None) -> Platform:
    """The platform with every limit of joints, legs and motors, home well within them.

    Args:
        seed: draw cones, axes, radii and forces that differ from leg to leg.
    """
    rng = np.random.default_rng(seed)
    spread = np.ones(6) if seed is None else rng.uniform(0.8, 1.2, 6)
    load = Payload(30.0, 0.1 * platform.size * np.array([0.1, 0.2, 1.0]))
    forces = payload_forces(platform, platform.home, load)
    most = 3 * np.max(np.abs(forces)) * spread
    gaps = leg_gaps(platform, platform.home)[~shared_joints(platform)]
    axes: dict = {}
    if seed is not None:
        axes = {
            "base_joint_axis": rng.normal([0.0, 0.0, 1.0], 0.1, (6, 3)),
            "moving_joint_axis": rng.normal([0.0, 0.0, 1.0], 0.1, (6, 3)),
        }
    return replace(platform, limits=MachineLimits(
        base_joint_cone=(30.0 if not axes else 100.0) * spread,
        moving_joint_cone=(40.0 if not axes else 100.0) * spread,
        leg_radius=0.2 * gaps.min() * spread,
        clearance=0.1 * gaps.min(),
        leg_force=np.stack([-most, most], axis=-1),
        payload=load,
        leg_speed=platform.size * spread,
        **axes,
    ))  # fmt: skip


# ---- the same platform seen otherwise -------------------------------------------------


def permuted(platform: Platform, order: NDArray[np.intp]) -> Platform:
    """The same machine with its legs numbered in another order."""
    arms = platform.rotary
    if arms is not None:
        arms = replace(
            arms, **{field.name: getattr(arms, field.name)[order] for field in fields(arms)}
        )
    return replace(
        platform,
        offset=platform.offset[order],
        gain=platform.gain[order],
        base=platform.base[order],
        moving=platform.moving[order],
        stroke=None if platform.stroke is None else platform.stroke[order],
        rotary=arms,
    )


def carried(platform: Platform, motion: Pose) -> Platform:
    """The same machine with its base moved by `motion`."""
    arms = platform.rotary
    if arms is not None:
        turn = motion.rotation.T
        arms = replace(arms, axis_x=arms.axis_x @ turn, axis_y=arms.axis_y @ turn)
    return replace(
        platform,
        base=motion.apply(platform.base),
        home=motion @ platform.home,
        rotary=arms,
        stroke=None,
    )

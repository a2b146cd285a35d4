"""Samples that several tests draw from: poses, twists, platforms, and the same machine rescaled."""

from __future__ import annotations

import dataclasses
from dataclasses import fields, replace

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from gough import Platform, Pose, RotaryArms, Workspace

Floats = NDArray[np.floating]

BATCHES: tuple[tuple[int, ...], ...] = ((), (1,), (3, 1, 2, 1))
# [rad] no turn, turns whose squares or cubes vanish, ordinary turns, nearly and exactly half a turn
ANGLES = (0.0, 1e-300, 1e-160, 1e-12, 1e-8, 1e-4, 0.299, 0.3, 0.301, 1.0, 2.5, np.pi - 1e-8, np.pi)
TELESCOPIC_LIKE = tuple(n for n in Platform.catalog() if Platform.load(n).legs != "rotary")

seeds = st.integers(0, 2**32 - 1)
batches = st.sampled_from(BATCHES)
angles = st.sampled_from(ANGLES) | st.floats(0.0, np.pi)


def unit_vectors(rng: np.random.Generator, *shape: int) -> Floats:
    """Directions (*shape, 3), evenly over the sphere."""
    v = rng.standard_normal((*shape, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def random_twists(rng: np.random.Generator, batch: tuple[int, ...], angle: float) -> Floats:
    """Twists (*batch, 6) that turn by `angle` [rad] and shift by about 1."""
    shift = rng.standard_normal((*batch, 3))
    return np.concatenate([shift, angle * unit_vectors(rng, *batch)], axis=-1)


def random_poses(rng: np.random.Generator, batch: tuple[int, ...], angle: float) -> Pose:
    """Poses with batch axes `batch` that turn by `angle` [rad], at positions of about 1."""
    twists = random_twists(rng, batch, angle)
    return Pose.from_rotation_vector(twists[..., :3], twists[..., 3:])


poses = st.builds(
    lambda seed, batch, angle: random_poses(np.random.default_rng(seed), batch, angle),
    seeds,
    batches,
    angles,
)


@st.composite
def pose_triples(draw: st.DrawFn) -> tuple[Pose, Pose, Pose]:
    """Three poses with the same batch axes."""
    rng, batch = np.random.default_rng(draw(seeds)), draw(batches)
    a, b, c = (random_poses(rng, batch, draw(angles)) for _ in range(3))
    return a, b, c


def assert_same_pose(a: Pose, b: Pose, tolerance: float = 1e-13) -> None:
    """Equal as rigid motions: the sign of a quaternion does not matter."""
    np.testing.assert_allclose(a.matrix, b.matrix, rtol=0, atol=tolerance)


# ---- platforms ------------------------------------------------------------------------


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
        unit=str(rng.choice(["mm", "m", "", 'the "foot"\n\x7f'])),
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


random_platforms = st.builds(
    random_platform,
    seeds,
    st.sampled_from(["telescopic", "length_change", "rotary"]),
    st.booleans(),
)


def assert_same_parts(a: object, b: object) -> None:
    """Every field equal, bit for bit, without trusting `==` of the classes themselves."""
    assert type(a) is type(b)
    if dataclasses.is_dataclass(a):
        for field in dataclasses.fields(a):
            assert_same_parts(getattr(a, field.name), getattr(b, field.name))
    else:
        np.testing.assert_array_equal(a, b)  # pyright: ignore[reportArgumentType]


def scaled(platform: Platform, factor: float, unit: str = "") -> Platform:
    """The same machine with its lengths told in another unit."""
    arms, space, stroke = platform.rotary, platform.workspace, platform.stroke
    if arms is not None:
        arms = replace(
            arms, arm_length=factor * arms.arm_length, rod_length=factor * arms.rod_length
        )
    if space is not None:
        space = replace(space, translation=factor * space.translation)
    along = 1.0 if platform.legs == "rotary" else factor
    if stroke is not None:
        stroke = along * stroke
    return replace(
        platform,
        base=factor * platform.base,
        moving=factor * platform.moving,
        home=Pose(factor * platform.home.position, platform.home.wxyz),
        pivot=None if platform.pivot is None else factor * platform.pivot,
        unit=unit,
        stroke=stroke,
        offset=along * platform.offset,
        workspace=space,
        rotary=arms,
    )


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


def sample(platform: Platform, batch: tuple[int, ...] = (20,), seed: int = 0) -> Pose:
    """Poses of the workspace with batch axes `batch`."""
    flat = platform.sample_poses(int(np.prod(batch)), seed=seed)
    return Pose(flat.position.reshape(*batch, 3), flat.wxyz.reshape(*batch, 4))


def moved(pose: Pose, twist: Floats) -> Pose:
    """The pose after a small twist (velocity of the position, angular velocity), in base axes."""
    turn = Pose.from_rotation_vector(np.zeros(3), twist[..., 3:]) @ Pose(np.zeros(3), pose.wxyz)
    return Pose(pose.position + twist[..., :3], turn.wxyz)

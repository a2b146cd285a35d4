"""Samples that several tests draw from: poses, twists, platforms, and the same machine rescaled."""

from __future__ import annotations

import dataclasses

import machines
import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from gough import Platform, Pose

Floats = NDArray[np.floating]

BATCHES: tuple[tuple[int, ...], ...] = ((), (1,), (3, 1, 2, 1))
# [rad] no turn, turns whose squares or cubes vanish, ordinary turns, nearly and exactly half a turn
ANGLES = (0.0, 1e-300, 1e-160, 1e-12, 1e-8, 1e-4, 0.299, 0.3, 0.301, 1.0, 2.5, np.pi - 1e-8, np.pi)
# legs are vertical, and dependent at every pose
PRISM = Platform(*[Platform.load("reference").base] * 2, home=(0, 0, 100), name="prism")
TELESCOPIC_LIKE = tuple(n for n in Platform.catalog() if Platform.load(n).legs != "rotary")

seeds = st.integers(0, 2**32 - 1)
batches = st.sampled_from(BATCHES)
angles = st.sampled_from(ANGLES) | st.floats(0.0, np.pi)


def at_most(count: int) -> settings:
    """Settings with `count` samples, or as many as the profile has if those are fewer."""
    return settings(max_examples=min(count, settings().max_examples))


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

random_platforms = st.builds(
    machines.random_platform,
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


def sample(platform: Platform, batch: tuple[int, ...] = (20,), seed: int = 0) -> Pose:
    """Poses of the workspace with batch axes `batch`."""
    flat = platform.sample_poses(int(np.prod(batch)), seed=seed)
    return Pose(flat.position.reshape(*batch, 3), flat.wxyz.reshape(*batch, 4))


def moved(pose: Pose, twist: Floats) -> Pose:
    """The pose after a small twist (velocity of the position, angular velocity), in base axes."""
    turn = Pose.from_rotation_vector(np.zeros(3), twist[..., 3:]) @ Pose(np.zeros(3), pose.wxyz)
    return Pose(pose.position + twist[..., :3], turn.wxyz)


def reading_scale(platform: Platform) -> float:
    """Scale of rounding errors of a reading: the size, or 1 rad for rotary legs."""
    return 1.0 if platform.legs == "rotary" else platform.size


def unitless(platform: Platform, J: Floats) -> Floats:
    """The Jacobian with readings and shifts counted in platform sizes."""
    columns = np.array([platform.size] * 3 + [1.0] * 3)
    return J * columns / reading_scale(platform)

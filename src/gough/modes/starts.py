"""A start system for each machine: every complex pose for one set of complex readings.

From the stored 40 solutions of a generic hexapod, first the base joints move to the
machine's, then, with the roles of base and platform exchanged, the platform joints. Special
machines lose solutions to infinity on the way (28 of the 40 remain for a symmetric planar
hexapod, 16 for a 6-3); the rest are checked by loops and kept. From then on each set of
readings moves six squared lengths (rotary legs: the arms' tips too), and no path leaves.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from functools import cache
from importlib import resources
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from gough.kernel.paths import LOST
from gough.kinematics import normalised_jacobian
from gough.modes.follow import Parameters, follow
from gough.modes.frames import Frames
from gough.modes.monodromy import APART, CAREFUL, Corner, fill_up, gaussian
from gough.modes.study import Complex, distances, distinct, inverse
from gough.platform import Platform
from gough.pose import Pose

SEED = 5  # of all that is drawn here
QUIET = 3  # loops that bring nothing new before a machine's list counts as complete
SPREAD = 0.5  # of the start's complex readings about those at home
WIDE = 3.0  # the same of the corners of loops, which must go round the branch points
ROUTES = 4  # from the generic hexapod at most
FAR = 2e4  # normalised distance beyond which a solution counts as being at infinity
CACHED = 64  # machines kept in memory


@dataclass(frozen=True, eq=False)
class Start:
    """What a machine's readings are tracked from.

    Attributes:
        frames: the change to normalised coordinates.
        at: the complex readings.
        e, t: (P, 4), (P, 3) all finite complex poses for them; of each pair of mirror images
            the first only, where `paired`.
        paired: whether poses come as mirror images (planar base and platform).
        count: finite complex poses, mirror images included.
        base_moves: whether readings move the base joints too (rotary legs).
        singular: the machine is architecturally singular, and has no start.
        history: how many poses were known after each step of the search, from the 40.
    """

    frames: Frames
    at: Parameters
    e: Complex
    t: Complex
    paired: bool
    count: int
    base_moves: bool
    singular: bool
    history: tuple[int, ...]


_known: OrderedDict[tuple[str, int], Start] = OrderedDict()
_lock = Lock()


def start_of(platform: Platform, number: int = 0) -> Start:
    """The machine's start system, from memory if it was found before.

    Args:
        number: 0, or 1, 2, ... for others: the same search from other random numbers, whose
            paths to the same readings are different ones.
    """
    key = platform.digest, number
    with _lock:
        if key not in _known:
            _known[key] = find_start(platform, SEED + number)
            while len(_known) > CACHED:
                _known.popitem(last=False)
        _known.move_to_end(key)
        return _known[key]


@cache
def generic() -> tuple[Parameters, Complex, Complex]:
    """The stored hexapod with 40 solutions; made by tools/start_system.py."""
    path = resources.files("gough.modes").joinpath("start_system.npz")
    with path.open("rb") as file, np.load(file) as stored:
        at = Parameters(stored["base"], stored["moving"], stored["squares"])
        return at, stored["e"], stored["t"]


def find_start(platform: Platform, seed: int = SEED) -> Start:
    """Track the 40 generic solutions to the machine; see the module's text."""
    frames = Frames.of(platform)
    rng = np.random.default_rng(seed)
    squares, base = _family(platform, frames, SPREAD)(rng)
    at = Parameters(base, frames.moving.astype(complex), squares)
    if architecturally_singular(platform):
        none = np.zeros((0, 4), complex), np.zeros((0, 3), complex)
        return Start(frames, at, *none, False, 0, False, True, (40, 0))
    e, t, history = _from_generic(at, rng)
    corner = _family(platform, frames, WIDE)
    (e, t), loops = fill_up((e, t), at, corner, rng, QUIET)
    count = len(e)
    paired = frames.mirror is not None
    if paired:
        first = _first_of_pairs(frames, e, t)
        paired = 2 * len(first) == count
        e, t = (e[first], t[first]) if paired else (e, t)
    moves = platform.rotary is not None
    return Start(frames, at, e, t, paired, count, moves, False, (*history, *loops))


def architecturally_singular(platform: Platform) -> bool:
    """Whether the six legs are dependent at every pose, so that readings never fix a pose.

    Tried at eight random poses, at none of which other machines are singular.
    """
    rng = np.random.default_rng(SEED)
    if platform.rotary is not None:
        return False
    shift = rng.normal(size=(8, 3)) * platform.size
    pose = Pose(shift, rng.normal(size=(8, 4)))
    values = np.linalg.svd(normalised_jacobian(platform, pose), compute_uv=False)
    return bool(np.all(values[:, -1] < 1e-9 * values[:, 0]))


def _family(platform: Platform, frames: Frames, spread: float) -> Corner:
    """A function that draws complex readings of this machine, `spread` times their size apart."""
    if platform.rotary is None:
        typical = float(np.mean(frames.squares(platform.home_lengths)))
        fixed = frames.base(platform.base).astype(complex)
        return lambda rng: (typical * (1 + spread * gaussian(rng, 6)), fixed)
    arms = platform.rotary
    typical = (arms.rod_length / frames.scale) ** 2
    centre = frames.base(platform.base)
    reach = arms.arm_length[:, None]
    tips = [frames.base(platform.base + reach * a) for a in (arms.axis_x, arms.axis_y)]
    angles = (platform.gain * platform.home_legs + platform.true_at_zero)[:, None]
    cos, sin = np.cos(angles), np.sin(angles)

    def draw(rng: np.random.Generator) -> tuple[Complex, Complex]:
        # arms of complex direction and length: a linear family that holds all readings
        x, y = cos + spread * gaussian(rng, 6, 1), sin + spread * gaussian(rng, 6, 1)
        base = centre + x * (tips[0] - centre) + y * (tips[1] - centre)
        return typical * (1 + spread * gaussian(rng, 6)), base

    return draw


def _from_generic(at: Parameters, rng: np.random.Generator) -> tuple[Complex, Complex, list[int]]:
    """Finite poses at `at`, and how many were known after each route.

    A path that passes infinity at a short distance is lost on the way; then all paths take
    another route too, and the lists are put together.
    """
    e, t, history = np.zeros((0, 4), complex), np.zeros((0, 3), complex), [len(generic()[1])]
    for _ in range(ROUTES):
        more_e, more_t, lost = _one_route(at, rng)
        e, t = np.concatenate([e, more_e]), np.concatenate([t, more_t])
        kept = distinct(e, t, APART)
        e, t = e[kept], t[kept]
        history.append(len(e))
        if not lost:
            break
    return e, t, history


def _one_route(at: Parameters, rng: np.random.Generator) -> tuple[Complex, Complex, bool]:
    """Base joints to the machine's, then platform joints, each over a random point.

    Returns:
        Finite poses at `at`, and whether a path was lost on the way or met another.
    """
    here, e, t = generic()
    size = np.mean(np.abs(at.squares))
    lost = False
    for joints in (at.base, at.moving):
        detour = gaussian(rng, 6) * size, gaussian(rng, 6, 3)
        last = at.squares if joints is at.moving else gaussian(rng, 6) * size
        for squares, base in (detour, (last, joints)):
            ends = follow((e, t), here, squares[None], base[None], share=CAREFUL)
            e, t = ends.finite()
            lost = lost or bool(np.any(ends.ends == LOST)) or len(distinct(e, t, APART)) < len(e)
            here = Parameters(base, here.moving, squares)
        (e, t), here = inverse(e, t), Parameters(here.moving, here.base, here.squares)
    near = np.abs(t).max(axis=1, initial=0.0) < FAR
    return e[near], t[near], lost


def _first_of_pairs(frames: Frames, e: Complex, t: Complex) -> NDArray[np.int64]:
    """Indices of one pose of each pair of mirror images."""
    gaps = distances((e, t), frames.reflect(e, t))
    first: list[int] = []
    for i in range(len(e)):
        j = int(np.argmin(gaps[i]))
        if gaps[i, j] < APART and j > i:
            first.append(i)
    return np.array(first, dtype=np.int64)

"""A start system for each machine: every complex pose for one set of complex readings.

From the stored 40 solutions of a generic hexapod, first the base joints move to the
machine's, then, with the roles of base and platform exchanged, the platform joints. Special
machines lose solutions to infinity on the way (28 of the 40 remain for a symmetric planar
hexapod, 16 for a 6-3); the rest are checked by loops and kept. From then on each set of
readings moves six squared lengths (rotary legs: the arms' tips too), and no path leaves.
Where a path ends before the machine is reached, others take the platform joints first.

The poses of a hexapod and the squared lengths they have form one irreducible variety (a graph
over the group of motions), so closed loops in the complex squared lengths lead from any regular
solution to every other: a set that many random loops map to itself has them all. One
that a loop brings back to where it began shows nothing, and for some solutions that is every
second loop, so there are many, of many corners.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from gough.errors import GoughError
from gough.kernel.paths import FINITE, LOST, Complex, LegEquations, track_paths
from gough.kinematics import normalised_jacobian
from gough.modes.frames import Frames, distances, distinct, inverse
from gough.platform import Platform
from gough.pose import Pose

SEED = 5  # of all random numbers here
LOOPS = 12  # that bring nothing new before a machine's list counts as complete
CORNERS = 4  # of a loop, besides its start: more go round more branch points
SPREAD = 0.5  # of the start's complex readings about those at home
WIDE = 10.0  # the same of the corners of loops, which must go round the branch points
ROUTES = 4  # from the generic hexapod at most
FAR = 2e4  # normalised distance beyond which a solution counts as being at infinity
CACHED = 64  # machines kept in memory
APART = 1e-6  # of two solutions that are different, see `distances`
CAREFUL = 0.3  # share of the radius of convergence where time does not matter

Draw = Callable[[np.random.Generator], tuple[Complex, Complex]]  # squares (6,), base (6, 3)


@dataclass(frozen=True, eq=False)
class StartSystem:
    """All complex poses of a machine for one set of complex readings.

    Attributes:
        frames: the change to normalised coordinates.
        at: the leg equations for these readings.
        poses: (P, 7) all finite poses; of each pair of mirror images the first only, where
            `paired`.
        paired: poses come as mirror images (planar base and platform).
        count: number of finite complex poses, mirror images included.
        base_moves: readings move the base joints too (rotary legs).
        singular: the machine is architecturally singular, and has no start system.
        history: number of poses known after each step of the search, from the 40.
    """

    frames: Frames
    at: LegEquations
    poses: Complex
    paired: bool
    count: int
    base_moves: bool
    singular: bool
    history: tuple[int, ...]


_known: OrderedDict[tuple[str, int], StartSystem] = OrderedDict()
_lock = Lock()


def start_system(platform: Platform, number: int = 0) -> StartSystem:
    """The machine's start system, from memory if it was found before.

    Args:
        number: 0, or 1, 2, ... for others: the same search from other random numbers, whose
            paths to the same readings are different ones.
    """
    key = platform.digest, number
    with _lock:
        if key not in _known:
            _known[key] = find_start_system(platform, SEED + number)
            while len(_known) > CACHED:
                _known.popitem(last=False)
        _known.move_to_end(key)
        return _known[key]


def find_start_system(platform: Platform, seed: int = SEED) -> StartSystem:
    """Track the 40 generic solutions to the machine; see the module's text."""
    frames = Frames.of(platform)
    rng = np.random.default_rng(seed)
    squares, base = _readings_of(platform, frames, SPREAD)(rng)
    at = LegEquations(base, frames.moving.astype(complex), squares)
    if architecturally_singular(platform):
        none = np.zeros((0, 7), complex)
        return StartSystem(frames, at, none, False, 0, False, True, (40, 0))
    poses, history = _from_generic(at, rng)
    poses, loops = complete_by_loops(poses, at, _readings_of(platform, frames, WIDE), rng, LOOPS)
    count, paired = len(poses), False
    if not count:
        raise GoughError(
            f"no pose of {platform.name!r} was found from any readings: its home is far from its "
            "base or too close to a singularity to calculate with; choose another home"
        )
    if frames.mirror is not None:
        first = _first_of_pairs(frames, poses)
        paired = 2 * len(first) == count
        poses = poses[first] if paired else poses
    moves = platform.rotary is not None
    return StartSystem(frames, at, poses, paired, count, moves, False, (*history, *loops))


def architecturally_singular(platform: Platform) -> bool:
    """True if the six legs are dependent at every pose, so that readings never fix a pose.

    Tried at eight random poses, at none of which other machines are singular.
    """
    if platform.rotary is not None:
        return False
    rng = np.random.default_rng(SEED)
    pose = Pose(rng.normal(size=(8, 3)) * platform.size, rng.normal(size=(8, 4)))
    values = np.linalg.svd(normalised_jacobian(platform, pose), compute_uv=False)
    return bool(np.all(values[:, -1] < 1e-9 * values[:, 0]))


def gaussian(rng: np.random.Generator, *shape: int) -> Complex:
    """Complex normal numbers of mean square 1."""
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2)


def complete_by_loops(
    poses: Complex, at: LegEquations, draw: Draw, rng: np.random.Generator, quiet: int
) -> tuple[Complex, list[int]]:
    """All solutions that loops reach from `poses`, until `quiet` loops bring nothing new.

    A loop carries the solutions round a random polygon; those whose paths arrive are kept.

    Args:
        poses: (P, 7) solutions at `at`.
        draw: a function that draws a corner of a polygon.

    Returns:
        The solutions, and how many there were after each loop.
    """
    idle, history = 0, [len(poses)]
    while idle < quiet:
        here, moved = at, poses
        for squares, base in [*(draw(rng) for _ in range(CORNERS)), (at.squares, at.base)]:
            moved = track_paths(moved, here, squares[None], base[None], share=CAREFUL).finite()
            here = LegEquations(base, at.moving, squares)
        poses = np.concatenate([poses, moved])
        poses = poses[distinct(poses, APART)]
        idle = idle + 1 if len(poses) == history[-1] else 0
        history.append(len(poses))
    return poses, history


def _readings_of(platform: Platform, frames: Frames, spread: float) -> Draw:
    """A function that draws complex readings of this machine, `spread` times their size apart."""
    fixed = frames.base(platform.base)
    arms = platform.rotary
    if arms is None:
        typical = float(np.mean(frames.squares(platform.home_lengths)))
        return lambda rng: (typical * (1 + spread * gaussian(rng, 6)), fixed.astype(complex))
    typical = (arms.rod_length / frames.scale) ** 2
    reach = arms.arm_length[:, None]
    tips = [frames.base(platform.base + reach * a) for a in (arms.axis_x, arms.axis_y)]
    angles = (platform.gain * platform.home_legs + platform.true_at_zero)[:, None]
    cos, sin = np.cos(angles), np.sin(angles)

    def draw(rng: np.random.Generator) -> tuple[Complex, Complex]:
        # arms of complex direction and length: a linear family that holds all readings
        x, y = cos + spread * gaussian(rng, 6, 1), sin + spread * gaussian(rng, 6, 1)
        base = fixed + x * (tips[0] - fixed) + y * (tips[1] - fixed)
        return typical * (1 + spread * gaussian(rng, 6)), base

    return draw


@cache
def _generic() -> tuple[LegEquations, Complex]:
    """The stored hexapod and its 40 solutions; made by tools/start_system.py."""
    path = resources.files("gough.modes").joinpath("start_system.npz")
    with path.open("rb") as file, np.load(file) as stored:
        at = LegEquations(stored["base"], stored["moving"], stored["squares"])
        return at, np.concatenate([stored["t"], stored["e"]], axis=1)


def _from_generic(at: LegEquations, rng: np.random.Generator) -> tuple[Complex, list[int]]:
    """Finite poses at `at`, and how many were known after each route.

    A path that passes infinity at a short distance is lost on the way; then all paths take
    another route too, and the lists are put together.
    """
    poses, history = np.zeros((0, 7), complex), [len(_generic()[1])]
    for route in range(ROUTES):
        more, lost = _one_route(at, rng, platform_first=route % 2 == 1)
        poses = np.concatenate([poses, more])
        poses = poses[distinct(poses, APART)]
        history.append(len(poses))
        if not lost:
            break
    return poses, history


def _one_route(
    at: LegEquations, rng: np.random.Generator, *, platform_first: bool
) -> tuple[Complex, bool]:
    """Base joints to the machine's and platform joints, each over a random point.

    Args:
        platform_first: the platform joints move before the base joints.

    Returns:
        Finite poses at `at`, and whether a path was lost on the way or met another.
    """
    here, poses = _generic()
    size = np.mean(np.abs(at.squares))
    lost = False
    for half, exchanged in enumerate((platform_first, not platform_first)):
        if exchanged:
            poses, here = _exchanged(poses, here)
        detour = gaussian(rng, 6) * size, gaussian(rng, 6, 3)
        joints = at.moving if exchanged else at.base
        last = (at.squares if half else gaussian(rng, 6) * size), joints
        for step, (squares, base) in enumerate((detour, last)):
            ends = track_paths(poses, here, squares[None], base[None], share=CAREFUL)
            poses = ends.finite()
            arrived = half and step  # at the machine, where special ones have fewer solutions
            lost = lost or bool(np.any(ends.how == LOST if arrived else ends.how != FINITE))
            lost = lost or len(distinct(poses, APART)) < len(poses)
            here = LegEquations(base, here.moving, squares)
        if exchanged:
            poses, here = _exchanged(poses, here)
    return poses[np.abs(poses[:, :3]).max(axis=1, initial=0.0) < FAR], lost


def _exchanged(poses: Complex, at: LegEquations) -> tuple[Complex, LegEquations]:
    """The same machine with the roles of base and platform exchanged."""
    return inverse(poses), LegEquations(at.moving, at.base, at.squares)


def _first_of_pairs(frames: Frames, poses: Complex) -> NDArray[np.int64]:
    """Indices of one pose of each pair of mirror images."""
    gaps = distances(poses, frames.reflect(poses))
    other, every = np.argmin(gaps, axis=1), np.arange(len(poses))
    return every[(gaps[every, other] < APART) & (other > every)]

"""Test vectors of the exported C: readings, and the events and poses of the Python tracker."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gough.checks import Array
from gough.export.precision import Precision
from gough.fk.solve import solve
from gough.fk.tracker import Tracker
from gough.kernel.constants import SINGULAR
from gough.kinematics import jacobian, leg_lengths, singularity_distance
from gough.platform import Platform
from gough.pose import Pose
from gough.workspace import Workspace

POSES = 12  # solved one by one
CYCLES = 48  # of a control loop
GONE, SPIKE, MOVED = 12, 24, 36  # cycles without a reading, with a wrong one, after a lasting jump
SMALL = 0.01  # share of the size, and [rad]: how far a guess is from the pose


def lines(platform: Platform, precision: Precision) -> dict[str, str]:
    """Text for the marked places of `hexapod_test.c`."""
    shift, turn = 0.005 * platform.size, 0.02
    poses, path = _poses(platform), _path(platform)
    cycles = _tracked(platform, path, shift, turn, precision)
    solved = _solved(platform, poses, precision)
    return {
        "pose_count": str(len(solved)),
        "cycle_count": str(len(cycles)),
        "pose_rows": ",\n".join(f"    {row}" for row in solved),
        "cycle_rows": ",\n".join(f"    {row}" for row in cycles),
        "max_shift": precision.literal(shift),
        "max_turn": precision.literal(turn),
        "size_double": repr(platform.size),
        "allowed": repr(_allowed(platform, [poses, path], precision)),
        "reading_unit": "1" if platform.rotary else "SIZE",
    }


def _box(platform: Platform) -> Workspace:
    """Half the workspace; a small box about home where none is stated."""
    if platform.workspace is None:
        return Workspace.about_home(0.02 * platform.size, 2.0)
    box = platform.workspace
    return Workspace(0.5 * box.translation, 0.5 * box.rotation_deg)


def _reached(platform: Platform, pose: Pose) -> Pose:
    """The poses that all legs reach."""
    return pose[np.all(np.isfinite(leg_lengths(platform, pose)), axis=-1)]


def _poses(platform: Platform) -> Pose:
    return _reached(platform, _box(platform).sample(platform.home, 4 * POSES, seed=3))[:POSES]


def _path(platform: Platform) -> Pose:
    """A smooth path about home, with a jump near its end (see `MOVED`)."""
    box = _box(platform)
    bounds = np.concatenate([box.translation, np.radians(box.rotation_deg)])
    middle, half = bounds.mean(axis=1), (bounds[:, 1] - bounds[:, 0]) / 2
    phase = np.linspace(0, 0.3, CYCLES)[:, None] + np.arange(6)
    x = middle + 0.3 * half * np.sin(phase)
    x[MOVED:] -= 1.2 * half * np.sin(phase[MOVED:])
    about_home = Pose.from_euler(np.zeros(3), x[:, 3:])
    wxyz = (Pose(np.zeros(3), platform.home.wxyz) @ about_home).wxyz
    return _reached(platform, Pose(platform.home.position + x[:, :3], wxyz))


def _tracked(
    platform: Platform, path: Pose, shift: float, turn: float, precision: Precision
) -> list[str]:
    """Initialisers of readings, event, status and pose of each cycle."""
    legs = precision.rounded(leg_lengths(platform, path))
    legs[GONE] = np.nan
    legs[SPIKE] = legs[-1]
    tracker = Tracker(platform, max_shift=shift, max_turn=turn)
    rows = []
    for reading in legs:
        pose = tracker.update(reading)
        words = [numbers(reading, precision), str(int(tracker.event)), str(int(tracker.status))]
        rows.append(braces([*words, pose_text(pose, precision)]))
    return rows


def _solved(platform: Platform, poses: Pose, precision: Precision) -> list[str]:
    """Initialisers of readings, status, guess, pose, leg rates, and the twist that causes them."""
    legs = precision.rounded(leg_lengths(platform, poses))
    rng = np.random.default_rng(5)
    aside = SMALL * rng.uniform(-1, 1, (len(poses), 6))
    turn = Pose.from_rotation_vector(np.zeros(3), aside[:, 3:])
    turned = turn @ Pose(np.zeros(3), poses.wxyz)
    guess = Pose(poses.position + platform.size * aside[:, :3], turned.wxyz)
    found = solve(platform, legs, seed=guess)
    twist = rng.uniform(-1, 1, (len(poses), 6)) * np.repeat([platform.size, 1.0], 3)
    rates = (jacobian(platform, found.pose) @ twist[..., None])[..., 0]
    return [
        braces([
            numbers(legs[i], precision), str(int(found.status[i])),
            pose_text(guess[i], precision), pose_text(found.pose[i], precision),
            numbers(rates[i], precision), numbers(twist[i], precision),
        ])
        for i in range(len(poses))
    ]  # fmt: skip


def _allowed(platform: Platform, paths: list[Pose], precision: Precision) -> float:
    """Largest pose error that rounding explains, as a share of the size and in radians."""
    nearest = min(float(np.min(singularity_distance(platform, pose))) for pose in paths)
    return max(precision.rounding / max(nearest, SINGULAR), precision.pose_error)


def pose_text(pose: Pose, precision: Precision) -> str:
    """A pose as an initialiser."""
    return braces([numbers(pose.position, precision), numbers(pose.wxyz, precision)])


def numbers(values: Array, precision: Precision) -> str:
    """Numbers (n,) as an initialiser."""
    return braces(precision.literal(float(value)) for value in values)


def braces(parts: Iterable[str]) -> str:
    """Initialisers as one."""
    return "{" + ", ".join(parts) + "}"

"""Home's assembly mode: which poses are in it, and the status of a pose.

A pose counts as in home's mode if det J has home's sign at points all along the straight way to it
from home, on which the centre of the platform joints moves in a line and the platform rotates about
one axis. That asks more than the sign at the pose alone, which other modes may share, and is no
proof: the points are a step apart, and where the straight way crosses singularities a way round may
not. Inside the stated workspace, where the machine is meant to go, the sign at the pose decides.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from gough import quaternion
from gough.checks import Array
from gough.kinematics import assembly_sign, home_sign, joint_positions
from gough.limit_rules import SLACK, in_stroke, in_workspace
from gough.platform import Platform
from gough.pose import Pose
from gough.status import InverseStatus
from gough.workspace import Workspace

# Points of a way are at most this far apart, as long as there are at most MOST_POINTS of them.
TRANSLATION_STEP = 0.02  # share of the platform's size
ROTATION_STEP = 0.05  # [rad]
MOST_POINTS = 64
SAME_TIP = 1e-6  # share of the size within which two places of a motor arm's tip are the same
# Half widths of the boxes that may be the sure workspace: shares of the size, and [deg].
SURE_WIDTHS = (0.2, 0.15, 0.1, 0.06, 0.03, 0.01, 0.003)
SURE_ANGLES = (40.0, 30.0, 20.0, 10.0, 5.0, 2.0, 0.5)
SAMPLED = 1_000  # poses of it that are looked at, beside its corners


def in_home_mode(platform: Platform, pose: Pose) -> NDArray[np.bool_]:
    """Return which poses (...) are in the assembly mode of home, as far as is known.

    In the stated workspace, or else in `sure_workspace`, those with home's sign of det J;
    elsewhere those that are `reached_from` home. All of them where home is singular.
    """
    flat = _flat(pose)
    ours = assembly_sign(platform, flat) >= 0
    box = platform.workspace or sure_workspace(platform)
    if box is not None:
        inside = box.contains(platform.home, flat, SLACK * platform.size, SLACK)
        beyond = np.flatnonzero(ours & ~inside)
        ours[beyond] = reached_from(platform, platform.home, flat[beyond])
    return ours.reshape(pose.batch)


def reached_from(platform: Platform, start: Pose, pose: Pose) -> NDArray[np.bool_]:
    """Return for which poses (N,) det J has home's sign all along the way from `start`.

    False where a motor cannot reach a point of the way.
    """
    centre = platform.moving.mean(axis=0) - platform.pivot_point
    first, last = (joint_positions(platform, p).mean(axis=-2) for p in (start, pose))
    along = np.sum(start.wxyz * pose.wxyz, axis=-1)
    wxyz = np.where(along < 0, -1.0, 1.0)[:, None] * pose.wxyz
    shift = np.linalg.norm(last - first, axis=-1) / (TRANSLATION_STEP * platform.size)
    turn = 2 * np.linalg.norm(wxyz - start.wxyz, axis=-1) / ROTATION_STEP  # a chord, for the angle
    count = np.minimum(np.floor(np.sqrt(1 + shift**2 + turn**2)), MOST_POINTS)
    good = np.isfinite(count)
    for n in range(1, MOST_POINTS + 1):
        rows = np.flatnonzero(good & (count >= n))
        if not len(rows):
            break
        t = (n / count[rows])[:, None]
        turned = (1 - t) * start.wxyz + t * wxyz[rows]
        turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
        lever = (quaternion.to_matrix(turned) @ centre[:, None])[..., 0]
        position = (1 - t) * first + t * last[rows] - platform.pivot_point - lever
        good[rows] = assembly_sign(platform, Pose.trusted(position, turned)) >= 0
    return good


@lru_cache(maxsize=256)
def sure_workspace(platform: Platform) -> Workspace | None:
    """Return a large box about home without any pose found on the other side of a singularity.

    It serves machines that state no workspace: poses in it need no closer look. None where home
    is singular, and every pose may be the machine's.
    """
    if not home_sign(platform):
        return None
    sizes = sorted(product(SURE_WIDTHS, SURE_ANGLES), key=lambda size: -size[0] * size[1])
    for share, angle in sizes:
        box = Workspace.about_home(share * platform.size, angle)
        if not any(np.any(assembly_sign(platform, pose) < 0) for pose in _poses_of(platform, box)):
            return box
    return Workspace.about_home(0.0, 0.0)


def _poses_of(platform: Platform, box: Workspace) -> Iterator[Pose]:
    """The corners of a box about home, then poses in it."""
    corners = np.array(list(product((0, 1), repeat=6)))
    turn = quaternion.from_euler(np.radians(box.rotation_deg[range(3), corners[:, 3:]]))
    shift = box.translation[range(3), corners[:, :3]]
    yield Pose.trusted(
        platform.home.position + shift, quaternion.product(platform.home.wxyz[None], turn)
    )
    yield box.sample(platform.home, SAMPLED, seed=0)


def pose_status(platform: Platform, pose: Pose, legs: Array) -> NDArray[np.uint8]:
    """Return the `InverseStatus` (N,) of poses (N,) whose readings are legs (N, 6).

    Where several apply, the most serious stands, as `gough.solve` has it: outside the workspace,
    outside the stroke, another assembly mode, no readings, no pose.
    """
    status = np.full(pose.batch, InverseStatus.OK, np.uint8)
    status[~in_workspace(platform, pose)] = InverseStatus.OUTSIDE_WORKSPACE
    status[~in_stroke(platform, legs)] = InverseStatus.OUTSIDE_STROKE
    with np.errstate(over="ignore", invalid="ignore"):  # poses far beyond reach
        status[~in_home_mode(platform, pose)] = InverseStatus.OTHER_MODE
    status[~np.all(np.isfinite(legs), axis=-1)] = InverseStatus.UNREACHABLE
    status[np.isnan(pose.position[..., 0])] = InverseStatus.INVALID_INPUT
    return status


def _flat(pose: Pose) -> Pose:
    return Pose.trusted(pose.position.reshape(-1, 3), pose.wxyz.reshape(-1, 4))

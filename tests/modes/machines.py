"""Platforms and poses that several tests use."""

from __future__ import annotations

import numpy as np

import gough

TELESCOPIC = ("dietmaier", "linuxcnc_genhex", "matlab_stewart", "nasa_msfc", "reference")
ALL = (*TELESCOPIC, "reachy_mini", "rubin_camera", "rubin_simulink")


def poses_of(platform: gough.Platform, count: int, seed: int = 1) -> gough.Pose:
    """Poses from the workspace, or near home where none is stated, whose legs exist."""
    if platform.workspace is not None:
        pose = platform.sample_poses(count, seed)
    else:
        rng = np.random.default_rng(seed)
        shift = rng.normal(size=(count, 3)) * platform.size * 0.05
        turn = rng.normal(size=(count, 4)) * 0.1
        pose = gough.Pose(platform.home.position + shift, platform.home.wxyz + turn)
    return pose[np.all(np.isfinite(gough.leg_lengths(platform, pose)), axis=1)]


def random_platform(seed: int, base=range(6), moving=range(6), planar=False) -> gough.Platform:
    """Joints at random; equal indices share a joint."""
    rng = np.random.default_rng(seed)
    joints = [rng.normal(size=(6, 3)) for _ in range(2)]
    if planar:
        for points in joints:
            points[:, 2] = 0.0
    return gough.Platform(joints[0][list(base)], joints[1][list(moving)], home=(0.1, 0.2, 2.0))


def griffis_duffy() -> gough.Platform:
    """Type I: equilateral triangles, vertices joined to midpoints of edges and back."""

    def triangle(radius: float) -> np.ndarray:
        angles = np.radians([90.0, 210.0, 330.0])
        return radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)

    large, small = triangle(2.0), triangle(1.0)
    base, moving = [], []
    for k in range(3):
        n = (k + 1) % 3
        base += [large[k], (large[k] + large[n]) / 2]
        moving += [(small[k] + small[n]) / 2, small[n]]
    return gough.Platform(np.array(base), np.array(moving), home=(0, 0, 1.5))


def found(modes: gough.AssemblyModes, truth: gough.Pose, share: float = 1e-7) -> np.ndarray:
    """Which of the true poses (N,) are among the modes of their readings."""
    shift, turn = modes.pose.distance(truth[modes.row])
    close = (shift < share * modes.platform.size) & (turn < share)
    return np.bincount(modes.row[close], minlength=len(truth)) > 0

"""Platforms and poses that several tests use."""

from __future__ import annotations

import numpy as np

import gough


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


def found(modes: gough.AssemblyModes, truth: gough.Pose, share: float = 1e-7) -> np.ndarray:
    """Which of the true poses (N,) are among the modes of their readings."""
    shift, turn = modes.pose.distance(truth[modes.row])
    close = (shift < share * modes.platform.size) & (turn < share)
    return np.bincount(modes.row[close], minlength=len(truth)) > 0

"""Readings of a machine on its way, with and without faults."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gough import Event, Platform, Pose, Tracker, leg_lengths

Floats = NDArray[np.float64]


def path(platform: Platform, count: int, seed: int, cycles: float = 2000.0) -> Pose:
    """A smooth path through the workspace, batch (count,); one coordinate's period in cycles."""
    assert platform.workspace is not None
    rng = np.random.default_rng(seed)
    box = np.concatenate(
        [platform.workspace.translation, np.radians(platform.workspace.rotation_deg)]
    )
    middle, half = box.mean(axis=1), (box[:, 1] - box[:, 0]) / 2
    rates = 2 * np.pi / cycles * rng.uniform(0.5, 2.0, (6, 3))
    waves = np.sin(np.arange(count)[:, None, None] * rates + rng.uniform(0, 2 * np.pi, (6, 3)))
    x = middle + 0.95 * half * waves.mean(axis=-1)
    about_home = Pose.from_euler(np.zeros(3), x[:, 3:])
    turned = Pose(np.zeros(3), platform.home.wxyz) @ about_home
    return Pose(platform.home.position + x[:, :3], turned.wxyz)


def faulty(platform: Platform, pose: Pose, seed: int) -> tuple[Floats, NDArray[np.bool_]]:
    """Readings (N, 6) of poses (N,) with faults of every kind, and which rows (N,) have one.

    Rows after the machine has jumped elsewhere are good ones again.
    """
    clean = leg_lengths(platform, pose)
    rng, legs, count = np.random.default_rng(seed), clean.copy(), len(clean)
    span = float(np.ptp(clean, axis=0).max())
    legs[rng.random(count) < 0.004] = np.nan  # dropouts
    spikes = np.flatnonzero(rng.random(count) < 0.008)
    legs[spikes, rng.integers(0, 6, len(spikes))] += span * rng.uniform(-1, 1, len(spikes))
    for start in rng.integers(0, count, count // 3000):  # a sensor that is stuck for a while
        legs[start : start + 40, rng.integers(6)] = legs[start, rng.integers(6)]
    for start in rng.integers(0, count, count // 10_000):  # two legs exchanged for a while
        a, b = rng.permutation(6)[:2]
        legs[start : start + 20, [a, b]] = legs[start : start + 20, [b, a]]
    bad = np.any(legs != clean, axis=-1)
    for start in rng.integers(0, count, count // 6000):  # the machine is elsewhere for good
        part = slice(start, start + 1500)
        legs[part] = np.roll(clean, count // 2, axis=0)[part]
        bad[part] = False
    return legs, bad


def tracked(tracker: Tracker, legs: Floats) -> tuple[Pose, NDArray[np.int32], NDArray[np.int32]]:
    """Poses, events and statuses of the Python tracker's cycles."""
    count = len(legs)
    position, wxyz = np.empty((count, 3)), np.empty((count, 4))
    events, statuses = np.empty(count, np.int32), np.empty(count, np.int32)
    for i, reading in enumerate(legs):
        pose = tracker.update(reading)
        position[i], wxyz[i] = pose.position, pose.wxyz
        events[i], statuses[i] = tracker.event, tracker.status
    return Pose.trusted(position, wxyz), events, statuses


def taken(events: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Cycles whose pose is new."""
    return events <= Event.FOUND

"""Fine-tune the universal network for one platform and its workspace.

The network goes on learning from poses of the platform's workspace alone. The result is a run's
folder as any other: `--seed runs/mine`, for this platform only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import numpy as np
import torch

from gough.errors import GoughError
from gough.kinematics import assembly_sign, leg_lengths
from gough.learn.config import OptimiserConfig
from gough.learn.universal.export import load
from gough.learn.universal.machines import Machines, Poses
from gough.learn.universal.network import Universal
from gough.learn.universal.train import ONE_CORE, Trainer, UniversalConfig, prepare
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.taylor import HomeStruts

SHIPPED = "universal"
ROWS, ROTARY_ROWS = 2048, 256  # per step; each row of a rotary platform is a machine of its own
RECIPE = OptimiserConfig(lr=2e-3, warmup=20, hold=0.1)


@dataclass(frozen=True)
class PlatformPoses:
    """Poses of one platform's workspace that are reached without crossing a singularity."""

    platform: Platform
    seed: int
    rows: int

    def batch(self, key: int) -> tuple[Machines, Poses]:
        """Poses of a step as displacements of the platform joints' centre."""
        platform = self.platform
        pose = platform.sample_poses(self.rows, (self.seed * 2**32 + key) % 2**63)
        legs = leg_lengths(platform, pose)
        good = np.isfinite(legs).all(-1) & (assembly_sign(platform, pose) > 0)
        if not good.any():
            raise GoughError(
                "workspace: hardly any of its poses can be reached without crossing a "
                "singularity; state a smaller one"
            )
        pose, home = pose[good], HomeStruts.of(platform, legs[good])
        rotation = pose.rotation @ platform.home.rotation.T
        translation = self._centre(pose) - self._centre(platform.home)
        shape = home.change[:, 0].shape  # (M, N)
        t = torch.tensor(translation / platform.size).view(*shape, 3)
        R = torch.tensor(rotation).view(*shape, 3, 3)
        machines = Machines(*(torch.tensor(v) for v in (home.base, home.joints, home.inverse)))
        ones = torch.ones(shape, dtype=torch.float64)
        return machines, Poses(t, R, torch.tensor(home.change), ones > 0, ones)

    def _centre(self, pose: Pose) -> np.ndarray:
        """The platform joints' centre (..., 3)."""
        pivot = self.platform.pivot_point
        return pose.apply(self.platform.moving.mean(axis=0) - pivot) + pivot


def finetune(platform: Platform, folder: Path, start: str = SHIPPED, *, resume: bool = False,
             budget: str | None = None, seed: int = 0) -> Path:  # fmt: skip
    """Fine-tune the universal network, or a run of it, for a platform; the run's folder.

    Args:
        start: "universal", the one that comes with gough, or a run's folder.
        budget: processor time, such as 60s; one minute unless given.

    Raises:
        GoughError: the folder holds a run already, or none to resume; no such network to start.
        PlatformError: the platform states no workspace.
    """
    model, facts = _start(start)
    rows = ROWS if platform.rotary is None else ROTARY_ROWS
    run = replace(ONE_CORE, budget="60s", seed=seed, log_every=5.0)
    config = UniversalConfig(
        network=facts["network"], machines=1, rows=rows, floor=1e-6, optimiser=RECIPE, run=run
    )
    samples = PlatformPoses(platform, seed, rows)
    samples.batch(-1)
    config = prepare(folder, config, resume, budget)
    platform.save(folder / "platform.toml")
    Trainer(config, folder, samples, model).fit()
    return folder


def _start(name: str) -> tuple[Universal, dict]:
    if name != SHIPPED:
        return load(Path(name))
    file = resources.files("gough").joinpath("weights", "universal.safetensors")
    with resources.as_file(file) as path:
        return load(path)

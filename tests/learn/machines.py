"""Platforms and networks that the tests of `gough.learn` share."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import torch

from gough import Platform, Workspace
from gough.learn.config import DataConfig, ModelConfig, OptimiserConfig, RunConfig, TrainConfig
from gough.learn.models import Scaling, build


def reference() -> Platform:
    return Platform.load("reference")


def with_some_workspace(platform: Platform) -> Platform:
    """Itself, or with a small workspace if it states none."""
    return platform if platform.workspace else platform.with_workspace(0.02 * platform.size, 5)


def random_platform(rng: np.random.Generator) -> Platform:
    """Twelve joints near two hexagons, no symmetry."""
    turn = np.arange(6) * np.pi / 3 + rng.uniform(-0.3, 0.3, (2, 6))
    circles = np.stack([np.cos(turn), np.sin(turn), rng.uniform(-0.1, 0.1, (2, 6))], axis=-1)
    return Platform(
        400 * circles[0], 200 * circles[1], home=(0, 0, 500), unit="mm",
        workspace=Workspace.about_home(30, 10),
    )  # fmt: skip


def network(kind: str, platform: Platform, seed: int = 0, **options) -> Any:
    """Of random weights, in float64, all of them different from their special starts."""
    torch.manual_seed(seed)
    model = build(kind, platform, Scaling.of(platform), **options).double()
    with torch.no_grad():
        for p in model.parameters():
            p.add_(0.1 * torch.randn_like(p))
    return model.eval()


def tiny(steps: int = 20, **run) -> TrainConfig:
    """A run of a second."""
    return TrainConfig(
        model=ModelConfig("resmlp", {"width": 16, "depth": 2}),
        data=DataConfig(batch=64, test=100),
        optimiser=OptimiserConfig(lr=2e-2, warmup=5),
        run=RunConfig(steps=steps, threads=1, device="cpu", **run),
    )


def with_model(config: TrainConfig, kind, **options: int) -> TrainConfig:
    return replace(config, model=ModelConfig(kind, options))

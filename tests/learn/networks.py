"""Platforms and networks that the tests of `gough.learn` share."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import torch

from gough import Platform
from gough.learn.config import DataConfig, ModelConfig, OptimiserConfig, RunConfig, TrainConfig
from gough.learn.models import Scaling, build


def reference() -> Platform:
    return Platform.load("reference")


def gradients(model: Any, value: torch.Tensor) -> dict[str, torch.Tensor]:
    """Derivatives of a number by the parameters that it depends on."""
    model.zero_grad()
    value.backward()
    return {n: p.grad.clone() for n, p in model.named_parameters() if p.grad is not None}


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

"""First-guess networks by name."""

from __future__ import annotations

from gough.errors import GoughError
from gough.learn.models.base import PoseNetwork, Scaling
from gough.learn.models.disgnet import DisGNet
from gough.learn.models.disgnet_linear import LinearDisGNet
from gough.learn.models.graph import GCN, GraphMLP
from gough.learn.models.mlp import PlainMLP, ResMLP, WiseMLP
from gough.platform import Platform

MODELS: dict[str, type[PoseNetwork]] = {
    model.kind: model
    for model in (ResMLP, DisGNet, LinearDisGNet, PlainMLP, WiseMLP, GCN, GraphMLP)
}

__all__ = ["MODELS", "PoseNetwork", "Scaling", "build"]


def build(kind: str, platform: Platform, scaling: Scaling, **options: object) -> PoseNetwork:
    """Create a network by name, with its own options.

    Raises:
        GoughError: no such network, or an option it does not have.
    """
    if kind not in MODELS:
        raise GoughError(f"no network is called {kind!r}; there are: {', '.join(MODELS)}")
    try:
        return MODELS[kind](platform, scaling, **options)  # pyright: ignore[reportCallIssue]
    except TypeError as error:
        raise GoughError(f"network {kind!r}: {error}") from None

"""First-guess networks by name."""

from __future__ import annotations

from gough.errors import GoughError
from gough.learn.models.base import PoseNetwork, Scaling
from gough.learn.models.disgnet import DisGNet
from gough.learn.models.gcn import GCN
from gough.learn.models.graphmlp import GraphMLP
from gough.learn.models.plain_mlp import PlainMLP
from gough.learn.models.resmlp import ResMLP
from gough.learn.models.wise_mlp import WiseMLP
from gough.platform import Platform

MODELS: dict[str, type[PoseNetwork]] = {
    model.kind: model for model in (ResMLP, DisGNet, PlainMLP, WiseMLP, GCN, GraphMLP)
}

__all__ = ["MODELS", "PoseNetwork", "Scaling", "build"]


def build(kind: str, platform: Platform, scaling: Scaling, **options: object) -> PoseNetwork:
    """A network by name, with its own options.

    Raises:
        GoughError: no such network, or an option it does not have.
    """
    if kind not in MODELS:
        raise GoughError(f"no network is called {kind!r}; there are: {', '.join(MODELS)}")
    try:
        return MODELS[kind](platform, scaling, **options)  # pyright: ignore[reportCallIssue]
    except TypeError as error:
        raise GoughError(f"network {kind!r}: {error}") from None

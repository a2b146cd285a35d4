"""Learned first guesses, and kinematics in PyTorch: data, networks, training, gradients.

`gough.learn.solve` and `gough.learn.leg_lengths` are differentiable; they load PyTorch when first
used. `gough.learn.batched_newton` is the module of the DisGNet paper's second stage.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

_HOMES = {
    "TorchSolution": "gough.learn.differentiable",
    "leg_lengths": "gough.learn.differentiable",
    "solve": "gough.learn.differentiable",
}

__all__ = ["TorchSolution", "leg_lengths", "solve"]

if TYPE_CHECKING:
    from gough.learn.differentiable import TorchSolution, leg_lengths, solve


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'gough.learn' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

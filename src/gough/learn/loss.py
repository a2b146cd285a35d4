"""What training makes small."""

from __future__ import annotations

import torch
from torch import Tensor

from gough.learn.models.base import PoseNetwork
from gough.learn.sampling import Batch
from gough.platform import Platform

BETA_OF_SIZE = 0.3


def pose_loss(shift: Tensor, turn: Tensor, wanted: Batch, beta: float) -> Tensor:
    """Mean of |t - t*| + beta |R - R*|_F over the batch, a number [platform unit].

    Args:
        shift: (N, 3) [platform unit].
        turn: (N, 3, 3).
        beta: weight of the rotation [platform unit]; the paper's is 250 mm.
    """
    away = torch.linalg.vector_norm(shift - wanted.shift, dim=-1)
    turned = torch.linalg.vector_norm((turn - wanted.turn).flatten(1), dim=-1)
    return (away + beta * turned).mean()


def euler_loss(model: PoseNetwork, raw: Tensor, wanted: Batch) -> Tensor:
    """Mean squared error of six scaled numbers: what plain-MLP is trained with."""
    shift = (wanted.shift - model.shift_mean) / model.shift_scale
    angles = matrix_to_euler(wanted.turn) / model.turn_scale
    return (raw - torch.cat([shift, angles], dim=-1)).square().mean()


def training_loss(model: PoseNetwork, legs: Tensor, wanted: Batch, beta: float) -> Tensor:
    """The loss that belongs to the model's kind of output."""
    raw = model.raw(legs)
    if model.rotation == "euler":
        return euler_loss(model, raw, wanted)
    return pose_loss(*model.decode(raw), wanted, beta)


def default_beta(platform: Platform) -> float:
    """Weight of the rotation where none is given: 0.3 of the platform's size [unit].

    About the distance of the joints from the pivot's axis, so that both terms of the loss
    measure how far joints are off; 240 mm for the reference platform, where the paper has 250.
    """
    return BETA_OF_SIZE * platform.size


def matrix_to_euler(turn: Tensor) -> Tensor:
    """Euler angles (..., 3) [rad], R = Rx(a) Ry(b) Rz(c), of matrices (..., 3, 3)."""
    a = torch.atan2(-turn[..., 1, 2], turn[..., 2, 2])
    b = torch.asin(turn[..., 0, 2].clamp(-1, 1))
    c = torch.atan2(-turn[..., 0, 1], turn[..., 0, 0])
    return torch.stack([a, b, c], dim=-1)

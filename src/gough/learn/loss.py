"""Training losses: the paper's (equations 13 to 15), and that of its baseline plain-MLP."""

from __future__ import annotations

import torch
from torch import Tensor

from gough.learn.kinematics import matrix_to_euler
from gough.learn.models.base import PoseNetwork
from gough.learn.sampling import Batch
from gough.platform import Platform

BETA_OF_SIZE = 0.3


def pose_loss(translation: Tensor, rotation: Tensor, wanted: Batch, beta: float) -> Tensor:
    """Mean of |t - t*| + beta |R - R*|_F over a batch, a number [platform unit].

    Equations 13 to 15 of Zhu et al., DisGNet.

    Args:
        translation: (N, 3) [platform unit].
        rotation: (N, 3, 3).
        wanted: true poses.
        beta: weight of the rotation [platform unit]; the paper's is 250 mm.
    """
    length = torch.linalg.vector_norm(translation - wanted.translation, dim=-1)
    angle = torch.linalg.vector_norm((rotation - wanted.rotation).flatten(1), dim=-1)
    return (length + beta * angle).mean()


def euler_loss(model: PoseNetwork, raw: Tensor, wanted: Batch) -> Tensor:
    """Mean squared error of the six scaled numbers that plain-MLP gives (N, 6)."""
    translation = (wanted.translation - model.shift_mean) / model.shift_scale
    angles = matrix_to_euler(wanted.rotation) / model.turn_scale
    return (raw - torch.cat([translation, angles], dim=-1)).square().mean()


def training_loss(model: PoseNetwork, legs: Tensor, wanted: Batch, beta: float) -> Tensor:
    """The loss of a network's kind, for readings (N, 6): `euler_loss` or `pose_loss`."""
    raw = model.raw(legs)
    if model.rotation == "euler":
        return euler_loss(model, raw, wanted)
    return pose_loss(*model.decode(raw), wanted, beta)


def default_beta(platform: Platform) -> float:
    """Weight of the rotation unless one is given: 0.3 of the platform's size [platform unit].

    This is about the distance of the joints from the pivot's axis, so that both terms of the loss
    measure displacements of joints; 240 mm for the reference platform, where the paper has 250.
    """
    return BETA_OF_SIZE * platform.size

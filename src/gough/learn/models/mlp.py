"""Multilayer perceptrons: this package's resmlp, and the paper's plain-MLP and wise-MLP."""

from __future__ import annotations

from torch import Tensor, nn

from gough.learn.models.base import PoseNetwork, Scaling
from gough.learn.models.layers import dense_stack
from gough.platform import Platform


class ResMLP(PoseNetwork):
    """Plain residual network 6 -> width -> ... -> 7, SiLU: the most accurate found here.

    It has no normalisation: layer normalisation divides by a quantity that depends on all features;
    for a function as smooth as this one, learned from unlimited data with a second-order optimiser,
    that costs accuracy and time. The rotation is a quaternion: its box of Euler angles has no hole,
    so a continuous choice of sign exists, and the loss does not see the sign.

    Args:
        platform: the machine.
        scaling: its scales.
        width: features per layer.
        depth: residual layers after the first.
    """

    kind = "resmlp"
    rotation = "quaternion"

    def __init__(
        self, platform: Platform, scaling: Scaling, *, width: int = 128, depth: int = 7
    ) -> None:
        super().__init__(platform, scaling)
        self.body = dense_stack(6, width, depth + 1, norm=False)
        self.last = nn.Linear(width, self.outputs)
        self.start_near_home(self.last)

    def network(self, x: Tensor) -> Tensor:
        return self.last(self.body(x))


class PlainMLP(PoseNetwork):
    """The paper's first baseline: 6 -> 6, Euler angles, batch norm, GELU, no residuals.

    It is trained with the mean squared error of its six numbers.
    """

    kind = "plain-mlp"
    rotation = "euler"

    def __init__(
        self, platform: Platform, scaling: Scaling, *, width: int = 176, depth: int = 4
    ) -> None:
        super().__init__(platform, scaling)
        layers: list[nn.Module] = []
        for inputs in [6] + [width] * depth:
            layers += [nn.Linear(inputs, width), nn.BatchNorm1d(width), nn.GELU()]
        self.body = nn.Sequential(*layers)
        self.last = nn.Linear(width, self.outputs)
        self.start_near_home(self.last)

    def network(self, x: Tensor) -> Tensor:
        return self.last(self.body(x))


class WiseMLP(PoseNetwork):
    """The paper's second baseline: 6 -> SE(3), residual, layer norm, 9D-SVD, weighted loss."""

    kind = "wise-mlp"
    rotation = "nine"

    def __init__(
        self, platform: Platform, scaling: Scaling, *, width: int = 128, depth: int = 7
    ) -> None:
        super().__init__(platform, scaling)
        self.body = nn.Sequential(dense_stack(6, width, depth + 1), nn.LayerNorm(width))
        self.last = nn.Linear(width, self.outputs)
        self.start_near_home(self.last)

    def network(self, x: Tensor) -> Tensor:
        return self.last(self.body(x))

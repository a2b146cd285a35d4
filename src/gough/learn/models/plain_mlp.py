"""plain-MLP, the paper's first baseline: 6 -> 6, Euler angles, batch norm, GELU, MSE."""

from __future__ import annotations

from torch import Tensor, nn

from gough.learn.models.base import PoseNetwork, Scaling
from gough.platform import Platform


class PlainMLP(PoseNetwork):
    """No residual connections; trained with the mean squared error of its six numbers."""

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

"""wise-MLP, the paper's second baseline: 6 -> SE(3), residual, layer norm, 9D-SVD."""

from __future__ import annotations

from torch import Tensor, nn

from gough.learn.models.base import PoseNetwork, Scaling
from gough.learn.models.layers import dense_stack
from gough.platform import Platform


class WiseMLP(PoseNetwork):
    """A residual MLP with layer normalisation and the weighted loss."""

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

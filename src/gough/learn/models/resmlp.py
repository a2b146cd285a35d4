"""A plain residual network, smooth and without normalisation: the most accurate found here.

Layer normalisation divides by a quantity that depends on all features; for a function as
smooth as this one, learned from unlimited data with a second-order optimiser, that costs
accuracy and time. The rotation is a quaternion: its box of Euler angles has no hole, so a
continuous choice of sign exists, and the loss does not see the sign.
"""

from __future__ import annotations

from torch import Tensor, nn

from gough.learn.models.base import PoseNetwork, Scaling
from gough.learn.models.layers import dense_stack
from gough.platform import Platform


class ResMLP(PoseNetwork):
    """6 -> width -> ... -> 7, SiLU, residual.

    Args:
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

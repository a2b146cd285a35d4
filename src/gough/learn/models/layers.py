"""Layers of the networks."""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import Tensor, nn


class Dense(nn.Module):
    """act(W norm(x) + b), plus x where input and output have the same width.

    Args:
        inputs: width of x.
        outputs: width of the result.
        norm: normalise x, where both widths are the same.
        residual: add x, where both widths are the same.
    """

    def __init__(self, inputs: int, outputs: int, *, norm: bool = True,
                 residual: bool = True) -> None:  # fmt: skip
        super().__init__()
        same = inputs == outputs
        self.residual = residual and same
        self.norm = nn.LayerNorm(inputs) if norm and same else nn.Identity()
        self.linear = nn.Linear(inputs, outputs)

    def forward(self, x: Tensor) -> Tensor:
        y = nn.functional.silu(self.linear(self.norm(x)))
        return x + y if self.residual else y


def dense_stack(inputs: int, width: int, layers: int, *, norm: bool = True) -> nn.Sequential:
    """Stack `layers` dense layers: from `inputs` features to `width`, then at that width."""
    sizes = [inputs] + [width] * layers
    return nn.Sequential(*(Dense(a, b, norm=norm) for a, b in pairwise(sizes)))


class RadialBasis(nn.Module):
    """Gaussian features of distances, with evenly spaced centres: (...) to (..., count).

    Args:
        count: number of Gaussians.
        largest: distance of the last centre; the first is 0.
    """

    centres: Tensor

    def __init__(self, count: int, largest: float = 1.05) -> None:
        super().__init__()
        centres = torch.linspace(0, largest, count, dtype=torch.float64)
        self.register_buffer("centres", centres, persistent=False)
        self.width = 1.5 * largest / (count - 1)  # smooth enough for short series

    def forward(self, distance: Tensor) -> Tensor:
        offset = (distance[..., None] - self.centres.to(distance.dtype)) / self.width
        return torch.exp(-offset * offset / 2)


class Standardise(nn.Module):
    """gain * x + bias, initialised so that its output has mean 0 and deviation 1 over samples."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.gain = nn.Parameter(torch.ones(width))
        self.bias = nn.Parameter(torch.zeros(width))

    @torch.no_grad()
    def start(self, x: Tensor) -> None:
        """Fit gain and bias to samples (N, width)."""
        x = x.detach()
        spread = x.std(0) + 1e-6 * x.abs().mean()
        self.gain.copy_(1 / spread)
        self.bias.copy_(-x.mean(0) / spread)

    def forward(self, x: Tensor) -> Tensor:
        return x * self.gain + self.bias

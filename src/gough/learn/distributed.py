"""Several processes, one run: started by torchrun, gradients averaged, one clock."""

from __future__ import annotations

import os

import torch
import torch.distributed as dist
from torch import nn


class Team:
    """The processes of a run; alone, every operation does nothing.

    Attributes:
        rank, size: which process this is, of how many.
    """

    def __init__(self) -> None:
        self.rank = int(os.environ.get("RANK", "0"))
        self.size = int(os.environ.get("WORLD_SIZE", "1"))
        self.local = int(os.environ.get("LOCAL_RANK", "0"))

    def join(self, device: torch.device) -> None:
        """Meet the others."""
        if self.size > 1 and not dist.is_initialized():
            dist.init_process_group("nccl" if device.type == "cuda" else "gloo")

    def leave(self) -> None:
        """Part, at the end."""
        if self.size > 1 and dist.is_initialized():
            dist.destroy_process_group()

    def average_gradients(self, model: nn.Module) -> None:
        """Replace every gradient by its mean over the processes, in one exchange."""
        if self.size == 1:
            return
        grads = [p.grad for p in model.parameters() if p.grad is not None]
        flat = torch.cat([g.flatten() for g in grads])
        dist.all_reduce(flat)
        flat /= self.size
        for g, part in zip(grads, flat.split([g.numel() for g in grads]), strict=True):
            g.copy_(part.view_as(g))

    def agree(self, value: float, device: torch.device) -> float:
        """The first process's value, for all."""
        if self.size == 1:
            return value
        shared = torch.tensor([value], dtype=torch.float64, device=device)
        dist.broadcast(shared, src=0)
        return float(shared)

    def mean(self, value: torch.Tensor) -> torch.Tensor:
        """Mean of a number over the processes."""
        if self.size > 1:
            dist.all_reduce(value)
            value = value / self.size
        return value

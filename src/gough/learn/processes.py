"""Device of a run, and its processes as torchrun starts them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import torch
import torch.distributed as dist
from torch import Tensor

from gough.errors import GoughError
from gough.learn.config import TrainConfig


class Processes:
    """The processes of a run, as torchrun starts them; a single one exchanges nothing.

    Attributes:
        rank: number of this process, from 0.
        count: number of processes.
        local_rank: number of this process on its machine.
    """

    def __init__(self) -> None:
        names = (("RANK", 0), ("WORLD_SIZE", 1), ("LOCAL_RANK", 0))
        self.rank, self.count, self.local_rank = (int(os.environ.get(n, d)) for n, d in names)

    @contextmanager
    def joined(self, device: torch.device) -> Iterator[None]:
        """Connect the processes for the duration of a block."""
        if self.count == 1:
            yield
            return
        dist.init_process_group("nccl" if device.type == "cuda" else "gloo")
        try:
            yield
        finally:
            dist.destroy_process_group()

    def average(self, tensors: list[Tensor]) -> None:
        """Replace tensors by their means over the processes, in one exchange."""
        if self.count == 1:
            return
        flat = torch.cat([t.flatten().double() for t in tensors])
        dist.all_reduce(flat)
        flat /= self.count
        for t, part in zip(tensors, flat.split([t.numel() for t in tensors]), strict=True):
            t.copy_(part.view_as(t))

    def of_first(self, value: float, device: torch.device) -> float:
        """The first process's value of a number."""
        if self.count == 1:
            return value
        shared = torch.tensor([value], dtype=torch.float64, device=device)
        dist.broadcast(shared, src=0)
        return float(shared)


def find_device(name: str, local_rank: int) -> torch.device:
    """The device of a name; auto: this process's GPU if there is one.

    Raises:
        GoughError: it cannot be used here.
    """
    if name == "auto":
        name = f"cuda:{local_rank}" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (RuntimeError, AssertionError) as error:
        raise GoughError(f"run.device: {name!r} cannot be used here: {error}") from None
    return device


def shard_count(config: TrainConfig, processes: int) -> int:
    """Number of parts that a step's samples are drawn in, a multiple of the processes.

    Raises:
        GoughError: the batch cannot be divided so.
    """
    shards = -(-config.run.shards // processes) * processes
    if config.data.batch % shards:
        raise GoughError(
            f"data.batch: {config.data.batch} samples cannot be shared by {shards} shards "
            f"({processes} processes); choose a multiple of {shards}"
        )
    return shards

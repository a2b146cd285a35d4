"""Fresh samples drawn where the training runs: poses of the workspace and their readings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from gough.errors import GoughError
from gough.learn.kinematics import TorchPlatform, euler_to_matrix
from gough.platform import Platform

TRIES = 64


@dataclass(frozen=True, eq=False)
class Batch:
    """Samples: readings (N, 6), shift from home (N, 3) [unit], turn (N, 3, 3), all float64."""

    legs: Tensor
    shift: Tensor
    turn: Tensor

    def __len__(self) -> int:
        return len(self.legs)

    def __getitem__(self, index) -> Batch:
        return Batch(self.legs[index], self.shift[index], self.turn[index])

    def to(self, device: torch.device) -> Batch:
        """The same on another device."""
        return Batch(self.legs.to(device), self.shift.to(device), self.turn.to(device))

    @staticmethod
    def join(parts: list[Batch]) -> Batch:
        """One batch of several."""
        columns = zip(*((p.legs, p.shift, p.turn) for p in parts), strict=True)
        return Batch(*(torch.cat(column) for column in columns))


class Stream:
    """An endless supply of samples, each batch drawn from its own number.

    There is no state: batch k of seed s is the same whenever, wherever and by however many
    processes it is drawn, on one kind of device.

    Args:
        same_assembly: leave out poses beyond a singularity (det J not of home's sign).
    """

    def __init__(self, platform: Platform, *, same_assembly: bool = False,
                 device: torch.device | str = "cpu") -> None:  # fmt: skip
        box = platform._workspace()
        self.platform = TorchPlatform(platform).to(device)
        self.same_assembly = same_assembly
        self.device = torch.device(device)
        low, high = torch.tensor(box.translation.T.copy(), device=device)
        low_turn, high_turn = torch.tensor(np.radians(box.rotation_deg.T), device=device)
        self._shift, self._turn = (low, high - low), (low_turn, high_turn - low_turn)
        self._plain = not same_assembly and platform.rotary is None
        self._generator = torch.Generator(device=self.device)

    def batch(self, count: int, *key: int) -> Batch:
        """`count` samples that belong to `key`, whole numbers such as (seed, step, shard).

        Raises:
            GoughError: hardly any pose of the workspace can be reached.
        """
        self._generator.manual_seed(_mix(key))
        if self._plain:
            return self._draw(count)
        parts, have = [], 0
        for _ in range(TRIES):
            drawn = self._draw(count + count // 2)
            kept = drawn[self._good(drawn)]
            parts.append(kept)
            have += len(kept)
            if have >= count:
                return Batch.join(parts)[:count]
        raise GoughError(
            f"workspace: only {have} of {TRIES * (count + count // 2)} sampled poses can be "
            "reached without crossing a singularity; state a smaller workspace"
        )

    def _draw(self, count: int) -> Batch:
        numbers = torch.rand(
            count, 6, generator=self._generator, dtype=torch.float64, device=self.device
        )
        shift = self._shift[0] + self._shift[1] * numbers[:, :3]
        turn = euler_to_matrix(self._turn[0] + self._turn[1] * numbers[:, 3:])
        return Batch(self.platform.legs(shift, turn), shift, turn)

    def _good(self, drawn: Batch) -> Tensor:
        good = torch.isfinite(drawn.legs).all(-1)
        if self.same_assembly:
            good &= self.platform.assembly_sign(drawn.shift, drawn.turn) > 0
        return good


def _mix(key: tuple[int, ...]) -> int:
    """One 63-bit number from several (splitmix64), so that no two keys share a stream."""
    state = 0
    for part in key:
        state = (state + part + 0x9E3779B97F4A7C15) & 0xFFFFFFFFFFFFFFFF
        state = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & 0xFFFFFFFFFFFFFFFF
        state = ((state ^ (state >> 27)) * 0x94D049BB133111EB) & 0xFFFFFFFFFFFFFFFF
        state ^= state >> 31
    return state >> 1

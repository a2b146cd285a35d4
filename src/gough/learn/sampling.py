"""Training samples as tensors: poses of the workspace from home, and their readings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from gough.errors import GoughError
from gough.learn.data import TRIES, DatasetSpec, dataset, relative_to_home
from gough.learn.kinematics import TorchPlatform, euler_to_matrix
from gough.platform import Platform


@dataclass(frozen=True, eq=False)
class Batch:
    """Samples, all float64.

    Attributes:
        legs: readings (N, 6).
        translation: t - t_home (N, 3) [platform unit].
        rotation: R_home^T R (N, 3, 3).
    """

    legs: Tensor
    translation: Tensor
    rotation: Tensor

    def __len__(self) -> int:
        return len(self.legs)

    def __getitem__(self, index) -> Batch:
        return Batch(self.legs[index], self.translation[index], self.rotation[index])

    def to(self, device: torch.device) -> Batch:
        """Copy to a device."""
        return Batch(self.legs.to(device), self.translation.to(device), self.rotation.to(device))

    @staticmethod
    def join(parts: list[Batch]) -> Batch:
        """Concatenate batches."""
        columns = zip(*((p.legs, p.translation, p.rotation) for p in parts), strict=True)
        return Batch(*(torch.cat(column) for column in columns))


class Stream:
    """An endless supply of samples, each batch drawn from its own key.

    There is no state: the batch of a key is the same whenever, wherever and by however many
    processes it is drawn, on one kind of device.

    Args:
        platform: the machine; it must state a workspace.
        same_assembly: leave out poses beyond a singularity (det J not of home's sign).
        device: where the samples are drawn.

    Example:
        >>> Stream(platform).batch(500, seed, step).legs
    """

    def __init__(self, platform: Platform, *, same_assembly: bool = False,
                 device: torch.device | str = "cpu") -> None:  # fmt: skip
        box = platform._workspace()
        self.platform = TorchPlatform(platform).to(device)
        self.same_assembly = same_assembly
        self.device = torch.device(device)
        lengths, angles = box.translation, np.radians(box.rotation_deg)
        self._low, high = torch.tensor(np.concatenate([lengths, angles]).T.copy(), device=device)
        self._range = high - self._low
        self._all_good = not same_assembly and platform.rotary is None
        self._generator = torch.Generator(device=self.device)

    def batch(self, count: int, *key: int) -> Batch:
        """Draw the `count` samples of a key, whole numbers such as (seed, step, shard).

        Raises:
            GoughError: hardly any pose of the workspace can be reached.
        """
        self._generator.manual_seed(_mix(key))
        if self._all_good:
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
        numbers = self._low + self._range * numbers
        translation, rotation = numbers[:, :3], euler_to_matrix(numbers[:, 3:])
        pose = self.platform.from_home(translation, rotation)
        return Batch(self.platform.leg_lengths(*pose), translation, rotation)

    def _good(self, drawn: Batch) -> Tensor:
        good = torch.isfinite(drawn.legs).all(-1)
        if self.same_assembly:
            pose = self.platform.from_home(drawn.translation, drawn.rotation)
            good &= self.platform.assembly_sign(*pose) > 0
        return good


def fixed_batch(platform: Platform, spec: DatasetSpec) -> Batch:
    """Load the data set that `gough dataset` writes for a specification, as one batch."""
    pose, legs = dataset(platform, spec)
    pose = relative_to_home(platform, pose)
    return Batch(*(torch.tensor(x) for x in (legs, pose.position, pose.rotation)))


def _mix(key: tuple[int, ...]) -> int:
    """One 63-bit number from several (splitmix64), so that no two keys share a stream."""
    state = 0
    for part in key:
        state = (state + part + 0x9E3779B97F4A7C15) & 0xFFFFFFFFFFFFFFFF
        state = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & 0xFFFFFFFFFFFFFFFF
        state = ((state ^ (state >> 27)) * 0x94D049BB133111EB) & 0xFFFFFFFFFFFFFFFF
        state ^= state >> 31
    return state >> 1

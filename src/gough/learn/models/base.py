"""Base of the first-guess networks: readings in, pose from home out."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import ClassVar, Literal

import numpy as np
import roma
import torch
from torch import Tensor, nn

from gough import quaternion
from gough.errors import GoughError
from gough.kinematics import assembly_sign, leg_lengths
from gough.learn.kinematics import euler_to_matrix
from gough.platform import Platform
from gough.pose import Pose

Rotation = Literal["quaternion", "nine", "euler"]
OUTPUTS = {"quaternion": 7, "nine": 12, "euler": 6}
SCALING_POSES = 20_000
WIDER = 0.03  # share by which the range of readings is widened to either side


@dataclass(frozen=True, eq=False)
class Scaling:
    """Constants that scale a platform's readings and poses to numbers of order one.

    The names are part of the format of network files.

    Attributes:
        leg_mean, leg_std: (6,) mean and deviation of the readings over the workspace.
        leg_range: (6, 2) lowest and highest reading over the workspace.
        shift_mean, shift_scale: (3,) middle and half width of the workspace's translations.
        turn_scale: (3,) largest Euler angle of the workspace to either side [rad].
    """

    leg_mean: np.ndarray
    leg_std: np.ndarray
    leg_range: np.ndarray
    shift_mean: np.ndarray
    shift_scale: np.ndarray
    turn_scale: np.ndarray

    @classmethod
    def of(cls, platform: Platform, same_assembly: bool = False) -> Scaling:
        """Compute the constants from 20,000 poses of the workspace, always the same.

        Raises:
            PlatformError: the platform states no workspace.
            GoughError: no pose of the workspace can be reached.
        """
        poses = platform.sample_poses(SCALING_POSES, seed=0)
        legs = leg_lengths(platform, poses)
        keep = np.all(np.isfinite(legs), axis=-1)
        if same_assembly:
            keep &= assembly_sign(platform, poses) > 0
        if not np.any(keep):
            raise GoughError(f"platform {platform.name!r}: no pose of its workspace is reachable")
        legs = legs[keep]
        box = platform.workspace
        assert box is not None
        half = (box.translation[:, 1] - box.translation[:, 0]) / 2
        reach = np.abs(np.radians(box.rotation_deg)).max(axis=1)
        smallest = 1e-6 * platform.size
        return cls(
            leg_mean=legs.mean(axis=0),
            leg_std=np.maximum(legs.std(axis=0), 1e-9),
            leg_range=np.stack([legs.min(axis=0), legs.max(axis=0)], axis=-1),
            shift_mean=box.translation.mean(axis=1),
            shift_scale=np.maximum(half, smallest),
            turn_scale=np.maximum(reach, 1e-6),
        )


def reading_range(platform: Platform) -> np.ndarray:
    """Lowest and highest reading (6, 2) over the workspace, widened a little.

    The poses are samples and the corners of the box, where the extremes mostly are.
    """
    box = platform._workspace()
    edges = np.concatenate([box.translation, np.radians(box.rotation_deg)])  # (6, 2)
    corners = np.array(list(product(*edges)))  # (64, 6)
    rotations = quaternion.from_euler(corners[:, 3:])
    home = platform.home
    poses = Pose(home.position + corners[:, :3], quaternion.product(home.wxyz, rotations))
    samples = platform.sample_poses(SCALING_POSES, seed=0)
    legs = np.concatenate([leg_lengths(platform, p) for p in (poses, samples)])
    low, high = np.nanmin(legs, axis=0), np.nanmax(legs, axis=0)
    spread = WIDER * (high - low)
    return np.stack([low - spread, high + spread], axis=-1)


class PoseNetwork(nn.Module):
    """A network from readings (N, 6) to poses from home.

    A subclass defines `network`, from normalised readings (N, 6) to raw numbers (N, outputs):
    three for the scaled translation from home, and then, by `rotation`, four for a quaternion
    (normalised), nine for a matrix (replaced by the nearest rotation: Levinson et al., An Analysis
    of SVD for Deep Rotation Estimation (2020)) or three for scaled Euler angles. Its keyword
    arguments with their defaults are its configuration.
    """

    kind: ClassVar[str]
    rotation: ClassVar[Rotation] = "nine"
    leg_mean: Tensor
    leg_std: Tensor
    shift_mean: Tensor
    shift_scale: Tensor
    turn_scale: Tensor

    def __init__(self, platform: Platform, scaling: Scaling) -> None:
        super().__init__()
        self.platform = platform
        self.scaling = scaling
        for name in ("leg_mean", "leg_std", "shift_mean", "shift_scale", "turn_scale"):
            value = torch.tensor(getattr(scaling, name), dtype=torch.float64)
            self.register_buffer(name, value, persistent=False)

    @property
    def outputs(self) -> int:
        """Number of raw numbers that describe a pose."""
        return OUTPUTS[self.rotation]

    @property
    def dtype(self) -> torch.dtype:
        """The dtype of the weights; readings and poses are float64 in any case."""
        return next(self.parameters()).dtype

    def cast(self, dtype: torch.dtype) -> None:
        """Change the dtype of the weights, not that of scales and distances."""
        kept = self.state_dict().keys()
        exact = {n: b for n, b in self.named_buffers() if n not in kept}
        self.to(dtype)
        for name, value in exact.items():
            owner, _, key = name.rpartition(".")
            setattr(self.get_submodule(owner), key, value)

    def network(self, x: Tensor) -> Tensor:
        """Raw numbers (N, outputs) for normalised readings (N, 6), both in `dtype`."""
        raise NotImplementedError

    def raw(self, legs: Tensor) -> Tensor:
        """Raw numbers (N, outputs), float64, for readings (N, 6), float64."""
        return self.network(self.normalised(legs)).double()

    def normalised(self, legs: Tensor) -> Tensor:
        """Readings (N, 6), float64, with mean 0 and deviation 1 over the workspace, in `dtype`."""
        return ((legs - self.leg_mean) / self.leg_std).to(self.dtype)

    def for_export(self) -> nn.Module:
        """The module whose `raw` a network's file evaluates."""
        return self

    def forward(self, legs: Tensor) -> tuple[Tensor, Tensor]:
        """Translation (N, 3) [platform unit] and rotation (N, 3, 3) from home, for readings (N, 6).

        All are float64.
        """
        return self.decode(self.raw(legs))

    def decode(self, raw: Tensor) -> tuple[Tensor, Tensor]:
        """Translation (N, 3) [platform unit] and rotation (N, 3, 3) of raw numbers (N, outputs).

        Nine numbers become the nearest rotation: equation 12 of the DisGNet paper.
        """
        translation = self.shift_mean + self.shift_scale * raw[:, :3]
        rest = raw[:, 3:]
        if self.rotation == "quaternion":
            xyzw = nn.functional.normalize(roma.quat_wxyz_to_xyzw(rest), dim=-1)
            return translation, roma.unitquat_to_rotmat(xyzw)
        if self.rotation == "euler":
            return translation, euler_to_matrix(self.turn_scale * rest)
        nearest = roma.special_procrustes(rest.unflatten(-1, (3, 3)))
        return translation, nearest  # pyright: ignore[reportReturnType]

    def start_near_home(self, last: nn.Linear) -> None:
        """Initialise the last layer so that its outputs are close to the home pose."""
        home = {"quaternion": (1.0, 0, 0, 0), "nine": (1.0, 0, 0, 0, 1, 0, 0, 0, 1)}
        with torch.no_grad():
            last.weight.mul_(0.1)
            last.bias.zero_()
            if self.rotation in home:
                last.bias[3:] = torch.tensor(home[self.rotation])

    def parameter_count(self) -> int:
        """Number of trained parameters."""
        return sum(p.numel() for p in self.parameters())

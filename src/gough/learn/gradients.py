"""Forward and inverse kinematics as torch functions that carry gradients."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from gough.checks import Array
from gough.errors import GoughError
from gough.fk.solution import Solution
from gough.fk.solve import solve as fast_solve
from gough.learn.implicit import implicit_pose
from gough.learn.kinematics import TorchPlatform
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.base import Seed, find_seed


@dataclass(frozen=True, eq=False)
class TorchSolution:
    """Poses as tensors that carry gradients.

    Attributes:
        position: (..., 3) [platform unit].
        rotation: (..., 3, 3).
        usable: (...) bool; the other rows are constants, with zero gradient.
        solution: what `gough.solve` says of each row: statuses, residuals, iterations.
    """

    position: Tensor
    rotation: Tensor
    usable: Tensor
    solution: Solution


def solve(
    platform: Platform,
    legs: Tensor,
    *,
    base: Tensor | None = None,
    moving: Tensor | None = None,
    seed: str | Seed | Pose = "auto",
) -> TorchSolution:
    """Poses that have the given readings, differentiable with respect to readings and joints.

    Forward this is `gough.solve`, on the CPU in float64; backward it is the implicit function
    theorem (see `implicit_pose`), so gradients of any order cost no iteration.

    Args:
        legs: readings (..., 6), floating point, on any device.
        base: (6, 3) base joints instead of the platform's; gradients flow to them.
        moving: (6, 3) platform joints, likewise. Where joints are given the platform's stroke is
            not looked at, and the first guess is that of the platform with its own joints.
        seed: the first guess, as `gough.solve` takes it.

    Raises:
        GoughError: tensors of other shapes; what `gough.solve` raises.
        PlatformError: joints that make no platform.
    """
    facts = _joints("legs", platform, legs, base, moving)
    if legs.shape[-1:] != (6,):
        raise GoughError(f"legs: expected (..., 6), got {tuple(legs.shape)}")
    flat = legs.reshape(-1, 6)
    readings = flat.detach().double().cpu().numpy()
    if base is not None or moving is not None:
        seed = seed if isinstance(seed, Pose) else _FromAfar(find_seed(platform, seed))
        platform = _with_joints(platform, base, moving)
    found = fast_solve(platform, readings, seed=seed)
    tensor = lambda x: torch.as_tensor(x, device=legs.device)  # noqa: E731
    position = tensor(found.pose.position.copy()).to(legs.dtype)
    rotation = tensor(found.pose.rotation).to(legs.dtype)
    usable = tensor(found.usable)
    position, rotation = implicit_pose(facts, position, rotation, flat, usable)
    batch = legs.shape[:-1]
    return TorchSolution(
        position.reshape(*batch, 3), rotation.reshape(*batch, 3, 3), usable.reshape(batch), found
    )


def leg_lengths(
    platform: Platform,
    position: Tensor,
    rotation: Tensor,
    *,
    base: Tensor | None = None,
    moving: Tensor | None = None,
) -> Tensor:
    """Readings (..., 6) of poses, as `gough.leg_lengths`, differentiable in every argument.

    Args:
        position, rotation: (..., 3) [platform unit] and (..., 3, 3), in base coordinates.
        base, moving: joints (6, 3) instead of the platform's own; for length changes, lengths at
            home are those of the joints given.
    """
    return _joints("position", platform, position, base, moving).legs_at(position, rotation)


class _FromAfar:
    """A seed's poses without the machine they were made for."""

    name = "the given platform's"

    def __init__(self, seed: Seed) -> None:
        self._seed = seed

    def guess(self, legs: Array) -> Pose:
        return self._seed.guess(legs)


def _joints(name: str, platform: Platform, like: Tensor, base: Tensor | None,
            moving: Tensor | None) -> TorchPlatform:  # fmt: skip
    """The platform in the dtype and on the device of a tensor, with joints that may be given."""
    kind = like.dtype if isinstance(like, Tensor) else type(like).__name__
    if not (isinstance(kind, torch.dtype) and kind.is_floating_point):
        found = str(kind).removeprefix("torch.")
        raise GoughError(f"{name}: expected a tensor of floating point, found {found}")
    for name, joints in (("base", base), ("moving", moving)):
        if joints is not None and joints.shape != (6, 3):
            raise GoughError(f"{name}: expected (6, 3), got {tuple(joints.shape)}")
    facts = TorchPlatform(platform, like.dtype).to(like.device)
    return facts if base is None and moving is None else facts.with_joints(base, moving)


def _with_joints(platform: Platform, base: Tensor | None, moving: Tensor | None) -> Platform:
    array = lambda x, own: own if x is None else x.detach().double().cpu().numpy()  # noqa: E731
    return replace(
        platform, base=array(base, platform.base), moving=array(moving, platform.moving),
        stroke=None,
    )  # fmt: skip

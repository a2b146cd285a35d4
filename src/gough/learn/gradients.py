"""Forward and inverse kinematics as PyTorch functions that carry gradients.

A pose x that a solver found satisfies F(x, legs, joints) = 0, however it was found. A change d of
the arguments changes the pose by dx = -J^-1 dF, with J = dF/dx at the solution (implicit function
theorem); backwards, a gradient g with respect to x becomes -(J^-T g) dF/d(legs, joints). No
iteration is differentiated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import torch
from torch import Tensor

from gough.errors import GoughError
from gough.fk.solution import Solution
from gough.fk.solve import solve as fast_solve
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
        solution: result of `gough.solve`: statuses, residuals, iterations.
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
    """Solve readings for poses that are differentiable with respect to readings and joints.

    Forward this is `gough.solve`, on the CPU in float64; backward it is the implicit function
    theorem (see `implicit_pose`), so gradients of any order cost no iteration.

    Args:
        platform: the machine.
        legs: readings (..., 6), floating point, on any device.
        base: (6, 3) base joints instead of the platform's [platform unit]; gradients flow to them.
        moving: (6, 3) platform joints, likewise. With given joints the platform's stroke is
            ignored, and the first guess is that of the platform with its own joints.
        seed: the first guess, as `gough.solve` takes it.

    Raises:
        GoughError: tensors of other shapes; what `gough.solve` raises.
        PlatformError: joints that make no platform.

    Example:
        >>> legs = torch.tensor(platform.home_legs, requires_grad=True)
        >>> gough.learn.solve(platform, legs).position.sum().backward()
    """
    tensors = _with_joints("legs", platform, legs, base, moving)
    if legs.shape[-1:] != (6,):
        raise GoughError(f"legs: expected (..., 6), got {tuple(legs.shape)}")
    flat = legs.reshape(-1, 6)
    readings = flat.detach().double().cpu().numpy()
    if base is not None or moving is not None:
        seed = find_seed(platform, seed)  # of the platform's own joints
        platform = _replace_joints(platform, base, moving)
    found = fast_solve(platform, readings, seed=seed)
    tensor = lambda x: torch.as_tensor(x, device=legs.device)  # noqa: E731
    position = tensor(found.pose.position.copy()).to(legs.dtype)
    rotation = tensor(found.pose.rotation).to(legs.dtype)
    usable = tensor(found.usable)
    position, rotation = implicit_pose(tensors, position, rotation, flat, usable)
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
    """Compute readings (..., 6) as `gough.leg_lengths` does, differentiable in every argument.

    Args:
        platform: the machine.
        position: (..., 3) [platform unit], in base coordinates.
        rotation: (..., 3, 3).
        base: (6, 3) base joints instead of the platform's [platform unit].
        moving: (6, 3) platform joints, likewise; for legs that read length changes, the lengths at
            home are those of the given joints.

    Raises:
        GoughError: tensors that are not of floating point, or joints of another shape.
    """
    return _with_joints("position", platform, position, base, moving).leg_lengths(
        position, rotation
    )


def _with_joints(name: str, platform: Platform, like: Tensor, base: Tensor | None,
                 moving: Tensor | None) -> TorchPlatform:  # fmt: skip
    """The platform with the dtype and device of the tensor `like`, and with any given joints."""
    kind = like.dtype if isinstance(like, Tensor) else type(like).__name__
    if not (isinstance(kind, torch.dtype) and kind.is_floating_point):
        found = str(kind).removeprefix("torch.")
        raise GoughError(f"{name}: expected a tensor of floating point, found {found}")
    for name, joints in (("base", base), ("moving", moving)):
        if joints is not None and joints.shape != (6, 3):
            raise GoughError(f"{name}: expected (6, 3), got {tuple(joints.shape)}")
    own = TorchPlatform(platform, like.dtype).to(like.device)
    return own if base is None and moving is None else own.with_joints(base, moving)


def _replace_joints(platform: Platform, base: Tensor | None, moving: Tensor | None) -> Platform:
    array = lambda x, own: own if x is None else x.detach().double().cpu().numpy()  # noqa: E731
    return replace(
        platform, base=array(base, platform.base), moving=array(moving, platform.moving),
        stroke=None,
    )  # fmt: skip


# ---- implicit function theorem ------------------------------------------------------------


def implicit_pose(
    platform: TorchPlatform,
    position: Tensor,
    rotation: Tensor,
    legs: Tensor,
    solved: Tensor,
) -> tuple[Tensor, Tensor]:
    """Attach gradients, of any order, to poses that are already solved.

    Args:
        platform: gradients flow to those of its tensors that require them, such as the joints
            of `TorchPlatform.with_joints`.
        position: (N, 3) [platform unit].
        rotation: (N, 3, 3). The more exactly the poses have these readings, the more exact the
            gradients are.
        legs: readings (N, 6).
        solved: (N,) bool. The other rows are constants: their gradients are zero and do not
            affect the gradients of the joints, which rows share. The same holds for rows whose
            Jacobian is singular to the last digit.

    Returns:
        Positions (N, 3) and rotations (N, 3, 3), equal to those given.
    """
    names, tensors = zip(*platform.named_buffers(), strict=True)
    arguments = (platform, names, solved, position, rotation, legs, *tensors)
    return _ImplicitPose.apply(*arguments)  # pyright: ignore[reportReturnType]


class _ImplicitPose(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, platform: TorchPlatform, names: tuple[str, ...], solved: Tensor,
                position: Tensor, rotation: Tensor, legs: Tensor, *tensors: Tensor
                ) -> tuple[Tensor, Tensor]:  # fmt: skip
        position, rotation = position.clone(), rotation.clone()
        ctx.platform, ctx.names = platform, names
        ctx.save_for_backward(solved, position, rotation, legs, *tensors)
        return position, rotation

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        again = torch.is_grad_enabled()  # the gradient itself will be differentiated
        solved, position, rotation, *arguments = ctx.saved_tensors
        wanted = ctx.needs_input_grad[5:]
        with torch.enable_grad():
            # copies, since F is differentiated at a fixed pose, not through the pose
            copies = [x.view_as(x) if again else x.detach() for x in arguments]
            copies = [x.requires_grad_() if w else x for x, w in zip(copies, wanted, strict=True)]
            F, J, solved = _equations(ctx, solved, position, rotation, *copies)
            by_rotation = torch.linalg.cross(rotation, grads[1], dim=-2).sum(-1)
            g = torch.where(solved[:, None], torch.cat([grads[0], by_rotation], dim=-1), 0)
            y = torch.linalg.solve(J.mT, g[..., None])[..., 0]
            chosen = [x for x, w in zip(copies, wanted, strict=True) if w]
            found = torch.autograd.grad(
                F, chosen, -y, create_graph=again, allow_unused=True, materialize_grads=True
            )
        rest = iter(found)
        return (None,) * 5 + tuple(next(rest) if w else None for w in wanted)


def _equations(ctx: Any, solved: Tensor, position: Tensor, rotation: Tensor, legs: Tensor,
               *tensors: Tensor) -> tuple[Tensor, Tensor, Tensor]:  # fmt: skip
    """F (N, 6), J (N, 6, 6), and the rows that have a gradient; home stands in for the others."""
    platform = ctx.platform.with_tensors(dict(zip(ctx.names, tensors, strict=True)))
    machine = platform.platform
    either = lambda rows, x, y: torch.where(rows, x, torch.tensor(y).to(x))  # noqa: E731
    position = either(solved[:, None], position, machine.home.position)
    rotation = either(solved[:, None, None], rotation, machine.home.rotation)
    legs = either(solved[:, None], legs, machine.home_legs)
    F, J = platform.strut_errors(position, rotation, *platform.equivalent_struts(legs))
    _, _, failed = torch.linalg.lu_factor_ex(J.detach())
    solved = solved & (failed == 0)
    eye = torch.eye(6, dtype=J.dtype, device=J.device)
    return F, torch.where(solved[:, None, None], J, eye), solved

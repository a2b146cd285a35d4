"""Gradients of solved poses, by the implicit function theorem.

A pose x that a solver found satisfies F(x, legs, geometry) = 0, however it was found. Moving the
arguments by d moves it by dx = -J^-1 dF, with J = dF/dx at the solution; backwards, a gradient g
with respect to x becomes -(J^-T g) dF/d(legs, geometry). No iteration is differentiated.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from gough.learn.kinematics import TorchPlatform


def implicit_pose(
    platform: TorchPlatform,
    position: Tensor,
    rotation: Tensor,
    legs: Tensor,
    solved: Tensor,
) -> tuple[Tensor, Tensor]:
    """The same poses, with gradients to the readings and to the platform's tensors, of any order.

    Args:
        platform: gradients flow to those of its tensors that require them, such as the joints
            of `TorchPlatform.with_joints`.
        position, rotation: (N, 3), (N, 3, 3), the poses that have these readings. The better they
            are solved, the better the gradients are.
        legs: readings (N, 6).
        solved: (N,) bool. The other rows are constants: their gradients are zero, and spoil none
            of the joints' gradients, which rows share. So are rows whose Jacobian is singular to
            the last digit.

    Returns:
        Positions (N, 3) and rotations (N, 3, 3).
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
        again = torch.is_grad_enabled()  # the gradient is to be differentiated in its turn
        solved, position, rotation, *arguments = ctx.saved_tensors
        wanted = ctx.needs_input_grad[5:]
        with torch.enable_grad():
            # copies, so that F's derivative at a fixed pose is meant, not through the pose
            copies = [x.view_as(x) if again else x.detach() for x in arguments]
            copies = [x.requires_grad_() if w else x for x, w in zip(copies, wanted, strict=True)]
            F, J, solved = _equations(ctx, solved, position, rotation, *copies)
            by_turn = torch.linalg.cross(rotation, grads[1], dim=-2).sum(-1)
            g = torch.where(solved[:, None], torch.cat([grads[0], by_turn], dim=-1), 0)
            pull = torch.linalg.solve(J.mT, g[..., None])[..., 0]
            chosen = [x for x, w in zip(copies, wanted, strict=True) if w]
            found = torch.autograd.grad(
                F, chosen, -pull, create_graph=again, allow_unused=True, materialize_grads=True
            )
        rest = iter(found)
        return (None,) * 5 + tuple(next(rest) if w else None for w in wanted)


def _equations(ctx: Any, solved: Tensor, position: Tensor, rotation: Tensor, legs: Tensor,
               *tensors: Tensor) -> tuple[Tensor, Tensor, Tensor]:  # fmt: skip
    """F (N, 6), J (N, 6, 6), and which rows have a gradient; home stands in for the others."""
    platform = ctx.platform.with_facts(dict(zip(ctx.names, tensors, strict=True)))
    home = platform.platform
    at = lambda rows, x, y: torch.where(rows, x, torch.tensor(y).to(x))  # noqa: E731
    position = at(solved[:, None], position, home.home.position)
    rotation = at(solved[:, None, None], rotation, home.home.rotation)
    legs = at(solved[:, None], legs, home.home_legs)
    F, J = platform.strut_errors(position, rotation, *platform.equivalent_struts(legs))
    _, _, failed = torch.linalg.lu_factor_ex(J.detach())
    solved = solved & (failed == 0)
    eye = torch.eye(6, dtype=J.dtype, device=J.device)
    return F, torch.where(solved[:, None, None], J, eye), solved

"""A platform's inverse kinematics and pose algebra in torch, differentiable, on any device."""

from __future__ import annotations

import copy

import torch
from torch import Tensor, nn

from gough.platform import Platform


class TorchPlatform(nn.Module):
    """Leg readings of poses relative to home, as `gough.leg_lengths` gives them.

    Here a pose is (shift (..., 3) [unit], turn (..., 3, 3)): the position minus home's, in
    base coordinates, and home's inverse rotation times the pose's own.
    """

    base: Tensor
    arms: Tensor
    pivot: Tensor
    origin: Tensor
    home_rotation: Tensor
    home_lengths: Tensor
    offset: Tensor
    gain: Tensor
    axis_x: Tensor
    axis_y: Tensor
    branch: Tensor
    arm: Tensor
    rod: Tensor

    def __init__(self, platform: Platform, dtype: torch.dtype = torch.float64) -> None:
        super().__init__()
        self.platform = platform
        rotary = platform.rotary
        facts = {
            "base": platform.base,
            "arms": platform.moving - platform.pivot_point,
            "pivot": platform.pivot_point,
            "origin": platform.home.position + platform.pivot_point,
            "home_rotation": platform.home.rotation,
            "home_lengths": platform.home_lengths,
            "offset": platform.offset,
            "gain": platform.gain,
        }
        if rotary is not None:
            facts |= {"axis_x": rotary.axis_x, "axis_y": rotary.axis_y, "branch": rotary.branch}
            facts |= {"arm": rotary.arm_length, "rod": rotary.rod_length}
        for name, value in facts.items():
            self.register_buffer(name, torch.tensor(value, dtype=dtype), persistent=False)

    def with_joints(self, base: Tensor | None = None, moving: Tensor | None = None
                    ) -> TorchPlatform:  # fmt: skip
        """The same machine with other joints (6, 3), or (N, 6, 3) for one machine a row.

        Gradients flow to the tensors given. Lengths at home, from which changes of length count,
        are those of the new joints.
        """
        values = dict(self.named_buffers())
        if base is not None:
            values["base"] = base
        if moving is not None:
            values["arms"] = moving - self.pivot
        other = self.with_facts(values)
        no_turn = torch.eye(3, dtype=self.base.dtype, device=self.base.device)
        struts, _ = other.struts(torch.zeros_like(self.origin), no_turn)
        return other.with_facts(values | {"home_lengths": torch.linalg.vector_norm(struts, dim=-1)})

    def with_facts(self, values: dict[str, Tensor]) -> TorchPlatform:
        """The same machine with other tensors under the names of its buffers."""
        other = copy.copy(self)
        other._buffers = dict(values)
        return other

    def rotation(self, turn: Tensor) -> Tensor:
        """The pose's rotation matrices (..., 3, 3)."""
        return self.home_rotation @ turn

    def struts(self, shift: Tensor, turn: Tensor) -> tuple[Tensor, Tensor]:
        """Base joint to platform joint, and pivot to platform joint, each (..., 6, 3) [unit]."""
        arms = self.arms @ self.rotation(turn).mT  # (..., 6, 3)
        return arms + (self.origin + shift)[..., None, :] - self.base, arms

    def equivalent_struts(self, legs: Tensor) -> tuple[Tensor, Tensor]:
        """Where struts start (..., 6, 3) and their lengths (..., 6): see `gough.kinematics`."""
        true = self.gain * legs + self._zero()
        if self.platform.rotary is None:
            return self.base.expand(*legs.shape, 3), true
        return self._tips(true), self.rod.expand(legs.shape)

    def _zero(self) -> Tensor:
        """Length or motor angle of a leg that reads 0, (6,): see `Platform.true_at_zero`."""
        change = self.platform.legs == "length_change"
        return self.offset + self.home_lengths if change else self.offset

    def _tips(self, angle: Tensor) -> Tensor:
        """Tips (..., 6, 3) of motor arms at angles (..., 6)."""
        angle = angle[..., None]
        turned = angle.cos() * self.axis_x + angle.sin() * self.axis_y
        return self.base + self.arm[:, None] * turned

    def strut_errors(self, position: Tensor, rotation: Tensor, starts: Tensor, lengths: Tensor
                     ) -> tuple[Tensor, Tensor]:  # fmt: skip
        """By how much struts at poses in base coordinates are too long, and d errors / d twist.

        Args:
            position, rotation: (..., 3), (..., 3, 3), of the pose itself, not relative to home.
            starts, lengths: what the readings ask for, from `equivalent_struts`.

        Returns:
            (..., 6) [unit] and (..., 6, 6), the twist as in `gough.jacobian`.
        """
        arms = self.arms @ rotation.mT
        struts = arms + (position + self.pivot)[..., None, :] - starts
        now = torch.linalg.vector_norm(struts, dim=-1)
        n = struts / now[..., None]
        return now - lengths, torch.cat([n, torch.linalg.cross(arms, n)], dim=-1)

    def legs(self, shift: Tensor, turn: Tensor) -> Tensor:
        """Readings (..., 6); NaN where a motor cannot reach."""
        return self._readings(self.struts(shift, turn)[0])

    def legs_at(self, position: Tensor, rotation: Tensor) -> Tensor:
        """Readings (..., 6) of poses (..., 3), (..., 3, 3) in base coordinates."""
        return self._readings(self._struts_at(position, rotation)[0])

    def _readings(self, struts: Tensor) -> Tensor:
        if self.platform.rotary is None:
            return (torch.linalg.vector_norm(struts, dim=-1) - self._zero()) / self.gain
        angle = self._motor_angles(struts) - self.offset
        return torch.atan2(torch.sin(angle), torch.cos(angle)) / self.gain

    def _struts_at(self, position: Tensor, rotation: Tensor) -> tuple[Tensor, Tensor]:
        """As `struts`, for poses in base coordinates."""
        arms = self.arms @ rotation.mT
        return arms + (position + self.pivot)[..., None, :] - self.base, arms

    def _motor_angles(self, joint: Tensor) -> Tensor:
        """See `gough.struts.motor_angles`."""
        x, y = (joint * self.axis_x).sum(-1), (joint * self.axis_y).sum(-1)
        reach = 2 * self.arm * torch.hypot(x, y)
        wanted = (joint**2).sum(-1) + self.arm**2 - self.rod**2
        return torch.atan2(y, x) + self.branch * torch.acos(wanted / reach)

    def assembly_sign(self, shift: Tensor, turn: Tensor) -> Tensor:
        """Sign of det J times that at home, (...): see `gough.assembly_sign`."""
        sign = self._sign(shift, turn)
        no_turn = torch.eye(3, dtype=turn.dtype, device=turn.device)
        return sign * self._sign(torch.zeros_like(self.origin), no_turn)

    def _sign(self, shift: Tensor, turn: Tensor) -> Tensor:
        struts, arms = self.struts(shift, turn)
        rods = struts
        if self.platform.rotary is not None:
            rods = struts - (self._tips(self._motor_angles(struts)) - self.base)
        rows = torch.cat([rods, torch.linalg.cross(arms, rods)], dim=-1)  # (..., 6, 6)
        return torch.linalg.slogdet(rows / torch.linalg.vector_norm(rods, dim=-1, keepdim=True))[0]


def euler_to_matrix(angles: Tensor) -> Tensor:
    """R = Rx(a) Ry(b) Rz(c), (..., 3, 3), of Euler angles (..., 3) [rad]."""
    (sa, sb, sc), (ca, cb, cc) = angles.sin().unbind(-1), angles.cos().unbind(-1)
    rows = [
        cb * cc, -cb * sc, sb,
        ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb,
        sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb,
    ]  # fmt: skip
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def quaternion_to_matrix(wxyz: Tensor) -> Tensor:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4), scalar first."""
    w, x, y, z = wxyz.unbind(-1)
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))

"""Inverse kinematics and the group SE(3) in PyTorch: differentiable, batched, on any device.

The formulas repeat those of `gough.struts` and `gough.pose`, and the tests compare them; rotations
come from the library roma. A pose is a position t (..., 3) [platform unit] and a rotation matrix R
(..., 3, 3) in base coordinates, or, where a function says "from home", the translation
t - t_home and the rotation R_home^T R.
"""

from __future__ import annotations

import copy
import math

import roma
import torch
from torch import Tensor, nn

from gough.platform import Platform
from gough.platform_checks import refuse_screws


class TorchPlatform(nn.Module):
    """A platform as tensors, with the functions of `gough.kinematics` on them."""

    base: Tensor
    joints: Tensor
    pivot: Tensor
    home_position: Tensor
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
        refuse_screws(platform)
        self.platform = platform
        rotary = platform.rotary
        values = {
            "base": platform.base,
            "joints": platform.moving - platform.pivot_point,
            "pivot": platform.pivot_point,
            "home_position": platform.home.position,
            "home_rotation": platform.home.rotation,
            "home_lengths": platform.home_lengths,
            "offset": platform.offset,
            "gain": platform.gain,
        }
        if rotary is not None:
            values |= {"axis_x": rotary.axis_x, "axis_y": rotary.axis_y, "branch": rotary.branch}
            values |= {"arm": rotary.arm_length, "rod": rotary.rod_length}
        for name, value in values.items():
            self.register_buffer(name, torch.tensor(value, dtype=dtype), persistent=False)

    def with_joints(self, base: Tensor | None = None, moving: Tensor | None = None
                    ) -> TorchPlatform:  # fmt: skip
        """Replace joints (6, 3) [platform unit], or (N, 6, 3) for one machine per row.

        Gradients flow to the given tensors. The lengths at home, which readings of length changes
        count from, are those of the new joints.
        """
        tensors = dict(self.named_buffers())
        if base is not None:
            tensors["base"] = base
        if moving is not None:
            tensors["joints"] = moving - self.pivot
        other = self.with_tensors(tensors)
        struts, _ = other.struts(self.home_position, self.home_rotation)
        return other.with_tensors(
            tensors | {"home_lengths": torch.linalg.vector_norm(struts, dim=-1)}
        )

    def with_tensors(self, tensors: dict[str, Tensor]) -> TorchPlatform:
        """Copy this platform with other tensors under the names of its buffers."""
        other = copy.copy(self)
        other._buffers = dict(tensors)
        return other

    def from_home(self, translation: Tensor, rotation: Tensor) -> tuple[Tensor, Tensor]:
        """Position and rotation in base coordinates of a pose that is given from home."""
        return self.home_position + translation, self.home_rotation @ rotation

    def struts(self, position: Tensor, rotation: Tensor, ends: Tensor | None = None
               ) -> tuple[Tensor, Tensor]:  # fmt: skip
        """Struts d_i and levers r_i of `gough.struts`, each (..., 6, 3) [platform unit].

        Args:
            position: (..., 3).
            rotation: (..., 3, 3).
            ends: lower ends of the struts (..., 6, 3); the base joints unless given.
        """
        levers = self.joints @ rotation.mT
        joints = levers + (position + self.pivot)[..., None, :]
        return joints - (self.base if ends is None else ends), levers

    def equivalent_struts(self, legs: Tensor) -> tuple[Tensor, Tensor]:
        """Lower ends (..., 6, 3) and lengths (..., 6) of `gough.struts.equivalent`."""
        ideal = self.gain * legs + self._true_at_zero()
        if self.platform.rotary is None:
            return self.base.expand(*legs.shape, 3), ideal
        return self.base + self._arms(ideal), self.rod.expand(legs.shape)

    def strut_errors(self, position: Tensor, rotation: Tensor, ends: Tensor, lengths: Tensor
                     ) -> tuple[Tensor, Tensor]:  # fmt: skip
        """Length errors of struts at a pose, and their derivative with respect to the twist.

        Args:
            position: (..., 3) [platform unit].
            rotation: (..., 3, 3).
            ends: lower ends (..., 6, 3) from `equivalent_struts`.
            lengths: wanted lengths (..., 6).

        Returns:
            Errors (..., 6) [platform unit] and Jacobians (..., 6, 6), twist as in
            `gough.jacobian`.
        """
        J, actual = strut_jacobian(*self.struts(position, rotation, ends))
        return actual - lengths, J

    def leg_lengths(self, position: Tensor, rotation: Tensor) -> Tensor:
        """Readings (..., 6) of poses; NaN where a motor cannot reach."""
        struts, _ = self.struts(position, rotation)
        if self.platform.rotary is None:
            return (torch.linalg.vector_norm(struts, dim=-1) - self._true_at_zero()) / self.gain
        angle = self._motor_angles(struts) - self.offset
        return torch.atan2(torch.sin(angle), torch.cos(angle)) / self.gain

    def assembly_sign(self, position: Tensor, rotation: Tensor) -> Tensor:
        """Sign of det J times that at home, (...): see `gough.assembly_sign`."""
        home = self._determinant_sign(self.home_position, self.home_rotation)
        return home * self._determinant_sign(position, rotation)

    def _determinant_sign(self, position: Tensor, rotation: Tensor) -> Tensor:
        struts, levers = self.struts(position, rotation)
        if self.platform.rotary is not None:
            struts = struts - self._arms(self._motor_angles(struts))
        return torch.linalg.slogdet(strut_jacobian(struts, levers)[0])[0]

    def _true_at_zero(self) -> Tensor:
        """Length or motor angle of a leg that reads 0, (6,): see `Platform.true_at_zero`."""
        change = self.platform.legs == "length_change"
        return self.offset + self.home_lengths if change else self.offset

    def _arms(self, angles: Tensor) -> Tensor:
        """Motor arms (..., 6, 3) [platform unit] at angles (..., 6) [rad]."""
        angles = angles[..., None]
        directions = angles.cos() * self.axis_x + angles.sin() * self.axis_y
        return self.arm[:, None] * directions

    def _motor_angles(self, struts: Tensor) -> Tensor:
        """Angles (..., 6) [rad] of `gough.struts.motor_angles`."""
        x, y = (struts * self.axis_x).sum(-1), (struts * self.axis_y).sum(-1)
        reach = 2 * self.arm * torch.hypot(x, y)
        wanted = (struts**2).sum(-1) + self.arm**2 - self.rod**2
        return torch.atan2(y, x) + self.branch * torch.acos(wanted / reach)


def strut_jacobian(struts: Tensor, levers: Tensor) -> tuple[Tensor, Tensor]:
    """Rows (n_i, r_i x n_i) for struts d_i = |d_i| n_i and levers r_i, and the lengths |d_i|.

    Args:
        struts: (..., 6, 3).
        levers: (..., 6, 3), from the pivot to the platform joints.

    Returns:
        (..., 6, 6) and (..., 6), as stated in `gough.kinematics`.
    """
    lengths = torch.linalg.vector_norm(struts, dim=-1)
    n = struts / lengths[..., None]
    return torch.cat([n, torch.linalg.cross(levers, n)], dim=-1), lengths


def euler_to_matrix(angles: Tensor) -> Tensor:
    """R = Rx(a) Ry(b) Rz(c), (..., 3, 3), of Euler angles (..., 3) [rad].

    Written out because each training step calls it: roma's takes 1.3 ms for 1,000 rows, this 0.13.
    """
    (sa, sb, sc), (ca, cb, cc) = angles.sin().unbind(-1), angles.cos().unbind(-1)
    rows = [
        cb * cc, -cb * sc, sb,
        ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb,
        sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb,
    ]  # fmt: skip
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def matrix_to_euler(rotation: Tensor) -> Tensor:
    """Euler angles (..., 3) [rad], R = Rx(a) Ry(b) Rz(c), of matrices (..., 3, 3)."""
    a = torch.atan2(-rotation[..., 1, 2], rotation[..., 2, 2])
    b = torch.asin(rotation[..., 0, 2].clamp(-1, 1))
    c = torch.atan2(-rotation[..., 0, 1], rotation[..., 0, 0])
    return torch.stack([a, b, c], dim=-1)


# ---- SE(3) --------------------------------------------------------------------------------
#
# xi = (rho [unit], w [rad]) stands for the pose R = exp(w), t = V(w) rho, where
#     V = I + a [w] + b [w]^2,    a = (1 - cos q) / q^2,    b = (q - sin q) / q^3,    q = |w|
# is the left Jacobian of SO(3) (Sola, Deray, Atchuthan, A micro Lie theory (2018), eq. 145, 172).

# Factors of (-q^2)^k in a, b, a' / q, b' / q: for q < 1 ten terms reach rounding.
_SERIES = [
    [
        1 / math.factorial(2 * k + 2),
        1 / math.factorial(2 * k + 3),
        -(2 * k + 2) / math.factorial(2 * k + 4),
        -(2 * k + 2) / math.factorial(2 * k + 5),
    ]
    for k in range(10)
]


def se3_exp(xi: Tensor) -> tuple[Tensor, Tensor]:
    """Positions (..., 3) [unit] and rotations (..., 3, 3) of xi (..., 6), as `gough.Pose.exp`."""
    rho, w = xi[..., :3], xi[..., 3:]
    a, b, _, _ = _coefficients(w)
    once = torch.linalg.cross(w, rho)
    position = rho + a * once + b * torch.linalg.cross(w, once)
    return position, rotation_exp(w)


def se3_log(position: Tensor, rotation: Tensor) -> Tensor:
    """Coordinates xi (..., 6), |w| <= pi, of positions (..., 3) and rotations (..., 3, 3)."""
    return _xi(position, roma.rotmat_to_rotvec(rotation))


def se3_shortest(xi: Tensor) -> Tensor:
    """Coordinates of the same poses with |w| <= pi, (..., 6)."""
    position, _ = se3_exp(xi)
    w = xi[..., 3:]
    angle = torch.linalg.vector_norm(w, dim=-1, keepdim=True)
    turns = torch.round(angle / (2 * torch.pi))
    return _xi(position, w * (1 - 2 * torch.pi * turns / angle.clamp(min=1e-30)))


def se3_exp_jacobian(xi: Tensor) -> Tensor:
    """Derivative d twist / d xi of `se3_exp`, (..., 6, 6), the twist as in `gough.jacobian`.

    [[V, D], [0, V]] with D = d(V rho) / d w. This is the left Jacobian of SE(3) except for its
    first rows: those of the left Jacobian give the velocity of the point at the base's origin.
    """
    rho, w = xi[..., :3], xi[..., 3:]
    a, b, slope_a, slope_b = _coefficients(w)
    W, P = hat(w), hat(rho)
    once = torch.linalg.cross(w, rho)
    twice = torch.linalg.cross(w, once)
    a, b = a[..., None], b[..., None]
    V = torch.eye(3, dtype=xi.dtype, device=xi.device) + a * W + b * (W @ W)
    D = (slope_a * once + slope_b * twice)[..., None] * w[..., None, :]
    D = D - a * P - b * (hat(once) + W @ P)
    low = torch.cat([torch.zeros_like(V), V], dim=-1)
    return torch.cat([torch.cat([V, D], dim=-1), low], dim=-2)


def rotation_exp(w: Tensor) -> Tensor:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) [rad].

    By way of a quaternion: `roma.rotvec_to_rotmat` is exact to the first order only below 1e-6 rad.
    """
    return roma.unitquat_to_rotmat(roma.rotvec_to_unitquat(w))


def hat(v: Tensor) -> Tensor:
    """Matrices (..., 3, 3) of the cross product by v (..., 3)."""
    x, y, z = v.unbind(-1)
    o = torch.zeros_like(x)
    return torch.stack([o, -z, y, z, o, -x, -y, x, o], dim=-1).unflatten(-1, (3, 3))


def _xi(position: Tensor, w: Tensor) -> Tensor:
    """Coordinates (V^-1 t, w), (..., 6).

    V^-1 = I - [w] / 2 + c [w]^2, c = (1 - (q/2) cot(q/2)) / q^2 = -a' / (2 a q).
    """
    a, _, slope_a, _ = _coefficients(w)
    once = torch.linalg.cross(w, position)
    rho = position - once / 2 - slope_a / (2 * a) * torch.linalg.cross(w, once)
    return torch.cat([rho, w], dim=-1)


def _coefficients(w: Tensor) -> tuple[Tensor, ...]:
    """Coefficients a, b, a' / q, b' / q, each (..., 1); none loses digits at small q."""
    square = (w * w).sum(-1)
    small = square < 1
    table = torch.tensor(_SERIES, dtype=w.dtype, device=w.device)
    x = torch.where(small, square, 0)[..., None]
    series = torch.zeros_like(x)
    for row in reversed(table):
        series = row - x * series
    square = torch.where(small, 1, square)
    q = square.sqrt()
    sinc = q.sin() / q
    a, b = 2 * (q / 2).sin() ** 2 / square, (1 - sinc) / square
    closed = torch.stack([a, b, (sinc - 2 * a) / square, (a - 3 * b) / square], dim=-1)
    return torch.where(small[..., None], series, closed).split(1, dim=-1)

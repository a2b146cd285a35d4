"""Residuals of poses by inverse kinematics from a platform's TOML text alone, in plain NumPy.

Nothing here uses gough's own formulas: they are what is judged.
"""

from __future__ import annotations

import tomllib

import numpy as np

Array = np.ndarray
GOOD = 1e-8  # largest strut error / size of a pose that may be called good


class Judge:
    """The inverse kinematics of a platform's file, for readings and poses."""

    def __init__(self, text: str) -> None:
        facts = tomllib.loads(text)
        self.base, self.moving = (np.array(facts[k], float) for k in ("base", "moving"))
        self.pivot = np.array(facts.get("pivot", [0.0] * 3), float)
        self.kind = facts.get("legs", "telescopic")
        self.offset, self.gain = (
            np.broadcast_to(np.array(facts.get(k, usual), float), 6)
            for k, usual in (("offset", 0.0), ("gain", 1.0))
        )
        self.arms = {k: np.array(v, float) for k, v in facts.get("rotary", {}).items()}
        home = facts["home"]
        if "euler_deg" in home:
            rotation = _euler(np.radians(np.array(home["euler_deg"], float)))
        else:
            rotation = rotation_of(np.array(home.get("wxyz", [1.0, 0, 0, 0]), float))
        at_home = self._joints(np.array(home["position"], float), rotation)
        self.home_lengths = np.linalg.norm(at_home - self.base, axis=-1)
        points = np.concatenate([self.base, at_home])
        self.size = np.linalg.norm(points[:, None] - points, axis=-1).max()

    def errors(self, legs: Array, position: Array, wxyz: Array) -> Array:
        """Largest strut error (N,) of poses (N) with readings (N, 6), divided by the size."""
        joints = self._joints(position, rotation_of(wxyz))
        ideal = self.gain * legs + self.offset
        if self.kind == "rotary":
            x, y = self.arms["axis_x"], self.arms["axis_y"]  # made exact by Gram and Schmidt
            x = x / np.linalg.norm(x, axis=-1, keepdims=True)
            y = y - np.einsum("ij,ij->i", x, y)[:, None] * x
            y = y / np.linalg.norm(y, axis=-1, keepdims=True)
            along = np.cos(ideal)[..., None] * x + np.sin(ideal)[..., None] * y
            arm = np.broadcast_to(self.arms["arm_length"], 6)
            lower = self.base + arm[:, None] * along
            length = np.broadcast_to(self.arms["rod_length"], 6)
        else:
            lower = self.base
            length = ideal + (self.home_lengths if self.kind == "length_change" else 0.0)
        return np.abs(np.linalg.norm(joints - lower, axis=-1) - length).max(axis=-1) / self.size

    def _joints(self, position: Array, rotation: Array) -> Array:
        turned = np.einsum("...ij,kj->...ki", rotation, self.moving - self.pivot)
        return turned + self.pivot + np.asarray(position)[..., None, :]


def rotation_of(wxyz: Array) -> Array:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4): v + 2 w (q x v) + 2 q x (q x v)."""
    unit = wxyz / np.linalg.norm(wxyz, axis=-1, keepdims=True)
    w, q = unit[..., :1, None], unit[..., 1:]
    cross = np.cross(q[..., None, :], np.eye(3))  # rows: q x e_i
    twice = np.cross(q[..., None, :], cross)
    return np.swapaxes(np.eye(3) + 2 * w * cross + 2 * twice, -1, -2)


def _euler(angles: Array) -> Array:
    """R = Rx Ry Rz."""
    product = np.eye(3)
    for axis, angle in enumerate(angles):
        c, s = np.cos(angle), np.sin(angle)
        i, j = [k for k in range(3) if k != axis]
        one = np.eye(3)
        one[i, i] = one[j, j] = c
        sign = -1.0 if axis == 1 else 1.0
        one[i, j], one[j, i] = -sign * s, sign * s
        product = product @ one
    return product

"""Proof that exactly one pose with the given legs lies near a computed one.

In the Study parameters (1, r; g0, c) relative to the computed pose, about the centre of the
platform joints, the legs' equations and the Study quadric g0 + r.c = 0 are quadratic with
constant coefficients (docs/proofs.md). Write x = (2 g, 2 L r), L the joints' root mean square
distance from their centre, so that x is a length: 2 g the translation, 2 L r the rotation. Half
the equation of leg i is

    F_i(x) = f_i / 2 + A_i x + B_i(x, x),       A_i = (d_i, q_i x d_i / L),

    |B_i(x, x)| <= b_i |x|^2,
    b_i = 1/2 + sqrt(d^2 + m^2) / (2 L) + (max(d^2, m^2) + |f|) / (8 L^2)

in the norm |x| = max(|2 g|, |2 L r|). For any matrix Y close to A's inverse, with

    beta >= |Y F(0)|,   delta >= |1 - Y A|,   kappa >= |Y| b   (block norms)

the map x - Y F(x) sends the ball of radius rho into one of radius beta + delta rho +
kappa rho^2 and contracts where delta + 2 kappa rho < 1 (Newton-Kantorovich; Krawczyk 1969).
So exactly one solution lies within (1 - delta) / (2 kappa), and it is within about beta, as
soon as (1 - delta)^2 > 4 kappa beta. Rounding enters as bounds on f, A and Y A; nothing is
assumed of Y, which is inverted without care and judged by its delta. `gough.kernel.bounds`
calculates all this.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough import quaternion
from gough.checks import Array
from gough.kernel.bounds import LANES, SLOTS, bound_rows
from gough.kinematics import equivalent_struts, joint_radius
from gough.platform import Platform
from gough.pose import Pose
from gough.tables import Table

# Rotations of the base frame in no special position, so that inversion needs no pivots at
# symmetric poses. Rows that fail with one, perhaps by a small pivot, are tried with the other.
TURNS = np.array([[0.52, 0.37, -0.61, 0.47], [0.29, -0.73, 0.44, 0.43]])
TURNS /= np.linalg.norm(TURNS, axis=1, keepdims=True)


@dataclass(frozen=True, eq=False)
class Certificate:
    """Proofs about poses (...).

    Attributes:
        certified: exactly one pose with these legs lies within `radius`.
        radius: [platform unit] uniqueness radius: no other pose with these readings lies within
            this distance. It covers every pose that differs by a translation s of the platform
            joints' centre and a rotation a with s / cos(a / 2) <= radius and
            2 L tan(a / 2) <= radius, L the joints' root mean square distance from their
            centre. 0 where nothing is proven.
        error: [platform unit] the true solution is within this, in the same measure; infinite
            where nothing is proven.
        unit: name of the length unit, a label.
    """

    certified: NDArray[np.bool_]
    radius: Array
    error: Array
    unit: str = ""

    def __getitem__(self, index: Any) -> Certificate:
        return Certificate(self.certified[index], self.radius[index], self.error[index], self.unit)

    def __repr__(self) -> str:
        known = self.radius[self.certified]
        unit = f" [{self.unit}]" if self.unit else ""
        smallest = f"; smallest radius {np.min(known):.3g}{unit}" if np.size(known) else ""
        count = f"{np.sum(self.certified)} of {np.size(self.certified)}"
        return f"Certificate({count} certified{smallest})"

    def _repr_html_(self) -> str:
        from gough.text import number, page, rows_of, with_unit

        def cells(i: tuple[int, ...]) -> list[str]:
            at = self[i]
            return ["yes" if at.certified else "no", number(at.radius), number(at.error, ".2g")]

        heads = ["", "certified", with_unit("radius", self.unit), with_unit("error", self.unit)]
        return page(repr(self), heads, rows_of(np.shape(self.certified), cells))


def certify(platform: Platform, legs: ArrayLike | Table, pose: Pose) -> Certificate:
    """Prove that each pose is within `error` of a pose with these legs, alone in its `radius`.

    Args:
        legs: readings (..., 6), or a table as for `solve`.
        pose: batch (...), the computed solutions.

    Returns:
        Certificates of the poses (...): not `certified` where the proof fails, as it does for
        poses without these legs and for singular poses.

    Raises:
        GoughError: legs of another shape, or not numbers.

    Example:
        >>> import gough
        >>> platform = gough.Platform.load("reference")
        >>> gough.certify(platform, platform.home_legs, platform.home)
        Certificate(1 of 1 certified; smallest radius 4.46 [mm])
    """
    base, lengths = equivalent_struts(platform, legs)
    shape = np.broadcast_shapes(lengths.shape[:-1], pose.batch)
    if platform.rotary is None:  # one base for all rows
        base = platform.base[None]
    else:
        base = np.broadcast_to(base, (*shape, 6, 3)).reshape(-1, 6, 3)
    lengths = np.broadcast_to(lengths, (*shape, 6)).reshape(-1, 6)
    position = np.broadcast_to(pose.position, (*shape, 3)).reshape(-1, 3)
    wxyz = np.broadcast_to(pose.wxyz, (*shape, 4)).reshape(-1, 4)
    found = certify_struts(platform, base, lengths, Pose.trusted(position, wxyz))
    radius, error = found.radius.reshape(shape), found.error.reshape(shape)
    return Certificate(radius > 0, radius, error, platform.unit)


def certify_struts(platform: Platform, base: Array, lengths: Array, pose: Pose) -> Certificate:
    """Certify poses, batch (N,), whose struts are known.

    Args:
        base: lower ends of the struts, (N, 6, 3) or (1, 6, 3) [platform unit].
        lengths: of the struts, (N, 6) [platform unit].
    """
    radius, error = np.zeros(len(lengths)), np.full(len(lengths), np.inf)
    todo: slice | NDArray[np.int64] = slice(None)
    for turn in TURNS:
        rows = base if len(base) == 1 else base[todo]
        # `pose[todo]` would check and normalise all of them once more
        part = Pose.trusted(pose.position[todo], pose.wxyz[todo])
        found = _bounds(platform, turn, rows, lengths[todo], part)
        radius[todo], error[todo] = found
        todo = np.flatnonzero(radius == 0)
        if not len(todo):
            break
    return Certificate(radius > 0, radius, error, platform.unit)


def _bounds(
    platform: Platform, turn: Array, base: Array, lengths: Array, pose: Pose
) -> tuple[Array, Array]:
    """Radii and errors (n,), calculated with the base frame rotated by the quaternion `turn`."""
    radius, error = np.zeros(len(lengths)), np.full(len(lengths), np.inf)
    # with a pivot c, joints are R (p - c) + c + t: p - c and b - c have the pose as it is
    moving = platform.moving - platform.pivot_point
    centre, matrix = moving.mean(axis=0), quaternion.to_matrix(turn)
    size = [joint_radius(platform)]
    shared = np.concatenate([turn, matrix.ravel(), (moving - centre).ravel(), centre, size])
    bound_rows(
        shared, np.ascontiguousarray((base - platform.pivot_point) @ matrix.T),
        np.ascontiguousarray(lengths), np.ascontiguousarray(pose.position),
        np.ascontiguousarray(pose.wxyz), radius, error, np.zeros(SLOTS * LANES),
    )  # fmt: skip
    return radius, error

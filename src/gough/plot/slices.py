"""Poses over two coordinates, and what a figure of the workspace shows of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import GoughError, suggestion
from gough.kinematics import assembly_sign, leg_lengths, platform_pose, singularity_distance
from gough.platform import Platform
from gough.plot.quantities import Quantity, limit_shares, quantity_named
from gough.pose import Pose, pose_values

COORDINATES = ("x", "y", "z", "rx", "ry", "rz")
WIDEST = {"rx": 180.0, "ry": 90.0, "rz": 180.0}  # [deg] what Euler angles tell apart
RESOLUTION = 271  # poses along each axis
BEYOND = 1.25  # span of a slice / span of workspace and stroke


@dataclass(frozen=True, eq=False)
class WorkspaceSlice:
    """Poses over two coordinates, the other four fixed: n values of the first, m of the second.

    Attributes:
        platform: whose workspace it is.
        axes: the two coordinates, of x, y, z [platform unit], rx, ry, rz [deg].
        u, v: (n,) and (m,) their values.
        fixed: the values of the other four, same units.
        quantity: what `values` are.
        values: (m, n) of the quantity that is drawn.
        distance: (m, n) distance to the nearest singularity; NaN where motors cannot reach.
        signed: (m, n) the same, negative where det J has not home's sign.
        margin: (m, n, 6) `stroke_margin`, negative outside; NaN where no stroke is stated or
            motors cannot reach.
        shares: (m, n) by name of each further limit that the machine states, such as "clearance":
            what is left of it, negative beyond it (see `gough.Limits.share`).
        frame: whose poses these are, such as "tool in work"; "" for the platform's.
    """

    platform: Platform
    axes: tuple[str, str]
    u: Array
    v: Array
    fixed: dict[str, float]
    quantity: Quantity
    values: Array
    distance: Array
    signed: Array
    margin: Array
    shares: dict[str, Array]
    frame: str = ""

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """(m, n) poses that have readings."""
        return np.isfinite(self.distance)

    @property
    def limits(self) -> dict[str, Array]:
        """What is left (m, n) of each limit that ends the workspace, by its name."""
        stroke = {} if self.platform.stroke is None else {"stroke": self.margin.min(axis=-1)}
        return stroke | self.shares


def workspace_slice(
    platform: Platform,
    axes: tuple[str, str] = ("x", "y"),
    *,
    at: Mapping[str, float] | None = None,
    span: tuple[float, float, float, float] | None = None,
    resolution: int = RESOLUTION,
    quantity: str = "singularity",
    frame: str | None = None,
) -> WorkspaceSlice:
    """Calculate a quantity, the distance to singularity and all limits over a grid of poses.

    Args:
        axes: two of x, y, z, rx, ry, rz; angles are those of R = Rx Ry Rz.
        at: values of the others [platform unit] or [deg]; those not given are home's.
        span: lowest and highest value of the first, then of the second axis; without it a
            little more than workspace and stroke allow.
        resolution: poses along each axis.
        quantity: "singularity" (its distance), "margin" (share that is left of the tightest
            limit), "force" (largest of a leg under the payload), "stiffness" (in the softest
            direction), "speed" (highest of the position) or "error" (of the position by that of
            the readings).
        frame: whose coordinates the axes are, and whose stiffness, speed and error are drawn, such
            as "tool in work" (see `Platform.frame`); those of the platform unless given.

    Raises:
        GoughError: unknown or equal axes, an empty span, too few poses, an unknown quantity or
            frame, or one that needs a payload that the platform does not state.
    """
    drawn = quantity_named(quantity, platform)
    first, second = axes
    fixed = _fixed(platform, axes, at or {}, frame)
    if resolution < 2:
        raise GoughError(f"resolution: expected 2 or more, found {resolution}")
    limits = [_span(platform, fixed, name, frame) for name in axes] if span is None else [
        _checked(name, *span[2 * i : 2 * i + 2]) for i, name in enumerate(axes)
    ]  # fmt: skip
    u, v = (np.linspace(low, high, resolution) for low, high in limits)
    pose = _poses({**fixed, first: u[None, :], second: v[:, None]})
    own = platform_pose(platform, pose, frame)
    distance = singularity_distance(platform, own)
    others = {name: value for name, value in fixed.items() if name not in axes}
    return WorkspaceSlice(
        platform, (first, second), u, v, others, drawn, drawn.of(platform, pose, frame), distance,
        distance * assembly_sign(platform, own), stroke_margin(platform, own),
        limit_shares(platform, own), frame or "",
    )  # fmt: skip


def stroke_margin(platform: Platform, pose: Pose) -> Array:
    """Distance (..., 6) of readings to the nearer end of their stroke / stroke."""
    readings = leg_lengths(platform, pose)
    if platform.stroke is None:
        return np.full(readings.shape, np.nan)
    low, high = platform.stroke.T
    return np.minimum(readings - low, high - readings) / (high - low)


def is_angle(name: str) -> bool:
    """True for rx, ry and rz."""
    return name.startswith("r")


def _home(platform: Platform, frame: str | None = None) -> dict[str, float]:
    home = platform.frame(frame).of(platform.home) if frame else platform.home
    return dict(zip(COORDINATES, pose_values(home, "deg").tolist(), strict=True))


def _fixed(
    platform: Platform, axes: tuple[str, str], at: Mapping[str, float], frame: str | None
) -> dict[str, float]:
    """All six coordinates, home's unless given."""
    for name in (*axes, *at):
        if name not in COORDINATES:
            near = suggestion(name, COORDINATES)
            raise GoughError(f"no coordinate {name!r}{near} there are {', '.join(COORDINATES)}")
    if axes[0] == axes[1]:
        raise GoughError(f"axes: expected two different coordinates, found {axes[0]} twice")
    for name in at:
        if name in axes:
            raise GoughError(f"{name}: is an axis of the slice, so it cannot have one value")
        if not np.isfinite(at[name]):
            raise GoughError(f"{name}: expected a finite number, found {at[name]}")
    return _home(platform, frame) | dict(at)


def _poses(values: Mapping[str, Any]) -> Pose:
    """Poses whose coordinates broadcast against each other."""
    numbers = np.stack(np.broadcast_arrays(*(values[name] for name in COORDINATES)), axis=-1)
    return Pose.from_euler(numbers[..., :3], np.radians(numbers[..., 3:]))


def _checked(name: str, low: float, high: float) -> tuple[float, float]:
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise GoughError(f"span: {name}: expected lowest below highest, found {low:g} {high:g}")
    return low, high


def workspace_box(
    platform: Platform, frame: str | None = None
) -> dict[str, tuple[float, float]] | None:
    """Lowest and highest value of each coordinate.

    None where none is stated, where home is rotated, or for a frame: the box about home is then
    not a box in these coordinates.
    """
    if frame:
        return None
    box, home = platform.workspace, _home(platform)
    if box is None or any(abs(home[name]) > 1e-9 for name in ("rx", "ry", "rz")):
        return None
    edges = [*box.translation, *box.rotation_deg]
    return {
        name: (home[name] + edge[0], home[name] + edge[1])
        for name, edge in zip(COORDINATES, edges, strict=True)
    }


def _span(
    platform: Platform, fixed: dict[str, float], name: str, frame: str | None
) -> tuple[float, float]:
    """Range of one axis: workspace or stroke through `fixed`, and a little more."""
    middle = fixed[name]
    widest = WIDEST.get(name, platform.size)
    reach = [0.35 * widest] * 2 if not is_angle(name) else [60.0] * 2
    box = workspace_box(platform, frame)
    if platform.stroke is not None:
        steps = np.linspace(0, widest, 2001)
        reach = [_first_outside(platform, fixed, name, middle + s * steps, frame) * widest / 2000
                 for s in (-1, 1)]  # fmt: skip
    if box is not None:
        reach = [max(reach[0], middle - box[name][0]), max(reach[1], box[name][1] - middle)]
    low, high = middle - BEYOND * reach[0], middle + BEYOND * reach[1]
    if is_angle(name):
        low, high = max(low, -widest), min(high, widest)
    return _checked(name, low, high)


def _first_outside(
    platform: Platform, fixed: dict[str, float], name: str, values: Array, frame: str | None
) -> int:
    """Number of steps along `values` with all readings within their stroke; 1 at least."""
    own = platform_pose(platform, _poses({**fixed, name: values}), frame)
    margin = stroke_margin(platform, own).min(axis=-1)
    outside = np.flatnonzero(~(margin >= 0))
    return max(1, int(outside[0])) if len(outside) else len(values) - 1

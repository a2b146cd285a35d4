"""A slice of the workspace: distance to singularity, stroke limits, singularity curve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from gough.checks import Array
from gough.errors import GoughError, suggestion
from gough.kinematics import assembly_sign, leg_lengths, singularity_distance
from gough.platform import Platform
from gough.plot.style import (
    BLUE,
    FAINT,
    INK,
    PURPLE,
    VERMILION,
    label_number,
    length_unit,
    muted,
    new_figure,
    styled,
)
from gough.pose import Pose, pose_values

NEAR_ZERO = 0.25  # colours begin at 0 where the least distance / largest is below this
RIM = "#22222266"  # around lines on colours
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
        distance: (m, n) distance to the nearest singularity; NaN where motors cannot reach.
        signed: (m, n) the same, negative where det J has not home's sign.
        margin: (m, n, 6) `stroke_margin`, negative outside; NaN where no stroke is stated or
            motors cannot reach.
    """

    platform: Platform
    axes: tuple[str, str]
    u: Array
    v: Array
    fixed: dict[str, float]
    distance: Array
    signed: Array
    margin: Array

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """(m, n) poses that have readings."""
        return np.isfinite(self.distance)


def workspace_slice(
    platform: Platform,
    axes: tuple[str, str] = ("x", "y"),
    *,
    at: Mapping[str, float] | None = None,
    span: tuple[float, float, float, float] | None = None,
    resolution: int = RESOLUTION,
) -> WorkspaceSlice:
    """Calculate distance to singularity and margin to the stroke over a grid of poses.

    Args:
        axes: two of x, y, z, rx, ry, rz; angles are those of R = Rx Ry Rz.
        at: values of the others [platform unit] or [deg]; those not given are home's.
        span: lowest and highest value of the first, then of the second axis; without it a
            little more than workspace and stroke allow.
        resolution: poses along each axis.

    Raises:
        GoughError: unknown or equal axes, an empty span, too few poses.
    """
    first, second = axes
    fixed = _fixed(platform, axes, at or {})
    if resolution < 2:
        raise GoughError(f"resolution: expected 2 or more, found {resolution}")
    limits = [_span(platform, fixed, name) for name in axes] if span is None else [
        _checked(name, *span[2 * i : 2 * i + 2]) for i, name in enumerate(axes)
    ]  # fmt: skip
    u, v = (np.linspace(low, high, resolution) for low, high in limits)
    pose = _poses({**fixed, first: u[None, :], second: v[:, None]})
    distance = singularity_distance(platform, pose)
    others = {name: value for name, value in fixed.items() if name not in axes}
    return WorkspaceSlice(
        platform, (first, second), u, v, others, distance,
        distance * assembly_sign(platform, pose), stroke_margin(platform, pose),
    )  # fmt: skip


def stroke_margin(platform: Platform, pose: Pose) -> Array:
    """Distance (..., 6) of readings to the nearer end of their stroke / stroke."""
    readings = leg_lengths(platform, pose)
    if platform.stroke is None:
        return np.full(readings.shape, np.nan)
    low, high = platform.stroke.T
    return np.minimum(readings - low, high - readings) / (high - low)


@styled
def workspace_figure(cut: WorkspaceSlice) -> Figure:
    """Draw a slice, with colour bar and legend."""
    figure = new_figure(6.8, 5.6)
    axes = figure.add_subplot()
    image = draw_slice(axes, cut)
    bar = figure.colorbar(image, ax=axes, shrink=0.85, aspect=26, pad=0.02)
    bar.set_label("distance to singularity [1], 0 is singular")
    bar.outline.set_visible(False)
    figure.suptitle(f"{cut.platform.name}: {_fixed_text(cut)}")
    figure.legend(handles=_marks(cut), loc="outside lower center", ncols=3)
    return figure


def draw_slice(axes: Axes, cut: WorkspaceSlice) -> Any:
    """Draw a slice into given axes; returns the image, for a colour bar.

    Darker is closer to a singularity; the colours span the distances within the stroke. Thin
    lines join poses of equal distance. The singularity curve, where det J changes its sign, is
    vermilion and dashed. The edge of the stroke is a thick dark line, with everything outside
    hatched; the limits of single legs are thin dotted lines. Poses that the motors
    of a rotary machine cannot reach are grey.
    """
    half = [(values[1] - values[0]) / 2 for values in (cut.u, cut.v)]
    extent = (cut.u[0] - half[0], cut.u[-1] + half[0], cut.v[0] - half[1], cut.v[-1] + half[1])
    scale = muted("cividis", 0.0, 0.95).with_extremes(bad=FAINT)
    inside = _inside(cut)
    lowest = max(0.0, np.nanmin(inside, initial=np.inf)) if np.any(np.isfinite(inside)) else 0.0
    highest = np.nanmax(inside, initial=lowest)
    lowest = 0.0 if lowest < NEAR_ZERO * highest else lowest
    image = axes.imshow(
        np.ma.masked_invalid(cut.distance), origin="lower", extent=extent, aspect="auto",
        cmap=scale, vmin=lowest, vmax=highest, interpolation="nearest",
    )  # fmt: skip
    _equal_distance(axes, cut)
    _stroke(axes, cut)
    _zero(axes, cut, cut.signed, colors="white", linewidths=4.0)  # a rim, for dark ground
    _zero(axes, cut, cut.signed, colors=VERMILION, linewidths=2.2, linestyles="dashed")
    _box(axes, cut)
    axes.set(xlim=(cut.u[0], cut.u[-1]), ylim=(cut.v[0], cut.v[-1]))
    axes.set(xlabel=_label(cut, 0), ylabel=_label(cut, 1))
    axes.grid(visible=False)
    if len({_is_angle(name) for name in cut.axes}) == 1:
        axes.set_aspect("equal", adjustable="box")
    return image


# ---- drawing -------------------------------------------------------------------------


def _inside(cut: WorkspaceSlice) -> Array:
    """Distances (m, n) of the slice, NaN outside the stroke."""
    outside = np.any(cut.margin < 0, axis=-1)
    return np.where(outside, np.nan, cut.distance)


def _equal_distance(axes: Axes, cut: WorkspaceSlice) -> None:
    """Draw lines of equal distance within the stroke, with labels that read on any colour."""
    inside = _inside(cut)
    if np.nanmax(inside, initial=0) > np.nanmin(inside, initial=0):
        lines = axes.contour(
            cut.u, cut.v, np.ma.masked_invalid(inside), levels=6, colors="white", linewidths=0.8
        )
        lines.set_path_effects([withStroke(linewidth=1.8, foreground=RIM)])
        for label in axes.clabel(lines, fontsize=8, fmt="%.3g", colors="white"):
            label.set_path_effects([withStroke(linewidth=1.4, foreground=INK)])


def _stroke(axes: Axes, cut: WorkspaceSlice) -> None:
    if cut.platform.stroke is None:
        return
    for leg in range(6):
        _zero(axes, cut, cut.margin[..., leg], colors=INK, linewidths=0.7, linestyles="dotted")
    worst = cut.margin.min(axis=-1)
    if np.nanmin(worst, initial=0) < 0:
        axes.contourf(cut.u, cut.v, np.ma.masked_invalid(worst), levels=[-np.inf, 0.0],
                      colors=["#FFFFFF70"], hatches=["///"])  # fmt: skip
    _zero(axes, cut, worst, colors=INK, linewidths=2.0)


def _zero(axes: Axes, cut: WorkspaceSlice, values: Array, **look: Any) -> None:
    """Draw the line where values change their sign, if they do."""
    if np.nanmin(values, initial=0) < 0 < np.nanmax(values, initial=0):
        axes.contour(cut.u, cut.v, np.ma.masked_invalid(values), levels=[0.0], **look)


def _box(axes: Axes, cut: WorkspaceSlice) -> None:
    """Draw the stated workspace."""
    box = _workspace_box(cut.platform)
    if box is None:
        return
    (a, b), (c, d) = (box[name] for name in cut.axes)
    for color, width, line in (("white", 3.0, "-"), (PURPLE, 1.6, "-")):
        axes.add_patch(Rectangle((a, c), b - a, d - c, fill=False, edgecolor=color,
                                 linewidth=width, linestyle=line))  # fmt: skip


def _marks(cut: WorkspaceSlice) -> list[Any]:
    marks: list[Any] = []
    if np.nanmin(cut.signed, initial=0) < 0 < np.nanmax(cut.signed, initial=0):
        marks.append(Line2D([], [], color=VERMILION, linestyle="--", linewidth=2.2,
                            label="singularity: det J changes sign"))  # fmt: skip
    if cut.platform.stroke is not None:
        marks += [
            Line2D([], [], color=INK, linewidth=2, label="edge of the stroke"),
            Line2D([], [], color=INK, linewidth=0.7, linestyle=":", label="limit of one leg"),
            Patch(facecolor="white", edgecolor=INK, hatch="////", label="outside the stroke"),
        ]
    if _workspace_box(cut.platform) is not None:
        marks.append(Line2D([], [], color=PURPLE, linewidth=1.6, label="stated workspace"))
    if not np.all(cut.reachable):
        marks.append(Patch(facecolor=FAINT, label="out of the motors' reach"))
    return marks or [Patch(facecolor=BLUE, label="all poses regular")]


def _label(cut: WorkspaceSlice, i: int) -> str:
    name = cut.axes[i]
    return f"{name} [{'deg' if _is_angle(name) else length_unit(cut.platform)}]"


def _fixed_text(cut: WorkspaceSlice) -> str:
    lengths = [n for n in cut.fixed if not _is_angle(n)]
    angles = [n for n in cut.fixed if _is_angle(n)]
    parts = []
    for names, size, unit in (
        (lengths, cut.platform.size, length_unit(cut.platform)),
        (angles, 100.0, "deg"),
    ):
        if names:
            values = ", ".join(f"{n} {label_number(cut.fixed[n], size)}" for n in names)
            parts.append(f"{values} {unit}")
    return "; ".join(parts)


# ---- ranges ---------------------------------------------------------------------------


def _is_angle(name: str) -> bool:
    return name.startswith("r")


def _home(platform: Platform) -> dict[str, float]:
    return dict(zip(COORDINATES, pose_values(platform.home, "deg").tolist(), strict=True))


def _fixed(platform: Platform, axes: tuple[str, str], at: Mapping[str, float]) -> dict[str, float]:
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
    return _home(platform) | dict(at)


def _poses(values: Mapping[str, Any]) -> Pose:
    """Poses whose coordinates broadcast against each other."""
    numbers = np.stack(np.broadcast_arrays(*(values[name] for name in COORDINATES)), axis=-1)
    return Pose.from_euler(numbers[..., :3], np.radians(numbers[..., 3:]))


def _checked(name: str, low: float, high: float) -> tuple[float, float]:
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise GoughError(f"span: {name}: expected lowest below highest, found {low:g} {high:g}")
    return low, high


def _workspace_box(platform: Platform) -> dict[str, tuple[float, float]] | None:
    """Lowest and highest value of each coordinate.

    None where none is stated, or where home is rotated: the box about home is then not a box
    in these coordinates.
    """
    box, home = platform.workspace, _home(platform)
    if box is None or any(abs(home[name]) > 1e-9 for name in ("rx", "ry", "rz")):
        return None
    edges = [*box.translation, *box.rotation_deg]
    return {
        name: (home[name] + edge[0], home[name] + edge[1])
        for name, edge in zip(COORDINATES, edges, strict=True)
    }


def _span(platform: Platform, fixed: dict[str, float], name: str) -> tuple[float, float]:
    """Range of one axis: workspace or stroke through `fixed`, and a little more."""
    middle = fixed[name]
    widest = WIDEST.get(name, platform.size)
    reach = [0.35 * widest] * 2 if not _is_angle(name) else [60.0] * 2
    box = _workspace_box(platform)
    if platform.stroke is not None:
        steps = np.linspace(0, widest, 2001)
        reach = [_first_outside(platform, fixed, name, middle + s * steps) * widest / 2000
                 for s in (-1, 1)]  # fmt: skip
    if box is not None:
        reach = [max(reach[0], middle - box[name][0]), max(reach[1], box[name][1] - middle)]
    low, high = middle - BEYOND * reach[0], middle + BEYOND * reach[1]
    if _is_angle(name):
        low, high = max(low, -widest), min(high, widest)
    return _checked(name, low, high)


def _first_outside(platform: Platform, fixed: dict[str, float], name: str, values: Array) -> int:
    """Number of steps along `values` with all readings within their stroke; 1 at least."""
    margin = stroke_margin(platform, _poses({**fixed, name: values})).min(axis=-1)
    outside = np.flatnonzero(~(margin >= 0))
    return max(1, int(outside[0])) if len(outside) else len(values) - 1

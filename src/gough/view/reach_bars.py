"""Bars of how far each axis of the pose can still move, each way, and what ends it."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from gough.checks import Array
from gough.frames import FramePose
from gough.platform import Platform
from gough.text import decimals, with_unit
from gough.view import meshes

if TYPE_CHECKING:
    import viser

    from gough.margins import Reach

AXES = ("x", "y", "z", "about x", "about y", "about z")
LITTLE = 0.05  # of a full bar; less is drawn orange
STYLE = (
    "<style>[data-gough=reach]{display:grid;grid-template-columns:auto 1fr 4.5em 1fr;gap:0 0.5em;"
    "align-items:center;margin:0.2em 0.95em 0.5em;font-size:0.75em;line-height:1.25;"
    "font-variant-numeric:tabular-nums}[data-gough=reach] i{opacity:0.75;display:block}"
    "[data-gough=reach] u{height:0.7em;display:flex;text-decoration:none;"
    "background:rgba(128,128,128,0.2)}</style>"
)


class ReachBars:
    """Six rows: the way down, a bar with the present pose in its middle, the way up."""

    def __init__(self, gui: viser.GuiApi, platform: Platform, view: FramePose | None) -> None:
        self._platform, self._full = platform, np.ones(6)
        at_rest = "the base" if view is None else view.name.split(" in ")[1]
        name = f"Left from here, along and about axes of {at_rest}"
        with gui.add_folder(with_unit(name, f"{platform.unit}, deg".lstrip(", "))):
            self._html = gui.add_html("")

    def set_scale(self, home: Reach) -> None:
        """Scale the bars by the ways from home: at home the longest of each unit is half full."""
        longest = np.nanmax(home.distance.reshape(2, -1), axis=1, initial=1e-12)
        self._full = np.repeat(2 * longest, 3)

    def show(self, reach: Reach) -> None:
        """Show the ways from a pose."""
        html = reach_html(reach, self._full, decimals(self._platform.size, 4))
        if html != self._html.content:
            self._html.content = html


def reach_html(reach: Reach, full: Array, places: int) -> str:
    """Rows of the bars as HTML.

    Args:
        full: (6,) ways that fill half a bar.
        places: digits after the point of lengths.
    """
    rows, scale = "", np.repeat([1.0, np.degrees(1.0)], 3)
    for k, axis in enumerate(AXES):
        shares = np.clip(np.nan_to_num(reach.distance[k] / full[k]), 0, 1)
        ways = [f"{v:.{places if k < 3 else 2}f}" for v in scale[k] * reach.distance[k]]
        low, high = (
            f"{way}<i>{escape(str(name)) or 'no limit met'}</i>"
            for way, name in zip(ways, reach.limit[k], strict=True)
        )
        rows += (
            f"<span>{axis}</span><span style='text-align:right'>-{low}</span>"
            f"<u>{_half(shares[0], 'margin-left:auto')}"
            f"<b style='width:1px;background:currentColor'></b>{_half(shares[1], '')}</u>"
            f"<span>+{high}</span>"
        )
    return f"{STYLE}<div data-gough='reach'>{rows}</div>"


def _half(share: float, side: str) -> str:
    color = meshes.BLUE if share > LITTLE else meshes.ORANGE
    return (
        f"<b style='flex:1;display:flex'><b style='width:{100 * share:.1f}%;{side};"
        f"background:{color}'></b></b>"
    )

"""Parts of the panel and of exported pages, as HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.kernel.constants import SINGULAR
from gough.platform import Platform
from gough.skeleton import outside_stroke
from gough.text import decimals, with_unit
from gough.view import meshes
from gough.view.beyond import leg_factor, leg_unit
from gough.view.model import CLOSE, Model

if TYPE_CHECKING:
    from gough.view.trajectory import Trajectory

POSE_NAMES = ("x", "y", "z", "rx", "ry", "rz")
ANGLE_DIGITS = 4  # after the point [deg]
LINE_POINTS = 400  # most points of a curve in the strip

SMALL = "font-size:0.8em;opacity:0.8"
# viser's boxes beside sliders are too narrow for more than five digits
WIDE_BOXES = "<style>[style*='width: 3rem']{width:4.6rem !important}</style>"
# viser is dark by its address only: reload once where the browser prefers dark pages
DARK = (
    "<img hidden src='data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIB"
    "RAA7' onload=\"const q=new URLSearchParams(location.search);"
    "if(matchMedia('(prefers-color-scheme: dark)').matches&&!q.has('darkMode')&&"
    "location.protocol.startsWith('http')){q.set('darkMode','');location.search=q}\">"
)
# navigator.clipboard would need https, which a page from another computer has not
COPY = (
    "const a=document.createElement('textarea'),l=this.textContent;a.value=this.dataset.copy;"
    "document.body.append(a);a.select();document.execCommand('copy');a.remove();"
    "this.textContent='copied';setTimeout(()=>this.textContent=l,900)"
)


def status_card(model: Model, note: str = "") -> str:
    """Result of the last request, what it took, and the distance to a singularity.

    Args:
        note: something that goes on at the same time.
    """
    answer = model.answer
    edge = meshes.OUT
    if answer.reached:
        well = model.singularity_share > CLOSE and model.beyond.ok
        edge = meshes.GREEN if well else meshes.ORANGE
    took = [answer.how]
    if answer.how == "forward kinematics" or answer.residual:
        took.append(f"residual {answer.residual:.3g} {model.platform.unit}".rstrip())
    if answer.iterations:
        took.append(f"{answer.iterations} iterations")
    if answer.seconds:
        took.append(_duration(answer.seconds))
    numbers = model.values(model.pose)
    aside = f"<div data-gough='note' style='{SMALL}'>{escape(note)}</div>" if note else ""
    return (
        f"{WIDE_BOXES}<div style='margin:0.4em 0.75em;padding:0.1em 0 0.1em 0.7em;"
        f"border-left:4px solid {edge};font-size:0.85em;line-height:1.35'>"
        f"<div data-gough='status' data-reached='{str(answer.reached).lower()}'>"
        f"{escape(answer.text)}</div><div style='{SMALL};display:flex;gap:0.6em'>"
        f"<span data-gough='took' style='flex:1'>{escape(' · '.join(took))}</span>"
        f"{_copy('copy pose', numbers, f'{model.frame} x y z, rx ry rz [deg]'.strip())}"
        f"{_copy('copy readings', model.legs, 'as gough modes takes them')}"
        f"</div>{aside}</div>{_meter(model)}"
    )


def legend(platform: Platform) -> str:
    """Meaning of the legs' colours."""
    if platform.stroke is None:
        text = "Legs are grey: the platform states no stroke."
        return f"{DARK}<div style='{SMALL};margin:0.2em 0.95em'>{text}</div>"
    ramp = ", ".join(meshes.RAMP)
    low, high = ("lowest", "highest") if platform.legs == "rotary" else ("shortest", "longest")
    flat = "height:0.6em;border-radius:2px"
    red = "outside stroke" if platform.limits is None else "beyond a limit"
    return (
        f"{DARK}<div style='{SMALL};margin:0.2em 0.95em;display:flex;align-items:center;gap:0.5em'>"
        f"<span>{low}</span><span style='flex:1;{flat};"
        f"background:linear-gradient(90deg, {ramp})'></span><span>{high}</span>"
        f"<span style='width:1.6em;{flat};background:{meshes.OUT}'></span>"
        f"<span>{red}</span></div>"
    )


def numbers_table(model: Model) -> str:
    """Readings and pose of the picture: six rows of leg, reading, coordinate and value."""
    platform = model.platform
    what = "motor" if platform.legs == "rotary" else "leg"
    names = [f"{what} {i + 1}" for i in range(6)]
    units = [leg_unit(platform)] * 6, [platform.unit] * 3 + ["deg"] * 3
    values = number_cells(platform, model.legs, model.values(model.pose))
    rows = ""
    for i in range(6):
        heads = with_unit(names[i], units[0][i]), with_unit(POSE_NAMES[i], units[1][i])
        cells = (heads[0], values[2 * i], heads[1], values[2 * i + 1])
        rows += "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
    whose = f"pose of {model.frame}" if model.frame else ""
    return (
        "<style>[data-gough=numbers]{font-variant-numeric:tabular-nums;border-spacing:0;"
        "width:100%}[data-gough=numbers] td{padding:0 0.4em 0 0;white-space:nowrap}"
        "[data-gough=numbers] td:nth-child(even){text-align:right;padding-right:0.9em}</style>"
        f"<div style='margin:0.3em 0.95em;font-size:0.85em'>{escape(whose)}"
        f"<table data-gough='numbers'>{rows}</table></div>"
    )


def strip(platform: Platform, trajectory: Trajectory) -> str:
    """Six small curves: the readings over time, each over its own range, red outside the stroke."""
    every = -(-len(trajectory) // LINE_POINTS)
    legs = trajectory.legs[::every]
    x = 100 * time_shares(trajectory.time[::every])
    outside = outside_stroke(platform, legs)
    low, high = np.nanmin(legs, axis=0, initial=np.inf), np.nanmax(legs, axis=0, initial=-np.inf)
    span = np.where(high > low, high - low, 1.0)
    y = 10 * np.arange(6) + 8.5 - 7 * (legs - low) / span
    curves = ""
    for i in range(6):
        curves += _curve(x, y[:, i], np.isfinite(y[:, i]), "currentColor")
        curves += _curve(x, y[:, i], outside[:, i], meshes.OUT)
    labels = "".join(f"<div style='height:1.2em'>{i + 1}</div>" for i in range(6))
    return (
        "<div style='display:flex;gap:0.5em;margin:0.3em 0.95em;font-size:0.8em;line-height:1.2' "
        f"title='readings of the legs over time'><div>{labels}</div>"
        "<div style='position:relative;flex:1'>"
        "<svg viewBox='0 0 100 60' preserveAspectRatio='none' width='100%' "
        f"style='display:block;height:7.2em'>{curves}"
        "</svg><div data-gough='cursor' style='position:absolute;top:0;bottom:0;left:0;"
        f"border-left:2px solid {meshes.ORANGE}'></div></div></div>"
    )


def row_text(trajectory: Trajectory, row: int) -> str:
    """Number and time of the row in the picture, and the cursor of the strip below it."""
    left = 100 * time_shares(trajectory.time)[row]
    return (
        f"<div style='margin:0.3em 0.95em;font-size:0.85em'>{trajectory.where(row)}</div>"
        f"<style>[data-gough=cursor]{{left:{left:.2f}% !important}}</style>"
    )


def mode_label(number: int, numbers: Array, platform: Platform) -> str:
    """One assembly mode in a line: its number, position and Euler angles (6,)."""
    places = decimals(platform.size, 4)
    position = ", ".join(f"{v:z.{places}f}" for v in numbers[:3])
    angles = ", ".join(f"{v:z.0f}" for v in numbers[3:])
    return f"{number}:  {position} {platform.unit};  {angles}°"


def _copy(label: str, values: Array, hint: str) -> str:
    """Button that copies six numbers, with all their digits, to the clipboard."""
    text = " ".join(repr(float(v)) for v in values)
    return (
        f'<button data-copy="{text}" title="{hint}" onclick="{COPY}" style="border:0;padding:0;'
        f'background:none;color:inherit;font:inherit;cursor:pointer;text-decoration:underline">'
        f"{label}</button>"
    )


def _meter(model: Model) -> str:
    """Bar that is full at home's distance to a singularity, and empty at one."""
    value, share = model.singularity, model.singularity_share
    if not np.isfinite(value):
        text, width, color = "unknown: motors on their other branch", 0.0, meshes.GREY
    else:
        text = f"{value:.3g} ({100 * share:.0f} % of home's)"
        width = 100 * min(1.0, max(share, 0.0))
        color = meshes.BLUE if share > CLOSE else meshes.ORANGE
        color = meshes.OUT if value < SINGULAR else color
    return (
        f"<div style='margin:0.5em 0.95em 0.3em;font-size:0.8em'>"
        f"<div style='display:flex;justify-content:space-between'>"
        f"<span>distance to a singularity</span><span data-gough='singularity'>{text}</span></div>"
        f"<div style='height:0.5em;background:rgba(128,128,128,0.2);border-radius:2px'>"
        f"<div style='height:100%;width:{width:.1f}%;background:{color};border-radius:2px'></div>"
        f"</div></div>"
    )


def _duration(seconds: float) -> str:
    for scale, name in ((1.0, "s"), (1e3, "ms")):
        if seconds * scale >= 0.1:
            return f"{seconds * scale:.2g} {name}"
    return f"{seconds * 1e6:.0f} µs"


def number_cells(platform: Platform, legs: Array, numbers: Array) -> list[str]:
    """Reading 1, x, reading 2, y, ... as text: lengths to a millionth of the size's first digit."""
    length = decimals(platform.size, 7)
    reading = ANGLE_DIGITS if platform.legs == "rotary" else length
    cells = []
    for i in range(6):
        cells.append(f"{leg_factor(platform) * legs[i]:z.{reading}f}")
        cells.append(f"{numbers[i]:z.{length if i < 3 else ANGLE_DIGITS}f}")
    return cells


def time_shares(times: Array) -> Array:
    """Rising times (N,) as shares of the last."""
    return times / times[-1] if times[-1] > 0 else np.zeros(len(times))


def _curve(x: Array, y: Array, shown: NDArray[np.bool_], color: str) -> str:
    """SVG curve through the points (N,) that are shown, with gaps between their runs."""
    path, gap = "", True
    for a, b, there in zip(x, y, shown, strict=True):
        if there:
            path += f"{'M' if gap else 'L'}{a:.2f} {b:.2f}"
        gap = not there
    style = f"fill='none' stroke='{color}' vector-effect='non-scaling-stroke'"
    return f"<path d='{path}' {style}/>" if path else ""

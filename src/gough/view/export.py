"""HTML: the parts that the panel shows, and pages that open without a server."""

from __future__ import annotations

import json
from html import escape
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.kernel.constants import SINGULAR
from gough.platform import Platform
from gough.pose import pose_values
from gough.skeleton import outside_stroke
from gough.text import decimals, with_unit
from gough.view import meshes
from gough.view.model import CLOSE, Model, leg_factor, leg_unit
from gough.view.scene import Scene
from gough.view.server import close_server, open_server

if TYPE_CHECKING:
    from gough.view.trajectory import Trajectory

POSE_NAMES = ("x", "y", "z", "rx", "ry", "rz")
LONGEST_WAIT = 1.0  # [s] between two rows of an exported page
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
PAGE_STYLE = """
#gough{position:fixed;top:1em;left:1em;z-index:2;width:21em;padding:0.7em 0.9em;
  background:rgba(255,255,255,0.88);border-radius:4px;box-shadow:0 0 1em rgba(0,0,0,0.08);
  font:13px/1.4 system-ui,sans-serif;color:#212529;pointer-events:none}
#gough h1{font-size:15px;margin:0 0 0.3em}#gough p{margin:0.3em 0}
@media (prefers-color-scheme: dark){#gough{background:rgba(26,27,30,0.88);color:#C9CDD2}}
"""
# moves cursor and numbers of a recorded page to the time of viser's player
PAGE_SCRIPT = """
const rows=DATA,cells=document.querySelectorAll('#gough [data-gough=numbers] td:nth-child(even)'),
  cursor=document.querySelector('#gough [data-gough=cursor]'),
  where=document.querySelector('#gough [data-gough=where]');
setInterval(()=>{
  const t=Number(document.querySelector('[role=slider]')?.getAttribute('aria-valuenow')??0);
  let i=rows.at.findIndex(a=>a>t);
  i=i<0?rows.at.length-1:Math.max(0,i-1);
  cursor.style.left=rows.share[i]+'%';
  where.textContent=rows.where[i];
  rows.numbers[i].forEach((v,k)=>{cells[k].textContent=v});
},50);
"""


# ---- parts of the panel ---------------------------------------------------------------


def status_card(model: Model, note: str = "") -> str:
    """Result of the last request, what it took, and the distance to a singularity.

    Args:
        note: something that goes on at the same time.
    """
    answer = model.answer
    edge = meshes.OUT
    if answer.reached:
        well = model.singularity_share > CLOSE and model.within_limits
        edge = meshes.GREEN if well else meshes.ORANGE
    took = [answer.how]
    if answer.how == "forward kinematics" or answer.residual:
        took.append(f"residual {answer.residual:.3g} {model.platform.unit}".rstrip())
    if answer.iterations:
        took.append(f"{answer.iterations} iterations")
    if answer.seconds:
        took.append(_duration(answer.seconds))
    numbers = pose_values(model.pose, "deg")
    aside = f"<div data-gough='note' style='{SMALL}'>{escape(note)}</div>" if note else ""
    return (
        f"{WIDE_BOXES}<div style='margin:0.4em 0.75em;padding:0.1em 0 0.1em 0.7em;"
        f"border-left:4px solid {edge};font-size:0.85em;line-height:1.35'>"
        f"<div data-gough='status' data-reached='{str(answer.reached).lower()}'>"
        f"{escape(answer.text)}</div><div style='{SMALL};display:flex;gap:0.6em'>"
        f"<span data-gough='took' style='flex:1'>{escape(' · '.join(took))}</span>"
        f"{_copy('copy pose', numbers, 'x y z, rx ry rz [deg]')}"
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
    return (
        f"{DARK}<div style='{SMALL};margin:0.2em 0.95em;display:flex;align-items:center;gap:0.5em'>"
        f"<span>{low}</span><span style='flex:1;{flat};"
        f"background:linear-gradient(90deg, {ramp})'></span><span>{high}</span>"
        f"<span style='width:1.6em;{flat};background:{meshes.OUT}'></span>"
        f"<span>outside stroke</span></div>"
    )


def numbers_table(model: Model) -> str:
    """Readings and pose of the picture: six rows of leg, reading, coordinate and value."""
    platform = model.platform
    what = "motor" if platform.legs == "rotary" else "leg"
    names = [f"{what} {i + 1}" for i in range(6)]
    units = [leg_unit(platform)] * 6, [platform.unit] * 3 + ["deg"] * 3
    values = _number_cells(platform, model.legs, pose_values(model.pose, "deg"))
    rows = ""
    for i in range(6):
        heads = with_unit(names[i], units[0][i]), with_unit(POSE_NAMES[i], units[1][i])
        cells = (heads[0], values[2 * i], heads[1], values[2 * i + 1])
        rows += "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
    return (
        "<style>[data-gough=numbers]{font-variant-numeric:tabular-nums;border-spacing:0;"
        "width:100%}[data-gough=numbers] td{padding:0;white-space:nowrap}"
        "[data-gough=numbers] td:nth-child(even){text-align:right;padding-right:0.9em}</style>"
        f"<div style='margin:0.3em 0.95em;font-size:0.85em'>"
        f"<table data-gough='numbers'>{rows}</table></div>"
    )


def strip(platform: Platform, trajectory: Trajectory) -> str:
    """Six small curves: the readings over time, each over its own range, red outside the stroke."""
    every = -(-len(trajectory) // LINE_POINTS)
    legs = trajectory.legs[::every]
    x = 100 * _shares(trajectory.time[::every])
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
    left = 100 * _shares(trajectory.time)[row]
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


def _number_cells(platform: Platform, legs: Array, numbers: Array) -> list[str]:
    """Reading 1, x, reading 2, y, ... as text: lengths to a millionth of the size's first digit."""
    length = decimals(platform.size, 7)
    reading = ANGLE_DIGITS if platform.legs == "rotary" else length
    cells = []
    for i in range(6):
        cells.append(f"{leg_factor(platform) * legs[i]:z.{reading}f}")
        cells.append(f"{numbers[i]:z.{length if i < 3 else ANGLE_DIGITS}f}")
    return cells


def _shares(times: Array) -> Array:
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


# ---- pages without a server -----------------------------------------------------------


def page(model: Model, trajectory: Trajectory | None = None) -> str:
    """HTML file with the picture of a model, or with a trajectory and a time slider."""
    platform = model.platform
    server = open_server("localhost", 0, platform.name)
    try:
        picture = Scene(server, platform, handle=False, panel=False)
        picture.draw(model.pose, model.legs)
        if trajectory is not None:
            picture.show_path(trajectory.pose)
        recording = server.get_scene_serializer()
        waits = np.empty(0)
        if trajectory is not None:
            waits = np.minimum(np.append(np.diff(trajectory.time), 1 / 30), LONGEST_WAIT)
            _record(picture, recording, trajectory, waits)
        html = recording.as_html()
    finally:
        close_server(server)
    html = html.replace(
        "darkMode:false", "darkMode:matchMedia('(prefers-color-scheme: dark)').matches", 1
    )
    caption = _caption_of_file(model, trajectory, waits) if trajectory else _caption(model)
    return _with_caption(html, platform.name, caption)


def _record(picture: Scene, recording, trajectory: Trajectory, waits: Array) -> None:
    """Draw row after row, with the time between them; rows without a pose keep the last one."""
    for i, answer in enumerate(trajectory.answers):
        if answer.reached:
            picture.draw(trajectory.pose[i], trajectory.legs[i])
        recording.insert_sleep(float(waits[i]))


def _caption(model: Model) -> str:
    singular = f"distance to a singularity {model.singularity:.3g}"
    return (
        f"<p data-gough='status'>{escape(model.answer.text)}</p>{numbers_table(model)}"
        f"<p>{singular}</p>{legend(model.platform)}"
    )


def _caption_of_file(model: Model, trajectory: Trajectory, waits: Array) -> str:
    """Caption whose numbers and cursor follow the player."""
    numbers = pose_values(trajectory.pose, "deg")
    rows = {
        "at": np.round(np.append(0.0, np.cumsum(waits)[:-1]), 4).tolist(),
        "share": np.round(100 * _shares(trajectory.time), 2).tolist(),
        "where": [trajectory.where(i) for i in range(len(trajectory))],
        "numbers": [
            _number_cells(model.platform, legs, pose)
            for legs, pose in zip(trajectory.legs, numbers, strict=True)
        ],
    }
    script = PAGE_SCRIPT.replace("DATA", json.dumps(rows).replace("<", "\\u003c"), 1)
    return (
        f"<p data-gough='status'>{escape(trajectory.about)}</p><p data-gough='where'></p>"
        f"{numbers_table(model)}{strip(model.platform, trajectory)}{legend(model.platform)}"
        f"<script>{script}</script>"
    )


def _with_caption(html: str, name: str, caption: str) -> str:
    """Viser's page with a title, and a caption over the picture."""
    name = escape(name)
    box = f"<style>{PAGE_STYLE}</style><div id='gough'><h1>{name}</h1>{caption}</div>"
    start, end = html.index("<title>"), html.index("</title>")
    html = f"{html[:start]}<title>{name} · gough{html[end:]}"
    body = html.rindex("</body>")
    return html[:body] + box + html[body:]

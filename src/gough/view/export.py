"""Pages that open in a browser without a server."""

from __future__ import annotations

import json
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from gough.checks import Array
from gough.view.html_parts import legend, number_cells, numbers_table, strip, time_shares
from gough.view.model import Model
from gough.view.scene import Scene
from gough.view.server import close_server, open_server

if TYPE_CHECKING:
    from gough.view.trajectory import Trajectory

LONGEST_WAIT = 1.0  # [s] between two rows of an exported page
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


def page(model: Model, trajectory: Trajectory | None = None) -> str:
    """HTML file with the picture of a model, or with a trajectory and a time slider."""
    platform = model.platform
    server = open_server("localhost", 0, platform.name)
    try:
        picture = Scene(server, platform, model.view, handle=False, panel=False)
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
    numbers = model.values(trajectory.pose)
    rows = {
        "at": np.round(np.append(0.0, np.cumsum(waits)[:-1]), 4).tolist(),
        "share": np.round(100 * time_shares(trajectory.time), 2).tolist(),
        "where": [trajectory.where(i) for i in range(len(trajectory))],
        "numbers": [
            number_cells(model.platform, legs, pose)
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

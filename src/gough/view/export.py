"""A page that opens without a server: one HTML file with the picture, or a trajectory, in it."""

from __future__ import annotations

from html import escape

import numpy as np

from gough.platform import Platform
from gough.view import server as servers
from gough.view import words
from gough.view.model import Model
from gough.view.scene import Scene
from gough.view.trajectory import Trajectory

LONGEST_STILL = 1.0  # [s] a recording waits at most so long for its next row

STYLE = """
#gough{position:fixed;top:1em;left:1em;z-index:2;max-width:19em;padding:0.7em 0.9em;
  background:rgba(255,255,255,0.88);border-radius:4px;box-shadow:0 0 1em rgba(0,0,0,0.08);
  font:13px/1.4 system-ui,sans-serif;color:#212529;pointer-events:none}
#gough h1{font-size:15px;margin:0 0 0.3em}#gough p{margin:0.3em 0}
#gough table{border-spacing:0;font-variant-numeric:tabular-nums}
#gough td{padding:0 0.8em 0 0}#gough td+td{text-align:right}
"""


def page(model: Model, trajectory: Trajectory | None = None) -> str:
    """The picture of a model, or a trajectory with a time slider, as the text of an HTML file."""
    platform = model.platform
    server = servers.start("localhost", 0, platform.name)
    try:
        scene = Scene(server, platform, handle=False, panel=False)
        scene.draw(model.pose, model.legs)
        if trajectory is not None:
            scene.show_way(trajectory.pose)
        recording = server.get_scene_serializer()
        if trajectory is not None:
            _record(scene, recording, trajectory)
        html = recording.as_html()
    finally:
        servers.stop(server)
    caption = _caption_of_file(platform, trajectory) if trajectory else _caption(model)
    return _with_caption(html, f"{platform.name} · gough", caption)


def _record(scene: Scene, recording, trajectory: Trajectory) -> None:
    """Draw row after row, with the time between them; rows without a pose show the last one."""
    waits = np.append(np.diff(trajectory.time), 1 / 30)
    for i, answer in enumerate(trajectory.answers):
        if answer.reached:
            scene.draw(trajectory.pose[i], trajectory.legs[i])
        recording.insert_sleep(float(min(waits[i], LONGEST_STILL)))


def _caption(model: Model) -> str:
    rows = "".join(
        f"<tr><td>{escape(name)}</td><td>{value}</td></tr>"
        for name, value in words.pose_rows(model)
    )
    singular = f"distance to a singularity {model.singularity:.3g}"
    return (
        f"<p data-gough='status'>{escape(model.answer.text)}</p><table>{rows}</table>"
        f"<p>{singular}</p>{words.legend(model.platform)}"
    )


def _caption_of_file(platform: Platform, trajectory: Trajectory) -> str:
    about = escape(trajectory.about)
    return f"<p data-gough='status'>{about}</p>{words.legend(platform)}"


def _with_caption(html: str, title: str, caption: str) -> str:
    """Viser's page under our title, with a caption over the picture."""
    name = escape(title.partition(" · ")[0])
    box = f"<style>{STYLE}</style><div id='gough'><h1>{name}</h1>{caption}</div>"
    head = html.index("<title>"), html.index("</title>")
    html = f"{html[: head[0]]}<title>{escape(title)}{html[head[1] :]}"
    body = html.rindex("</body>")
    return html[:body] + box + html[body:]

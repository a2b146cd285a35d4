"""What the page says: the status card, the legend, and the captions of exported pages."""

from __future__ import annotations

from html import escape

import numpy as np

from gough.checks import Array
from gough.kernel.constants import SINGULAR
from gough.platform import Platform
from gough.view import colors
from gough.view.model import Model
from gough.view.ranges import leg_factor

POSE_NAMES = ("x", "y", "z", "rx", "ry", "rz")
# viser's boxes beside sliders are too narrow for more than five digits
STYLE = "<style>[style*='width: 3rem']{width:4.6rem !important}</style>"
CLOSE = 0.2  # share of home's distance to a singularity that deserves a warning
SMALL = "font-size:0.8em;color:#5B6670"


def leg_unit(platform: Platform) -> str:
    """The unit in which people are told readings."""
    return "deg" if platform.legs == "rotary" else platform.unit


def with_unit(name: str, unit: str) -> str:
    """A name and its unit in brackets, if it has one."""
    return f"{name} [{unit}]" if unit else name


def status_card(model: Model, note: str = "") -> str:
    """The sentence about the last thing asked for, what it took, and the singularity meter.

    Args:
        note: something that is going on besides.
    """
    answer = model.answer
    edge = colors.OUT
    if answer.reached:
        well = model.singularity_share > CLOSE and not model.out_of_stroke
        edge = colors.GREEN if well else colors.ORANGE
    took = [answer.how]
    if answer.how == "forward kinematics" or answer.residual:
        took.append(f"residual {_with(answer.residual, model.platform.unit, '.3g')}")
    if answer.iterations:
        took.append(f"{answer.iterations} iterations")
    if answer.seconds:
        took.append(_duration(answer.seconds))
    asked = "" if answer.reached else f"<div style='{SMALL}'>{_asked_for(model)}</div>"
    aside = f"<div data-gough='note' style='{SMALL}'>{escape(note)}</div>" if note else ""
    return (
        f"{STYLE}<div style='margin:0.4em 0.75em;padding:0.1em 0 0.1em 0.7em;"
        f"border-left:4px solid {edge};font-size:0.85em;line-height:1.35;min-height:9.5em'>"
        f"<div data-gough='status' data-reached='{str(answer.reached).lower()}'>"
        f"{escape(answer.text)}</div>"
        f"<div data-gough='took' style='{SMALL};margin-top:0.2em'>{escape(' · '.join(took))}</div>"
        f"{asked}{aside}</div>{_meter(model)}"
    )


def legend(platform: Platform) -> str:
    """What the legs' colours mean."""
    if platform.stroke is None:
        text = "Legs are grey: the platform states no stroke."
        return f"<div style='{SMALL};margin:0.2em 0.95em'>{text}</div>"
    ramp = ", ".join(colors.RAMP)
    low, high = ("lowest", "highest") if platform.legs == "rotary" else ("shortest", "longest")
    flat = "height:0.6em;border-radius:2px"
    return (
        f"<div style='{SMALL};margin:0.2em 0.95em;display:flex;align-items:center;gap:0.5em'>"
        f"<span>{low}</span><span style='flex:1;{flat};"
        f"background:linear-gradient(90deg, {ramp})'></span><span>{high}</span>"
        f"<span style='width:1.6em;{flat};background:{colors.OUT}'></span>"
        f"<span>out of stroke</span></div>"
    )


def pose_rows(model: Model) -> list[tuple[str, str]]:
    """Name and value of the six pose numbers and six readings of the picture."""
    platform = model.platform
    units = [platform.unit] * 3 + ["deg"] * 3
    numbers = zip(POSE_NAMES, model.numbers, units, strict=True)
    rows = [(with_unit(n, unit), f"{v:.6g}") for n, v, unit in numbers]
    legs = leg_factor(platform) * model.legs
    what = "motor" if platform.legs == "rotary" else "leg"
    named = with_unit(what, leg_unit(platform)).replace(what, what + " {}", 1)
    return rows + [(named.format(i + 1), f"{v:.6g}") for i, v in enumerate(legs)]


def mode_label(number: int, position: Array, euler_deg: Array, platform: Platform) -> str:
    """One assembly mode in a line."""
    places = max(0, 3 - int(np.floor(np.log10(platform.size))))
    where = ", ".join(f"{v:z.{places}f}" for v in position)
    turn = ", ".join(f"{v:z.0f}" for v in euler_deg)
    return f"{number}:  {where} {platform.unit};  {turn}°"


def _meter(model: Model) -> str:
    """A bar that is full at home's distance to a singularity, and empty at one."""
    value, share = model.singularity, model.singularity_share
    if not np.isfinite(value):
        text, width, color = "not known: the motors are on their other branch", 0.0, colors.GREY
    else:
        text = f"{value:.3g} ({100 * share:.0f} % of home's)"
        width = 100 * min(1.0, max(share, 0.0))
        color = colors.BLUE if share > CLOSE else colors.ORANGE
        color = colors.OUT if value < SINGULAR else color
    return (
        f"<div style='margin:0.5em 0.95em 0.3em;font-size:0.8em'>"
        f"<div style='display:flex;justify-content:space-between'>"
        f"<span>distance to a singularity</span><span data-gough='singularity'>{text}</span></div>"
        f"<div style='height:0.5em;background:#E6E9EC;border-radius:2px'>"
        f"<div style='height:100%;width:{width:.1f}%;background:{color};border-radius:2px'></div>"
        f"</div></div>"
    )


def _asked_for(model: Model) -> str:
    """Which numbers on the page are wishes, and not the picture's."""
    side = "leg" if model.answer.how == "forward kinematics" else "pose"
    return f"The {side} sliders show what was asked for, all else what the picture shows."


def _with(value: float, unit: str, form: str) -> str:
    return f"{value:{form}} {unit}".rstrip()


def _duration(seconds: float) -> str:
    for scale, name in ((1.0, "s"), (1e3, "ms")):
        if seconds * scale >= 0.1:
            return f"{seconds * scale:.2g} {name}"
    return f"{seconds * 1e6:.0f} µs"

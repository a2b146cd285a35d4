"""Figures of networks, drawn from numbers that a benchmark or this file wrote.

`python docs/figures/learned.py` reads one table out of the shipped DisGNet, into disgnet.json.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILION, figure, label, polar, sketch

import gough

NUMBERS = Path(__file__).parent / "universal.json"  # python benchmarks/universal.py distance
RECIPE = Path(__file__).parent / "recipe.json"  # python benchmarks/recipe.py
TABLE = Path(__file__).parent / "disgnet.json"
LEGS, NODES = (0, 3), 8  # two legs, by index, and the nodes of each in training


def universal() -> Figure:
    """Error of the universal network on machines more and more unlike those it was trained on."""
    numbers = json.loads(NUMBERS.read_text("utf-8"))
    whole = figure(6.8, 3.6)
    axes = whole.subplots(1, 3, sharex=True, sharey=True)
    titles = ("second-order Taylor", "the network alone", "with damped steps")
    groups = (("usual", BLUE, "."), ("anywhere", VERMILION, "x"), ("catalog", BLACK, "D"))
    labels = {
        "usual": "usual machines", "anywhere": "joints anywhere", "catalog": "the catalog"
    }  # fmt: skip
    for column, (panel, title) in enumerate(zip(axes, titles, strict=True), start=1):
        for name, color, marker in groups:
            rows = np.array(numbers[name])
            panel.plot(
                rows[:, 0], 100 * rows[:, column], marker, color=color, linestyle="none",
                markersize=4 if marker != "." else 3, label=labels[name],
            )  # fmt: skip
        panel.set(xscale="log", yscale="log", title=title)
        panel.set_xticks([0.01, 0.02, 0.05, 0.1], ["0.01", "0.02", "0.05", "0.1"])
        panel.minorticks_off()
        panel.axhline(0.015, color=GREEN, linewidth=0.8)
        panel.grid()
    axes[1].set(xlabel="distance from the training set [share of the size]")
    axes[0].set(ylabel="mean position error [% of the size]")
    axes[0].legend(loc="lower right")
    axes[2].text(0.02, 0.015, "0.015 %", color=GREEN, ha="left", va="bottom", fontsize=7,
                 transform=axes[2].get_yaxis_transform())  # fmt: skip
    return whole


# ---- DisGNet ------------------------------------------------------------------------------


def disgnet() -> Figure:
    """The graph, its distance matrix, and a table of a function of two legs."""
    from gough.learn.data import HexapodGraph

    graph = HexapodGraph.of(gough.Platform.load("reference"))
    whole = figure(7.4, 3.1)
    drawn, matrix, table = whole.subplots(1, 3)
    _graph(drawn, graph)
    _matrix(matrix, graph)
    _table(table)
    return whole


def _color(leg: int) -> str:
    return {LEGS[0]: VERMILION, LEGS[1]: ORANGE}.get(leg, BLUE)


def _graph(axes: Axes, graph) -> None:
    """Twelve joints, the rings' edges grey, the legs' in colour, u and v named."""
    platform = gough.Platform.load("reference")
    angle = lambda points: np.degrees(np.arctan2(points[:, 1], points[:, 0]))  # noqa: E731
    places = np.concatenate([polar(2.0, angle(platform.base)), polar(1.0, angle(platform.moving))])
    for a, b in graph.rings:
        axes.plot(*places[[a, b]].T, color=GREY, linewidth=1)
    for leg, (a, b) in enumerate(graph.legs):
        axes.plot(*places[[a, b]].T, color=_color(leg), linewidth=2)
    axes.plot(*places.T, "o", color=BLACK, markersize=4)
    u, v = LEGS[0], LEGS[1] + 6
    label(axes, 1.22 * places[u], "u", VERMILION)
    label(axes, 0.62 * places[v], "v", ORANGE)
    axes.set_title("joints, legs and rings", fontsize=9)
    axes.margins(0.1)
    sketch(axes)


def _matrix(axes: Axes, graph) -> None:
    """E: entries of legs in colour, of rings grey; row u and column v framed."""
    colors = np.ones((12, 12, 3))
    rgb = lambda text: [int(text[k : k + 2], 16) / 255 for k in (1, 3, 5)]  # noqa: E731
    for a, b in graph.rings:
        colors[a, b] = colors[b, a] = rgb("#c8c8c8")
    for leg, (a, b) in enumerate(graph.legs):
        colors[a, b] = colors[b, a] = rgb(_color(leg))
    axes.pcolormesh(np.arange(13), np.arange(13), colors, edgecolors=GREY, linewidth=0.3)
    frame = {"fill": False, "linewidth": 1.4}
    axes.add_patch(Rectangle((0, LEGS[0]), 12, 1, edgecolor=VERMILION, **frame))
    axes.add_patch(Rectangle((LEGS[1] + 6, 0), 1, 12, edgecolor=ORANGE, **frame))
    axes.set_title("distance matrix E", fontsize=9)
    axes.text(-0.4, LEGS[0] + 0.5, "u", color=VERMILION, ha="right", va="center")
    axes.text(LEGS[1] + 6.5, 12.3, "v", color=ORANGE, ha="center", va="top")
    axes.set_ylim(12, 0)
    sketch(axes)


def _table(axes: Axes) -> None:
    """One number of z as a function of two legs: values at the nodes, and their series."""
    facts = json.loads(TABLE.read_text("utf-8"))
    values = np.array(facts["values"])
    at = np.cos((np.arange(NODES) + 0.5) * np.pi / NODES)
    basis = np.polynomial.chebyshev.chebvander(at, NODES - 1)
    series = np.linalg.solve(basis, np.linalg.solve(basis, values).T).T
    series[np.add.outer(range(NODES), range(NODES)) >= NODES] = 0
    fine = np.linspace(-1, 1, 81)
    smooth = np.polynomial.chebyshev.chebgrid2d(fine, fine, series)
    low, high = np.transpose(facts["range_mm"])
    scale = [lo + (hi - lo) * (fine + 1) / 2 for lo, hi in zip(low, high, strict=True)]
    axes.contour(*scale, smooth.T, levels=9, colors=GREY, linewidths=0.8)
    nodes = [lo + (hi - lo) * (at + 1) / 2 for lo, hi in zip(low, high, strict=True)]
    first, second = np.meshgrid(*nodes, indexing="ij")
    axes.scatter(first, second, s=9, color=BLACK, zorder=3)
    axes.set_xlabel(f"leg {LEGS[0] + 1} [mm]", color=VERMILION)
    axes.set_ylabel(f"leg {LEGS[1] + 1} [mm]", color=ORANGE)
    axes.set_title(f"a table: {NODES} x {NODES} values", fontsize=9)
    axes.set_box_aspect(1)


def write_table() -> None:
    """Write values of the number of z that varies most with both legs, from the shipped network."""
    import torch

    from gough.learn.models import Scaling, build
    from gough.learn.run_folder import load_tensors, load_weights
    from gough.seeds.network import shipped_weights

    platform = gough.Platform.load("reference")
    weights = shipped_weights(platform, "disgnet")
    assert weights is not None
    tensors, _ = load_tensors(weights)
    model: Any = build("disgnet", platform, Scaling.of(platform))
    load_weights(weights, model, tensors)
    model.double().eval()
    middle, half = model.range_middle.double(), model.range_half.double()
    at = torch.cos((torch.arange(NODES) + 0.5) * torch.pi / NODES).double()
    x = middle.repeat(NODES, NODES, 1)
    x[:, :, LEGS[0]] += half[LEGS[0]] * at[:, None]
    x[:, :, LEGS[1]] += half[LEGS[1]] * at
    with torch.no_grad():
        z = model.structured(model.edges(x.flatten(0, 1))).unflatten(0, (NODES, NODES))
    mixed = z - z.mean(0) - z.mean(1, keepdim=True)
    values = z[..., int(mixed.flatten(0, 1).std(0).argmax())]
    rows = [[round(float(v), 5) for v in row] for row in values]
    ends = torch.stack([middle - half, middle + half], -1) * model.leg_std[:, None]
    ends = (ends + model.leg_mean[:, None])[list(LEGS)]
    facts = {"range_mm": ends.round(decimals=2).tolist(), "values": rows}
    TABLE.write_text(json.dumps(facts) + "\n", "utf-8")


def recipe() -> Figure:
    """E-trans and E-rot by the paper's own recipe, over epochs, beside the paper's figures."""
    runs = json.loads(RECIPE.read_text("utf-8"))
    whole = figure(6.8, 2.8)
    panels = whole.subplots(1, 2, sharex=True)
    for (name, run), color in zip(runs.items(), (BLUE, VERMILION), strict=True):
        rows = np.array(run["rows"])
        for column, panel in enumerate(panels):
            panel.plot(rows[:, 0], rows[:, column + 1], color=color, linewidth=1, label=name)
            panel.plot(1200, run["paper"][column], "*", color=color, markersize=9)
    for panel, title in zip(panels, ("E-trans [mm]", "E-rot [deg]"), strict=True):
        panel.set(xscale="log", yscale="log", title=title, xlabel="epoch")
        panel.grid()
    panels[0].legend()
    return whole


FIGURES = {"universal": universal, "disgnet": disgnet, "recipe": recipe}

if __name__ == "__main__":
    write_table()

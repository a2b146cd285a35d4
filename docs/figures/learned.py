"""Figures of what networks reach, drawn from numbers that a benchmark wrote."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from style import BLACK, BLUE, GREEN, VERMILION, figure

NUMBERS = Path(__file__).parent / "universal.json"  # python benchmarks/universal.py distance


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


FIGURES = {"universal": universal}

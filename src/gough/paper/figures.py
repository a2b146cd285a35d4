"""The figures, drawn from the results of the stages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from gough.paper.study import Study
from gough.plot.histograms import LogHistogram, histogram_figure
from gough.plot.pose import PoseStyle, draw_pose, pose_axes
from gough.plot.style import BLUE, CURVES, INK, VERMILION, length_unit, new_figure, save, styled
from gough.pose import Pose

WIDTH = 8.0  # inches
TRUTH = PoseStyle(width=3.5, numbers=False)
SOLVED = PoseStyle(plate=VERMILION, line="--", width=1.2, fill=0.0, legs=INK, base=False,
                   numbers=False)  # fmt: skip


def draw_all(study: Study) -> list[str]:
    """Write all figures into the study's folder and return their names."""
    folder = study.folder / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in FIGURES.items():
        save(draw(study), folder / f"{name}.svg")
    return list(FIGURES)


@styled
def accuracy(study: Study) -> Figure:
    """Share of DisGNet's errors below thresholds while it trains."""
    result = study.result("curves")
    curve = result["networks"]["disgnet"]
    figure, axes = _panels(2)
    for axis, key, title, unit in (
        (axes[0], "trans", "translation", length_unit(study.platform)),
        (axes[1], "rot", "rotation", "deg"),
    ):
        for i, threshold in enumerate(result["thresholds"]):
            share = 100 * np.array(curve[f"{key}_below_{threshold:g}"])
            axis.plot(_percent(curve), share, **_line(i), label=f"below {threshold:g} {unit}")
        axis.set(title=f"DisGNet, {title}", xlabel="training done [%]", ylim=(0, 101))
        axis.legend(loc="lower right")
    axes[0].set_ylabel("share of test poses [%]")
    return figure


@styled
def training(study: Study) -> Figure:
    """E-trans and E-rot of all networks while they train."""
    result = study.result("curves")["networks"]
    figure, axes = _panels(2)
    for i, (name, curve) in enumerate(result.items()):
        axes[0].semilogy(_percent(curve), curve["trans"], **_line(i), label=name)
        axes[1].semilogy(_percent(curve), curve["rot_deg"], **_line(i), label=name)
    axes[0].set(title="translation", ylabel=f"E-trans [{study.platform.unit or 'unit'}]")
    axes[1].set(title="rotation", ylabel="E-rot, angle [deg]")
    for axis in axes:
        axis.set_xlabel("training done [%]")
    axes[0].legend(loc="lower left", ncols=2)
    return figure


@styled
def newton_times(study: Study) -> Figure:
    """Second stage alone, one sample at a time and batched."""
    return _times(study, ("CPU-NR", "batched NR"))


@styled
def two_stage_times(study: Study) -> Figure:
    """Both stages together."""
    return _times(study, ("plain-mlp + CPU-NR", "disgnet + batched NR"))


@styled
def solved_poses(study: Study) -> Figure:
    """Eight poses after the second stage, over the true ones and DisGNet's guesses."""
    result = study.result("poses")
    truth, guess, solved = (
        Pose(result[k]["position"], result[k]["wxyz"]) for k in ("truth", "guess", "solved")
    )
    guessed, _ = guess.distance(truth)
    left, turned = solved.distance(truth)
    unit = length_unit(study.platform)
    figure = new_figure(WIDTH, 0.62 * WIDTH)
    places = figure.add_gridspec(2, 4)
    for i in range(len(truth)):
        axes = pose_axes(figure, study.platform, [truth[i], solved[i]], places[divmod(i, 4)])
        draw_pose(axes, study.platform, truth[i], style=TRUTH)
        draw_pose(axes, study.platform, solved[i], style=SOLVED)
        axes.set(xticklabels=[], yticklabels=[], zticklabels=[], xlabel="", ylabel="", zlabel="")
        axes.set_title(f"guess {guessed[i]:.2g} {unit}\nsolved {left[i]:.0e} {unit}, "
                       f"{np.degrees(turned[i]):.0e} deg", fontsize=7)  # fmt: skip
    return figure


@styled
def error_histograms(study: Study) -> Figure:
    """Errors of the guesses and after the second stage, on a log axis."""
    result = study.result("errors")
    unit = length_unit(study.platform)
    labels = {"trans": f"translation error [{unit}]", "rot_deg": "rotation error [deg]"}
    return histogram_figure({
        label: {name: LogHistogram.from_dict(h) for name, h in result[key].items()}
        for key, label in labels.items()
    })  # fmt: skip


def _times(study: Study, names: tuple[str, str]) -> Figure:
    result = study.result("times")
    n = np.array(result["sizes"], float)
    figure, axes = _panels(2)
    for axis, name, colour in zip(axes, names, (VERMILION, BLUE), strict=True):
        fit = result["fit_seconds"][name]
        line = fit["slope"] * n + fit["intercept"]
        band = _band(fit, n)
        axis.plot(n, 1e3 * np.array(result["seconds"][name]), ".", color=colour, markersize=3,
                  label="measured")  # fmt: skip
        axis.plot(n, 1e3 * line, color=INK, linewidth=1, label="linear fit")
        axis.fill_between(n, 1e3 * (line - band), 1e3 * (line + band), color=colour, alpha=0.3,
                          linewidth=0, label="95 % confidence")  # fmt: skip
        axis.set(title=name, xlabel="samples", ylim=(0, None))
        axis.legend(loc="upper left")
    axes[0].set_ylabel("time [ms]")
    return figure


def _band(fit: dict, x: np.ndarray) -> np.ndarray:
    """Half the width of the 95 % confidence band of the mean, see `results.linear_fit`."""
    spread = np.sqrt(1 / fit["count"] + (x - fit["mean"]) ** 2 / fit["sxx"])
    return fit["quantile"] * fit["deviation"] * spread


def _panels(count: int) -> tuple[Figure, Any]:
    figure = new_figure(WIDTH, 0.42 * WIDTH)
    axes: Any = figure.subplots(1, count)
    return figure, axes


def _percent(curve: dict) -> np.ndarray:
    return 100 * np.array(curve["share"])


def _line(i: int) -> dict:
    colour, style = CURVES[i % len(CURVES)]
    return {"color": colour, "linestyle": style, "alpha": 1.0 if i < len(CURVES) else 0.5}


FIGURES: dict[str, Callable[[Study], Figure]] = {
    "accuracy": accuracy,
    "training": training,
    "newton_times": newton_times,
    "two_stage_times": two_stage_times,
    "solved_poses": solved_poses,
    "error_histograms": error_histograms,
}

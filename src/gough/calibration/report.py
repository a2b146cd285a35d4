"""One HTML file about a calibration: what was found, how sure it is, what looks odd."""

from __future__ import annotations

from html import escape
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gough.calibration import identify
from gough.calibration.arrays import Array
from gough.calibration.result import Calibration
from gough.calibration.sensors import PoseSensor
from gough.calibration.words import error_text
from gough.plot.style import (
    BLUE,
    CURVES,
    FAINT,
    GREY,
    INK,
    VERMILION,
    house_style,
    new_figure,
    reading_name,
    reading_unit,
    shown_readings,
    styled,
)
from gough.whole_file import replacing

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 60rem;
       margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
svg { max-width: 100%; height: auto; } table { border-collapse: collapse; }
td, th { padding: .15rem .8rem .15rem 0; text-align: left; border-bottom: 1px solid #e4e4e4; }
td.n { text-align: right; font-variant-numeric: tabular-nums; }
li { margin: .3rem 0; } .note { color: #707070; }
"""


def write_report(found: Calibration, path: str | Path) -> None:
    """Write the report; the file appears whole or not at all.

    Raises:
        GoughError: no such folder, a full disk.
    """
    with replacing(path) as file:
        file.write(report(found).encode())


def report(found: Calibration) -> str:
    """The page as HTML, figures inside."""
    name = found.parameters.drawing.name
    parts = [
        f"<h1>Calibration of {escape(name)}</h1>",
        _summary(found),
        _section(
            "Error over the workspace",
            "Differences between the drawing and the calibrated machine (what was wrong), and the "
            "standard deviation that the calibrated machine still has, at 200 poses.",
            error_figure(found),
        ),
        _section(
            "Residual of each pose",
            "Mahalanobis distance: errors in standard deviations of all that was measured at a "
            "pose together. Crosses are outliers, left out; the line is what one good pose in "
            "5000 exceeds.",
            residual_figure(found),
        ),
        _section(
            "Each leg against its reading",
            "A slope stands for a gain (fit gains), a sine for the lead of a screw, a step for "
            "backlash. The band is two standard deviations of the noise.",
            leg_figure(found),
        )
        if isinstance(found.problem.sensor, PoseSensor)
        else "",
        _section(
            "Changes of the parameters",
            "Calibrated minus drawn, in tolerances, with 95 % bars. The grey band is two "
            "tolerances. A bar as wide as the band was not learned from the data.",
            change_figure(found),
        ),
        _section(
            "Error against number of poses",
            "Predicted from this calibration's information per pose.",
            count_figure(found),
        ),
        _weakest(found),
    ]
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Calibration of \
{escape(name)}</title><style>{STYLE}</style>'
    return head + "\n".join(parts) + "</html>\n"


# ---- text -----------------------------------------------------------------------------


def _section(title: str, note: str, figure: Figure) -> str:
    return f'<h2>{escape(title)}</h2><p class="note">{escape(note)}</p>{_svg(figure)}'


def _svg(figure: Figure) -> str:
    file = BytesIO()
    with house_style():
        figure.savefig(file, format="svg", metadata={"Date": None})
    text = file.getvalue().decode()
    return text[text.index("<svg") :]


def _summary(found: Calibration) -> str:
    unit = found.parameters.drawing.unit
    ours, theirs = found.cross_validated
    rows = [
        ("Error as drawn (rms)", error_text(found.error_before, unit)),
        ("Error calibrated (rms, predicted)", error_text(found.predicted_error, unit)),
        ("Poses used", f"{int(np.sum(found.inliers))} of {len(found.rows)}"),
        ("Combinations found", f"{found.rank} of {found.changes.size}"),
        ("Held-out poses", f"{theirs:.3g} standard deviations as drawn, {ours:.3g} calibrated"),
        ("Probability of being better", f"{found.probability_better:.3f}"),
    ]
    table = "".join(f"<tr><th>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in rows)
    messages = "".join(f"<li>{escape(text)}</li>" for text in found.messages)
    return f"<table>{table}</table>" + (f"<ul>{messages}</ul>" if messages else "")


def _weakest(found: Calibration) -> str:
    """The combinations that the data say least about, as a table."""
    unseen, weak = identify.weakest(found.parameters, found.estimate.information, 8)
    rows = "".join(
        f'<tr><td class="n">{100 * share:.1f} %</td><td>{escape(words)}</td></tr>'
        for share, words in weak
    )
    more = (
        f" Nothing was learned of {unseen} more, which stay as drawn: all base joints or all "
        "platform joints moved together, which cannot be told from moving a frame."
        if unseen
        else ""
    )
    return (
        '<h2>Weakest combinations</h2><p class="note">Standard deviation after measuring as a '
        f"share of that before.{more}</p>"
        f"<table><tr><th>left</th><th>combination</th></tr>{rows}</table>"
    )


# ---- figures --------------------------------------------------------------------------


@styled
def error_figure(found: Calibration) -> Figure:
    """Errors over the workspace before and after, each sorted, on a logarithmic axis."""
    workspace, state = found.workspace, found.estimate.state
    before = workspace.mean_squares(workspace.differences(found.drawn, state))
    G, _ = workspace.derivatives(state)
    variance = np.sum((G @ found.estimate.covariance) * G, axis=-1)
    after = workspace.mean_squares(np.sqrt(np.maximum(variance, 0)))
    unit = found.parameters.drawing.unit or "unit"
    which = [(i, n) for i, n in ((0, f"position [{unit}]"), (1, "rotation [deg]"))
             if np.isfinite(before[i]).all()]  # fmt: skip
    figure = new_figure(7.6, 2.8)
    axes = np.atleast_1d(figure.subplots(1, len(which)))
    for panel, (i, label) in zip(axes, which, strict=True):
        scale = 180 / np.pi if i else 1.0
        for values, text, (color, line) in (
            (before[i], "as drawn", (VERMILION, "--")), (after[i], "calibrated", (BLUE, "-")),
        ):  # fmt: skip
            errors = scale * np.sort(np.sqrt(values))
            share = 100 * (np.arange(len(errors)) + 0.5) / len(errors)
            panel.plot(errors, share, color=color, linestyle=line, label=text)
        panel.set(xscale="log", xlabel=f"error of {label}", ylabel="poses below [%]")
        panel.legend()
    return figure


@styled
def residual_figure(found: Calibration) -> Figure:
    """Mahalanobis distance of each pose in the order of the file."""
    from gough.calibration.robust import CUT, chi_squared

    figure = new_figure(7.6, 2.6)
    axes: Axes = figure.subplots()
    at, d, good = found.rows + 1, found.distances, found.inliers
    axes.plot(at[good], d[good], "o", color=BLUE, markersize=4)
    axes.plot(at[~good], d[~good], "X", color=VERMILION, markersize=8)
    for row, distance in zip(at[~good][:12], d[~good][:12], strict=True):
        axes.annotate(f"row {row}", (row, distance), xytext=(5, 3), textcoords="offset points",
                      fontsize=8)  # fmt: skip
    cut = float(np.sqrt(chi_squared(found.residuals.shape[1], CUT)))
    axes.axhline(cut, color=GREY, linestyle="--", linewidth=0.8)
    axes.set(xlabel="row of the file", ylabel="distance")
    if d.max() > 3 * cut:
        axes.set_yscale("log")
    else:
        axes.set_ylim(0, 1.15 * max(d.max(), cut))
    return figure


@styled
def leg_figure(found: Calibration) -> Figure:
    """Strut errors of good poses against the readings, a panel for each leg."""
    drawing = found.parameters.drawing
    unit = drawing.unit or "unit"
    figure = new_figure(7.6, 4.2)
    panels = figure.subplots(2, 3, sharey=True)
    rows, _ = found.problem.rows(found.estimate.state)
    noise = np.sqrt(np.mean(rows.covariance[:, range(6), range(6)], axis=0))
    good = found.inliers
    readings: Array = shown_readings(drawing, np.asarray(found.problem.legs, dtype=np.float64))
    for i, panel in enumerate(panels.flat):
        panel.axhspan(-2 * noise[i], 2 * noise[i], color=FAINT, alpha=0.5, linewidth=0)
        panel.plot(readings[good, i], found.residuals[good, i], "o", color=BLUE, markersize=3)
        panel.set_title(f"leg {i + 1}", loc="left")
        if i >= 3:
            panel.set_xlabel(f"{reading_name(drawing)} [{reading_unit(drawing)}]")
        if i % 3 == 0:
            panel.set_ylabel(f"residual [{unit}]")
    return figure


@styled
def change_figure(found: Calibration) -> Figure:
    """Changes with 95 % bars, in tolerances, a colour and a line of points for each leg."""
    parameters = found.parameters
    figure = new_figure(7.6, 0.6 + 0.33 * parameters.count)
    axes: Axes = figure.subplots()
    axes.axvspan(-2, 2, color=FAINT, alpha=0.5, linewidth=0)
    axes.axvline(0, color=GREY, linewidth=0.7)
    change = found.changes / parameters.tolerance
    bar = 1.96 * found.deviations / parameters.tolerance
    rows = np.arange(parameters.count)
    for leg in range(6):
        color = CURVES[leg][0]
        axes.errorbar(
            change[leg], rows + 0.11 * (leg - 2.5), xerr=bar[leg], fmt="o", color=color,
            markersize=3, elinewidth=1, label=f"leg {leg + 1}",
        )  # fmt: skip
    axes.set_yticks(rows, parameters.names)
    axes.invert_yaxis()
    axes.set_xlabel("change [tolerances]")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


@styled
def count_figure(found: Calibration) -> Figure:
    """Predicted error if the same poses were measured more or less often."""
    estimate, used = found.estimate, int(np.sum(found.inliers))
    prior = np.linalg.inv(estimate.covariance) - estimate.information
    counts = np.unique(np.round(np.geomspace(max(8, used / 4), 16 * used, 12)).astype(int))
    errors = []
    for count in counts:
        covariance = np.linalg.inv(estimate.information * count / used + prior)
        error = found.workspace.error(estimate.state, covariance)
        errors.append(error.position if np.isfinite(error.position) else np.degrees(error.rotation))
    figure = new_figure(7.6, 2.6)
    axes: Axes = figure.subplots()
    axes.plot(counts, errors, "-", color=BLUE)
    now = found.predicted_error
    here = now.position if np.isfinite(now.position) else np.degrees(now.rotation)
    axes.plot([used], [here], "o", color=INK)
    axes.annotate("this calibration", (used, here), xytext=(6, 6), textcoords="offset points")
    unit = (found.parameters.drawing.unit or "unit") if np.isfinite(now.position) else "deg"
    axes.set(xscale="log", yscale="log", xlabel="poses", ylabel=f"error [{unit}]")
    axes.xaxis.set_major_formatter("{x:.0f}")
    axes.xaxis.set_minor_formatter("")
    axes.yaxis.set_major_formatter("{x:.3g}")
    axes.yaxis.set_minor_formatter("{x:.3g}")
    return figure

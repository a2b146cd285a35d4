"""All there is to say about a fit, in sentences, most important first."""

from __future__ import annotations

import numpy as np

from gough.calibration import identify
from gough.calibration.estimate import Estimate
from gough.calibration.result import NOTICEABLE, SURE, Calibration
from gough.calibration.words import row_numbers

FOUR = 4.0  # tolerances or standard errors beyond which something is called unlikely


def advice(found: Calibration) -> list[str]:
    """Sentences about a fit that a person should read."""
    out = []
    if not found.better:
        reason = (
            f"the probability that it errs less is {found.probability_better:.3f}"
            if found.probability_better < SURE
            else f"held-out poses fit better by {found.noticeable:.1f} standard errors only"
        )
        out.append(
            f"The calibrated machine is not surely better than the drawing: {reason} (wanted: "
            f"{SURE} and {NOTICEABLE:g}). Measure more poses, or with a better instrument."
        )
    unseen = identify.in_words(found.problem.sensor)
    if unseen:
        out.append(unseen)
    out += _outliers(found) + _noise(found) + _far_parameters(found)
    return out


def _outliers(found: Calibration) -> list[str]:
    bad = found.rows[~found.inliers]
    if not len(bad):
        return []
    text = f"{len(bad)} of {len(found.rows)} poses are outliers and left out"
    return [f"{text}: {row_numbers(bad + 1)}."]


def _noise(found: Calibration) -> list[str]:
    """Noise of another size than stated, by chi squared."""
    estimate: Estimate = found.estimate
    used = found.inliers
    count = found.residuals[used].size
    spent = np.sum(estimate.information * estimate.covariance.T)
    freedom = max(count - spent, 1.0)
    ratio = float(np.sum(estimate.distance[used]) / freedom)
    if abs(ratio - 1) < FOUR * np.sqrt(2 / freedom) or 0.64 < ratio < 1.44:
        return []
    text = f"The noise looks {np.sqrt(ratio):.2g} times what sigma and leg_sigma state"
    if ratio > 1:
        return [text + ": state more, look for outliers (robust), or fit gains; the predicted "
                "error is too small by as much."]  # fmt: skip
    return [text + ": state less, and more is gained from the data."]


def _far_parameters(found: Calibration) -> list[str]:
    share = np.abs(found.changes) / found.parameters.tolerance
    out = []
    for leg, column in np.argwhere(share > FOUR)[:6]:
        out.append(
            f"Leg {leg + 1}, {found.parameters.names[column]}: {share[leg, column]:.1f} tolerances "
            f"from the drawing ({found.changes[leg, column]:+.4g} "
            f"{found.parameters.unit_names[column]}); check the drawing there."
        )
    return out

"""The numbers behind the figures, each stage a function from a study to what JSON can hold."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.learn.metrics import THRESHOLDS
from gough.learn.models import MODELS
from gough.paper.methods import batched, sequential, timed
from gough.paper.published import GAMMAS
from gough.paper.study import Study
from gough.plot.histograms import LogHistogram
from gough.pose import Pose

FIT_GAMMA = GAMMAS[1]  # the precision level of the paper's timings
DRAWN = 8


@dataclass(frozen=True)
class _Guessed:
    """Guesses made before the clock runs: for the first rows, in order."""

    pose: Pose
    name: str = "guessed"

    def guess(self, legs: Array) -> Pose:
        return self.pose[: len(legs)]


def curves(study: Study) -> dict:
    """Errors of every network on 2,000 held-out poses while it trained on the full set."""
    out: dict[str, Any] = {}
    for kind in MODELS:
        path = study.curve_path(kind)
        try:
            with path.open(newline="") as file:
                rows = list(csv.DictReader(file))
        except OSError as error:
            raise GoughError(
                f"{path}: cannot be read: {error.strerror}; gough paper --stage train makes it"
            ) from None
        step = np.array([float(row["step"]) for row in rows])
        share = step / step[-1]
        names = ["trans", "rot_deg", *(f"{k}_below_{t:g}" for k in ("trans", "rot")
                                       for t in THRESHOLDS)]  # fmt: skip
        out[kind] = {"share": _short(share), "steps": int(step[-1])}
        out[kind] |= {name: _short([float(row[name]) for row in rows]) for name in names}
    return {"networks": out, "thresholds": THRESHOLDS}


def times(study: Study) -> dict:
    """Time of CPU and batched Newton, and of both stages, over the number of samples."""
    first, last, step = study.plan.sizes
    sizes = list(range(first, last + 1, step))
    _, legs = study.test_set()
    plain, disgnet = (study.network("full", kind) for kind in ("plain-mlp", "disgnet"))
    from_guess = _Guessed(disgnet.guess(legs[:last]))
    p = study.platform
    work = {
        "CPU-NR": sequential(p, from_guess),
        "batched NR": batched(p, from_guess),
        "plain-mlp + CPU-NR": sequential(p, plain),
        "disgnet + batched NR": batched(p, disgnet),
    }
    seconds = {
        name: [timed(partial(method.run, legs[:n], FIT_GAMMA)) for n in sizes]
        for name, method in work.items()
    }
    return {"sizes": sizes, "gamma": FIT_GAMMA, "seconds": seconds,
            "fit_seconds": {name: linear_fit(sizes, y) for name, y in seconds.items()}}  # fmt: skip


def linear_fit(x: list[int], y: list[float]) -> dict:
    """Least-squares line through (x, y), with what its 95 % confidence band needs.

    The band of the mean at x is +-t s sqrt(1/n + (x - mean)^2 / Sxx), t Student's 97.5 % quantile
    with n - 2 degrees of freedom, s the residuals' standard deviation (Draper and Smith, Applied
    Regression Analysis, 3rd ed., eq. 1.4.7).
    """
    from scipy import stats

    a, b = np.asarray(x, float), np.asarray(y, float)
    fit: Any = stats.linregress(a, b)  # its type has no fields
    slope, intercept, r = fit.slope, fit.intercept, fit.rvalue
    left = b - slope * a - intercept
    freedom = len(a) - 2
    return {
        "slope": float(slope), "intercept": float(intercept), "mean": float(a.mean()),
        "sxx": float(np.sum((a - a.mean()) ** 2)), "count": len(a),
        "deviation": float(np.sqrt(np.sum(left**2) / freedom)),
        "quantile": float(stats.t.ppf(0.975, freedom)), "r2": float(r**2),
    }  # fmt: skip


def poses(study: Study) -> dict:
    """Eight test poses, DisGNet's guesses for them, and what the second stage makes of these."""
    truth, legs = study.test_set(DRAWN)
    disgnet = study.network("full", "disgnet")
    guess = disgnet.guess(legs)
    end = batched(study.platform, _Guessed(guess)).run(legs, GAMMAS[-1])
    return {
        "gamma": GAMMAS[-1],
        **{name: {"position": pose.position.tolist(), "wxyz": pose.wxyz.tolist()}
           for name, pose in (("truth", truth), ("guess", guess), ("solved", end.pose))},
    }  # fmt: skip


def errors(study: Study) -> dict:
    """Histograms of the errors on a log axis, of the guesses and after the second stage."""
    truth, legs = study.test_set()
    guesses = {kind: study.network("full", kind).guess(legs) for kind in MODELS}
    found = {kind: guess.distance(truth) for kind, guess in guesses.items()}
    few = slice(0, 10 * study.plan.solved)
    second = batched(study.platform, _Guessed(guesses["disgnet"][few]))
    end = second.run(legs[few], GAMMAS[-1])
    found["disgnet + batched NR"] = end.pose.distance(truth[few])
    return {
        "gamma": GAMMAS[-1],
        "trans": {name: LogHistogram.of(away).as_dict() for name, (away, _) in found.items()},
        "rot_deg": {
            name: LogHistogram.of(np.degrees(angle)).as_dict() for name, (_, angle) in found.items()
        },
    }


def _short(values: Any) -> list[float]:
    return [float(f"{v:.4g}") for v in values]

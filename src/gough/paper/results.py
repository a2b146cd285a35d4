"""Results behind the tables and figures: each stage a function from a study to JSON data.

Keys that end in `seconds` are times, which differ from run to run; everything else repeats.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.learn.evaluate import Row, evaluate
from gough.learn.metrics import THRESHOLDS, measure, median_time
from gough.paper.methods import Method, Success, batched, ours, scipy, sequential
from gough.paper.published import GAMMAS
from gough.paper.study import Study, with_workspace_of
from gough.plot.histograms import LogHistogram
from gough.pose import Pose
from gough.seeds.base import Seed
from gough.seeds.polynomial import PolynomialSeed

OTHER_F_MAX = (15, 17, 40)  # inner iterations that the iteration table tries
WIDE_SOLVED = 10  # times W poses for the two-stage methods of the wide workspace
FIT_GAMMA = GAMMAS[1]  # the precision level of the paper's timings
DRAWN = 8  # poses of the figure
REPEATS = 3  # timings, of which the median counts


@dataclass(frozen=True)
class _Guessed:
    """First guesses made beforehand, so that the clock does not count them."""

    pose: Pose
    name: str = "guessed"

    def guess(self, legs: Array) -> Pose:
        return self.pose[: len(legs)]


# ---- tables -------------------------------------------------------------------------------


def networks(study: Study) -> dict:
    """Table I: parameters, E-trans, E-rot, E-ik, time for 1000, of networks and polynomials."""
    rows = evaluate(study.platform, _names(study, "full"), poses=study.plan.test)
    return {"rows": [_network_row(row) for row in rows]}


def sets(study: Study) -> dict:
    """Median, mean and shares below 0.5 and 1 of networks by size of the training set."""
    truth, legs = study.test_set()
    out = []
    for name in ("full", "90", "80"):
        for kind in study.kinds(name):
            guess = study.network(name, kind).guess(legs)
            found = asdict(measure(study.platform, guess, truth, legs))
            axis = _along_axes(np.abs(guess.position - truth.position))
            out.append({"set": name, "rows": study.plan.rows_of(name), "name": kind,
                        "axis": axis, **found})  # fmt: skip
    return {"rows": out, "thresholds": THRESHOLDS}


def methods(study: Study) -> dict:
    """Table II: average time and success rate of two-stage methods at gamma = 0.0001."""
    gamma = GAMMAS[-1]
    truth, legs = study.test_set(study.plan.solved)
    out = []
    for method in two_stage(study):
        end = Success.of(study.platform, method, method.run(legs, gamma), truth)
        seconds = median_time(partial(method.run, legs, gamma), REPEATS) / len(legs)
        out.append({"name": method.name, **asdict(end), "average_seconds": seconds})
    return {"rows": out, "gamma": gamma}


def iterations(study: Study) -> dict:
    """Iterations at the three precision levels, and the effect of the inner iterations on them."""
    truth, legs = study.test_set(study.plan.solved)
    disgnet = study.network("full", "disgnet")
    chosen = [m for m in two_stage(study) if "gough" not in m.name]  # which has no gamma
    chosen += [batched(study.platform, disgnet, f_max) for f_max in OTHER_F_MAX]
    chosen += [batched(study.platform, disgnet, scaled=True)]
    out = []
    for method in chosen:
        ends = [
            Success.of(study.platform, method, method.run(legs, gamma), truth) for gamma in GAMMAS
        ]
        out.append({"name": method.name, "counts": method.counts,
                    "iterations": [end.iterations for end in ends],
                    "unsolved": [end.singular + end.imprecise for end in ends]})  # fmt: skip
    return {"rows": out, "gammas": GAMMAS}


def wide(study: Study) -> dict:
    """First guesses and where Newton ends from them, over the wide workspace."""
    machine = with_workspace_of(study.platform, "wide")
    names = _names(study, "wide")
    out: dict[str, Any] = {"workspace": str(machine.workspace)}
    for key, same in (("same", True), ("all", False)):
        rows = evaluate(machine, names, poses=study.plan.test, same_assembly=same)
        out[key] = [_network_row(row) for row in rows]
    truth, legs = study.test_set(WIDE_SOLVED * study.plan.solved, "wide", same_assembly=True)
    seeds: list[Seed] = [PolynomialSeed(machine, degree) for degree in (0, *study.plan.degrees)]
    seeds += [study.network("wide", kind) for kind in study.kinds("wide")]
    for row, seed in zip(out["same"], seeds, strict=True):
        for key in ("batched", "scaled"):
            method = batched(machine, seed, scaled=key == "scaled")
            row[key] = asdict(Success.of(machine, method, method.run(legs, GAMMAS[-1]), truth))
    return out


def two_stage(study: Study) -> list[Method]:
    """The paper's two methods, and those that it leaves out."""
    p = study.platform
    plain, disgnet, resmlp = (study.network("full", k) for k in ("plain-mlp", "disgnet", "resmlp"))
    home, cubic, quintic = (PolynomialSeed(p, degree) for degree in (0, 3, 5))
    return [
        *(sequential(p, seed) for seed in (plain, disgnet, home)),
        scipy(p, home),
        *(batched(p, seed) for seed in (disgnet, plain, resmlp, cubic, quintic, home)),
        *(ours(p, seed) for seed in (home, cubic, disgnet, resmlp)),
    ]


def _along_axes(away: Array) -> dict:
    """Statistics of absolute errors (N, 3) along each axis, as in the supplement's table."""
    within = [float(np.mean(away < t)) for t in THRESHOLDS]
    return {"median": float(np.median(away)), "mean": float(away.mean()), "within": within}


def _names(study: Study, name: str) -> list[str]:
    """First guesses of a table, as `evaluate` takes them."""
    polynomials = (f"polynomial-{degree}" for degree in study.plan.degrees)
    networks = (str(study.network_path(name, kind)) for kind in study.kinds(name))
    return ["home", *polynomials, *networks]


def _network_row(row: Row) -> dict:
    """One first guess of a table; times apart."""
    end = row.newton
    return {
        "name": row.name.rpartition("/")[2].removesuffix(".onnx"), "parameters": row.parameters,
        **asdict(row.metrics), "true": end.true, "other": end.other, "twins": end.twins,
        "unconverged": end.unconverged, "solve_wrong": row.wrong,
        "training_seconds": row.seconds, "thousand_seconds": row.per_thousand,
    }  # fmt: skip


# ---- figures ------------------------------------------------------------------------------


def curves(study: Study) -> dict:
    """Errors of every network on 2,000 held-out poses while it trained on the full set."""
    out: dict[str, Any] = {}
    for kind in study.kinds("full"):
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
        out[kind] = {"share": _rounded(share), "steps": int(step[-1])}
        out[kind] |= {name: _rounded([float(row[name]) for row in rows]) for name in names}
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
        name: [median_time(partial(method.run, legs[:n], FIT_GAMMA), REPEATS) for n in sizes]
        for name, method in work.items()
    }
    return {"sizes": sizes, "gamma": FIT_GAMMA, "seconds": seconds,
            "fit_seconds": {name: linear_fit(sizes, y) for name, y in seconds.items()}}  # fmt: skip


def linear_fit(x: list[int], y: list[float]) -> dict:
    """Least-squares line through (x, y), with the numbers that its 95 % confidence band needs.

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
    """Eight test poses, DisGNet's guesses for them, and the poses after the second stage."""
    truth, legs = study.test_set(DRAWN)
    guess = study.network("full", "disgnet").guess(legs)
    end = batched(study.platform, _Guessed(guess)).run(legs, GAMMAS[-1])
    return {
        "gamma": GAMMAS[-1],
        **{name: {"position": pose.position.tolist(), "wxyz": pose.wxyz.tolist()}
           for name, pose in (("truth", truth), ("guess", guess), ("solved", end.pose))},
    }  # fmt: skip


def errors(study: Study) -> dict:
    """Histograms of the errors on a log axis, of the guesses and after the second stage."""
    truth, legs = study.test_set()
    guesses = {kind: study.network("full", kind).guess(legs) for kind in study.kinds("full")}
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


def _rounded(values: Any) -> list[float]:
    return [float(f"{v:.4g}") for v in values]


STAGES: dict[str, Callable[[Study], dict]] = {
    f.__name__: f for f in (networks, sets, methods, iterations, wide, curves, times, poses, errors)
}

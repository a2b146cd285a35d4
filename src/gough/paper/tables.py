"""The numbers of the tables, each stage a function from a study to what JSON can hold.

Keys that end in `seconds` are times, which differ from run to run; all else repeats.
"""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from gough.checks import Array
from gough.learn.evaluate import DEGREES, Row, evaluate
from gough.learn.metrics import THRESHOLDS, measure
from gough.learn.models import MODELS
from gough.learn.models.polynomial import PolynomialGuess
from gough.paper.methods import Method, Outcome, batched, ours, scipy, sequential, timed
from gough.paper.plan import machine_of
from gough.paper.published import GAMMAS
from gough.paper.study import Study
from gough.seeds.base import PolynomialSeed, Seed

POLYNOMIALS = tuple(f"polynomial-{degree}" for degree in DEGREES)
OTHER_F_MAX = (15, 17, 40)  # inner iterations that the iteration table tries
WIDE_SOLVED = 10  # times W poses for the two-stage methods of the wide workspace


def networks(study: Study) -> dict:
    """Table I: parameters, E-trans, E-rot, E-ik, time for 1000, of networks and polynomials."""
    names = ["home", *POLYNOMIALS, *(str(study.network_path("full", kind)) for kind in MODELS)]
    rows = evaluate(study.platform, names, poses=study.plan.test)
    return {"rows": [_network_row(name, row) for name, row in zip(_short(), rows, strict=True)]}


def sets(study: Study) -> dict:
    """Median, mean and shares below 0.5 and 1 of networks by size of the training set."""
    truth, legs = study.test_set()
    out = []
    for name in ("full", "90", "80"):
        for kind in MODELS:
            seed = study.network(name, kind)
            guess = seed.guess(legs)
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
        end = Outcome.of(study.platform, method, method.run(legs, gamma), truth)
        seconds = timed(partial(method.run, legs, gamma)) / len(legs)
        out.append({"name": method.name, **asdict(end), "average_seconds": seconds})
    return {"rows": out, "gamma": gamma}


def iterations(study: Study) -> dict:
    """Iterations at the three precision levels, and what the inner iterations change in them."""
    truth, legs = study.test_set(study.plan.solved)
    disgnet = study.network("full", "disgnet")
    chosen = [m for m in two_stage(study) if "gough" not in m.name]  # which knows no gamma
    chosen += [batched(study.platform, disgnet, f_max) for f_max in OTHER_F_MAX]
    chosen += [batched(study.platform, disgnet, scaled=True)]
    out = []
    for method in chosen:
        ends = [
            Outcome.of(study.platform, method, method.run(legs, gamma), truth) for gamma in GAMMAS
        ]
        out.append({"name": method.name, "counts": method.counts,
                    "iterations": [end.iterations for end in ends],
                    "unsolved": [end.singular + end.imprecise for end in ends]})  # fmt: skip
    return {"rows": out, "gammas": GAMMAS}


def wide(study: Study) -> dict:
    """First guesses and where Newton ends from them, over the wide workspace."""
    machine = machine_of(study.platform, "wide")
    names = ["home", *POLYNOMIALS, *(str(study.network_path("wide", kind)) for kind in MODELS)]
    out: dict[str, Any] = {"workspace": str(machine.workspace)}
    for key, same in (("same", True), ("all", False)):
        rows = evaluate(machine, names, poses=study.plan.test, same_assembly=same)
        out[key] = [_network_row(name, row) for name, row in zip(_short(), rows, strict=True)]
    truth, legs = study.test_set(WIDE_SOLVED * study.plan.solved, "wide", same_assembly=True)
    for row in out["same"]:
        seed = _wide_seed(study, row["name"])
        for key in ("batched", "scaled"):
            method = batched(machine, seed, scaled=key == "scaled")
            end = method.run(legs, GAMMAS[-1])
            row[key] = asdict(Outcome.of(machine, method, end, truth))
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
    """Of absolute errors (N, 3) along each axis: what the supplement's table seems to hold."""
    within = [float(np.mean(away < t)) for t in THRESHOLDS]
    return {"median": float(np.median(away)), "mean": float(away.mean()), "within": within}


def _short() -> list[str]:
    return ["home", *POLYNOMIALS, *MODELS]


def _wide_seed(study: Study, name: str) -> Seed:
    if name in MODELS:
        return study.network("wide", name)
    machine = machine_of(study.platform, "wide")
    degree = 0 if name == "home" else int(name.removeprefix("polynomial-"))
    return PolynomialGuess(machine, degree, same_assembly=True)


def _network_row(name: str, row: Row) -> dict:
    """What a table says of a first guess; times apart."""
    return {
        "name": name, "parameters": row.parameters, **asdict(row.metrics), **_ends(row),
        "training_seconds": row.seconds, "thousand_seconds": row.per_thousand,
    }  # fmt: skip


def _ends(row: Row) -> dict:
    """Where plain Newton, with exact inverses and no second try, ends from the guesses."""
    end = row.outcome
    return {"true": end.true, "other": end.other, "twins": end.twins,
            "unconverged": end.unconverged, "solve_wrong": row.wrong}  # fmt: skip

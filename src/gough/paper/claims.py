"""The paper's claims about its methods, each beside the result here."""

from __future__ import annotations

from dataclasses import dataclass

from gough.paper import published
from gough.paper.markdown import number, percent
from gough.paper.study import Study


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, with its number and ours."""

    claim: str
    paper: str
    here: str
    holds: bool


def claims(study: Study) -> list[Claim]:
    """All claims, from the results of the stages."""
    return [*_networks(study), *_sets(study), *_methods(study), *_iterations(study), *_times(study)]


def _networks(study: Study) -> list[Claim]:
    rows = {row["name"]: row for row in study.result("networks")["rows"]}
    paper, found = published.TABLE, []
    dis, plain = rows["disgnet"], rows["plain-mlp"]
    for words, key, theirs in (
        ("E-trans", "trans_mean", lambda n: n.trans),
        ("E-rot", "rot_mean", lambda n: n.rot),
        ("E-ik", "ik_mean", lambda n: n.ik),
    ):
        said = 1 - theirs(paper["disgnet"]) / theirs(paper["plain-mlp"])
        ours = 1 - dis[key] / plain[key]
        found.append(Claim(f"DisGNet's {words} is below plain-mlp's by (%)", percent(said),
                           percent(ours), ours > 0))  # fmt: skip
    for other, words in (("wise-mlp", "below wise-mlp's"), ("gcn", "below gcn's")):
        said = paper["disgnet"].trans / paper[other].trans
        ours = dis["trans_mean"] / rows[other]["trans_mean"]
        found.append(Claim(f"DisGNet's E-trans is {words}: ratio", number(said), number(ours),
                           ours < 1))  # fmt: skip
    said = paper["disgnet"].trans / paper["graphmlp"].trans
    ours = dis["trans_mean"] / rows["graphmlp"]["trans_mean"]
    found.append(Claim("DisGNet's E-trans is about that of graphmlp, which is 2.7 times as large: "
                       "ratio", number(said), number(ours), ours < 1.1))  # fmt: skip
    said = paper["wise-mlp"].rot / paper["plain-mlp"].rot
    ours = rows["wise-mlp"]["rot_mean"] / plain["rot_mean"]
    found.append(Claim("9D rotations, residuals and the weighted loss cut an MLP's E-rot: ratio",
                       number(said), number(ours), ours < 1))  # fmt: skip
    return found


def _sets(study: Study) -> list[Claim]:
    rows = {(row["set"], row["name"]): row for row in study.result("sets")["rows"]}
    found = []
    for name in ("disgnet", "wise-mlp"):
        said = published.SETS["80"][name][1] / published.SETS["full"][name][1]
        ours = rows["80", name]["axis"]["mean"] / rows["full", name]["axis"]["mean"]
        found.append(Claim(f"with 80 % of the data {name}'s mean translation error grows: ratio",
                           number(said), number(ours), ours > 1.02))  # fmt: skip
    return found


def _methods(study: Study) -> list[Claim]:
    rows = {row["name"]: row for row in study.result("methods")["rows"]}
    sequential, batched = (rows[name] for name in published.METHODS)
    (slow, low), (fast, high) = published.METHODS.values()
    ratio = sequential["average_seconds"] / batched["average_seconds"]
    success = [100 * (1 - (r["singular"] + r["imprecise"]) / r["count"])
               for r in (sequential, batched)]  # fmt: skip
    return [
        Claim("MLP + CPU-NR solves (%)", str(low), f"{success[0]:.1f}", success[0] <= low + 1),
        Claim("DisGNet + batched NR solves (%)", str(high), f"{success[1]:.1f}",
              success[1] >= high - 0.1),
        Claim("the batched method is faster per pose than MLP + CPU-NR: times",
              number(slow / fast), number(ratio), ratio > 1),
    ]  # fmt: skip


def _iterations(study: Study) -> list[Claim]:
    rows = {row["name"]: row["iterations"] for row in study.result("iterations")["rows"]}
    theirs = published.ITERATIONS
    sequential, batched = published.METHODS
    said = theirs[sequential][-1] / theirs[batched][-1]
    ours = rows[sequential][-1] / rows[batched][-1]
    growth = [n[-1] / n[0] for n in (theirs[batched], rows[batched])]
    return [
        Claim("iterations of MLP + CPU-NR over sweeps of the batch at gamma 0.0001: times",
              number(said), number(ours), ours > 1),
        Claim("sweeps grow from gamma 0.01 to 0.0001: times", number(growth[0]),
              number(growth[1]), growth[1] > 0.5 * growth[0]),
    ]  # fmt: skip


def _times(study: Study) -> list[Claim]:
    result = study.result("times")
    seconds, sizes = result["seconds"]["disgnet + batched NR"], result["sizes"]
    said = published.TWO_STAGE_SECONDS[1000] / published.TWO_STAGE_SECONDS[10]
    ours = seconds[-1] / seconds[0]
    return [
        Claim(f"two-stage time of {sizes[-1]:,} samples over that of {sizes[0]}: ratio (samples: "
              f"{sizes[-1] / sizes[0]:g})", number(said), number(ours),
              ours < sizes[-1] / sizes[0]),
    ]  # fmt: skip

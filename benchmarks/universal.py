"""The universal network beside what needs no training, on machines that it has never seen.

python benchmarks/universal.py                 # every table; about ten minutes
python benchmarks/universal.py wide speed      # some of them
python benchmarks/universal.py tuning          # trains networks: half an hour of processor time

Errors are mean translation errors as shares of the machine's size, over poses with home's sign of
det J, drawn evenly from boxes about home with a fixed seed. `network` is the network's answer
alone, `universal` the seed: the network and its damped Newton steps.
"""

from __future__ import annotations

import csv
import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import gough
from gough.seeds.damped import polish
from gough.seeds.network import NetworkSeed
from gough.seeds.taylor import HomeStruts, TaylorSeed, series
from gough.seeds.universal import UniversalSeed

POSES, NEWTON_POSES = 20_000, 100_000
NARROW = {
    "reference": (0.08, 30), "nasa_msfc": (0.08, 30), "matlab_stewart": (0.08, 30),
    "linuxcnc_genhex": (0.08, 30), "reachy_mini": (0.08, 30), "dietmaier": (0.04, 15),
    "rubin_camera": (0.05, 6), "rubin_simulink": (0.05, 6),
}  # fmt: skip
# where +-15 % and +-60 deg leave less than half of the poses, or a pivot far away moves the joints
# by the machine's size, a smaller box
WIDE = dict.fromkeys(NARROW, (0.15, 60)) | {
    "dietmaier": (0.08, 30), "rubin_camera": (0.08, 15), "rubin_simulink": (0.08, 15)
}  # fmt: skip


TUNED, RUNS = ("reference", "nasa_msfc", "rubin_simulink"), Path("runs/tuning")
TIMES = (10, 20, 40, 60, 120, 300, 600)  # [s]


@dataclass(frozen=True)
class Case:
    """A machine with a box as its workspace, poses of it and their readings."""

    platform: gough.Platform
    pose: gough.Pose
    legs: np.ndarray

    @classmethod
    def of(cls, platform: gough.Platform, box: tuple[float, float], count: int) -> Case:
        platform = platform.with_workspace(box[0] * platform.size, box[1])
        pose = platform.sample_poses(count, seed=77)
        legs = gough.leg_lengths(platform, pose)
        good = np.isfinite(legs).all(-1) & (gough.assembly_sign(platform, pose) > 0)
        return cls(platform, pose[good], legs[good])

    def errors(self, guess: gough.Pose) -> np.ndarray:
        return guess.distance(self.pose)[0] / self.platform.size

    def missed(self, guess: gough.Pose) -> str:
        """Count guesses from which plain Newton does not end at the true pose."""
        from gough.learn.metrics import count_newton_ends

        ends = count_newton_ends(self.platform, guess, self.pose, self.legs)
        return f"{ends.count - ends.true:,}"

    def newton(self, guess: gough.Pose) -> tuple[np.ndarray, np.ndarray, gough.Pose]:
        """Which rows (N,) plain Newton takes to the true pose, which anywhere, and where to."""
        from gough.learn.metrics import plain_newton, same_pose

        end, converged = plain_newton(self.platform, guess, self.legs)
        return converged & same_pose(self.platform, end, self.pose), converged, end


class Network:
    """The network's answer alone, without the damped steps."""

    def __init__(self, platform: gough.Platform) -> None:
        self.seed = UniversalSeed(platform, polished=False)

    def guess(self, legs: np.ndarray) -> gough.Pose:
        return self.seed.guess(legs)


class Closed:
    """A Taylor series and damped steps: what costs less than the network."""

    def __init__(self, platform: gough.Platform, order: int) -> None:
        self.platform, self.order = platform, order

    def guess(self, legs: np.ndarray) -> gough.Pose:
        with np.errstate(all="ignore"):
            home = HomeStruts.of(self.platform, legs)
            terms = series(home.base, home.joints, home.inverse, home.change, self.order)
            found = polish(home, home.twist(np.sum(terms, axis=0)))
        return home.pose(self.platform, found.t, found.wxyz)


NAMES = (
    "home", "taylor-2", "taylor-2 + steps", "polynomial-3, fitted", "network", "universal"
)  # fmt: skip


def seeds(platform: gough.Platform) -> dict[str, Any]:
    """First guesses to compare: names and objects with `guess(legs)`."""
    made = (
        gough.PolynomialSeed(platform, 0), TaylorSeed(platform, 2), Closed(platform, 2),
        gough.PolynomialSeed(platform, 3), Network(platform), UniversalSeed(platform),
    )  # fmt: skip
    return dict(zip(NAMES, made, strict=True))


def accuracy() -> None:
    """Mean and worst error, share of the size in %, over a box that the machine is used in."""
    _table(NARROW, POSES, lambda case, guess: _mean_and_worst(case.errors(guess)))


def newton() -> None:
    """Print how many of 100,000 poses plain Newton misses from each guess, over the same boxes."""
    names = ("home", "taylor-2", "polynomial-3, fitted", "universal")
    _table(NARROW, NEWTON_POSES, Case.missed, names)


def wide() -> None:
    """The same over wide boxes: mean and worst error in %, and what plain Newton misses."""
    both = lambda case, guess: f"{_mean_and_worst(case.errors(guess))}; {case.missed(guess)}"  # noqa: E731
    _table(WIDE, POSES, both)


def misses() -> None:
    """Where plain Newton ends for the poses that it misses from the network in wide boxes.

    A twin is another pose with the same readings and home's sign of det J: readings alone cannot
    tell which of the two is meant.
    """
    heads = ("machine", "missed", "at a twin", "beyond a singularity", "no end, but solved",
             "no end", "the cubic misses too", "predicted where none ends, %")  # fmt: skip
    print(f"| {' | '.join(heads)} |\n|---|{'---:|' * 7}")
    for name, box in WIDE.items():
        case = Case.of(gough.Platform.load(name), box, POSES)
        guess = UniversalSeed(case.platform).guess_with_error(case.legs)
        right, converged, end = case.newton(guess.pose)
        missed = ~right
        twin = missed & converged & (gough.assembly_sign(case.platform, end) > 0)
        none = missed & ~converged
        again = gough.solve(case.platform, case.legs[none], seed="universal").pose
        solved = int(np.sum(again.distance(case.pose[none])[0] < 1e-6 * case.platform.size))
        cubic = ~case.newton(gough.PolynomialSeed(case.platform, 3).guess(case.legs))[0]
        share = 100 * guess.position_error[none] / case.platform.size
        cells = [missed.sum(), twin.sum(), (missed & converged & ~twin).sum(), solved,
                 none.sum() - solved, (missed & cubic).sum(),
                 " ".join(f"{v:.2g}" for v in sorted(share))]  # fmt: skip
        print(f"| {name} | {' | '.join(map(str, cells))} |", flush=True)
    print()


def _table(boxes: dict, count: int, cell: Callable[[Case, gough.Pose], str],
           heads: Sequence[str] = NAMES) -> None:  # fmt: skip
    print("| machine | box | poses | " + " | ".join(heads) + " |")
    print("|---|---|---:|" + "---:|" * len(heads))
    for name, box in boxes.items():
        case = Case.of(gough.Platform.load(name), box, count)
        ours = seeds(case.platform)
        cells = [cell(case, ours[name].guess(case.legs)) for name in heads]
        print(f"| {name} | ±{100 * box[0]:g} %, ±{box[1]}° | {len(case.pose):,} | "
              f"{' | '.join(cells)} |", flush=True)  # fmt: skip
    print()


def _mean_and_worst(errors: np.ndarray) -> str:
    return f"{100 * errors.mean():.2g} ({100 * errors.max():.2g})"


def random_machines(count: int = 500, odd: float = 0.0, rows: int = 60) -> list[Case]:
    """Random machines of a seed that no training has, over +-8 % and +-30 deg."""
    from gough.learn.universal.machines import Draw

    machines = Draw(10**9 + int(10 * odd)).machines(count, odd)
    made = [
        gough.Platform(b.numpy(), j.numpy(), home=np.zeros(3))
        for b, j in zip(machines.base, machines.joints, strict=True)
    ]
    return [Case.of(platform, (0.08, 30), rows) for platform in made]


def random() -> None:
    """500 random machines of the usual kinds, and 200 with joints anywhere in a box."""
    print("| machines | guess | median of their mean errors, % | 90 % of them below | worst |")
    print("|---|---|---:|---:|---:|")
    for label, cases in (
        ("500 usual ones", random_machines()),
        ("200 with joints anywhere", random_machines(200, 1.0)),
    ):
        for name, make in (
            ("taylor-2", lambda p: TaylorSeed(p, 2)), ("network", Network),
            ("taylor-2 + steps", lambda p: Closed(p, 2)), ("universal", UniversalSeed),
        ):  # fmt: skip
            means = np.array([c.errors(make(c.platform).guess(c.legs)).mean() for c in cases])
            print(f"| {label} | {name} | {100 * np.median(means):.2g} | "
                  f"{100 * np.quantile(means, 0.9):.2g} | {100 * means.max():.2g} |")  # fmt: skip
    print()


def predicted() -> None:
    """Print how often the error is below three times its prediction, and their usual ratio."""
    print("| machines | below 3 x the prediction, % | prediction / error, median |")
    print("|---|---:|---:|")
    groups = {f"{n}, ±{100 * b[0]:g} %, ±{b[1]}°": [Case.of(gough.Platform.load(n), b, POSES)]
              for boxes in (NARROW, WIDE) for n, b in boxes.items()}  # fmt: skip
    groups |= {"500 usual random ones": random_machines()}
    groups |= {"200 with joints anywhere": random_machines(200, 1.0)}
    for label, cases in groups.items():
        ratio = np.concatenate([_ratio(case) for case in cases])
        print(f"| {label} | {100 * np.mean(ratio < 3):.2f} | {1 / np.median(ratio):.2f} |",
              flush=True)  # fmt: skip
    print()


def _ratio(case: Case) -> np.ndarray:
    guess = UniversalSeed(case.platform).guess_with_error(case.legs)
    return guess.pose.distance(case.pose)[0] / guess.position_error


def speed() -> None:
    """Milliseconds for 1,000 guesses in one call: the least of 30, on all cores of this machine."""
    print("| guess | reference, ms | reachy_mini (rotary), ms |")
    print("|---|---:|---:|")
    cases = [
        Case.of(gough.Platform.load(n), (0.06, 20), 1100) for n in ("reference", "reachy_mini")
    ]
    for name in NAMES:
        times = [_time(seeds(c.platform)[name].guess, c.legs[:1000]) for c in cases]
        print(f"| {name} | {times[0]:.2f} | {times[1]:.2f} |", flush=True)
    facts = UniversalSeed(cases[0].platform).facts
    record = facts["record"]
    print(f"\nnumbers: {facts['parameters']:,}; trained {record['seconds']:,.0f} s on one core, "
          f"{record['steps']:,} steps, {record['samples']:,} poses\n")  # fmt: skip


def _time(guess: Callable, legs: np.ndarray, repeats: int = 30) -> float:
    guess(legs)
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        guess(legs)
        times.append(time.perf_counter() - began)
    return 1e3 * min(times)


def auto() -> None:
    """Whole solves without a stated workspace, from home and from the network: rows not true."""
    print("| machine | box | from home: not true, s | from universal: not true, s |")
    print("|---|---|---:|---:|")
    for boxes in (NARROW, WIDE):
        for name, box in boxes.items():
            case = Case.of(gough.Platform.load(name), box, POSES)
            plain = replace(gough.Platform.load(name), workspace=None)
            cells = []
            for seed in ("home", "universal"):
                gough.solve(plain, case.legs, seed=seed)  # compiled, and in memory
                began = time.perf_counter()
                solved = gough.solve(plain, case.legs, seed=seed)
                took = time.perf_counter() - began
                wrong = np.sum(case.errors(solved.pose) > 1e-6)
                cells.append(f"{wrong:,}, {took:.3f}")
            print(f"| {name} | ±{100 * box[0]:g} %, ±{box[1]}° | {' | '.join(cells)} |", flush=True)
    print()


def distance() -> None:
    """Mean error of each machine against its distance from the training set, for the figure.

    The distance of two machines is the root mean square difference of their sorted distances
    between base joints, between platform joints, and from one to the other [share of the size];
    that from the training set is to the nearest of 20,000 machines drawn as for training.
    """
    from gough.learn.universal.machines import Draw

    drawn = Draw(0).machines(20_000)
    known = _signature(drawn.base.numpy(), drawn.joints.numpy())
    catalog = [Case.of(gough.Platform.load(n), box, 2000) for n, box in NARROW.items()]
    groups = {"usual": random_machines(250), "anywhere": random_machines(150, 1.0)}
    out: dict[str, Any] = {}
    for label, cases in (groups | {"catalog": catalog}).items():
        rows = []
        for case in cases:
            p = case.platform
            joints = p.home.apply(p.moving - p.pivot_point) + p.pivot_point
            mine = _signature(p.base[None] / p.size, joints[None] / p.size)
            nearest = float(np.sqrt(np.mean((known - mine) ** 2, axis=1)).min())
            made = TaylorSeed(p, 2), Network(p), UniversalSeed(p)
            errors = [float(case.errors(seed.guess(case.legs)).mean()) for seed in made]
            rows.append([float(f"{v:.4g}") for v in (nearest, *errors)])
        out[label] = rows
    out["names"] = list(NARROW)
    text = json.dumps(out) + "\n"
    Path("docs/figures/universal.json").write_text(text)
    print(f"docs/figures/universal.json: {sum(len(v) for v in groups.values())} machines\n")


def _signature(base: np.ndarray, joints: np.ndarray) -> np.ndarray:
    gaps = lambda a, b: np.linalg.norm(a[:, :, None] - b[:, None], axis=-1).reshape(len(a), -1)  # noqa: E731
    pairs = gaps(base, base), gaps(joints, joints), gaps(base, joints)
    return np.concatenate([np.sort(d, axis=1) for d in pairs], axis=1)


def tuning(budget: str = "60s", whole: str = "10m") -> None:
    """`gough train --from universal` for a minute beside ResMLP from nothing for ten, one core.

    Mean position error over held-out poses of the workspace, in units of the machine. Slow: half an
    hour of processor time.
    """
    from gough.learn.config import PRESETS
    from gough.learn.evaluate import held_out
    from gough.learn.train import train
    from gough.learn.universal.finetune import finetune

    print("| machine | universal | network alone | tuned 60 s | network alone | ResMLP 10 min |")
    print("|---|---:|---:|---:|---:|---:|")
    for name in TUNED:
        platform, folder = gough.Platform.load(name), RUNS / name
        pose, legs = held_out(platform, POSES, False)
        finetune(platform, folder / "tuned", budget=budget)
        config = PRESETS["default"].with_run(budget=whole, clock="processor", threads=1)
        train(platform, config, folder / "new", show=False)
        paths = {"universal": None, "tuned": folder / "tuned"}
        guesses = [
            UniversalSeed(platform, path, polished=polished)
            for path in paths.values() for polished in (True, False)
        ] + [NetworkSeed(platform, folder / "new")]  # fmt: skip
        errors = [seed.guess(legs).distance(pose)[0].mean() for seed in guesses]
        print(f"| {name} | {' | '.join(f'{e:.3g}' for e in errors)} |", flush=True)
    print()
    curves()


def curves() -> None:
    """Mean position error while both train, in units of the machine, after so many seconds.

    Reads what `tuning` has left in runs/tuning; "tuned" is the network alone, without the steps.
    """
    print(f"| machine | network | {' | '.join(f'{t} s' for t in TIMES)} |")
    print(f"|---|---|{'---:|' * len(TIMES)}")
    for name in TUNED:
        size = gough.Platform.load(name).size
        for run, column, unit in (("tuned", "narrow_error", size), ("new", "trans", 1.0)):
            with (RUNS / name / run / "metrics.csv").open(newline="") as file:
                rows = [
                    (float(r["seconds"]), unit * float(r[column])) for r in csv.DictReader(file)
                ]
            last = [[e for s, e in rows if s <= 1.02 * t] for t in TIMES]
            whole = rows[-1][0] + 10  # the last measurement is a few seconds before the end
            known = [t <= whole and bool(e) for t, e in zip(TIMES, last, strict=True)]
            cells = [f"{e[-1]:.2g}" if k else "" for k, e in zip(known, last, strict=True)]
            print(f"| {name} | {run} | {' | '.join(cells)} |")
    print()


TABLES = {
    f.__name__: f
    for f in (
        accuracy,
        random,
        newton,
        wide,
        misses,
        predicted,
        speed,
        auto,
        distance,
        tuning,
        curves,
    )
}

if __name__ == "__main__":
    for chosen in sys.argv[1:] or [name for name in TABLES if name not in ("tuning", "curves")]:
        print(f"## {chosen}\n\n{TABLES[chosen].__doc__}\n")
        TABLES[chosen]()

"""Errors of calibrations beside the bound that statistics allow (Cramer and Rao, with a prior).

    python benchmarks/calibration.py [--trials 200] [--only bound,before,plan,outliers,...]

Each trial draws a machine whose joints and zeros are off by N(0, 0.5 mm), measuring and tool frames
anywhere, random poses within workspace and stroke, and noise: tracker 0.01 mm and 0.002 deg, camera
0.1 mm and 0.05 deg, leg readings 0.003 mm. Errors are those of positions in the measuring frame, at
100 other poses of the workspace. The bound is the same mean for the covariance at the truth.
"""

# tests/calibration is found at run time
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import gough
from gough.calibration.estimate import Problem, State, minimise
from gough.calibration.placements import Targets
from gough.calibration.prediction import Workspace
from gough.calibration.residuals import Rigid, forward
from gough.calibration.sensors import PoseSensor, TargetSensor

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "calibration"))
from machines import LEG, TRACKER, Truth, measure, options, truth

CAMERA = (0.1, float(np.radians(0.05)))
NOISE = {"tracker": TRACKER, "camera": CAMERA}
MACHINES = ("reference", "nasa_msfc", "rubin_camera")


class Trial:
    """One machine, measured and calibrated; what came of it in [mm]."""

    def __init__(self, name: str, noise: str, count: int, number: int, **how: Any) -> None:
        self.sigma = NOISE[noise]
        gains = how.get("gains", 0.0)
        self.known: Truth = truth(name, 1000 + number, gains=gains)
        poses = how.get("poses")
        poses = self.known.poses(count, 2000 + number) if poses is None else poses
        legs, seen = measure(self.known, poses, 3000 + number, self.sigma)
        told = options(self.known, self.sigma)
        measured: Any = seen
        if how.get("position"):
            measured = seen.position
            told |= {"kind": "position", "sigma": told["sigma"][0]}
        good = np.ones(len(legs), dtype=bool)
        if how.get("outliers"):
            measured, good = spoil(seen, how["outliers"], number, self.known.mm)
            told["robust"] = True
        self.found = gough.calibrate(self.known.drawing, legs, measured, gains=gains > 0, **told)
        self._judge(poses[good], how)

    def _judge(self, poses: gough.Pose, how: dict) -> None:
        known, found = self.known, self.found
        other = known.poses(100, 77)
        legs = gough.leg_lengths(known.platform, other)
        near = Rigid.of(other, known.drawing.pivot_point)
        true = known.seen(other)

        def errors(state: State) -> np.ndarray:
            body, _ = forward(found.parameters, state.values, legs, near)
            if isinstance(state.place, Targets):
                sensor = TargetSensor(true.t[:, None], 1.0)
                return np.linalg.norm(sensor.predicted(state.place, body) - true.t, axis=1)
            seen = state.place.frame @ body @ state.place.tool.inverse()
            return np.linalg.norm(seen.t - true.t, axis=1)

        mm = known.mm
        self.before, after = errors(found.drawn) / mm, errors(found.estimate.state) / mm
        self.after, self.rms = after, float(np.sqrt(np.mean(after**2)))
        self.bound = self._bound(poses, legs, near, how) / mm
        off = (found.estimate.state.values - known.values) / found.deviations
        self.covered = np.mean(np.abs(off) < 1.96)

    def _bound(self, poses: gough.Pose, legs: Any, near: Rigid, how: dict) -> float:
        """The error that the covariance at the truth predicts, from good poses only."""
        known, problem = self.known, self.found.problem
        body = Rigid.of(poses, known.drawing.pivot_point)
        exact = gough.leg_lengths(known.platform, poses)
        seen = known.seen(poses)
        place: Any = known.frames
        sensor: Any = PoseSensor(seen, (self.sigma[0] * known.mm, self.sigma[1]))
        if how.get("position"):
            place = Targets(known.frames.frame, known.frames.tool.inverse().t[None])
            sensor = TargetSensor(seen.t[:, None], self.sigma[0] * known.mm)
        ideal = Problem(problem.parameters, sensor, exact, problem.leg_sigma)
        state = State(known.values, place, body)
        covariance = minimise(ideal, state, iterations=0).covariance
        return Workspace(ideal, legs, near).error(state, covariance).position


def spoil(pose: gough.Pose, share: float, seed: int, mm: float) -> tuple[gough.Pose, np.ndarray]:
    """Poses of which a share are outliers of 5 mm and 1 deg, and which are good."""
    rng = np.random.default_rng(seed)
    bad = rng.random(len(pose)) < share
    shift, turn = (
        rng.normal(0, 5 * mm, (len(pose), 3)),
        rng.normal(0, np.radians(1), (len(pose), 3)),
    )
    turned = gough.Pose.from_rotation_vector(np.zeros(3), turn * bad[:, None]) @ gough.Pose(
        np.zeros(3), pose.wxyz
    )
    return gough.Pose(pose.position + shift * bad[:, None], turned.wxyz), ~bad


def rms(values: list[float]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def run(trials: int, name: str, noise: str, count: int, label: str = "", **how: Any) -> None:
    """Print a row of results."""
    done = [Trial(name, noise, count, k, **how) for k in range(trials)]
    before = np.mean([np.mean(t.before) for t in done])
    after = np.mean([np.mean(t.after) for t in done])
    ratio = rms([t.rms for t in done]) / rms([t.bound for t in done])
    worse = [np.mean(t.after) > np.mean(t.before) for t in done]
    written = [t.found.better for t in done]
    bad = np.sum(np.array(worse) & np.array(written))
    far = np.sum([t.rms > 3 * t.bound for t in done])
    print(
        f"{name:13} {noise:8} {count:4} {label:16} before {1e3 * before:7.1f} um  after "
        f"{1e3 * after:6.2f} um  {before / after:5.0f}x  rms/bound {ratio:.3f}  beyond 3 bounds "
        f"{far}  worse {np.sum(worse)}  written {np.sum(written)}  written and worse {bad}  "
        f"in 95 % intervals {100 * np.mean([t.covered for t in done]):.1f} %",
        flush=True,
    )


def timing() -> None:
    """Print the times for 1,000 poses and for a plan of 20, on one thread."""
    known = truth("reference", 0)
    legs, seen = measure(known, known.poses(1000, 1))
    spoilt, _ = spoil(seen, 0.1, 0, 1.0)
    told = options(known)
    jobs: dict[str, Callable[[], Any]] = {
        "1000 poses": lambda: gough.calibrate(known.drawing, legs, seen, **told),
        "the same with its messages": lambda: (
            gough.calibrate(known.drawing, legs, seen, **told).messages
        ),
        "1000 poses, 10 % outliers, robust": lambda: gough.calibrate(
            known.drawing, legs, spoilt, robust=True, **told
        ),
        "plan of 20": lambda: gough.plan_poses(known.drawing, 20),
    }
    for name, job in jobs.items():
        wall, busy = [], []
        for _ in range(7):
            started = time.perf_counter(), time.process_time()
            job()
            wall.append(time.perf_counter() - started[0])
            busy.append(time.process_time() - started[1])
        print(f"{name}: best of 7: {min(wall):.3f} s, of which {min(busy):.3f} s on the processor")


def main() -> None:
    """Print the rows that are asked for."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--only", default="bound,plan,outliers,position,gains,times")
    options_ = parser.parse_args()
    trials, wanted = options_.trials, options_.only.split(",")
    print(f"{trials} trials a row; leg readings {LEG} mm; NumPy {np.__version__}", flush=True)
    if "times" in wanted:
        timing()
    if "plan" in wanted:
        plan = gough.plan_poses(truth("reference").drawing, 20).poses
        run(trials, "reference", "tracker", 20, "planned", poses=plan)
        run(trials, "reference", "tracker", 40, "random")
    if "position" in wanted:
        run(trials, "reference", "tracker", 40, "position only", position=True)
    if "gains" in wanted:
        run(trials, "reference", "tracker", 40, "gains 2e-4", gains=2e-4)
    if "outliers" in wanted:
        for name in MACHINES:
            run(trials, name, "tracker", 40, "10 % outliers", outliers=0.1)
    if "bound" in wanted:
        for name in MACHINES:
            for noise in NOISE:
                for count in (20, 40, 200):
                    run(trials, name, noise, count)


if __name__ == "__main__":
    main()

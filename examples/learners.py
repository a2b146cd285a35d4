"""Kinds of learner that surveys of learned forward kinematics name, on the benchmark's test set.

    python examples/learners.py            # all of them: knn svr gp labels physics physics-1
    python examples/learners.py knn svr

prints the score of each (docs/join.md) and what it took. The first three are of scikit-learn;
kernels cost the square or the cube of the number of poses, so they learn from subsets. The last
three are the network `resmlp`, trained for two minutes of processor time as usual: with the
pose of each row (`labels`), physics-informed without any pose (`physics`), whose loss is how far
the leg lengths of the answer are from those asked, and with the poses of 4,000 rows beside
(`physics-1`, 1 % of the paper's training set). Needs the extras `learn` and `study`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from sklearn.compose import TransformedTargetRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel
from sklearn.multioutput import MultiOutputRegressor
from sklearn.neighbors import KNeighborsRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVR

import gough
from gough.learn.config import PRESETS
from gough.learn.loss import pose_loss
from gough.learn.optim import learning_rate
from gough.learn.train import Trainer
from gough.paper.benchmark import benchmark, score

ROWS, LABELLED, BUDGET = 400_000, 4_000, "2m"
TEST = benchmark("paper")
Method = Callable[[np.ndarray], gough.Pose]


def regression(model: Any, count: int) -> Method:
    """A regression of scikit-learn from leg lengths to positions and rotation vectors."""
    poses = TEST.platform.sample_poses(count, seed=1)
    targets = np.column_stack([poses.position, poses.rotation_vector])
    scaled = TransformedTargetRegressor(
        make_pipeline(StandardScaler(), model), transformer=StandardScaler()
    )
    scaled.fit(gough.leg_lengths(TEST.platform, poses), targets)

    def method(legs: np.ndarray) -> gough.Pose:
        parts = [scaled.predict(legs[i : i + 5000]) for i in range(0, len(legs), 5000)]
        found = np.concatenate(parts)
        return gough.Pose.from_rotation_vector(found[:, :3], found[:, 3:])

    return method


def knn() -> Method:
    """The mean of the eight nearest of 400,000 rows, weighted by closeness."""
    return regression(KNeighborsRegressor(8, weights="distance"), ROWS)


def svr() -> Method:
    """One support vector regression for each of the six numbers, from 8,000 rows."""
    one = SVR(C=100.0, gamma=0.05, epsilon=1e-3, tol=1e-3, cache_size=1000)
    return regression(MultiOutputRegressor(one), 8_000)


def gp() -> Method:
    """A Gaussian process whose lengths are fitted to 800 rows, and which knows 5,000."""
    kernel = ConstantKernel(10.0, (1e-2, 1e8)) * RBF(3 * np.ones(6), (0.1, 1e3))
    first = GaussianProcessRegressor(kernel, alpha=1e-8, random_state=0)
    poses = TEST.platform.sample_poses(800, seed=2)
    targets = np.column_stack([poses.position, poses.rotation_vector])
    scale = StandardScaler().fit_transform
    first.fit(scale(gough.leg_lengths(TEST.platform, poses)), scale(targets))
    return regression(GaussianProcessRegressor(first.kernel_, alpha=1e-8, optimizer=None), 5_000)


def network(labels: float, physics: bool) -> Method:
    """`resmlp` after two minutes: with all, none or some poses of the rows it learns from."""
    config = PRESETS["default"].with_run(budget=BUDGET, clock="processor", threads=1)
    trainer = Trainer(TEST.platform, config, Path())
    model, machine = trainer.model, trainer.stream.platform
    known = trainer.stream.batch(LABELLED, 0, 0)
    trainer.clock.tick()
    while (progress := trainer.clock.progress(trainer.step)) < 1:
        for group in trainer.optimiser.param_groups:
            group["lr"] = learning_rate(config.optimiser, trainer.step, progress)
        batch = trainer.samples(trainer.step)
        answer = model(batch.legs)
        loss = torch.zeros(())
        if physics:
            miss = machine.leg_lengths(*machine.from_home(*answer)) - batch.legs
            loss = loss + torch.linalg.vector_norm(miss, dim=-1).mean()
        if 0 < labels < 1:
            batch = known[torch.randint(LABELLED, (len(batch.legs) // 5,))]  # of the known rows
            answer = model(batch.legs)
        if labels:
            loss = loss + pose_loss(*answer, batch, trainer.beta)
        trainer.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        trainer.optimiser.step()
        trainer.step += 1
        trainer.clock.tick()

    @torch.no_grad()
    def method(legs: np.ndarray) -> gough.Pose:
        position, rotation = machine.from_home(*model.eval()(torch.tensor(legs)))
        return gough.Pose.from_rotation(position.numpy(), rotation.numpy())

    return method


LEARNERS: dict[str, Callable[[], Method]] = {
    "knn": knn,
    "svr": svr,
    "gp": gp,
    "labels": lambda: network(1.0, False),
    "physics": lambda: network(0.0, True),
    "physics-1": lambda: network(LABELLED / ROWS, True),
}

if __name__ == "__main__":
    for name in sys.argv[1:] or LEARNERS:
        began = time.process_time()
        method = LEARNERS[name]()
        trained = time.process_time() - began
        print(score(method, TEST, name))
        began = time.process_time()
        method(TEST.legs[:1000])
        ms = 1e3 * (time.process_time() - began)
        print(f"made in {trained:.0f} s of processor time, 1,000 rows in {ms:.3g} ms\n", flush=True)

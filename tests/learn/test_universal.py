"""Training the universal network: its machines, its loop, its file, and tuning it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

import gough
from gough.learn.config import RunConfig
from gough.learn.universal.export import load
from gough.learn.universal.finetune import PlatformPoses, finetune
from gough.learn.universal.machines import SINGULAR, Draw, Machines
from gough.learn.universal.train import (
    BOXES,
    RandomMachines,
    Trainer,
    UniversalConfig,
    mean_by_machine,
    pose_errors,
    prepare,
)  # fmt: skip
from gough.seeds.taylor import series
from gough.seeds.universal import UniversalSeed

TINY = UniversalConfig(
    network={"width": 8, "layers": 1, "code": 8, "rounds": 1}, machines=8, rows=4,
    run=RunConfig(steps=3, threads=1),
)  # fmt: skip


def platform_of(machines: Machines, i: int) -> gough.Platform:
    """A random machine as a platform whose home is the identity."""
    return gough.Platform(machines.base[i].numpy(), machines.joints[i].numpy(), home=np.zeros(3))


def test_random_machines_and_their_poses_agree_with_gough():
    draw = Draw(3)
    machines = draw.machines(20)
    poses = draw.poses(machines, 5)
    for i in range(20):
        platform = platform_of(machines, i)
        assert platform.size == pytest.approx(1)
        assert gough.singularity_distance(platform, platform.home) > SINGULAR
        pose = gough.Pose.from_rotation(poses.translation[i].numpy(), poses.rotation[i].numpy())
        change = gough.leg_lengths(platform, pose) - platform.home_legs
        np.testing.assert_allclose(poses.change[i].numpy().T, change, atol=1e-12)
        sign = gough.assembly_sign(platform, pose)
        np.testing.assert_array_equal(poses.regular[i].numpy(), sign > 0)


def test_no_machine_of_the_catalog_is_among_them():
    """Sorted distances between joints tell machines apart, whatever their frames and numbering."""
    drawn = Draw(0).machines(2000)
    ours = signature(drawn.base, drawn.joints)
    for name in gough.Platform.catalog():
        platform = gough.Platform.load(name)
        pivot = platform.pivot_point
        joints = platform.home.apply(platform.moving - pivot) + pivot
        points = (torch.tensor(p)[None] / platform.size for p in (platform.base, joints))
        assert (ours - signature(*points)).abs().amax(-1).min() > 1e-3


def signature(base: torch.Tensor, joints: torch.Tensor) -> torch.Tensor:
    pairs = [torch.cdist(base, base), torch.cdist(joints, joints), torch.cdist(base, joints)]
    return torch.cat([d.flatten(1).sort()[0] for d in pairs], dim=1)


def test_machines_are_drawn_where_they_are_used():
    drawn = Draw(1).machines(2000, odd=0.0)
    base, joints = drawn.base, drawn.joints
    closest = (torch.cdist(base, base) + torch.eye(6)).amin((1, 2))
    assert (closest < 1e-6).double().mean() > 0.005  # 6-3 machines
    flat = torch.linalg.svdvals(base - base.mean(1, keepdim=True))[:, 2]
    assert 0.05 < (flat < 1e-6).double().mean() < 0.5
    radius = lambda p: (p - p.mean(1, keepdim=True)).square().sum(-1).mean(-1).sqrt()  # noqa: E731
    ratio = radius(joints) / radius(base)
    assert ratio.quantile(0.02) < 0.3
    assert ratio.quantile(0.98) > 1.0


def test_the_file_computes_what_torch_does():
    """ONNX, through onnxruntime and the seed, beside the weights for PyTorch."""
    weights = Path(gough.__file__).parent / "weights" / "universal.safetensors"
    model, facts = load(weights)
    platform = gough.Platform.load("matlab_stewart")
    seed = UniversalSeed(platform)
    assert facts["parameters"] == seed.facts["parameters"] < 500_000
    machines, poses = PlatformPoses(platform, 0, 50).batch(0)
    terms = series(machines.base, machines.joints, machines.inverse, poses.change, 3)
    with torch.no_grad():
        mine = model(machines.base, machines.joints, machines.inverse, torch.stack(terms))
    given = {"base": machines.base, "joints": machines.joints, "inverse": machines.inverse}
    given |= {"terms": torch.stack(terms)}
    theirs = seed._session.run(None, {name: v.numpy() for name, v in given.items()})[0]
    np.testing.assert_allclose(theirs, mine.numpy(), atol=1e-6)


@pytest.mark.parametrize("name", ["rubin_camera", "reachy_mini"])
def test_poses_of_a_platform_are_displacements_of_the_joints_centre(name):
    platform = gough.Platform.load(name)
    machines, poses = PlatformPoses(platform, 0, 20).batch(4)
    levers = machines.joints[:, None] @ poses.rotation.mT
    struts = levers + poses.translation[..., None, :] - machines.base[:, None]
    home = (machines.joints - machines.base).norm(dim=-1)
    change = struts.norm(dim=-1) - home[:, None]
    torch.testing.assert_close(change.mT, poses.change, rtol=0, atol=1e-12)


def test_a_run_goes_on_bit_for_bit(tmp_path):
    whole = Trainer(TINY, tmp_path / "whole", RandomMachines(TINY))
    for step in range(3):
        whole.learn(step / 3)
    (tmp_path / "cut").mkdir()
    first = Trainer(TINY, tmp_path / "cut", RandomMachines(TINY))
    first.learn(0.0)
    first.save()
    second = Trainer(TINY, tmp_path / "cut", RandomMachines(TINY))
    second._load()
    for step in range(second.step, 3):
        second.learn(step / 3)
    other = second.model.state_dict()
    for name, value in whole.model.state_dict().items():
        torch.testing.assert_close(value, other[name], rtol=0, atol=0)


def test_a_folder_holds_one_run(tmp_path):
    prepare(tmp_path / "a", TINY, False, None)
    assert prepare(tmp_path / "a", UniversalConfig(), True, None) == TINY
    assert prepare(tmp_path / "a", TINY, True, "9s").run.budget == "9s"
    with pytest.raises(gough.GoughError, match="holds a run already"):
        prepare(tmp_path / "a", TINY, False, None)
    with pytest.raises(gough.GoughError, match="no run to resume"):
        prepare(tmp_path / "b", TINY, True, None)


def test_training_lowers_the_error(tmp_path):
    recipe = replace(TINY.optimiser, warmup=0)
    config = replace(TINY, machines=32, rows=16, optimiser=recipe)
    trainer = Trainer(config, tmp_path, RandomMachines(config))
    before = trainer.measure(0.0, 0.0)
    for _ in range(60):
        trainer.learn(0.0)
    after = trainer.measure(0.0, 0.0)
    for box in BOXES:
        assert after[f"{box}_error"] < 0.9 * before[f"{box}_error"]


@pytest.mark.slow
def test_tuned_for_one_platform(tmp_path):
    platform = gough.Platform.load("nasa_msfc")
    run = finetune(platform, tmp_path / "tuned", budget="3s")
    machines, poses = PlatformPoses(platform, 9, 500).batch(-5)
    with torch.no_grad():
        before, after = (
            float(mean_by_machine(pose_errors(load(path)[0], machines, poses)[0], poses.regular)[0])
            for path in (Path(gough.__file__).parent / "weights" / "universal.safetensors", run)
        )
    assert after < before
    seed = gough.solve(platform, platform.home_legs[None], seed=str(run), max_iterations=0)
    assert seed.pose.distance(platform.home)[0][0] < 1e-6 * platform.size
    with pytest.raises(gough.GoughError, match="fine-tuned for platform"):
        gough.solve(gough.Platform.load("reference"), np.ones(6), seed=str(run))


def test_predicted_errors_of_random_machines():
    """99 % below three times the prediction, over machines of a seed that no training has."""
    draw = Draw(10**9)
    machines = draw.machines(40)
    poses = draw.poses(machines, 40, BOXES["narrow"])
    below, count = 0, 0
    for i in range(40):
        good = poses.regular[i].numpy()
        pose = gough.Pose.from_rotation(poses.translation[i].numpy(), poses.rotation[i].numpy())
        pose, platform = pose[good], platform_of(machines, i)
        guess = UniversalSeed(platform).guess_with_error(gough.leg_lengths(platform, pose))
        away = guess.pose.distance(pose)[0]
        below += np.sum(away < 3 * guess.position_error)
        count += good.sum()
    assert below / count > 0.985

"""Training runs: they learn, stop on time, survive kill -9, and can be shared by processes."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from learn.networks import reference, tiny, with_model
from machines import random_platform

from gough import GoughError, leg_lengths
from gough.learn.config import PRESETS, DataConfig, RunConfig, TrainConfig, seconds
from gough.learn.optim import Clock, learning_rate
from gough.learn.run_folder import CHECKPOINT, load_tensors, save_tensors
from gough.learn.train import Trainer, prepare, run, train
from gough.seeds.network import NetworkSeed


def metrics(folder: Path) -> list[dict[str, str]]:
    with (folder / "metrics.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def weights(folder: Path) -> dict[str, torch.Tensor]:
    return load_tensors(folder / "weights.safetensors")[0]


def assert_same_weights(a: Path, b: Path) -> None:
    first, second = weights(a), weights(b)
    assert first.keys() == second.keys()
    assert all(torch.equal(first[name], second[name]) for name in first)


@pytest.fixture
def weights_only(monkeypatch):
    """Runs end without an ONNX file, which takes seconds to write."""

    def save(model, config, record, folder):
        facts = {"record": record}
        save_tensors(folder / "weights.safetensors", model.state_dict(), facts)

    monkeypatch.setattr("gough.learn.train.export_run", save)


def test_a_short_run_learns_and_leaves_all_files(tmp_path):
    folder = train(reference(), tiny(150), tmp_path / "run", show=False)
    names = {p.name for p in folder.iterdir()}
    assert {"config.json", "environment.json", "platform.toml", "metrics.csv", CHECKPOINT} <= names
    assert {"weights.safetensors", "network.onnx"} <= names
    assert any(name.startswith("events.out") for name in names)
    environment = json.loads((folder / "environment.json").read_text())
    assert environment["torch"] == torch.__version__
    assert float(metrics(folder)[-1]["trans"]) < 15  # a guess at home is 48 mm off
    platform = reference()
    pose = platform.sample_poses(500, 1)
    guess = NetworkSeed(platform, folder).guess(leg_lengths(platform, pose))
    assert guess.distance(pose)[0].mean() < 15


@pytest.mark.parametrize(
    "kind", ["disgnet", "disgnet-linear", "plain-mlp", "gcn", "graphmlp", "wise-mlp"]
)
def test_every_network_learns(tmp_path, kind):
    options = {"width": 16} | ({"hidden": 32} if kind == "graphmlp" else {})
    config = with_model(tiny(), kind, **options)
    config = replace(config, optimiser=replace(config.optimiser, lr=6e-3))
    trainer = Trainer(random_platform(0), config, tmp_path)
    before = trainer.measure(0.0, 0.0)["rot_deg"]
    while trainer.step < 120:
        trainer.learn(trainer.step / 120)
    assert trainer.measure(0.0, 1.0)["rot_deg"] < 0.85 * before


def test_a_killed_run_goes_on_bit_for_bit(tmp_path, weights_only):
    config = tiny(120, checkpoint_every=0.05, log_every=0.05)
    whole = train(reference(), config, tmp_path / "whole", show=False)
    killed = tmp_path / "killed"
    slow = replace(config, run=replace(config.run, checkpoint_every=0.02))
    prepare(reference(), slow, killed)
    process = subprocess.Popen([sys.executable, "-m", "gough.learn.train", str(killed)])
    deadline = time.monotonic() + 60
    while not (killed / CHECKPOINT).exists() and time.monotonic() < deadline:
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert not (killed / "network.onnx").exists(), "it finished before it was killed"
    step = load_tensors(killed / CHECKPOINT)[1]["step"]
    assert 0 < step < 120
    with (killed / "metrics.csv").open("a") as file:
        file.write("119,0.3,1")  # a line that was cut off
    train(reference(), config, killed, resume=True, show=False)
    assert_same_weights(whole, killed)
    steps = [int(row["step"]) for row in metrics(killed)]
    assert steps == sorted(set(steps))
    assert steps[-1] == 120


@pytest.mark.parametrize("kind", ["soap", "adamw"])
def test_a_run_stopped_anywhere_goes_on_bit_for_bit(tmp_path, kind, weights_only):
    config = with_model(tiny(25), "plain-mlp", width=8, depth=2)
    config = replace(config, data=replace(config.data, samples=640))
    config = replace(config, optimiser=replace(config.optimiser, kind=kind, average=0.9))
    whole = train(reference(), config, tmp_path / "whole", show=False)
    for stop in (1, 10, 13):
        folder = tmp_path / str(stop)
        prepare(reference(), config, folder)
        trainer = Trainer(reference(), config, folder)
        while trainer.step < stop:
            trainer.learn(trainer.step / 25)
        trainer.save()
        run(folder, show=False)
        assert_same_weights(whole, folder)


def test_two_processes_learn_what_one_does_with_the_joint_batch(tmp_path, weights_only):
    # not SOAP: where a gradient is zero but for rounding, its bases are a matter of rounding too
    config = tiny(12, shards=2, log_every=0.0, dtype="float64")
    config = replace(config, optimiser=replace(config.optimiser, kind="adamw"))
    alone = train(reference(), config, tmp_path / "alone", show=False)
    together = tmp_path / "together"
    prepare(reference(), config, together)
    environment = os.environ | {"OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo"}
    result = subprocess.run(
        [sys.executable, "-m", "torch.distributed.run", "--nproc-per-node", "2", "--standalone",
         "-m", "gough.learn.train", str(together)],
        env=environment, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    ours, theirs = metrics(alone), metrics(together)
    assert len(ours) == len(theirs) == 12
    for a, b in zip(ours, theirs, strict=True):
        assert float(a["loss"]) == pytest.approx(float(b["loss"]), rel=1e-8)
    first, second = weights(alone), weights(together)
    for name in first:
        torch.testing.assert_close(first[name], second[name], rtol=1e-8, atol=1e-10)


def test_a_run_can_start_from_the_weights_of_another(tmp_path, weights_only):
    first = train(reference(), tiny(60), tmp_path / "first", show=False)
    still = replace(tiny(1), optimiser=replace(tiny().optimiser, lr=0.0))
    second = train(reference(), still, tmp_path / "second", start=first, show=False)
    assert_same_weights(first, second)
    assert float(metrics(second)[-1]["trans"]) == float(metrics(first)[-1]["trans"])
    record = load_tensors(second / "weights.safetensors")[1]["record"]
    assert record["started_from"]["steps"] == 60
    with pytest.raises(GoughError, match="no such file"):
        train(reference(), tiny(), tmp_path / "third", start=tmp_path)
    other = with_model(tiny(), "resmlp", width=8, depth=2)
    with pytest.raises(GoughError, match="of another network"):
        train(reference(), other, tmp_path / "fourth", start=first, show=False)


def test_a_budget_is_kept_and_the_schedule_ends(tmp_path):
    config = tiny().with_run(budget="3s", log_every=0.2)
    began = time.monotonic()
    folder = train(reference(), config, tmp_path / "run", show=False)
    assert time.monotonic() - began < 15  # start and export included, on a busy machine
    rows = metrics(folder)
    rates = [float(row["lr"]) for row in rows]
    assert rates[-1] == 0
    assert 2.8 < float(rows[-1]["seconds"]) < 3.1
    assert max(rates) == 0.02


def test_a_sleeping_machine_loses_no_budget(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    clock = Clock(tiny().with_run(budget="100s"))
    monkeypatch.undo()
    for _ in range(50):
        now[0] += 0.1
        clock.tick()
    now[0] += 3600
    clock.tick()
    assert clock.elapsed < 8
    assert clock.progress(51) < 0.1


def test_the_rate_rises_stays_and_falls_to_zero():
    told = PRESETS["default"].optimiser
    rate = [learning_rate(told, step, step / 10_000) for step in range(10_001)]
    assert rate[0] == pytest.approx(told.lr / 200)
    assert max(rate) == rate[200] == rate[3000] == told.lr
    assert np.all(np.diff(rate[3000:]) < 0)
    assert learning_rate(told, 5, 0.05) == told.lr  # a run of a hundred steps
    assert rate[-1] == 0
    constant = PRESETS["paper"].optimiser
    assert {learning_rate(constant, s, s / 10) for s in range(11)} == {1e-3}


def test_fixed_samples_are_each_seen_once_an_epoch():
    config = replace(tiny(), data=DataConfig(batch=10, samples=50, test=10)).with_run(epochs=2)
    trainer = Trainer(reference(), config, Path())
    assert config.total_steps() == 10
    assert trainer.fixed is not None
    for epoch in (0, 1):
        seen = torch.cat([trainer.samples(5 * epoch + i).legs[:, 0] for i in range(5)])
        assert torch.equal(seen.sort().values, trainer.fixed.legs[:, 0].sort().values)
    assert not torch.equal(trainer.samples(0).legs, trainer.samples(5).legs)


def test_configurations_survive_their_file():
    for config in PRESETS.values():
        assert TrainConfig.from_json(config.to_json()) == config
    with pytest.raises(GoughError, match="not a training configuration"):
        TrainConfig.from_json('{"model": {"kind": "resmlp"}, "extra": 1}')


def test_the_papers_recipe():
    paper = PRESETS["paper"]
    assert (paper.optimiser.kind, paper.optimiser.lr) == ("adam", 1e-3)
    assert (paper.data.batch, paper.data.samples, paper.run.epochs) == (4000, 400_000, 1200)
    assert paper.loss.beta == 250
    assert paper.total_steps() == 120_000


@pytest.mark.parametrize(
    ("text", "value"), [("90s", 90), ("30m", 1800), ("1.5h", 5400), ("45", 45)]
)
def test_budgets_are_read(text, value):
    assert seconds(text) == value


def test_mistakes_are_named(tmp_path):
    for text in ("", "soon", "-3m", "0s", "nan"):
        with pytest.raises(GoughError, match="90s, 30m or 2h"):
            seconds(text)
    with pytest.raises(GoughError, match="one of budget, steps and epochs"):
        TrainConfig(run=RunConfig(budget="1m", steps=4))
    with pytest.raises(GoughError, match="no epochs"):
        TrainConfig(run=RunConfig(epochs=4))
    with pytest.raises(GoughError, match=r"data\.batch"):
        TrainConfig(data=DataConfig(batch=0))
    with pytest.raises(GoughError, match="holds no run"):
        train(reference(), tiny(), tmp_path / "none", resume=True)
    prepare(reference(), tiny(), tmp_path / "run")
    with pytest.raises(GoughError, match="holds a run already"):
        train(reference(), tiny(), tmp_path / "run")
    with pytest.raises(GoughError, match=r"run\.device"):
        Trainer(reference(), tiny().with_run(device="nonsense"), tmp_path)
    with pytest.raises(GoughError, match="shards"):
        Trainer(reference(), tiny().with_run(shards=7), tmp_path)

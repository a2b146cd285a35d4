"""The commands dataset, train and evaluate."""

import json
import re
import signal
from importlib import import_module

import pytest
import tyro
from learn.networks import reference

from gough import GoughError
from gough.commands import COMMANDS
from gough.learn.config import PRESETS, TrainConfig
from gough.learn.run_folder import CHECKPOINT, WEIGHTS, load_tensors
from gough.learn.train import Trainer


def call(name: str, *arguments: str) -> int:
    run = import_module(COMMANDS[name][0]).run
    return tyro.cli(run, args=list(arguments), prog=f"gough {name}")


def test_dataset(tmp_path, capsys):
    path = tmp_path / "data.csv"
    assert call("dataset", "-p", "reference", "-o", str(path), "--count", "20") == 0
    assert len(path.read_text().splitlines()) == 21
    assert "the first 16 for training" in capsys.readouterr().out
    wide = tmp_path / "wide.csv"
    call("dataset", "-p", "reference", "-o", str(wide), "--count", "20", "--workspace", "100", "60",
         "--same-assembly", "--layout", "paper")  # fmt: skip
    assert len(wide.read_text().splitlines()[0].split(",")) == 13 + 144


def test_train_prepare_takes_presets_and_options(tmp_path, capsys):
    folder = tmp_path / "run"
    call("train", "-p", "reference", "-o", str(folder), "--prepare", "--steps", "7",
         "--random-seed", "5", "wide", "--optimiser.lr", "1e-3",
         "--model.options", "width", "32")  # fmt: skip
    config = TrainConfig.from_json((folder / "config.json").read_text())
    assert (config.run.steps, config.run.budget, config.run.seed) == (7, None, 5)
    assert config.data.same_assembly
    assert config.optimiser.lr == 1e-3
    assert config.model.options == {"width": 32}
    assert "torchrun" in capsys.readouterr().out


def test_train_without_a_preset_takes_the_default(tmp_path):
    call("train", "-p", "reference", "-o", str(tmp_path / "run"), "--prepare")
    config = TrainConfig.from_json((tmp_path / "run" / "config.json").read_text())
    assert config == PRESETS["default"]


def test_train_own_platform_then_evaluate(tmp_path, capsys):
    own = tmp_path / "my.toml"
    platform = reference().with_workspace(20, 5)
    platform.save(own)
    run = tmp_path / "run"
    call("train", "-p", str(own), "-o", str(run), "--steps", "30",
         "default", "--model.options", "width", "8", "--data.test", "50")  # fmt: skip
    capsys.readouterr()
    call("evaluate", str(run), "home", "-p", str(own), "--poses", "200", "--json")
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows] == [str(run), "home"]
    assert rows[0]["newton"]["true"] == 200
    with pytest.raises(GoughError, match="holds a run already"):
        call("train", "-p", str(own), "-o", str(run))


def test_ctrl_c_keeps_a_checkpoint_and_says_how_to_go_on(tmp_path, capsys, monkeypatch):
    folder, learn = tmp_path / "run", Trainer.learn

    def interrupted(self, progress):
        if self.step == 2:
            signal.raise_signal(signal.SIGINT)
        return learn(self, progress)

    handler = signal.default_int_handler  # what started the tests may ignore SIGINT
    before = signal.signal(signal.SIGINT, handler)
    monkeypatch.setattr(Trainer, "learn", interrupted)
    arguments = ("-p", "reference", "-o", str(folder), "--steps", "12")
    options = ("default", "--model.options", "width", "8", "--data.test", "50")
    assert call("train", *arguments, *options) == 130
    err = capsys.readouterr().err
    assert re.search(r"stopped after 3 steps, 25 % of the run; \d:\d\d is left\.", err)
    assert f"gough train -p reference -o {folder} --resume" in err
    assert load_tensors(folder / CHECKPOINT)[1]["step"] == 3
    assert signal.getsignal(signal.SIGINT) == handler
    signal.signal(signal.SIGINT, before)
    monkeypatch.undo()
    assert call("train", "-p", "reference", "-o", str(folder), "--resume") == 0
    assert load_tensors(folder / WEIGHTS)[1]["record"]["steps"] == 12


def test_help_loads_no_torch():
    import subprocess
    import sys

    code = """
import sys, tyro
from gough.commands import dataset, evaluate, train
for command in (dataset, train, evaluate):
    try:
        tyro.cli(command.run, args=["--help"])
    except SystemExit:
        pass
assert not {"torch", "onnx", "onnxruntime", "numba", "pyarrow"} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)

"""From an own platform to poses by a network, as a newcomer would go."""

from __future__ import annotations

import numpy as np
import pytest

import gough as library

pytest.importorskip("torch")
pytestmark = pytest.mark.torch


def test_train_then_solve(gough, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    platform = library.Platform.load("matlab_stewart")
    platform.save("mine.toml")
    code, out, _ = gough("train", "-p", "mine.toml", "-o", "run", "--steps", "30")
    assert code == 0
    assert "gough solve LEGS -p mine.toml --seed run" in out
    legs = library.leg_lengths(platform, platform.sample_poses(50))
    head = ",".join(f"leg_{i}" for i in range(1, 7))
    np.savetxt("legs.csv", legs, delimiter=",", header=head, comments="")
    code, out, _ = gough("solve", "legs.csv", "-p", "mine.toml", "--seed", "run", "-o", "p.csv")
    assert code == 0
    assert "converged    50  100.0 %" in out
    code, _, err = gough("solve", "legs.csv", "-p", "reference", "--seed", "run")
    assert code == 2
    assert "trained in 'm', but platform 'reference' is in 'mm'" in err
    code, out, _ = gough("evaluate", "home", "run", "-p", "mine.toml", "--poses", "200")
    assert code == 0
    assert "run" in out


def test_dataset(gough, tmp_path):
    target = tmp_path / "data.csv"
    code, out, _ = gough("dataset", "-p", "reference", "-o", target, "--count", "20")
    assert code == 0
    assert "20 rows, the first 16 for training" in out
    assert len(target.read_text().splitlines()) == 21

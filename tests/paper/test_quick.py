"""`gough paper --quick`, once and whole, and what can be done with its folder."""

import json
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from cli.conftest import gough, process  # noqa: F401 - a fixture
from filelock import FileLock

from gough.learn.models import MODELS
from gough.learn.run_folder import load_tensors
from gough.paper import results
from gough.paper.study import QUICK, SETS, Plan, Study
from gough.platform import Platform

pytestmark = pytest.mark.slow


@pytest.fixture(scope="session")
def study(tmp_path_factory) -> Path:
    """The folder of a study, run once by all processes of pytest-xdist together."""
    root = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        root = root.parent
    folder = root / "study"
    with FileLock(root / "study.lock"):
        if not folder.exists():
            done = process("paper", "-o", folder, "--quick", "--budget", "0.3s", timeout=1200)
            assert done.code == 0, done.err
    return folder


@pytest.fixture
def paper(gough):  # noqa: F811
    return lambda *arguments: gough("paper", *arguments)


def test_every_table_is_filled_and_every_figure_there(study):
    text = (study / "index.md").read_text()
    for line in text.splitlines():
        if line.startswith("|"):
            assert all(cell.strip() for cell in line.strip("|").split("|")), line
    for heading in ("The paper's claims", "First guesses", "training sets", "Two-stage methods",
                    "Number of iterations", "A wide workspace", "Figures"):  # fmt: skip
        assert heading in text
    figures = re.findall(r"\]\((figures/\w+\.svg)\)", text)
    assert len(figures) == 6
    assert all((study / name).stat().st_size > 5000 for name in figures)
    assert "nan" not in text.lower().replace("finance", "")


def test_the_page_stands_alone(study):
    page = (study / "report.html").read_text()
    assert page.count("<svg") == 6
    assert not re.search(r'(?:src|href)="(?!#|data:)', page)  # nothing is fetched
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_all_networks_had_their_steps(study):
    plan = Plan.load(study / "plan.json")
    assert set(plan.steps) == set(MODELS)
    for name in SETS:
        for kind, steps in plan.steps.items():
            if name != "full" and kind not in plan.others:
                continue
            _, facts = load_tensors(study / "runs" / name / kind / "weights.safetensors")
            assert facts["record"]["steps"] == steps
            assert facts["record"]["samples"] == steps * 500


def test_a_table_made_again_says_the_same(paper, study, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(study / "results", copy / "results")  # no runs: the networks are enough
    for name in ("plan.json", "networks.json"):
        shutil.copy(study / name, copy)
    stages = ("networks", "sets", "methods", "iterations", "curves", "poses", "errors")
    words = [word for s in stages for word in ("--stage", s)]
    done = paper("-o", copy, "--networks", study / "networks", *words)
    assert done.code == 0, done.err
    for stage in stages:
        first, again = (without_times(f / "results" / f"{stage}.json") for f in (study, copy))
        assert first == again, stage


def test_other_networks_than_those_of_the_results_are_refused(paper, study, tmp_path):
    copy = tmp_path / "networks"
    shutil.copytree(study / "networks", copy)
    shutil.copy(copy / "90" / "disgnet.onnx", copy / "80" / "disgnet.onnx")
    done = paper("-o", study, "--stage", "sets", "--networks", copy)
    assert done.code == 2
    assert "80/disgnet.onnx: is not the network of this study" in done.err
    sums = json.loads((study / "networks.json").read_text())
    assert len(sums) == len(MODELS) + 3 * len(QUICK.others)
    assert sums["90/disgnet.onnx"]["sha256"][:16] in (study / "index.md").read_text()


def without_times(path: Path):
    """A result without what may differ: times, and how it was made."""

    def strip(value):
        if isinstance(value, dict):
            return {k: strip(v) for k, v in value.items()
                    if not k.endswith("seconds") and k != "made"}  # fmt: skip
        return [strip(v) for v in value] if isinstance(value, list) else value

    return strip(json.loads(path.read_text()))


def test_a_training_made_again_gives_the_same_bits(study, tmp_path):
    plan = Plan.load(study / "plan.json")
    again = Study(Platform.load("reference"), plan, tmp_path, tmp_path / "networks")
    from gough.learn.train import train

    threads = torch.get_num_threads()
    try:
        train(again.platform, plan.config("full", "wise-mlp"), tmp_path / "run", show=False)
    finally:
        torch.set_num_threads(threads)
    first, second = (load_tensors(f / "weights.safetensors")[0]
                     for f in (study / "runs/full/wise-mlp", tmp_path / "run"))  # fmt: skip
    assert all(torch.equal(first[name], second[name]) for name in first)


def test_a_study_that_was_stopped_goes_on(paper, study, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(study, copy)
    (copy / "networks" / "80" / "wise-mlp.onnx").unlink()
    (copy / "results" / "poses.json").unlink()
    kept = (copy / "results" / "times.json").read_bytes()
    assert paper("-o", copy).code == 2  # not by accident
    done = paper("-o", copy, "--resume")
    assert done.code == 0, done.err
    assert (copy / "networks" / "80" / "wise-mlp.onnx").exists()
    assert (copy / "results" / "poses.json").exists()
    assert (copy / "results" / "times.json").read_bytes() == kept
    assert "times: done before" in done.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "holds a study already"),
        (("--resume", "--budget", "2s"), "is a study of another size"),
        (("--resume", "-p", "rubin_camera"), "is a study of another platform"),
        (("--stage", "speed"), "invalid choice"),
    ],
)
def test_mistakes_are_told_in_a_line(paper, study, arguments, words):
    done = paper("-o", study, *arguments)
    assert done.code == 2
    assert words in done.err
    assert "Traceback" not in done.err


def test_a_stage_without_networks_says_what_to_run(paper, study, tmp_path):
    shutil.copy(study / "plan.json", tmp_path)
    done = paper("-o", tmp_path, "--stage", "sets")
    assert done.code == 2
    assert "there is no such network; run: gough paper --stage train" in done.err


def test_another_machine_has_a_study_too(tmp_path):
    """Metres, motor arms: the experiments are not made for one platform."""
    machine = Platform.load("reachy_mini")
    plan = replace(QUICK, budget=0.2, platform=machine.digest, steps=dict.fromkeys(MODELS, 5))
    other = Study(machine, plan, tmp_path, tmp_path / "networks")
    threads = torch.get_num_threads()
    try:
        other.train(["full"], show=False)
        rows = results.methods(other)["rows"]
    finally:
        torch.set_num_threads(threads)
    ends = {r["name"]: (r["singular"], r["imprecise"], r["wrong"]) for r in rows}
    assert ends["polynomial-3 + gough.solve"] == (0, 0, 0)
    assert ends["home + batched NR"][2] == 0
    assert len(ends) == 14

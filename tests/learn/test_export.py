"""From training to solving: files that say what they are, and refuse what they are not for."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from learn.networks import network, reference, tiny, with_model

from gough import GoughError, Platform, leg_lengths
from gough.learn.export import export_run, network_facts, to_onnx
from gough.learn.models import MODELS
from gough.learn.run_folder import WEIGHTS, load_state, load_tensors, save_tensors
from gough.seeds.network import NetworkSeed, _unseal, seal

RECORD = {"seconds": 1.0, "steps": 20, "seed": 0}
SIZES = {
    "resmlp": {"width": 16, "depth": 2}, "disgnet": {"width": 16},
    "disgnet-linear": {"width": 16},
    "plain-mlp": {"width": 16, "depth": 1}, "wise-mlp": {"width": 16, "depth": 1},
    "gcn": {"width": 16, "layers": 1}, "graphmlp": {"width": 16, "blocks": 1, "hidden": 16},
}  # fmt: skip


def exported(kind, folder, platform=None):
    platform = platform or reference()
    model = network(kind, platform, **SIZES[kind])
    model.cast(torch.float32)
    export_run(model, with_model(tiny(), kind, **SIZES[kind]), RECORD, folder)
    return model


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    exported("resmlp", folder)
    return folder


@pytest.fixture(scope="module")
def legs():
    return leg_lengths(reference(), reference().sample_poses(300, 4))


@pytest.mark.parametrize("kind", MODELS)
def test_onnx_gives_what_torch_gives(tmp_path, kind, legs):
    model = exported(kind, tmp_path)
    seed = NetworkSeed(reference(), tmp_path)
    assert seed.name == kind
    translation, rotation = (
        x.detach().numpy() for x in model(torch.tensor(seed_range(seed, legs)))
    )
    guess = seed.guess(legs)
    np.testing.assert_allclose(guess.position - reference().home.position, translation, atol=1e-3)
    np.testing.assert_allclose(guess.rotation, rotation, atol=1e-4)
    assert seed.guess(legs[:1]).batch == (1,)
    assert seed.guess(legs[:0]).batch == (0,)


def seed_range(seed, legs):
    return np.clip(legs, *seed.leg_range.T)


def test_chunks_do_not_show(run, legs, monkeypatch):
    seed = NetworkSeed(reference(), run / "network.onnx")
    whole = seed.guess(legs)
    monkeypatch.setattr("gough.seeds.network.CHUNK", 7)
    np.testing.assert_allclose(seed.guess(legs).position, whole.position, atol=1e-4)


def test_files_say_what_they_are(run):
    seed = NetworkSeed(reference(), run)
    weights, facts = load_tensors(run / WEIGHTS)
    assert facts == seed.facts
    assert facts["parameters"] == sum(tensor.numel() for tensor in weights.values())
    assert facts["platform"] == reference().digest
    assert facts["unit"] == "mm"
    assert facts["record"] == RECORD
    assert facts["config"]["model"] == {"kind": "resmlp", "options": SIZES["resmlp"]}


def test_it_is_a_plain_onnx_file(run):
    import onnx

    model = onnx.load(str(run / "network.onnx"))
    onnx.checker.check_model(model)
    keys = {p.key: p.value for p in model.metadata_props}
    assert set(keys) == {"gough", "gough.sha256"}
    assert b".py" not in (run / "network.onnx").read_bytes()  # no paths of whoever trained it
    assert json.loads(keys["gough"])["kind"] == "resmlp"


@settings(max_examples=60)
@given(st.data())
def test_a_damaged_file_is_refused_in_one_sentence(run, tmp_path_factory, data):
    content = bytearray((run / "network.onnx").read_bytes())
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    else:
        content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    path = tmp_path_factory.mktemp("damaged") / "network.onnx"
    path.write_bytes(content)
    with pytest.raises(GoughError, match=r"network\.onnx: truncated, corrupt") as caught:
        NetworkSeed(reference(), path)
    assert "\n" not in str(caught.value)


def test_other_files_are_refused(run, tmp_path):
    path = tmp_path / "other.onnx"
    path.write_bytes(seal(b"anything"))
    with pytest.raises(GoughError, match="another format"):
        NetworkSeed(reference(), path)
    with pytest.raises(GoughError, match="No such file"):
        NetworkSeed(reference(), tmp_path / "none")
    facts = load_tensors(run / WEIGHTS)[1]
    path.write_bytes(seal(b"not a graph\x0a\x05gough\x12" + length_and(json.dumps(facts))))
    with pytest.raises(GoughError, match="onnxruntime cannot run"):
        NetworkSeed(reference(), path)
    truncated = tmp_path / WEIGHTS
    truncated.write_bytes((run / WEIGHTS).read_bytes()[:-100])
    with pytest.raises(GoughError, match="truncated, corrupt"):
        load_tensors(truncated)
    save_tensors(truncated, {}, {"format": 0})
    assert load_tensors(truncated) == ({}, {"format": 0})


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'"rotation"', b'"rotatiom"'),
        (b'"nine"', b'"none"'),
        (b'"quaternion"', b'"quaternium"'),
        (b'"shift_mean": [', b'"shift_mean": {'),
        (b'"leg_range"', b'"leg_rangf"'),
        (b'"platform_name"', b'"platform_namf"'),
    ],
)
def test_a_network_with_other_facts_is_of_another_format(run, tmp_path, old, new):
    content = _unseal((run / "network.onnx").read_bytes(), "network")
    if old in content:
        path = tmp_path / "network.onnx"
        path.write_bytes(seal(content.replace(old, new)))
        with pytest.raises(GoughError, match="a network of another format"):
            NetworkSeed(reference(), path)


def test_a_checkpoint_with_other_parts_is_refused_in_one_line(tmp_path):
    path, model = tmp_path / "checkpoint.safetensors", torch.nn.Linear(3, 2)
    optimiser = torch.optim.Adam(model.parameters())
    weights = {f"model/{k}": v for k, v in model.state_dict().items()}
    for tensors, facts in (
        ({}, {"numbers": {}}),
        (weights | {"modle/bias": torch.ones(2)}, {"numbers": {}}),
        (weights, {}),
        (weights, {"numbers": {"x": {}}}),
        (weights | {"optimiser/x/step": torch.ones(2)}, {"numbers": {}}),
    ):
        save_tensors(path, tensors, facts)
        with pytest.raises(GoughError, match="checkpoint") as error:
            load_state(path, model, {}, optimiser)
        assert "\n" not in str(error.value)


def length_and(text: str) -> bytes:
    size = len(text)
    return bytes([size & 0x7F | 0x80, size >> 7 & 0x7F | 0x80, size >> 14]) + text.encode()


def test_weights_of_another_platform_are_refused(run):
    moved = replace(reference(), home=(0, 0, 601))
    for other in (moved, reference().with_workspace(60, 30), Platform.load("rubin_camera")):
        unit = "trained in 'mm'" if other.unit != "mm" else "weights of platform 'reference'"
        with pytest.raises(GoughError, match=unit):
            NetworkSeed(other, run)
    with pytest.raises(GoughError, match="trained in 'mm', but platform 'reference' is in 'm'"):
        NetworkSeed(replace(reference(), unit="m"), run)


def test_legs_outside_the_training_range_are_flagged_and_still_guessed(run, legs):
    seed = NetworkSeed(reference(), run)
    assert not seed.outside(legs[:20]).any()
    strange = legs[:4].copy()
    strange[1, 2] = 2 * strange[1, 2]
    strange[3, 0] = np.nan
    assert seed.outside(strange).tolist() == [False, True, False, True]
    guess = seed.guess(strange[:3])
    assert np.isfinite(guess.position).all()
    assert np.isfinite(guess.wxyz).all()
    nearest = seed.guess(np.clip(strange[:3], *seed.leg_range.T))
    np.testing.assert_array_equal(guess.position, nearest.position)


def test_solving_needs_no_torch(run):
    code = f"""
import sys, gough
from gough.seeds.network import NetworkSeed
platform = gough.Platform.load("reference")
seed = NetworkSeed(platform, {str(run)!r})
seed.guess(platform.home_legs[None])
heavy = {{"torch", "onnx", "onnxscript", "safetensors"}} & set(sys.modules)
assert not heavy, heavy
"""
    subprocess.run([sys.executable, "-c", code], check=True)
    code = "import sys, gough; assert not {'torch', 'onnxruntime', 'numba'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_onnx_of_a_double_network_keeps_its_digits(legs):
    model = network("resmlp", reference(), **SIZES["resmlp"])
    import onnxruntime

    content = to_onnx(model, network_facts(model, tiny(), RECORD))
    session = onnxruntime.InferenceSession(content)
    raw = np.asarray(session.run(None, {"legs": legs})[0])
    np.testing.assert_allclose(raw, model.raw(torch.tensor(legs)).detach(), rtol=1e-9, atol=1e-10)


QUIET = """
import logging, sys, warnings
sys.path.insert(0, {tests!r})
warnings.simplefilter("always")
import torch
from learn.networks import network, reference, tiny
from gough.learn import export

class Talking(torch.nn.Module):
    def __init__(self, model):
        super().__init__()
        self.model = model

    def forward(self, legs):
        warnings.warn("a real warning")
        logging.getLogger("torch.onnx").error("a real error")
        return self.model.raw(legs)

export._Raw = Talking
model = network("disgnet", reference(), width=16)
model.cast(torch.float32)
export.to_onnx(model, export.network_facts(model, tiny(), {{}}))
"""


def test_exporting_says_nothing_of_its_own_and_hides_nothing_else():
    tests = str(Path(__file__).resolve().parent.parent)
    code = QUIET.format(tests=tests)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == ""
    assert "a real warning" in done.stderr
    assert "a real error" in done.stderr
    for line in done.stderr.splitlines():
        assert "a real" in line or "warnings.warn(" in line, done.stderr

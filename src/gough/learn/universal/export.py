"""The universal network as files: safetensors to go on training, ONNX to solve without torch."""

from __future__ import annotations

from pathlib import Path

import torch

from gough.errors import GoughError
from gough.learn.export import finish_onnx, quiet
from gough.learn.run_folder import NETWORK, WEIGHTS, load_tensors, load_weights, save_tensors
from gough.learn.universal.network import Universal
from gough.platform import Platform
from gough.seeds.network import FORMAT
from gough.seeds.universal import KIND, ORDER
from gough.whole_file import write_whole


def export(model: Universal, options: dict, record: dict, folder: Path,
           platform: Platform | None = None) -> None:  # fmt: skip
    """Write both files into a run's folder; `platform` is the one it was fine-tuned for, if any."""
    facts = {
        "format": FORMAT,
        "kind": KIND,
        "parameters": model.parameter_count(),
        "platform": None if platform is None else platform.digest,
        "platform_name": None if platform is None else platform.name,
        "unit": None if platform is None else platform.unit,
        "network": options,
        "record": record,
    }
    save_tensors(folder / WEIGHTS, model.state_dict(), facts)
    write_whole(folder / NETWORK, to_onnx(model, facts))


def to_onnx(model: Universal, facts: dict) -> bytes:
    """A sealed ONNX file: base, joints, inverse, terms to strut length changes, all float64."""
    machines, rows = (torch.export.Dim(name, min=1) for name in ("machines", "rows"))
    base = torch.rand(2, 6, 3, dtype=torch.float64)
    joints, inverse = base.flip(1) + 1, torch.eye(6, dtype=torch.float64).repeat(2, 1, 1)
    terms = torch.rand(ORDER, 2, 6, 3, dtype=torch.float64)
    with quiet():
        program = torch.onnx.export(
            model.eval(), (base, joints, inverse, terms),
            dynamo=True, external_data=False, opset_version=18, verbose=False,
            input_names=["base", "joints", "inverse", "terms"], output_names=["changes"],
            dynamic_shapes=({0: machines}, {0: machines}, {0: machines}, {1: machines, 3: rows}),
        )  # fmt: skip
    assert program is not None
    return finish_onnx(program.model_proto, facts)


def load(path: Path) -> tuple[Universal, dict]:
    """A trained network from its run's folder or its weights.safetensors; its facts.

    Raises:
        GoughError: no such file, a damaged one, or one of another kind of network.
    """
    tensors, facts = load_tensors(path / WEIGHTS if path.is_dir() else path)
    if facts.get("kind") != KIND or facts.get("format") != FORMAT:
        raise GoughError(f"{path}: not a universal network of this version")
    try:
        model = Universal(**facts["network"])
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise GoughError(f"{path}: not a universal network of this version: {error}") from None
    load_weights(path, model, tensors)
    return model, facts

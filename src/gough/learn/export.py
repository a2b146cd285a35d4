"""Trained networks as files: safetensors to go on training, ONNX to solve without torch.

Both carry one JSON text, under the key "gough": platform digest, unit, model configuration,
scaling, training range and training record. The ONNX file ends with a checksum of what comes
before it, written as one more metadata entry, so that it stays a plain ONNX file.
"""

from __future__ import annotations

import contextlib
import json
import logging
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import onnx
import torch
from torch import Tensor, nn

from gough.errors import GoughError
from gough.learn.checkpoint import load_tensors, save_tensors
from gough.learn.config import TrainConfig
from gough.learn.models import PoseNetwork, Scaling, build
from gough.learn.models.base import reading_range
from gough.platform import Platform
from gough.seeds.network import FORMAT, seal
from gough.whole_file import write_whole

WEIGHTS, NETWORK = "weights.safetensors", "network.onnx"


def export_run(model: PoseNetwork, config: TrainConfig, record: dict, folder: Path) -> None:
    """Write both files into a run's folder."""
    facts = facts_of(model, config, record)
    model = model.eval().to("cpu")
    save_tensors(folder / WEIGHTS, model.state_dict(), facts)
    write_whole(folder / NETWORK, to_onnx(model, facts))


def facts_of(model: PoseNetwork, config: TrainConfig, record: dict) -> dict:
    """What a file of weights says about itself."""
    return {
        "format": FORMAT,
        "kind": model.kind,
        "rotation": model.rotation,
        "parameters": model.parameter_count(),
        "platform": model.platform.digest,
        "platform_name": model.platform.name,
        "unit": model.platform.unit,
        "leg_range": reading_range(model.platform).tolist(),
        "scaling": {name: value.tolist() for name, value in vars(model.scaling).items()},
        "config": json.loads(config.to_json()),
        "record": record,
    }


def to_onnx(model: PoseNetwork, facts: dict) -> bytes:
    """A sealed ONNX file: legs (N, 6) float64 to raw numbers (N, outputs) float64."""
    legs = torch.as_tensor(model.scaling.leg_mean).expand(2, 6).contiguous()
    with quiet():
        program = torch.onnx.export(
            _Raw(model).eval(), (legs,), dynamo=True, external_data=False, opset_version=18,
            input_names=["legs"], output_names=["raw"],
            dynamic_shapes=({0: torch.export.Dim("rows", min=1)},), verbose=False,
        )  # fmt: skip
    assert program is not None
    return finish_onnx(program.model_proto, facts)


def finish_onnx(proto: onnx.ModelProto, facts: dict) -> bytes:
    """A sealed ONNX file of a graph and its facts."""
    _strip(proto)
    entry = proto.metadata_props.add()
    entry.key, entry.value = "gough", json.dumps(facts)
    onnx.checker.check_model(proto)
    return seal(proto.SerializeToString())


def load_network(path: str | Path, platform: Platform) -> tuple[PoseNetwork, dict]:
    """A trained network for `platform` from a run's folder or its weights.safetensors; its facts.

    Raises:
        GoughError: no such file, a damaged one, or one of another platform.
    """
    path = Path(path)
    tensors, facts = load_tensors(path / WEIGHTS if path.is_dir() else path)
    if facts.get("format") != FORMAT:
        raise GoughError(f"{path}: weights of another format; train again with this version")
    if facts["platform"] != platform.digest:
        raise GoughError(
            f"{path}: weights of platform {facts['platform_name']!r}, not of {platform.name!r} as "
            "it is now; train a network for this platform"
        )
    config = TrainConfig.from_json(json.dumps(facts["config"]))
    scaling = Scaling(**{name: np.array(value) for name, value in facts["scaling"].items()})
    model = build(config.model.kind, platform, scaling, **config.model.options)
    model.load_state_dict(tensors)
    return model.eval(), facts


def _strip(proto: onnx.ModelProto) -> None:
    """Drop the exporter's notes, among them paths of source files."""
    graph = proto.graph
    parts = [proto, graph, *graph.node, *graph.value_info, *graph.input, *graph.output]
    for part in [*parts, *graph.initializer]:
        del part.metadata_props[:]
        part.doc_string = ""


class _Raw(nn.Module):
    def __init__(self, model: PoseNetwork) -> None:
        super().__init__()
        self.model = model

    def forward(self, legs: Tensor) -> Tensor:
        return self.model.raw(legs)


# What the exporter says of itself at every export, and what no user can do anything about
REMARKS = {
    "torch.onnx._internal.exporter._registration": "torchvision is not installed. Skipping ",
    "onnxscript.optimizer._constant_folding": "Skipping constant folding for op ",
}


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Without these remarks; all other warnings pass."""
    drop = [
        (logging.getLogger(name), lambda record, start=start: not record.msg.startswith(start))
        for name, start in REMARKS.items()
    ]
    for logger, rule in drop:
        logger.addFilter(rule)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".*treespec, LeafSpec.*deprecated", FutureWarning)
            warnings.filterwarnings("ignore", "(?s).*axis name: .* not be used", UserWarning)
            yield
    finally:
        for logger, rule in drop:
            logger.removeFilter(rule)

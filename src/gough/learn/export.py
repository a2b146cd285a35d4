"""Trained networks as files: safetensors to go on training, ONNX to solve without PyTorch.

Both carry one JSON text, under the key "gough": platform digest, unit, model configuration,
scaling, training range and training record. The ONNX file ends with a checksum of everything before
it, written as one more metadata entry, so it stays a plain ONNX file.
"""

from __future__ import annotations

import contextlib
import json
import logging
import warnings
from collections.abc import Iterator
from pathlib import Path

import onnx
import torch
from torch import Tensor, nn

from gough.learn.config import TrainConfig
from gough.learn.models import PoseNetwork
from gough.learn.models.base import reading_range
from gough.learn.run_folder import NETWORK, WEIGHTS, save_tensors
from gough.seeds.network import FORMAT, seal
from gough.whole_file import write_whole


def export_run(model: PoseNetwork, config: TrainConfig, record: dict, folder: Path) -> None:
    """Write both files into a run's folder."""
    facts = network_facts(model, config, record)
    model = model.eval().to("cpu")
    save_tensors(folder / WEIGHTS, model.state_dict(), facts)
    write_whole(folder / NETWORK, to_onnx(model, facts))


def network_facts(model: PoseNetwork, config: TrainConfig, record: dict) -> dict:
    """The JSON object that both files carry."""
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
    """Convert to a sealed ONNX file: legs (N, 6) float64 to raw numbers (N, outputs) float64."""
    legs = torch.as_tensor(model.scaling.leg_mean).expand(2, 6).contiguous()
    given = _Raw(model.for_export()).eval()
    with quiet():
        program = torch.onnx.export(
            given, (legs,), dynamo=True, external_data=False, opset_version=18,
            input_names=["legs"], output_names=["raw"],
            dynamic_shapes=({0: torch.export.Dim("rows", min=1)},), verbose=False,
        )  # fmt: skip
    assert program is not None
    return finish_onnx(program.model_proto, facts)


def finish_onnx(proto: onnx.ModelProto, facts: dict) -> bytes:
    """Seal a graph with its facts as the bytes of an ONNX file."""
    _strip(proto)
    onnx.helper.set_model_props(proto, {"gough": json.dumps(facts)})
    onnx.checker.check_model(proto)
    return seal(proto.SerializeToString())


def _strip(proto: onnx.ModelProto) -> None:
    """Drop the exporter's notes, among them paths of source files."""
    graph = proto.graph
    parts = [proto, graph, *graph.node, *graph.value_info, *graph.input, *graph.output]
    for part in [*parts, *graph.initializer]:
        del part.metadata_props[:]
        part.doc_string = ""


class _Raw(nn.Module):
    def __init__(self, model) -> None:
        super().__init__()
        self.model = model

    def forward(self, legs: Tensor) -> Tensor:
        return self.model.raw(legs)


# Messages of the exporter at every export, about which no user can do anything
REMARKS = {
    "torch.onnx._internal.exporter._registration": "torchvision is not installed. Skipping ",
    "onnxscript.optimizer._constant_folding": "Skipping constant folding for op ",
}


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Suppress these messages; all other warnings pass."""
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

"""The state of a run in one safetensors file: no pickle, whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn
from torch.optim import Optimizer

from gough.errors import GoughError
from gough.whole_file import write_whole


def save_tensors(path: Path, tensors: dict[str, Tensor], facts: dict) -> None:
    """Tensors by name, and facts that JSON can hold, as one safetensors file."""
    plain = {name: t.detach().cpu().contiguous() for name, t in tensors.items()}
    write_whole(path, save(plain, {"gough": json.dumps(facts)}))


def load_tensors(path: Path) -> tuple[dict[str, Tensor], dict]:
    """What `save_tensors` wrote.

    Raises:
        GoughError: the file is not there, not whole, or not one of these.
    """
    try:
        with safe_open(path, framework="pt") as file:
            facts = json.loads((file.metadata() or {})["gough"])
            return {name: file.get_tensor(name) for name in file.keys()}, facts  # noqa: SIM118
    except FileNotFoundError:
        raise GoughError(f"{path}: no such file") from None
    except (SafetensorError, OSError, KeyError, json.JSONDecodeError) as error:
        raise GoughError(f"{path}: truncated, corrupt, or not written by gough: {error}") from None


def save_state(path: Path, model: nn.Module, average: dict[str, Tensor], optimiser: Optimizer,
               facts: dict) -> None:  # fmt: skip
    """A checkpoint: weights, their average, the optimiser's tensors and numbers, and facts."""
    tensors = {f"model/{k}": v for k, v in model.state_dict().items()}
    tensors |= {f"average/{k}": v for k, v in average.items()}
    numbers: dict[str, dict] = {}
    for index, entries in optimiser.state_dict()["state"].items():
        for key, value in entries.items():
            if isinstance(value, Tensor):
                tensors[f"optimiser/{index}/{key}"] = value
            else:
                numbers.setdefault(str(index), {})[key] = value
    save_tensors(path, tensors, facts | {"numbers": numbers})


def load_state(path: Path, model: nn.Module, average: dict[str, Tensor],
               optimiser: Optimizer) -> dict:  # fmt: skip
    """Fill model, average and optimiser from a checkpoint; its facts.

    Raises:
        GoughError: not a checkpoint, or one of another network.
    """
    tensors, facts = load_tensors(path)
    parts: dict[str, dict[str, Tensor]] = {"model": {}, "average": {}, "optimiser": {}}
    for name, tensor in tensors.items():
        part, _, key = name.partition("/")
        parts[part][key] = tensor
    try:
        model.load_state_dict(parts["model"])
    except RuntimeError as error:
        raise GoughError(f"{path}: of another network: {error}") from None
    for key, value in average.items():
        value.copy_(parts["average"][key])
    state: dict[int, dict] = {int(i): dict(n) for i, n in facts["numbers"].items()}
    for name, tensor in parts["optimiser"].items():
        index, _, key = name.partition("/")
        state.setdefault(int(index), {})[key] = tensor
    groups = optimiser.state_dict()["param_groups"]
    with torch.no_grad():
        optimiser.load_state_dict({"state": state, "param_groups": groups})
    return facts

"""The data set of the DisGNet paper (its Algorithm 2), for any platform and workspace.

Poses are drawn from the workspace's box about home: translations and Euler angles evenly, with
R = Rx Ry Rz. Rows are made in chunks of 10,000, each from its own random numbers, so the same
seed gives the same rows whatever number of processes makes them.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from typing import Literal

import numpy as np

from gough import quaternion
from gough.checks import Array
from gough.errors import GoughError, InputError
from gough.kinematics import assembly_sign, leg_lengths
from gough.learn.graph import NODES, HexapodGraph, edge_lengths
from gough.platform import Platform
from gough.pose import Pose
from gough.whole_file import replacing

CHUNK = 10_000
TRIES = 64
TRAIN_SHARE = 0.8
QUATERNION, EULER = ("qw", "qx", "qy", "qz"), ("rx", "ry", "rz")
LEGS = tuple(f"leg_{i}" for i in range(1, 7))
EDGES = tuple(f"e_{i}_{j}" for i in range(1, NODES + 1) for j in range(1, NODES + 1))


@dataclass(frozen=True)
class DatasetSpec:
    """Which samples.

    Attributes:
        count: rows; the first 80 % are for training, the rest for testing.
        seed: of the random numbers.
        same_assembly: only poses with det J of home's sign.
    """

    count: int = 500_000
    seed: int = 0
    same_assembly: bool = False

    @property
    def train_rows(self) -> int:
        """How many rows, from the first, are for training."""
        return round(TRAIN_SHARE * self.count)


def chunk(platform: Platform, spec: DatasetSpec, index: int) -> tuple[Pose, Array]:
    """Poses and readings (rows, 6) of chunk number `index`.

    Raises:
        PlatformError: the platform states no workspace.
        GoughError: hardly any pose of the workspace can be reached.
    """
    rows = min(CHUNK, spec.count - index * CHUNK)
    rng = np.random.default_rng([spec.seed, index])
    poses, legs = [], []
    have = 0
    for _ in range(TRIES):
        pose, reading = _draw(platform, rows, rng)
        good = np.all(np.isfinite(reading), axis=-1)
        if spec.same_assembly:
            good &= assembly_sign(platform, pose) > 0
        poses.append(np.concatenate([pose.position, pose.wxyz], axis=-1)[good])
        legs.append(reading[good])
        have += int(np.sum(good))
        if have >= rows:
            numbers = np.concatenate(poses)[:rows]
            return Pose(numbers[:, :3], numbers[:, 3:]), np.concatenate(legs)[:rows]
    raise GoughError(
        f"workspace: only {have} of {TRIES * rows} sampled poses can be reached without crossing "
        "a singularity; state a smaller workspace"
    )


def chunks(platform: Platform, spec: DatasetSpec, processes: int = 1) -> Iterator:
    """All chunks in order, made by `processes` processes."""
    count = -(-spec.count // CHUNK)
    make = partial(chunk, platform, spec)
    if processes <= 1 or count == 1:
        yield from map(make, range(count))
        return
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        todo = iter(range(count))
        waiting = [pool.submit(make, i) for i in islice(todo, 2 * processes)]
        while waiting:  # bounded: finished chunks do not pile up in memory
            yield waiting.pop(0).result()
            waiting += [pool.submit(make, i) for i in islice(todo, 1)]


def dataset(platform: Platform, spec: DatasetSpec) -> tuple[Pose, Array]:
    """The whole data set in memory: poses (count,) and readings (count, 6)."""
    parts = list(chunks(platform, spec))
    position = np.concatenate([p.position for p, _ in parts])
    wxyz = np.concatenate([p.wxyz for p, _ in parts])
    return Pose(position, wxyz), np.concatenate([legs for _, legs in parts])


def write_dataset(
    platform: Platform,
    path: str | Path,
    spec: DatasetSpec,
    *,
    layout: Literal["compact", "paper"] = "compact",
    rotation: Literal["quaternion", "euler"] = "quaternion",
    processes: int = 1,
) -> Path:
    """Write a data set as .parquet or .csv; the file appears whole or not at all.

    Args:
        layout: "compact" (pose and readings) or "paper", its concatenation: translation from
            home, rotation from home, readings, and the vectorised 12 x 12 distance matrix.
        rotation: quaternion (qw, qx, qy, qz), or Euler angles (rx, ry, rz) [rad].

    Raises:
        GoughError: another ending, fewer than one row, or a file that cannot be written.
    """
    path = Path(path)
    if path.suffix not in (".parquet", ".csv"):
        raise InputError(f"{path}: expected a name that ends in .parquet or .csv")
    if spec.count < 1:
        raise InputError(f"count: expected 1 or more, got {spec.count}")
    with replacing(path) as file:
        _write(platform, file, path.suffix, spec, layout, rotation, processes)
    return path


def _write(platform, file, suffix, spec, layout, rotation, processes) -> None:
    import pyarrow as pa
    from pyarrow import csv, parquet

    names = ["x", "y", "z", *(QUATERNION if rotation == "quaternion" else EULER), *LEGS]
    names += EDGES if layout == "paper" else ()
    facts = {"platform": platform.digest, "unit": platform.unit, "seed": spec.seed}
    facts |= {"train_rows": spec.train_rows, "layout": layout, "toml": platform.to_toml()}
    schema = pa.schema(
        [(name, pa.float64()) for name in names],
        metadata={f"gough.{key}": str(value) for key, value in facts.items()},
    )
    if suffix == ".csv":
        writer = csv.CSVWriter(file, schema)
    else:
        writer = parquet.ParquetWriter(
            file, schema, compression="zstd", use_dictionary=False,
            use_byte_stream_split=True,
        )  # fmt: skip
    with writer:
        for pose, legs in chunks(platform, spec, processes):
            numbers = _columns(platform, pose, legs, layout, rotation)
            columns = [pa.array(np.ascontiguousarray(c)) for c in numbers.T]
            writer.write_table(pa.Table.from_arrays(columns, schema=schema))


def _columns(platform: Platform, pose: Pose, legs: Array, layout: str, rotation: str) -> Array:
    """All numbers of a chunk, (rows, columns)."""
    if layout == "paper":
        turn = quaternion.product(platform.home.inverse().wxyz, pose.wxyz)
        pose = Pose(pose.position - platform.home.position, turn)
    parts = [pose.position, pose.wxyz if rotation == "quaternion" else pose.euler, legs]
    if layout == "paper":
        matrix = HexapodGraph.of(platform).matrix(edge_lengths(platform, legs))
        parts.append(matrix.reshape(len(legs), -1))
    return np.concatenate(parts, axis=-1)


def _draw(platform: Platform, rows: int, rng: np.random.Generator) -> tuple[Pose, Array]:
    box = platform._workspace()
    shift = rng.uniform(*box.translation.T, size=(rows, 3))
    angles = np.radians(rng.uniform(*box.rotation_deg.T, size=(rows, 3)))
    turn = Pose.from_euler(np.zeros(3), angles).wxyz
    pose = Pose(platform.home.position + shift, quaternion.product(platform.home.wxyz, turn))
    return pose, leg_lengths(platform, pose)

"""The data set of the DisGNet paper (its Algorithm 2), for any platform and workspace.

Poses are drawn evenly from the workspace's box about home: translations, and Euler angles with
R = Rx Ry Rz. Rows are made in chunks of 10,000, each from its own random numbers, so the same
seed gives the same rows on any number of processes. PyTorch is not needed; training draws its own
samples on its device (`gough.learn.sampling`).

The paper's graph has 12 nodes, the joints, and 18 edges: the six legs and, on each plate, the ring
that joins every joint to its two neighbours. Nodes 0-5 are the base joints, nodes 6-11 the platform
joints, in the platform file's order.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gough import quaternion
from gough.checks import Array
from gough.errors import GoughError, InputError
from gough.kinematics import assembly_sign, leg_lengths
from gough.platform import Platform
from gough.pose import Pose
from gough.whole_file import replacing

NODES = 12
CHUNK = 10_000  # rows
TRIES = 64  # times that poses are drawn before a workspace counts as unreachable
TRAIN_SHARE = 0.8
QUATERNION, EULER = ("qw", "qx", "qy", "qz"), ("rx", "ry", "rz")
LEGS = tuple(f"leg_{i}" for i in range(1, 7))
EDGES = tuple(f"e_{i}_{j}" for i in range(1, NODES + 1) for j in range(1, NODES + 1))


@dataclass(frozen=True)
class DatasetSpec:
    """Size and origin of a data set.

    Attributes:
        count: rows; the first 80 % are for training, the rest for testing.
        seed: seed of the random numbers.
        same_assembly: keep only poses with det J of home's sign.
    """

    count: int = 500_000
    seed: int = 0
    same_assembly: bool = False

    @property
    def train_rows(self) -> int:
        """Number of rows, from the first, that are for training."""
        return round(TRAIN_SHARE * self.count)


def chunk(platform: Platform, spec: DatasetSpec, index: int) -> tuple[Pose, Array]:
    """Draw poses and readings (rows, 6) of chunk number `index`.

    Raises:
        PlatformError: the platform states no workspace.
        GoughError: hardly any pose of the workspace can be reached.
    """
    rows = min(CHUNK, spec.count - index * CHUNK)
    rng = np.random.default_rng([spec.seed, index])
    poses, legs, have = [], [], 0
    for _ in range(TRIES):
        pose = platform._workspace().draw(platform.home, rows, rng)
        reading = leg_lengths(platform, pose)
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


def chunks(
    platform: Platform, spec: DatasetSpec, processes: int = 1
) -> Iterator[tuple[Pose, Array]]:
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
    """Make the whole data set in memory: poses (count,) and readings (count, 6)."""
    parts = list(chunks(platform, spec))
    position = np.concatenate([p.position for p, _ in parts])
    wxyz = np.concatenate([p.wxyz for p, _ in parts])
    return Pose(position, wxyz), np.concatenate([legs for _, legs in parts])


def relative_to_home(platform: Platform, pose: Pose) -> Pose:
    """Translations t - t_home and rotations R_home^T R of poses (...), as networks learn them."""
    rotation = quaternion.product(platform.home.inverse().wxyz, pose.wxyz)
    return Pose(pose.position - platform.home.position, rotation)


# ---- files --------------------------------------------------------------------------------


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
        platform: the machine.
        path: file to write.
        spec: size and origin of the data.
        layout: "compact" (pose and readings) or "paper", its concatenation: translation from
            home, rotation from home, readings, and the vectorised 12 x 12 distance matrix.
        rotation: quaternion (qw, qx, qy, qz), or Euler angles (rx, ry, rz) [rad].
        processes: number of processes that make the rows.

    Raises:
        GoughError: another ending, fewer than one row, or a file that cannot be written.

    Example:
        >>> write_dataset(platform, "data.parquet", DatasetSpec(count=10_000))
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
            file, schema, compression="zstd", use_dictionary=False, use_byte_stream_split=True
        )
    with writer:
        for pose, legs in chunks(platform, spec, processes):
            numbers = _columns(platform, pose, legs, layout, rotation)
            columns = [pa.array(np.ascontiguousarray(c)) for c in numbers.T]
            writer.write_table(pa.Table.from_arrays(columns, schema=schema))


def _columns(platform: Platform, pose: Pose, legs: Array, layout: str, rotation: str) -> Array:
    """All numbers of a chunk, (rows, columns)."""
    if layout == "paper":
        pose = relative_to_home(platform, pose)
    parts = [pose.position, pose.wxyz if rotation == "quaternion" else pose.euler, legs]
    if layout == "paper":
        matrix = HexapodGraph.of(platform).matrix(edge_lengths(platform, legs))
        parts.append(matrix.reshape(len(legs), -1))
    return np.concatenate(parts, axis=-1)


# ---- the graph ----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class HexapodGraph:
    """The distance graph of one platform: equation 3 of the DisGNet paper.

    Attributes:
        legs: (6, 2) nodes of each leg's edge, base joint first.
        rings: (12, 2) nodes of the edges within the plates, lower number first.
        constant: (12, 12) symmetric distances of the rings, zero elsewhere [platform unit].
    """

    legs: NDArray[np.int64]
    rings: NDArray[np.int64]
    constant: Array

    @classmethod
    def of(cls, platform: Platform) -> HexapodGraph:
        """Build the graph of a platform."""
        legs = np.array([[i, i + 6] for i in range(6)])
        rings, constant = [], np.zeros((NODES, NODES))
        for offset, points in ((0, platform.base), (6, platform.moving)):
            for a, b in _ring(points):
                rings.append((a + offset, b + offset))
                constant[a + offset, b + offset] = np.linalg.norm(points[a] - points[b])
        return cls(legs, np.array(sorted(rings)), constant + constant.T)

    @cached_property
    def adjacency(self) -> NDArray[np.bool_]:
        """(12, 12), True where an edge is."""
        out = np.zeros((NODES, NODES), dtype=bool)
        for a, b in (*self.legs, *self.rings):
            out[a, b] = out[b, a] = True
        return out

    def matrix(self, leg_edges: Array) -> Array:
        """Distance matrices E (..., 12, 12), equation 6, for lengths (..., 6) of legs' edges."""
        out = np.broadcast_to(self.constant, (*leg_edges.shape[:-1], NODES, NODES)).copy()
        out[..., self.legs[:, 0], self.legs[:, 1]] = leg_edges
        out[..., self.legs[:, 1], self.legs[:, 0]] = leg_edges
        return out


def edge_lengths(platform: Platform, legs: Array) -> Array:
    """Lengths (..., 6) of the legs' edges for readings (..., 6) [platform unit].

    The distance between the joints. Rotary legs do not measure it: their edge has the distance at
    home plus the path of the arm's tip from there, which identifies the reading just as well.
    """
    if platform.rotary is not None:
        angle = platform.gain * (legs - platform.home_legs)
        return platform.home_lengths + platform.rotary.arm_length * angle
    return platform.gain * legs + platform.true_at_zero


def _ring(points: Array) -> list[tuple[int, int]]:
    """Edges (lower, higher) that join six joints (6, 3) in the order of their angles.

    The angles are about the joints' centre, in the plane that fits them best; joints at the
    same place keep the order of their numbers.
    """
    offsets = points - points.mean(axis=0)
    x, y = np.linalg.svd(offsets, full_matrices=False)[2][:2]
    angles = np.round(np.arctan2(offsets @ y, offsets @ x), 9)
    order = np.argsort(angles, kind="stable")
    pairs = zip(order, np.roll(order, -1), strict=True)
    return [(int(min(a, b)), int(max(a, b))) for a, b in pairs]

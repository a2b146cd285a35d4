"""gough dataset: the DisGNet paper's data set for any platform."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from gough.commands.options import (
    PlatformName,
    RandomSeed,
    SameAssembly,
    WorkspaceBox,
    option,
)


def run(
    *,
    platform: PlatformName,
    out: Annotated[Path, option("Write to this file, .parquet or .csv.", "OUT", aliases=["-o"])],
    count: Annotated[int, arg(metavar="N")] = 500_000,
    random_seed: RandomSeed = 0,
    layout: Literal["compact", "paper"] = "compact",
    rotation: Literal["quaternion", "euler"] = "quaternion",
    workspace: WorkspaceBox = None,
    same_assembly: SameAssembly = False,
    processes: Annotated[int, arg(metavar="N")] = 1,
) -> int:
    """Make poses and readings to train on, as the DisGNet paper does.

    gough dataset -p reference -o data.parquet

    The first 80 % of the rows are for training.

    The same seed gives the same rows with any number of processes.

    Args:
        count: Make this many rows.
        layout: Write compact columns (pose, readings) or the paper's (translation and rotation from
            home, readings, 12 x 12 distance matrix).
        rotation: Write quaternions, or Euler angles with R = Rx Ry Rz [rad].
        processes: Share the rows between this many processes.
    """
    from gough.learn.data import DatasetSpec, write_dataset
    from gough.platform import Platform

    spec = DatasetSpec(count, random_seed, same_assembly)
    machine = Platform.load(platform)
    if workspace is not None:
        machine = machine.with_workspace(*workspace)
    path = write_dataset(machine, out, spec, layout=layout, rotation=rotation, processes=processes)
    print(f"{path}: {count:,} rows, the first {spec.train_rows:,} for training")
    return 0

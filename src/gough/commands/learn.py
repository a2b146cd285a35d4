"""The commands of this package for `gough`: dataset, train, evaluate.

Each is a function whose arguments are the command line's; it returns the exit code. Heavy
imports stand inside, so that `--help` is quick.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import tyro
from tyro.conf import Positional, arg

from gough.learn.config import PRESETS

PlatformName = Annotated[
    str, arg(aliases=["-p"], metavar="PLATFORM", help="a machine of the catalog, or a .toml file.")
]
WorkspaceBox = Annotated[
    tuple[float, float] | None,
    arg(
        metavar="LENGTH DEG",
        help="another workspace about home: +-LENGTH [platform unit] and +-DEG on every axis.",
        help_behavior_hint="",
    ),
]
SameAssembly = Annotated[
    bool, arg(help="only poses that are reached without crossing a singularity.")
]
Preset = tyro.extras.subcommand_type_from_defaults(PRESETS, prefix_names=False)


def dataset(
    *,
    platform: PlatformName,
    out: Annotated[Path, arg(aliases=["-o"], metavar="OUT", help=".parquet or .csv to write.")],
    count: int = 500_000,
    seed: int = 0,
    layout: Literal["compact", "paper"] = "compact",
    rotation: Literal["quaternion", "euler"] = "quaternion",
    workspace: WorkspaceBox = None,
    same_assembly: SameAssembly = False,
    processes: int = 1,
) -> int:
    """Poses and readings to learn from: the DisGNet paper's data set for any platform.

    gough dataset -p reference -o data.parquet

    The first 80 % of the rows are for training.

    The same seed gives the same rows whatever the number of processes.

    Args:
        count: rows.
        seed: of the random numbers.
        layout: compact (pose, readings) or paper (shift, rotation, readings, 12 x 12 matrix).
        rotation: quaternion, or Euler angles with R = Rx Ry Rz [rad].
        processes: that make the rows.
    """
    from gough.learn.data import DatasetSpec, write_dataset

    spec = DatasetSpec(count, seed, same_assembly)
    machine = _platform(platform, workspace)
    path = write_dataset(machine, out, spec, layout=layout, rotation=rotation, processes=processes)
    print(f"{path}: {count:,} rows, the first {spec.train_rows:,} for training")
    return 0


def train(
    *,
    platform: PlatformName,
    out: Annotated[Path, arg(aliases=["-o"], metavar="FOLDER", help="of the run.")] = Path(
        "runs/mine"
    ),
    resume: bool = False,
    prepare: bool = False,
    start: Annotated[Path | None, arg(metavar="FOLDER", help_behavior_hint="")] = None,
    from_: Annotated[str | None, arg(name="from", metavar="NAME", help_behavior_hint="")] = None,
    budget: Annotated[str | None, arg(metavar="TIME", help_behavior_hint="")] = None,
    steps: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None,
    seed: Annotated[int | None, arg(metavar="SEED", help_behavior_hint="")] = None,
    device: Annotated[str | None, arg(metavar="DEVICE", help_behavior_hint="")] = None,
    workspace: WorkspaceBox = None,
    preset: Annotated[Preset, arg(name="")] = PRESETS["default"],  # pyright: ignore[reportInvalidTypeForm]
) -> int:
    """Train a first guess for a platform, ten minutes unless told otherwise.

    gough train -p my.toml -o runs/mine

    gough solve legs.csv -p my.toml --seed runs/mine

    Options of the network and its training follow a preset's name:

    gough train -p my.toml default --optimiser.lr 1e-3

    Args:
        resume: go on with the run of this folder, after it was stopped or killed.
        prepare: only make the folder, for torchrun -m gough.learn.train FOLDER.
        start: another run, whose weights are the first of this one.
        from_: universal, the network for any hexapod that comes with gough, or a run of it: tune it
            for this platform, one minute of processor time unless a budget is given.
        budget: time to train, such as 90s, 30m or 2h; the preset's unless given.
        steps: number of steps in place of a budget; such a run repeats bit for bit.
        seed: of the weights at the start and of the samples.
        device: cpu, cuda, cuda:1; a GPU if there is one unless given.
    """
    if from_ is not None:
        return _finetune(_platform(platform, workspace), platform, out, from_, resume, budget, seed)
    from gough.learn import train as loop

    changes = {"budget": budget, "steps": steps, "seed": seed, "device": device}
    config = preset.with_run(**{k: v for k, v in changes.items() if v is not None})
    machine = _platform(platform, workspace)
    if prepare:
        loop.prepare(machine, config, out, start)
        print(f"{out}: ready; torchrun --nproc-per-node N -m gough.learn.train {out}")
        return 0
    loop.train(machine, config, out, resume=resume, start=start)
    print(f"{out}: trained; use it with: gough solve LEGS -p {platform} --seed {out}")
    return 0


def evaluate(
    names: Positional[tuple[str, ...]] = (),
    *,
    platform: PlatformName = "reference",
    poses: int = 100_000,
    workspace: WorkspaceBox = None,
    same_assembly: SameAssembly = False,
    train_peers: Annotated[str | None, arg(metavar="TIME", help_behavior_hint="")] = None,
    folder: Path = Path("runs/peers"),
    json: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    speed: bool = False,
) -> int:
    """First guesses side by side: errors, where Newton's method ends, time.

    gough evaluate

    gough evaluate runs/mine polynomial-5 -p my.toml

    Args:
        names: home, polynomial-3 (any degree to 8), a network that comes with the package, a
            run's folder; none: all there are for the platform.
        poses: held-out poses.
        train_peers: first train every network for this long, such as 4m, in `folder`.
        folder: of those runs.
        json: file for all numbers.
        speed: time DisGNet's structured and dense evaluation instead.
    """
    from rich.console import Console

    machine = _platform(platform, workspace)
    if speed:
        from gough.learn.speed import measure_speed

        print("\n".join(measure_speed(machine).lines()))
        return 0
    from gough.learn import evaluate as loop

    chosen = list(names) or loop.default_names(machine)
    if train_peers is not None:
        chosen += loop.train_peers(machine, folder, train_peers)
    rows = loop.evaluate(machine, chosen, poses=poses, same_assembly=same_assembly)
    Console(width=max(Console().width, 200)).print(loop.table(machine, rows))
    if json is not None:
        from gough.whole_file import write_whole

        write_whole(json, loop.to_json(rows).encode())
    return 0


def _finetune(machine, name: str, out: Path, start: str, resume: bool, budget: str | None,
              seed: int | None) -> int:  # fmt: skip
    from gough.learn.universal.finetune import finetune

    finetune(machine, out, start, resume=resume, budget=budget, seed=seed or 0)
    print(f"{out}: tuned; use it with: gough solve LEGS -p {name} --seed {out}")
    return 0


def _platform(name: str, workspace: tuple[float, float] | None):
    from gough.platform import Platform

    machine = Platform.load(name)
    return machine if workspace is None else machine.with_workspace(*workspace)

"""gough train: a network that guesses poses of a platform."""

from __future__ import annotations

import shlex
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Annotated

import tyro
from tyro.conf import arg

from gough.commands.options import PlatformName, WorkspaceBox, option
from gough.commands.signals import SIGNALS, Stopped
from gough.learn.config import PRESETS

ABOUT = {
    "default": "A residual network with a graph of the joints; ten minutes.",
    "disgnet": "The paper's network, trained by our recipe; 30 minutes.",
    "wide": "For wide workspaces: poses reached without crossing a singularity; 15 minutes.",
    "paper": "The paper's own network, recipe and 400,000 fixed samples; hours.",
}
Preset = tyro.extras.subcommand_type_from_defaults(PRESETS, ABOUT, prefix_names=False)


def run(
    *,
    platform: PlatformName,
    out: Annotated[
        Path, arg(aliases=["-o"], metavar="FOLDER", help="Write the run to this folder.")
    ] = Path("runs/mine"),
    resume: Annotated[bool, option()] = False,
    prepare: Annotated[bool, option()] = False,
    start: Annotated[Path | None, option(metavar="FOLDER")] = None,
    from_: Annotated[str | None, option(name="from", metavar="NAME")] = None,
    budget: Annotated[str | None, option(metavar="TIME")] = None,
    steps: Annotated[int | None, option(metavar="N")] = None,
    random_seed: Annotated[int | None, option(metavar="N")] = None,
    device: Annotated[str | None, option(metavar="DEVICE")] = None,
    workspace: WorkspaceBox = None,
    preset: Annotated[Preset, arg(name="")] = PRESETS["default"],  # pyright: ignore[reportInvalidTypeForm]
) -> int:
    """Train a first guess for a platform, for ten minutes unless --budget is given.

    gough train -p my.toml -o runs/mine

    gough solve legs.csv -p my.toml --seed runs/mine

    gough train -p my.toml --from universal -o runs/mine

    Options of the network and its training follow the name of a preset; gough train default --help
    lists them:

    gough train -p my.toml default --optimiser.lr 1e-3

    Ctrl-C writes a checkpoint; --resume goes on from there.

    Args:
        resume: Go on with the run of this folder, after it was stopped or killed.
        prepare: Only make the folder, for torchrun -m gough.learn.train FOLDER.
        start: Begin with the weights of the run in this folder.
        from_: Tune universal, the network for any hexapod that comes with gough, or a run of it,
            for this platform, for one minute of processor time unless a budget is given.
        budget: Train for this time, such as 90s, 30m or 2h; the preset's unless given.
        steps: Train for this many steps instead of a time; such a run repeats bit for bit.
        random_seed: Draw the first weights and the samples from this seed of the random numbers.
        device: Train on cpu, cuda or cuda:1; on a GPU if there is one unless given.
    """
    from gough.learn import train as loop
    from gough.learn.run_folder import duration
    from gough.platform import Platform

    changes = {"budget": budget, "steps": steps, "seed": random_seed, "device": device}
    config = preset.with_run(**{k: v for k, v in changes.items() if v is not None})
    machine = Platform.load(platform)
    if workspace is not None:
        machine = machine.with_workspace(*workspace)
    if from_ is not None:
        from gough.learn.universal.finetune import finetune

        finetune(machine, out, from_, resume=resume, budget=budget, seed=random_seed or 0)
        print(f"{out}: tuned; use it with: gough solve LEGS -p {platform} --seed {out}")
        return 0
    if prepare:
        loop.prepare(machine, config, out, start)
        print(f"{out}: ready; torchrun --nproc-per-node N -m gough.learn.train {out}")
        return 0
    with _signals_noted() as signals:
        try:
            loop.train(machine, config, out, resume=resume, start=start, stop=lambda: bool(signals))
        except loop.TrainingStopped as stopped:
            again = shlex.join(["gough", "train", "-p", platform, "-o", str(out), "--resume"])
            print(
                f"gough train: stopped after {stopped.step:,} steps, {100 * stopped.progress:.0f} "
                f"% of the run; {duration(stopped.remaining)} is left. Go on with: {again}",
                file=sys.stderr,
            )
            return 128 + signals[0]
    print(f"{out}: trained; use it with: gough solve LEGS -p {platform} --seed {out}")
    return 0


@contextmanager
def _signals_noted() -> Iterator[list[int]]:
    """Collect the first signal to stop, so that a step can end; a second one interrupts at once."""
    noted: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        noted.append(number)
        if len(noted) > 1:
            raise Stopped(number)

    numbers = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
    before = {n: signal.getsignal(n) for n in numbers}
    for number, handler in before.items():
        if handler != signal.SIG_IGN:
            signal.signal(number, note)
    try:
        yield noted
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

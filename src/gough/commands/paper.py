"""gough paper: the DisGNet paper's experiments, tables and figures, run again."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import UseAppendAction, arg

from gough.commands.options import PlatformName, option

if TYPE_CHECKING:
    from gough.paper.study import Plan, Study
    from gough.platform import Platform

Stage = Literal[
    "train", "networks", "sets", "methods", "iterations", "wide", "curves", "times", "poses",
    "errors", "report",
]  # fmt: skip


def run(
    *,
    platform: PlatformName = "reference",
    out: Annotated[
        Path, arg(aliases=["-o"], metavar="FOLDER", help="Write the study to this folder.")
    ] = Path("gough-paper"),
    networks: Annotated[Path | None, option(metavar="FOLDER")] = None,
    quick: Annotated[bool, option()] = False,
    budget: Annotated[str | None, option(metavar="TIME")] = None,
    stage: Annotated[
        UseAppendAction[tuple[Stage, ...]],
        option(metavar="STAGE..."),
    ] = (),
    resume: Annotated[bool, option()] = False,
) -> int:
    """Run the DisGNet paper's experiments again: networks, tables, figures, report.

    gough paper --quick

    gough paper -o FOLDER --resume

    gough paper -o FOLDER --stage sets

    In full it trains 28 networks, five minutes each on one thread.

    The folder gets index.md, report.html, figures, results and networks.

    Args:
        networks: Take the networks from this folder instead of the study's own; each must have the
            sum that networks.json states.
        quick: Run everything at small scale, in about three minutes.
        budget: Train each network for this processor time, such as 5m; else 5m, or 1s if --quick.
        stage: Run only this part; may be repeated: train, then networks, sets, methods, iterations,
            wide, curves, times, poses, errors, then report.
        resume: Go on with a study that was stopped; results that exist are kept.
    """
    from gough.errors import GoughError
    from gough.learn.config import seconds
    from gough.paper.study import FULL, PLAN, QUICK
    from gough.platform import Platform

    machine = Platform.load(platform)
    sizes = QUICK if quick else FULL
    if budget is not None:
        sizes = replace(sizes, budget=seconds(budget))
    known = (out / PLAN).exists()
    if known and not stage and not resume:
        raise GoughError(
            f"{out}: holds a study already; go on with --resume, repeat a part with --stage, or "
            "name another folder with -o"
        )
    study = _open(machine, out, networks or out / "networks", sizes,
                  given=quick or budget is not None)  # fmt: skip
    command = _command(platform, out)
    for name in stage or STAGES:
        if resume and name not in ("train", "report") and study.result_path(name).exists():
            print(f"{name}: done before")
            continue
        _carry_out(study, name, command)
    return 0


STAGES: tuple[Stage, ...] = Stage.__args__  # pyright: ignore[reportAttributeAccessIssue]


def _open(machine: Platform, out: Path, networks: Path, sizes: Plan, *, given: bool) -> Study:
    """Open the study of a folder, or make a new one with every network timed.

    Raises:
        GoughError: the folder's study has other sizes, another platform or other networks.
    """
    from gough.errors import GoughError
    from gough.paper.study import PLAN, Plan, Study

    path = out / PLAN
    if not path.exists():
        out.mkdir(parents=True, exist_ok=True)
        print(f"{out}: timing a training step of every network", flush=True)
        sizes.timed(machine, out).save(path)
    plan = Plan.load(path)
    if plan.platform != machine.digest:
        raise GoughError(f"{out}: is a study of another platform than {machine.name!r}")
    if given and replace(plan, steps={}, platform="") != sizes:
        raise GoughError(f"{out}: is a study of another size; name another folder with -o")
    study = Study(machine, plan, out, networks)
    study.check_networks()
    return study


def _carry_out(study: Study, name: Stage, command: str) -> None:
    """Run one stage and print its name."""
    print(f"{name} ...", flush=True)
    if name == "train":
        study.train()
    elif name == "report":
        from gough.paper import figures, report

        figures.draw_all(study)
        report.write(study)
        print(f"{study.folder / 'index.md'} and {study.folder / 'report.html'}: written")
    else:
        from gough.paper.results import STAGES as MAKERS

        study.save(name, MAKERS[name](study), f"{command} --stage {name}")


def _command(platform: str, out: Path) -> str:
    """Command line that repeats a stage."""
    words = ["gough", "paper", "-o", str(out)]
    return shlex.join(words if platform == "reference" else [*words, "-p", platform])

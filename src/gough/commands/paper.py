"""gough paper: the DisGNet paper's experiments, tables and figures, run again."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import UseAppendAction, arg

if TYPE_CHECKING:
    from gough.paper.plan import Plan
    from gough.paper.study import Study
    from gough.platform import Platform

Stage = Literal[
    "train", "networks", "sets", "methods", "iterations", "wide", "curves", "times", "poses",
    "errors", "report",
]  # fmt: skip


def run(
    *,
    platform: Annotated[
        str,
        arg(aliases=["-p"], metavar="PLATFORM", help="a machine of the catalog, or a .toml file."),
    ] = "reference",
    out: Annotated[Path, arg(aliases=["-o"], metavar="FOLDER", help="of the study.")] = Path(
        "gough-paper"
    ),
    quick: bool = False,
    budget: Annotated[str | None, arg(metavar="TIME", help_behavior_hint="")] = None,
    stage: Annotated[
        UseAppendAction[tuple[Stage, ...]],
        arg(metavar="STAGE...", help_behavior_hint=""),
    ] = (),
    resume: bool = False,
) -> int:
    """The DisGNet paper's experiments, run again: networks, tables, figures, report.

    gough paper --quick

    gough paper -o FOLDER --resume

    gough paper -o FOLDER --stage sets

    In full it trains 24 networks, five minutes each on one thread.

    The folder gets index.md, report.html, figures, results and networks.

    Args:
        quick: everything at small scale, in about two minutes.
        budget: processor time for each network, such as 5m; else 5m, or 1s if quick.
        stage: only this part, may be repeated: train, then networks, sets, methods, iterations,
            wide, curves, times, poses, errors, then report.
        resume: go on with a study that was stopped: what is there stays.
    """
    from gough.errors import GoughError
    from gough.learn.config import seconds
    from gough.paper.plan import FULL, QUICK
    from gough.paper.study import PLAN
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
    study = _open(machine, out, sizes, asked=quick or budget is not None)
    command = _command(platform, out)
    for name in stage or STAGES:
        if resume and name not in ("train", "report") and study.result_path(name).exists():
            print(f"{name}: done before")
            continue
        _carry_out(study, name, command)
    return 0


STAGES: tuple[Stage, ...] = Stage.__args__  # pyright: ignore[reportAttributeAccessIssue]


def _open(machine: Platform, out: Path, sizes: Plan, *, asked: bool) -> Study:
    """The study in a folder: the one that is there, or a new one with every network timed.

    Raises:
        GoughError: the one that is there has other sizes or another platform.
    """
    from gough.errors import GoughError
    from gough.paper.plan import Plan
    from gough.paper.study import PLAN, Study

    path = out / PLAN
    if not path.exists():
        out.mkdir(parents=True, exist_ok=True)
        print(f"{out}: timing a training step of every network", flush=True)
        sizes.timed(machine, out).save(path)
    plan = Plan.load(path)
    if plan.platform != machine.digest:
        raise GoughError(f"{out}: is a study of another platform than {machine.name!r}")
    if asked and replace(plan, steps={}, platform="") != sizes:
        raise GoughError(f"{out}: is a study of another size; name another folder with -o")
    return Study(machine, plan, out)


def _carry_out(study: Study, name: Stage, command: str) -> None:
    """One stage, and what is said about it."""
    print(f"{name} ...", flush=True)
    if name == "train":
        study.train()
    elif name == "report":
        from gough.paper import figures, report

        figures.draw_all(study)
        report.write(study)
        print(f"{study.folder / 'index.md'} and {study.folder / 'report.html'}: written")
    else:
        from gough.paper import series, tables

        make = getattr(tables, name, None) or getattr(series, name)
        study.save(name, make(study), f"{command} --stage {name}")


def _command(platform: str, out: Path) -> str:
    """What to type to repeat a stage."""
    words = ["gough", "paper", "-o", str(out)]
    return shlex.join(words if platform == "reference" else [*words, "-p", platform])

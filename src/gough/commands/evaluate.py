"""gough evaluate: first guesses side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from gough.commands.options import Json, PlatformName, SameAssembly, WorkspaceBox, option

if TYPE_CHECKING:
    from gough.learn.evaluate import Row
    from gough.platform import Platform


def run(
    names: Annotated[Positional[tuple[str, ...]], option(metavar="[NAME ...]")] = (),
    *,
    platform: PlatformName = "reference",
    poses: Annotated[int, arg(metavar="N")] = 100_000,
    workspace: WorkspaceBox = None,
    same_assembly: SameAssembly = False,
    train_peers: Annotated[str | None, option(metavar="TIME")] = None,
    folder: Annotated[Path, arg(metavar="FOLDER")] = Path("runs/peers"),
    json: Json = False,
    speed: Annotated[bool, option()] = False,
) -> int:
    """Compare first guesses: errors, where Newton's method ends, time.

    gough evaluate

    gough evaluate runs/mine polynomial-5 -p my.toml

    Args:
        names: Compare these: home, taylor-2, polynomial-3 (any degree to 7), universal, a network
            that comes with the package, the folder of a run. Without names all there are for the
            platform.
        poses: Measure errors over this many held-out poses.
        train_peers: First train every network for this time, such as 4m.
        folder: Train them in this folder.
        speed: Time the forms of DisGNet instead: dense, structured, tables.
    """
    from gough.commands import as_json
    from gough.learn import evaluate as loop
    from gough.platform import Platform

    machine = Platform.load(platform)
    if workspace is not None:
        machine = machine.with_workspace(*workspace)
    if speed:
        from gough.learn.forms import measure_speed

        found = measure_speed(machine)
        as_json.print_json(asdict(found)) if json else print("\n".join(found.lines()))
        return 0
    chosen = list(names) or loop.default_names(machine)
    if train_peers is not None:
        chosen += loop.train_peers(machine, folder, train_peers)
    rows = loop.evaluate(machine, chosen, poses=poses, same_assembly=same_assembly)
    if json:
        as_json.print_json([asdict(row) for row in rows])
    else:
        _print(machine, rows)
    return 0


def _print(platform: Platform, rows: Sequence[Row]) -> None:
    """Two tables of at most 80 columns: errors, and where solvers end from the guesses."""
    from gough.commands.show import console, plain_table

    screen, unit = console(), platform.unit or "unit"
    screen.print(
        f"First guesses for {platform.name}, {rows[0].metrics.count:,} held-out poses: errors in "
        f"{unit} and deg",
        markup=False, soft_wrap=True,
    )  # fmt: skip
    errors = plain_table(
        "first guess", ">numbers", ">E-trans", ">median", ">worst", f"><1 {unit} %", ">E-rot",
        ">worst", ">E-ik",
    )  # fmt: skip
    ends = plain_table(
        "first guess", ">true %", ">other", ">twins", ">no end", ">solve", ">ms/1000",
        ">training s", ">seed",
    )  # fmt: skip
    for row in rows:
        m, n = row.metrics, row.newton
        name = row.name.rstrip("/").rpartition("/")[2][-14:]
        values = f"{m.trans_mean:.3g}", f"{m.trans_median:.2g}", f"{m.trans_worst:.2g}"
        errors.add_row(
            name, _optional(row.parameters, ",d"), *values, f"{100 * m.trans_within[1]:.4g}",
            f"{m.rot_mean:.2g}", f"{m.rot_worst:.2g}", f"{m.ik_mean:.3g}",
        )  # fmt: skip
        ends.add_row(
            name, f"{100 * n.share:.4f}", str(n.other), str(n.twins), str(n.unconverged),
            str(row.wrong), f"{1e3 * row.per_thousand:.2f}", _optional(row.seconds, ",.1f"),
            _optional(row.seed, "d"),
        )  # fmt: skip
    screen.print(errors)
    screen.print(
        "\nNewton's method from them without a second try: true pose, another pose (twins: also in "
        "the workspace), no convergence. solve: rows that gough.solve does not end at the true "
        "pose. ms/1000: time of 1,000 guesses in one call.",
        markup=False,
    )  # fmt: skip
    screen.print(ends)
    for row in rows:
        if row.forms is not None:
            screen.print("\n" + row.forms.text(row.name, unit), markup=False)


def _optional(value: float | None, spec: str) -> str:
    return "-" if value is None else f"{value:{spec}}"

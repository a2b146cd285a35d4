"""gough modes: every pose that leg readings allow, each with its proof."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg

if TYPE_CHECKING:
    from gough.modes.assembly import AssemblyModes
    from gough.modes.choose import Choice

LEGS = tuple(f"leg_{i}" for i in range(1, 7))
ROWS_PRINTED = 3  # sets of readings whose tables are printed


def run(
    legs: Annotated[Positional[tuple[str, ...]], arg(metavar="LEGS")] = (),
    *,
    platform: Annotated[
        str,
        arg(aliases=["-p"], metavar="PLATFORM", help="a machine of the catalog, or a .toml file."),
    ],
    out: Annotated[str | None, arg(aliases=["-o"], metavar="OUT", help_behavior_hint="")] = None,
    plot: Annotated[str | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    threads: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None,
) -> int:
    """Every pose that leg readings allow, each with its proof.

    gough modes -p dietmaier

    gough modes 652.1 660.3 655.0 648.8 671.2 639.9 -p reference --plot modes.png

    Exit code 0: every list of poses is complete; 1: one may not be, or is invalid.

    Args:
        legs: six readings, or a .csv or .parquet file with columns leg_1 to leg_6; without
            them, those of the home pose.
        out: file to write, .csv or .parquet, one row for each pose.
        plot: .png, .svg or .pdf to draw all poses of the first set of readings in.
        threads: at most so many.
    """
    from gough.modes.assembly import assembly_modes
    from gough.modes.choose import choose_mode
    from gough.platform import Platform

    machine = Platform.load(platform)
    readings = machine.home_legs if not legs else _readings(legs)
    modes = assembly_modes(machine, readings, threads=threads)
    choice = choose_mode(modes)
    _print(modes, choice)
    if out is not None:
        _write(out, modes, choice)
    if plot is not None:
        from gough.modes.plot import draw

        single = modes if modes.legs.ndim == 1 else modes[0]
        draw(single, plot)
    return 0 if modes.complete.all() else 1


def _readings(legs: tuple[str, ...]) -> Any:
    """Six numbers (6,), or those in a file (N, 6)."""
    import numpy as np

    from gough.errors import InputError

    if len(legs) == 1 and legs[0].endswith((".csv", ".parquet")):
        return _read(legs[0])
    try:
        numbers = np.array([float(v) for v in legs])
    except ValueError as error:
        raise InputError(
            f"LEGS: {error}; expected six numbers or a .csv or .parquet file"
        ) from None
    if len(numbers) != 6:
        raise InputError(f"LEGS: expected six readings, found {len(numbers)}")
    return numbers


def _read(path: str) -> Any:
    import numpy as np
    import pyarrow as pa
    from pyarrow import csv, parquet

    from gough.errors import InputError

    try:
        reader = csv.read_csv if path.endswith(".csv") else parquet.read_table
        table = reader(path)
    except (OSError, pa.ArrowInvalid) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    missing = [name for name in LEGS if name not in table.column_names]
    if missing:
        found = ", ".join(table.column_names)
        raise InputError(f"{path}: no column {', '.join(missing)}; found {found}")
    try:
        columns = [table[name].cast(pa.float64()).to_numpy() for name in LEGS]
    except pa.ArrowInvalid as error:
        raise InputError(f"{path}: leg columns must be numbers: {error}") from None
    return np.stack(columns, axis=-1).astype(float)


def _print(modes: AssemblyModes, choice: Choice) -> None:
    """A table for each of the first sets of readings, and what is known about all."""
    from rich.console import Console

    console = Console(soft_wrap=True)
    sets = 1 if modes.legs.ndim == 1 else len(modes.legs)
    for k in range(min(sets, ROWS_PRINTED)):
        table = _table(modes, choice, k)
        # a narrow terminal may break lines, but no digit is left out
        wanted = Console(width=1000).measure(table).maximum
        console.width = max(console.width, wanted)
        console.print(table)
        console.print(_summary(modes, choice, k))
    if sets > ROWS_PRINTED:
        found, whole = len(modes.row), int(modes.complete.sum())
        console.print(f"{sets} sets of readings, {found} poses; {whole} lists are complete.")


def _table(modes: AssemblyModes, choice: Choice, k: int) -> Any:
    import numpy as np
    from rich import box
    from rich.table import Table

    from gough.modes.result import ModesStatus

    unit = modes.platform.unit or "unit"
    status = ModesStatus(int(np.ravel(modes.status)[k]))
    table = Table(
        box=box.SIMPLE_HEAD, title=f"{modes.platform.name}: {status.label}", title_justify="left"
    )
    headings = [f"x [{unit}]", "y", "z", "rx [deg]", "ry", "rz", "residual", "radius"]
    for heading in ["pose", *headings, "sigma_min", "fails"]:
        table.add_column(heading, justify="left" if heading == "fails" else "right", no_wrap=True)
    places = max(0, 5 - math.floor(math.log10(modes.platform.size)))
    euler = np.degrees(modes.pose.euler)
    certificate = modes.certificate
    mine = np.flatnonzero(modes.row == k)
    for i in mine[np.argsort(choice.rank[mine])]:
        fails = [name for name, passed in choice.passes.items() if not passed[i]]
        proof = f"{certificate.radius[i]:.3g}" if certificate.certified[i] else "no"
        table.add_row(
            str(choice.rank[i] + 1),
            *(f"{v:z.{places}f}" for v in modes.pose.position[i]),
            *(f"{v:z.3f}" for v in euler[i]),
            f"{modes.residual[i]:.1e}", proof, f"{modes.singularity_distance[i]:.2g}",
            ", ".join(fails) or "-",
        )  # fmt: skip
    return table


def _summary(modes: AssemblyModes, choice: Choice, k: int) -> str:
    import numpy as np

    from gough.modes.result import ModesStatus

    real, other, away, meet = modes.paths.reshape(-1, 4)[k]
    mine = modes.row == k
    status = ModesStatus(int(np.ravel(modes.status)[k]))
    counts = (
        f"{mine.sum()} real poses, {int(modes.certified[mine].sum())} certified; of this "
        f"machine's {modes.solutions} complex solutions {real} are real, {other} complex, "
        f"{away} at infinity, {meet} in multiple ones."
    )
    passed = np.ravel(choice.count)[k]
    filters = f"{passed} of them pass every filter ({', '.join(choice.passes)})."
    return f"{counts}\n{status.text}\n{filters}"


def _write(path: str, modes: AssemblyModes, choice: Choice) -> None:
    """One row for each pose; the file appears whole or not at all."""
    import numpy as np
    import pyarrow as pa
    from pyarrow import csv, parquet

    from gough.errors import GoughError
    from gough.modes.result import ModesStatus

    if not path.endswith((".csv", ".parquet")):
        raise GoughError(f"{path}: expected a name that ends in .csv or .parquet")
    labels = np.array([status.label for status in ModesStatus])
    columns: dict[str, Any] = {"row": modes.row, "pose": choice.rank + 1}
    columns |= dict(zip("xyz", modes.pose.position.T, strict=True))
    columns |= dict(zip(("qw", "qx", "qy", "qz"), modes.pose.wxyz.T, strict=True))
    columns["status"] = labels[np.ravel(modes.status)[modes.row]]
    columns["residual"] = modes.residual
    columns["multiplicity"] = modes.multiplicity
    columns["certified"] = modes.certified
    columns["radius"], columns["error"] = modes.certificate.radius, modes.certificate.error
    columns["sigma_min"], columns["sign"] = modes.singularity_distance, modes.sign
    columns |= {f"passes_{name}": passed for name, passed in choice.passes.items()}
    order = np.lexsort((choice.rank, modes.row))
    table = pa.table({name: np.asarray(values)[order] for name, values in columns.items()})
    target = Path(path)
    temporary = target.with_name(f"{target.name}.{os.getpid()}.partial")
    try:
        writer = csv.write_csv if path.endswith(".csv") else parquet.write_table
        writer(table, str(temporary))
        os.replace(temporary, target)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise GoughError(f"{path}: cannot be written: {error}") from None

"""gough modes: every pose that leg readings allow, each with its certificate."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

from gough.commands.folder import FolderOptions, JobOptions
from gough.commands.given import Legs, readings_given
from gough.commands.options import Frame, Json, PlatformName, option

if TYPE_CHECKING:
    from gough.modes.assembly import AssemblyModes
    from gough.modes.choose import Choice

ROWS_PRINTED = 3  # sets of readings whose tables are printed


def run(
    legs: Legs = (),
    *,
    platform: PlatformName,
    out: Annotated[str | None, option(metavar="OUT", aliases=["-o"])] = None,
    frame: Frame = None,
    json: Json = False,
    plot: Annotated[str | None, option(metavar="FILE")] = None,
    workers: Annotated[int | None, option(metavar="N")] = None,
    folder: FolderOptions = JobOptions(),
) -> int:
    """Find every pose that leg readings allow, and certify each.

    gough modes -p dietmaier

    gough modes 652.1 660.3 655.0 648.8 671.2 639.9 -p reference --plot modes.png

    Exit code 0: every list of poses is complete; 1: one may not be, or is invalid.

    Args:
        legs: Find the poses of these six readings, or of every row of readings in this file;
            without it those of the readings at home. For every file of a folder, a glob or a list,
            also of an object store, -o is a folder.
        out: Write a row for each pose to this file, .csv or .parquet, or as CSV to standard
            output (-).
        plot: Draw all poses of the first set of readings into this file, .png, .svg or .pdf.
        workers: Use this many threads, or processes for many files; without it all cores.
    """
    from gough.commands import as_json, show
    from gough.commands.folder import is_job, run_folder
    from gough.commands.options import ReadingOptions
    from gough.errors import InputError
    from gough.modes.assembly import assembly_modes
    from gough.modes.choose import choose_mode
    from gough.platform import Platform

    machine = Platform.load(platform)
    if is_job(legs, out, folder):
        if plot is not None:
            raise InputError("--plot: draws one set of readings; leave it out for many files")
        return run_folder(
            "modes", legs, machine, out, folder, workers=workers, allow_failures=False, json=json,
            reading=ReadingOptions().of(platform),
        )  # fmt: skip
    draw = None if plot is None else _painter(plot)
    given = readings_given(legs, machine, platform)
    modes = assembly_modes(machine, given, workers=workers, frame=frame)
    choice = choose_mode(modes)
    if json:
        as_json.print_json(_facts(modes, choice), out)
    else:
        _print(modes, choice, show.console_beside(out))
    if out is not None:
        _write(out, modes, choice)
    if draw is not None:
        draw(modes if modes.legs.ndim == 1 else modes[0])
    return 0 if modes.complete.all() else 1


def _painter(path: str) -> Callable[[AssemblyModes], None]:
    """A function that draws modes; an unusable file name is refused before any work is done."""
    from gough.plot.modes import modes_figure
    from gough.plot.style import check_picture, save

    check_picture(path)
    return lambda modes: save(modes_figure(modes), path)


def _print(modes: AssemblyModes, choice: Choice, screen: Any) -> None:
    """Print a sentence, a table and what is known for each of the first sets of readings."""
    import numpy as np

    batch = modes.legs.ndim > 1
    sets = len(modes.legs) if batch else 1
    for k in range(min(sets, ROWS_PRINTED)):
        number = f"Row {k + 1}: " if batch else ""
        screen.print(number + _verdict(modes, choice, k), markup=False)
        if modes.frame:
            screen.print(f"poses of {modes.frame}", markup=False)
        if np.any(modes.row == k):
            screen.print(_table(modes, choice, k))
        screen.print(_summary(modes, choice, k), markup=False)
    if sets > ROWS_PRINTED:
        found, whole = len(modes.row), int(modes.complete.sum())
        screen.print(f"{sets} sets of readings, {found} poses; {whole} lists are complete.")


def _verdict(modes: AssemblyModes, choice: Choice, k: int) -> str:
    """The answer for one set of readings in a sentence."""
    found, fit = int(modes.counts.flat[k]), int(choice.count.flat[k])
    if not found:
        return "No pose was found for these readings."
    poses = f"{found} poses" if found > 1 else "the only pose"
    return f"{fit} of {poses} fit{'s' if fit == 1 else ''} your machine."


def _table(modes: AssemblyModes, choice: Choice, k: int) -> Any:
    """The poses of one set, in 80 columns: five digits of a length; a file holds all."""
    import numpy as np

    from gough.commands.show import plain_table

    heads = [">pose", ">x", ">y", ">z", ">rx_deg", ">ry_deg", ">rz_deg", ">radius"]
    table = plain_table(*heads, "fails")
    table.padding = 0
    table.columns[-1].no_wrap = False
    places = max(0, 4 - math.floor(math.log10(modes.platform.size)))
    euler = np.degrees(modes.pose.euler)
    certificate = modes.certificate
    mine = np.flatnonzero(modes.row == k)
    for i in mine[np.argsort(choice.rank[mine])]:
        fails = [name for name, passed in choice.passes.items() if not passed[i]]
        proof = f"{certificate.radius[i]:.1g}" if certificate.certified[i] else "none"
        table.add_row(
            str(choice.rank[i] + 1),
            *(f"{v:z.{places}f}" for v in modes.pose.position[i]),
            *(f"{v:z.2f}" for v in euler[i]),
            proof,
            " ".join(fails) or "-",
        )
    return table


def _summary(modes: AssemblyModes, choice: Choice, k: int) -> str:
    """Status of one set of readings, counts of its solutions and the meaning of the table."""
    import numpy as np

    from gough.status import ModesStatus

    real, other, away, meet = modes.paths.reshape(-1, 4)[k]
    mine = modes.row == k
    status = ModesStatus(int(np.ravel(modes.status)[k]))
    unit = f" {modes.platform.unit}" if modes.platform.unit else ""
    lines = [f"{modes.platform.name}, {status.label}: {status.text}"]
    if real + other + away + meet:
        lines.append(
            f"{mine.sum()} real poses, {int(modes.certified[mine].sum())} certified; of this "
            f"machine's {modes.solutions} complex solutions {real} are real, {other} complex, "
            f"{away} at infinity, {meet} in multiple ones."
        )
    if np.any(mine):
        lines += [
            f"A pose fits if it passes every filter: {', '.join(choice.passes)}.",
            f"Uniqueness radius{unit and f' [{unit[1:]}]'}: no other pose with these readings lies "
            "within this distance.",
            f"Largest residual: {modes.residual[mine].max():.1e}{unit}.",
        ]
    return "\n".join(lines)


def _write(path: str, modes: AssemblyModes, choice: Choice) -> None:
    """One row for each pose, the best of its set of readings first."""
    from gough.files import write_table
    from gough.files.modes import mode_table

    write_table(path, mode_table(modes, choice), modes.platform, modes.frame or None)


def _facts(modes: AssemblyModes, choice: Choice) -> dict:
    """The answer for JSON: the sets of readings, and the columns of a file as rows."""
    import numpy as np
    import pyarrow as pa

    from gough.files.modes import mode_table
    from gough.status import ModesStatus

    rows = pa.table(mode_table(modes, choice)).to_pylist()
    legs, complete = modes.legs.reshape(-1, 6), np.ravel(modes.complete)
    sets = [
        {
            "row": k + 1,
            "readings": legs[k],
            "status": ModesStatus(int(np.ravel(modes.status)[k])).label,
            "complete": complete[k],
            "fit": np.ravel(choice.count)[k],
            "poses": [row for row in rows if row["row"] == k + 1],
        }
        for k in range(len(legs))
    ]
    platform = modes.platform
    facts = {"platform": platform.name, "unit": platform.unit, "frame": modes.frame}
    return facts | {"sets": sets}

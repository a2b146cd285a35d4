"""gough modes: every pose that leg readings allow, each with its certificate."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg

from gough.commands.options import PlatformName

if TYPE_CHECKING:
    from gough.checks import Array
    from gough.modes.assembly import AssemblyModes
    from gough.modes.choose import Choice
    from gough.platform import Platform

Legs = Annotated[Positional[tuple[str, ...]], arg(metavar="LEGS")]
ROWS_PRINTED = 3  # sets of readings whose tables are printed


def run(
    legs: Legs = (),
    *,
    platform: PlatformName,
    out: Annotated[str | None, arg(aliases=["-o"], metavar="OUT", help_behavior_hint="")] = None,
    plot: Annotated[str | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    workers: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None,
) -> int:
    """Find every pose that leg readings allow, and certify each.

    gough modes -p dietmaier

    gough modes 652.1 660.3 655.0 648.8 671.2 639.9 -p reference --plot modes.png

    Exit code 0: every list of poses is complete; 1: one may not be, or is invalid.

    Args:
        legs: six readings, or a .csv or .parquet file with columns leg_1 to leg_6; without
            them, those of the home pose.
        out: file to write, .csv or .parquet, one row for each pose; or - for CSV on standard
            output.
        plot: .png, .svg or .pdf to draw all poses of the first set of readings in.
        workers: number of threads; all cores unless given.
    """
    from gough.commands import show
    from gough.modes.assembly import assembly_modes
    from gough.modes.choose import choose_mode
    from gough.platform import Platform

    machine = Platform.load(platform)
    draw = None if plot is None else _painter(plot)
    modes = assembly_modes(machine, readings(legs, machine, platform), workers=workers)
    choice = choose_mode(modes)
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


def readings(legs: tuple[str, ...], platform: Platform, name: str) -> Array:
    """Six numbers (6,), those in a file (N, 6), or those at home if nothing is given.

    Raises:
        InputError: neither six numbers nor a file that can be read.
    """
    from gough.commands.options import FILE_ENDINGS, reading_options

    if not legs:
        return platform.home_legs
    if len(legs) == 1 and legs[0].lower().endswith(FILE_ENDINGS):
        from gough.files import read_legs

        return read_legs(legs[0], platform, reading_options(name))
    return six_numbers("LEGS", legs, "readings or a .csv or .parquet file")


def six_numbers(name: str, values: tuple[str, ...], expected: str) -> Array:
    """Six numbers from the command line, (6,).

    Raises:
        InputError: there are not six, or one is no number.
    """
    import numpy as np

    from gough.errors import InputError

    try:
        numbers = np.array([float(v) for v in values])
    except ValueError as error:
        raise InputError(f"{name}: {error}; expected six {expected}") from None
    if len(numbers) != 6:
        raise InputError(f"{name}: expected six {expected}, found {len(numbers)}")
    return numbers


def _print(modes: AssemblyModes, choice: Choice, screen: Any) -> None:
    """Print a sentence, a table and what is known for each of the first sets of readings."""
    import numpy as np

    batch = modes.legs.ndim > 1
    sets = len(modes.legs) if batch else 1
    for k in range(min(sets, ROWS_PRINTED)):
        number = f"Row {k + 1}: " if batch else ""
        screen.print(number + _verdict(modes, choice, k), markup=False)
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
    import numpy as np

    from gough.files import write_table
    from gough.modes.result import mode_columns
    from gough.tables import number_column

    columns = mode_columns(modes, None)
    columns = {"row": columns.pop("row"), "pose": number_column(choice.rank + 1)} | columns
    columns |= {f"passes_{name}": number_column(passed) for name, passed in choice.passes.items()}
    order = number_column(np.lexsort((choice.rank, modes.row)))
    write_table(path, {name: c.take(order) for name, c in columns.items()}, modes.platform)

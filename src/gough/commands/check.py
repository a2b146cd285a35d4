"""gough check: a machine's file and a log examined, with likely mistakes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional

from gough.commands.options import FileOptions, Json, ReadingOptions, option

if TYPE_CHECKING:
    from gough.examination.log import LogCheck
    from gough.examination.machine import Check
    from gough.examination.mistakes import Remark

KINDS = {
    "telescopic": "legs of variable length, readings are lengths",
    "length_change": "legs of variable length, readings are changes from home",
    "rotary": "motor arms with rods, readings are motor angles",
}


def run(
    platform: Annotated[Positional[str], option(metavar="PLATFORM")],
    log: Annotated[Positional[str | None], option(metavar="[LOG]")] = None,
    *,
    plot: Annotated[str | None, option(metavar="FILE")] = None,
    json: Json = False,
    reading: FileOptions = ReadingOptions(),
) -> int:
    """Examine a machine's file, and a log of its readings.

    gough check mine.toml

    gough check mine.toml log.csv

    Prints the readings at home and over the workspace, the reach, the nearest singularity, the
    motion when one leg is moved, and what looks like a mistake: of unit, order, zero, diameters
    for radii, left-handed frames.

    Exit code 0: nothing looks wrong; 1: something does, or a row has no usable pose; 2: a file
    cannot be read.

    Args:
        platform: Examine this machine: a name in the catalog or a .toml file.
        log: Examine this file of leg readings of the machine, too.
        plot: Draw the machine at home, its legs numbered, in this .png, .svg or .pdf file.
    """
    from gough.commands import as_json, show
    from gough.errors import PlatformError
    from gough.examination.log import check_log
    from gough.examination.machine import check
    from gough.platform import Platform

    screen = show.console()
    try:
        machine = Platform.load(platform)
    except PlatformError as error:
        if "forbids the home pose" not in str(error):
            raise
        return _refused(str(error), platform, screen)
    if plot is not None:
        _draw(machine, plot)
    found = check(machine)
    options = replace(reading, keep_bad_rows=True).of(platform)
    logged = None if log is None else check_log(log, machine, options)
    if json:
        as_json.print_json(found.to_dict() | {"log": logged and logged.to_dict()})
    else:
        _print_machine(found, screen)
        if logged is not None:
            _print_log(logged, machine, screen)
    return 0 if found.ok and (logged is None or logged.ok) else 1


def _draw(machine: Any, path: str) -> None:
    from gough.plot.pose import pose_figure
    from gough.plot.style import check_picture, save

    check_picture(path)
    save(pose_figure(machine, machine.home), path)


def _refused(error: str, path: str, screen: Any) -> int:
    """Print why a file is refused, and changes with which it would not be."""
    from gough.examination.mistakes import cures

    screen.print(error, markup=False)
    found = cures(Path(path).read_text("utf-8")) if path.endswith(".toml") else []
    if found:
        screen.print("The file would be accepted", markup=False)
        for text in found:
            screen.print(f"- {text}", markup=False)
    return 1


def _print_machine(found: Check, screen: Any) -> None:
    platform = found.platform
    unit = f" {platform.unit}" if platform.unit else ""
    screen.print(f"{platform.name}: {KINDS[platform.legs]}", markup=False)
    screen.print(
        f"size {platform.size:.5g}{unit} (the largest distance between two joints at home)\n",
        markup=False,
    )
    _print_readings(found, screen)
    _print_reach(found, screen)
    _print_singularity(found, screen)
    _print_steps(found, screen)
    _print_remarks(found.remarks, "in the machine's file", screen)


def _print_readings(found: Check, screen: Any) -> None:
    import numpy as np

    from gough.commands.show import plain_table

    platform = found.platform
    stated = platform.workspace is not None
    box = "in the workspace" if stated else "about home"
    scale = np.degrees(1.0) if platform.rotary else 1.0
    unit = "deg" if platform.rotary else platform.unit
    table = plain_table("leg", f">at home{_brackets(unit)}", f">{box}", ">stroke")
    for leg in range(6):
        used = _span(scale * found.used[leg])
        stroke = "-" if platform.stroke is None else _span(scale * platform.stroke[leg])
        table.add_row(str(leg + 1), f"{scale * platform.home_legs[leg]:.6g}", used, stroke)
    screen.print(table)
    if stated and found.within < 1:
        share = f"{100 * found.within:.1f} % of the workspace is reached by all legs.\n"
        screen.print(share, markup=False)
    elif not stated:
        screen.print(
            "No workspace is stated: a box about home without singularities was looked at,\n"
            f"+-{found.box.translation[0, 1]:.4g}{_plain(platform.unit)} and "
            f"+-{found.box.rotation_deg[0, 1]:.4g} deg on each axis.\n",
            markup=False,
        )
    else:
        screen.print("All of the workspace is reached.\n", markup=False)


def _print_reach(found: Check, screen: Any) -> None:
    from gough.commands.show import plain_table

    table = plain_table("axis", ">down", "ended by", ">up", "ended by")
    for axis, (low, high), (first, second) in found.reach_rows():
        unit = " deg" if axis.startswith("r") else _plain(found.platform.unit)
        table.add_row(
            axis, f"-{low:.5g}{unit}", first or "nothing", f"+{high:.5g}{unit}", second or "nothing"
        )
    screen.print("Reach from home, one axis at a time (the workspace aside):", markup=False)
    screen.print(table)


def _print_singularity(found: Check, screen: Any) -> None:
    import numpy as np

    from gough.text import vector

    pose = found.nearest_pose
    place = f"position {vector(pose.position)}, rx ry rz {vector(np.degrees(pose.euler))} deg"
    box = "workspace" if found.platform.workspace is not None else "box"
    screen.print(
        f"\nSmallest distance to a singularity in the {box}: {max(found.nearest, 0):.2g} at\n"
        f"{place} (0 is singular, 0.1 and above is good).\n"
        f"The readings at home have {found.poses} poses; {found.fitting} "
        f"fit{'s' if found.fitting == 1 else ''} the machine.\n",
        markup=False,
    )


def _print_steps(found: Check, screen: Any) -> None:
    import numpy as np

    from gough.commands.show import plain_table

    steps = found.steps
    if steps is None:
        return
    rotary = found.platform.rotary is not None
    step = f"{np.degrees(steps.step):.4g} deg" if rotary else f"{steps.step:.4g}"
    unit = f" [{found.platform.unit}]" if found.platform.unit else ""
    screen.print(
        f"One leg at a time, its reading raised by {step}: rise of the platform's\n"
        f"joints P1 to P6 along the base's z{unit}, and rotation about z:",
        markup=False,
    )
    table = plain_table("leg", *(f">P{k + 1}" for k in range(6)), ">rz_deg")
    places = max(0, 1 - int(np.floor(np.log10(np.abs(steps.rise).max()))))
    for leg in range(6):
        rises = (f"{v:z.{places}f}" for v in steps.rise[leg])
        table.add_row(str(leg + 1), *rises, f"{np.degrees(steps.turn[leg]):+z.2f}")
    screen.print(table)


def _print_log(found: LogCheck, platform: Any, screen: Any) -> None:
    import numpy as np

    from gough.commands.show import plain_table

    report = found.report
    layout = f" ({'; '.join(found.layout)})" if found.layout else ""
    screen.print(f"\n{found.where}: {report.rows:,} rows{layout}", markup=False)
    scale = np.degrees(1.0) if platform.rotary else 1.0
    unit = "deg" if platform.rotary else platform.unit
    stroke = platform.stroke is not None
    heads = ["leg", "column", f">readings{_brackets(unit)}", *([">stroke", ">outside"] * stroke)]
    table = plain_table(*heads)
    for leg in range(6):
        row = [str(leg + 1), found.columns[leg][:24].replace("[", r"\[")]
        row.append(_span(scale * np.array([found.low[leg], found.high[leg]])))
        if stroke:
            row += [_span(scale * platform.stroke[leg]), f"{found.outside[leg]:,}"]
        table.add_row(*row)
    screen.print(table)
    factor, offset = found.conversion.T
    if np.any(factor != 1) or np.any(offset != 0):
        added = f" + {_same(offset)}" if np.any(offset != 0) else ""
        screen.print(f"reading = {_same(factor)} x value{added}", markup=False)
    counts = plain_table("status", ">rows", ">share")
    for outcome, count in zip(report.outcomes, report.counts, strict=True):
        if count:
            counts.add_row(outcome.label, f"{count:,}", f"{100 * count / report.rows:.1f} %")
    screen.print(counts)
    for text in report.unlikely:
        screen.print(f"{found.where}: {text}", markup=False)
    _print_remarks(found.remarks, "in the log", screen)


def _print_remarks(remarks: list[Remark], where: str, screen: Any) -> None:
    mistakes = [remark.text for remark in remarks if remark.mistake]
    notes = [remark.text for remark in remarks if not remark.mistake]
    screen.print("", markup=False)
    for text in notes:
        screen.print(f"Note: {text}", markup=False)
    if not mistakes:
        screen.print(f"Nothing looks like a mistake {where}.", markup=False)
        return
    count = "One thing looks" if len(mistakes) == 1 else f"{len(mistakes)} things look"
    screen.print(f"{count} like a mistake {where}:", markup=False)
    for number, text in enumerate(mistakes, 1):
        screen.print(f"{number}. {text}", markup=False)


def _span(pair: Any) -> str:
    return f"{pair[0]:.6g} to {pair[1]:.6g}"


def _same(values: Any) -> str:
    """One number if all are equal, else six."""
    texts = [f"{value:.6g}" for value in values]
    return texts[0] if len(set(texts)) == 1 else f"({', '.join(texts)})"


def _brackets(unit: str) -> str:
    return rf" \[{unit}]" if unit else ""


def _plain(unit: str) -> str:
    return f" {unit}" if unit else ""

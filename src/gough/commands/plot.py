"""gough plot: figures for reports, one subcommand each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from gough.commands.given import Legs, PoseNumbers
from gough.commands.options import FileOptions, Frame, PlatformName, ReadingOptions, option

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gough.files.rows import Source
    from gough.platform import Platform

Picture = Annotated[
    str | None,
    option(
        "Write to this file, .svg, .png or .pdf; without it to a new PLATFORM_FIGURE.svg in this "
        "folder.",
        "OUT",
        aliases=["-o"],
    ),
]
Coordinate = Literal["x", "y", "z", "rx", "ry", "rz"]
WorkspaceQuantity = Literal["singularity", "margin", "force", "stiffness", "speed", "error"]
Value = Annotated[float | None, option(metavar="V")]


def pose(
    legs: Legs = (),
    *,
    platform: PlatformName,
    pose: PoseNumbers = None,
    row: Annotated[int, arg(metavar="N")] = 1,
    frame: Frame = None,
    out: Picture = None,
) -> int:
    """Draw a pose in 3-D, with the readings of its legs within their strokes.

    gough plot pose -p rubin_camera

    gough plot pose --pose 20 -10 610 5 3 -4 -p reference -o pose.svg

    gough plot pose poses.parquet --row 17 -p reference

    Args:
        legs: Draw the pose of these six readings, or of a row of this file of poses or readings;
            without it and without --pose, home.
        row: Take the row of this number in the file, from 1.
    """
    from gough.commands.given import row_given
    from gough.plot.pose import pose_figure

    machine = _machine(platform, out, "pose")
    given = row_given(legs, pose, machine, row, ReadingOptions().of(platform), frame)
    if given is not None and len(legs) > 1:
        print(f"{given.outcomes[0].label}: {given.outcomes[0].text}")
    found = machine.home if given is None else given.pose[0]
    translation, rotation = found.distance(machine.home)
    away = translation > 1e-9 * machine.size or rotation > 1e-9
    ghost = machine.home if away else None
    figure = pose_figure(machine, found, ghost=ghost, frame=frame)
    return _save(figure, machine, out, "pose")


def modes(
    legs: Legs = (),
    *,
    platform: PlatformName,
    row: Annotated[int, arg(metavar="N")] = 1,
    frame: Frame = None,
    out: Picture = None,
) -> int:
    """Draw all poses that have six leg readings; see gough modes.

    gough plot modes -p dietmaier -o modes.svg

    Args:
        legs: Draw the poses of these six readings, or of a row of this file; without it those of
            the readings at home.
        row: Take the row of this number in the file, from 1.
    """
    from gough.commands.given import readings_given
    from gough.errors import InputError
    from gough.modes.assembly import assembly_modes
    from gough.plot.modes import modes_figure

    machine = _machine(platform, out, "modes")
    readings = readings_given(legs, machine, platform).reshape(-1, 6)
    if not 1 <= row <= len(readings):
        raise InputError(f"--row {row}: rows are 1 to {len(readings)}")
    figure = modes_figure(assembly_modes(machine, readings[row - 1], frame=frame))
    return _save(figure, machine, out, "modes")


def workspace(
    *,
    platform: PlatformName,
    axes: Annotated[tuple[Coordinate, Coordinate], arg(metavar="A B")] = ("x", "y"),
    x: Value = None,
    y: Value = None,
    z: Value = None,
    rx: Value = None,
    ry: Value = None,
    rz: Value = None,
    span: Annotated[
        tuple[float, float, float, float] | None,
        option(metavar="A1 A2 B1 B2"),
    ] = None,
    resolution: Annotated[int, arg(metavar="N")] = 271,
    quantity: Annotated[WorkspaceQuantity, option(metavar="NAME")] = "singularity",
    frame: Frame = None,
    out: Picture = None,
) -> int:
    """Draw a slice of the workspace, and which limit ends it where.

    gough plot workspace -p nasa_msfc --axes x z

    gough plot workspace -p reachy_mini --axes rx ry --z 0.18 -o tilt.png

    gough plot workspace -p cell.toml --frame 'tool in work' --quantity error

    Lengths are in the platform's unit, angles (R = Rx Ry Rz) in degrees.

    Args:
        axes: Vary these two of x, y, z, rx, ry, rz.
        x: Fix x at this value, where it is not an axis; without it at that of home.
        y: Fix y, as x.
        z: Fix z, as x.
        rx: Fix rx, as x.
        ry: Fix ry, as x.
        rz: Fix rz, as x.
        span: Draw from the lowest to the highest value of the first and of the second axis;
            without it a little more than workspace and stroke allow.
        resolution: Take this many poses along each axis.
        quantity: Show by colour: singularity (distance to it), margin (share left of the tightest
            limit), force (largest of a leg under the payload of the platform's file), stiffness (in
            the softest direction), speed (highest of the position) or error (largest of the
            position by that of the readings).
    """
    from gough.plot.slices import workspace_slice
    from gough.plot.workspace import workspace_figure

    machine = _machine(platform, out, "workspace")
    given = {"x": x, "y": y, "z": z, "rx": rx, "ry": ry, "rz": rz}
    at = {name: value for name, value in given.items() if value is not None}
    cut = workspace_slice(
        machine, axes, at=at, span=span, resolution=resolution, quantity=quantity, frame=frame
    )
    return _save(workspace_figure(cut), machine, out, "workspace")


def trajectory(
    file: Annotated[Positional[str], arg(metavar="FILE")],
    *,
    platform: PlatformName,
    time: Annotated[str | None, option(metavar="COLUMN")] = None,
    frame: Frame = None,
    out: Picture = None,
    seed: Annotated[str, arg(metavar="NAME")] = "auto",
    reading: FileOptions = ReadingOptions(),
) -> int:
    """Draw leg readings and pose over the rows of a file, with the stroke limits.

    gough plot trajectory legs.csv -p rubin_camera --time time

    Rows without a usable pose are marked. In long files, bands from the lowest to the highest
    value of many rows replace lines.

    Args:
        file: Read poses or readings from this file, .csv, .txt, .tsv or .parquet, or from standard
            input (-).
        time: Draw over this column, in seconds unless its name ends in a unit, as in time_ms;
            without it over the time of the platform file's [readings], or the numbers of rows.
        seed: Start from this first guess, as in gough solve.
    """
    from gough.plot.trajectory import note, read_trajectory, trajectory_figure

    machine = _machine(platform, out, "trajectory")
    envelope = read_trajectory(
        file, machine, time=time, seed=seed, reading=reading.of(platform), frame=frame,
        tick=_check_signals,
    )  # fmt: skip
    figure = trajectory_figure(machine, envelope, time=envelope.time,
                               title=f"{machine.name}: {_name(file)}")  # fmt: skip
    code = _save(figure, machine, out, "trajectory")
    remark = note(envelope).replace("\N{MULTIPLICATION SIGN} ", "")
    if remark:
        print(remark)
    return code


def errors(
    files: Annotated[Positional[tuple[str, ...]], arg(metavar="FILE ...")],
    *,
    platform: PlatformName,
    truth: Annotated[str | None, option(metavar="POSES")] = None,
    all_rows: Annotated[bool, option()] = False,
    out: Picture = None,
    reading: FileOptions = ReadingOptions(),
) -> int:
    """Draw histograms of residuals and errors of solved files, on logarithmic axes.

    gough plot errors poses.parquet -p reference

    gough plot errors home.csv disgnet.csv -p reference --truth true.csv

    Args:
        files: Compare these files, .csv or .parquet as gough solve writes them.
        truth: Compare their poses with this file of the true poses, row for row.
        all_rows: Include rows whose status is not usable, such as first guesses.
    """
    from gough.errors import InputError
    from gough.plot.histograms import histogram_figure, read_errors
    from gough.plot.style import length_unit

    if not files:
        raise InputError("FILE: expected a .csv or .parquet file that gough solve wrote")
    machine, options = _machine(platform, out, "errors"), reading.of(platform)
    unit = length_unit(machine)
    labels = {
        "residual": f"residual: largest leg error [{unit}]",
        "position": f"position error [{unit}]",
        "rotation": "rotation error [deg]",
    }
    panels: dict[str, dict[str, Any]] = {}
    for file in files:
        found = read_errors(
            file, machine, truth, all_rows=all_rows, reading=options, tick=_check_signals
        )
        for quantity, histogram in found.items():
            panels.setdefault(labels[quantity], {})[file] = histogram
    return _save(histogram_figure(panels, title=machine.name), machine, out, "errors")


FIGURES: dict[str, Callable[..., int]] = {
    "pose": pose,
    "modes": modes,
    "workspace": workspace,
    "trajectory": trajectory,
    "errors": errors,
}


# ---- parts ----------------------------------------------------------------------------


def _machine(platform: str, out: str | None, figure: str) -> Platform:
    """Load the platform, and check first that the picture can be written."""
    from gough.platform import Platform
    from gough.plot.style import check_picture

    machine = Platform.load(platform)
    check_picture(_target(machine, out, figure))
    return machine


def _target(machine: Platform, out: str | None, figure: str) -> str:
    """Path of the picture: the one given, or a new one in this folder."""
    from gough.errors import GoughError

    if out is not None:
        return out
    name = "".join(c if c.isalnum() or c in "-." else "_" for c in machine.name) or "platform"
    path = f"{name}_{figure}.svg"
    if Path(path).exists():
        raise GoughError(f"{path}: is there already; pass -o {path} to replace it, or another name")
    return path


def _save(figure: Figure, machine: Platform, out: str | None, name: str) -> int:
    from gough.plot.style import save

    path = _target(machine, out, name)
    save(figure, path)
    print(f"{path}: written, {Path(path).stat().st_size / 1000:.0f} kB")
    return 0


def _check_signals(_: Source) -> None:
    """End the command after a block of rows if a signal has arrived."""
    from gough.commands import signals

    signals.check()


def _name(file: str) -> str:
    return "standard input" if file == "-" else Path(file).name

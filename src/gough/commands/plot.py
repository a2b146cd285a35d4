"""gough plot: figures for reports, each a command of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from gough.commands.modes import Legs, readings, six_numbers
from gough.commands.options import BlockRows, IgnorePlatform, KeepBadRows, PlatformName

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gough.files.rows import Source
    from gough.platform import Platform
    from gough.pose import Pose

Picture = Annotated[
    str | None,
    arg(
        aliases=["-o"],
        metavar="OUT",
        help=".svg, .png or .pdf to write; without it a new PLATFORM_FIGURE.svg in this folder.",
        help_behavior_hint="",
    ),
]
Coordinate = Literal["x", "y", "z", "rx", "ry", "rz"]
Value = Annotated[float | None, arg(metavar="V", help_behavior_hint="")]


def pose(
    pose: Annotated[Positional[tuple[str, ...]], arg(metavar="POSE")] = (),
    *,
    platform: PlatformName,
    legs: Annotated[
        tuple[str, str, str, str, str, str] | None,
        arg(metavar="LEGS", help_behavior_hint=""),
    ] = None,
    row: Annotated[int, arg(metavar="N")] = 1,
    out: Picture = None,
) -> int:
    """Draw a pose in 3-D, with the readings of its legs within their strokes.

    gough plot pose -p rubin_camera

    gough plot pose 20 -10 610 5 3 -4 -p reference -o pose.svg

    gough plot pose poses.parquet --row 17 -p reference

    Args:
        pose: x y z in the platform's unit and rx ry rz in degrees (R = Rx Ry Rz), or a .csv or
            .parquet file of poses or leg readings; without it, and without --legs, home.
        legs: solve six readings and draw their pose.
        row: number of the row in the file, from 1.
    """
    from gough.plot.pose import pose_figure

    machine = _machine(platform, out, "pose")
    found = _pose(machine, pose, legs, row)
    translation, rotation = found.distance(machine.home)
    away = translation > 1e-9 * machine.size or rotation > 1e-9
    ghost = machine.home if away else None
    return _save(pose_figure(machine, found, ghost=ghost), machine, out, "pose")


def modes(legs: Legs = (), *, platform: PlatformName, out: Picture = None) -> int:
    """Draw all poses that have six leg readings; see gough modes.

    gough plot modes -p dietmaier -o modes.svg

    Args:
        legs: six readings, or a .csv or .parquet file, of which the first row is used; without
            them, those of the home pose.
    """
    from gough.modes.assembly import assembly_modes
    from gough.plot.modes import modes_figure

    machine = _machine(platform, out, "modes")
    figure = modes_figure(
        assembly_modes(machine, readings(legs, machine, platform).reshape(-1, 6)[0])
    )
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
        arg(metavar="A1 A2 B1 B2", help_behavior_hint=""),
    ] = None,
    resolution: Annotated[int, arg(metavar="N")] = 271,
    out: Picture = None,
) -> int:
    """Draw a slice of the workspace: distance to singularity, stroke limits.

    gough plot workspace -p nasa_msfc --axes x z

    gough plot workspace -p reachy_mini --axes rx ry --z 0.18 -o tilt.png

    Lengths are in the platform's unit, angles (R = Rx Ry Rz) in degrees.

    Args:
        axes: two of x, y, z, rx, ry, rz.
        x: fixed value of x, where it is not an axis; without it, that of home.
        y: fixed value of y, as for x.
        z: fixed value of z, as for x.
        rx: fixed value of rx, as for x.
        ry: fixed value of ry, as for x.
        rz: fixed value of rz, as for x.
        span: lowest and highest value of the first, then of the second axis; without it a
            little more than workspace and stroke allow.
        resolution: poses along each axis.
    """
    from gough.plot.workspace import workspace_figure, workspace_slice

    machine = _machine(platform, out, "workspace")
    given = {"x": x, "y": y, "z": z, "rx": rx, "ry": ry, "rz": rz}
    at = {name: value for name, value in given.items() if value is not None}
    cut = workspace_slice(machine, axes, at=at, span=span, resolution=resolution)
    return _save(workspace_figure(cut), machine, out, "workspace")


def trajectory(
    file: Annotated[Positional[str], arg(metavar="FILE")],
    *,
    platform: PlatformName,
    time: Annotated[str | None, arg(metavar="COLUMN", help_behavior_hint="")] = None,
    out: Picture = None,
    seed: Annotated[str, arg(metavar="NAME")] = "auto",
    keep_bad_rows: KeepBadRows = False,
    ignore_platform: IgnorePlatform = False,
    block_rows: BlockRows = 65536,
) -> int:
    """Draw leg readings and pose over the rows of a file, with the stroke limits.

    gough plot trajectory legs.csv -p rubin_camera --time time

    Rows without a usable pose are marked. In long files, bands from the lowest to the highest
    value of many rows replace lines.

    Args:
        file: .csv or .parquet with columns of poses or leg_1 to leg_6, or - for CSV on
            standard input.
        time: column on the horizontal axis, in seconds unless its name ends in a unit, as in
            time_ms; without it, row numbers.
        seed: first guess for leg readings, as in gough solve.
    """
    from gough.commands.options import reading_options
    from gough.plot.trajectory import note, read_trajectory, trajectory_figure

    machine = _machine(platform, out, "trajectory")
    reading = reading_options(platform, "", keep_bad_rows, ignore_platform, block_rows)
    envelope = read_trajectory(
        file, machine, time=time, seed=seed, reading=reading, tick=_check_signals
    )
    figure = trajectory_figure(machine, envelope, time=time or "row",
                               title=f"{machine.name}: {_name(file)}")  # fmt: skip
    code = _save(figure, machine, out, "trajectory")
    said = note(envelope).replace("\N{MULTIPLICATION SIGN} ", "")
    if said:
        print(said)
    return code


def errors(
    files: Annotated[Positional[tuple[str, ...]], arg(metavar="FILE")],
    *,
    platform: PlatformName,
    truth: Annotated[str | None, arg(metavar="POSES", help_behavior_hint="")] = None,
    all_rows: Annotated[bool, arg(help_behavior_hint="")] = False,
    out: Picture = None,
    keep_bad_rows: KeepBadRows = False,
    ignore_platform: IgnorePlatform = False,
    block_rows: BlockRows = 65536,
) -> int:
    """Draw histograms of residuals and errors of solved files, on logarithmic axes.

    gough plot errors poses.parquet -p reference

    gough plot errors home.csv disgnet.csv -p reference --truth true.csv

    Args:
        files: .csv or .parquet as gough solve writes them, one or several to compare.
        truth: the true poses, row for row, to compare the files' poses with.
        all_rows: include rows whose status is not usable, such as first guesses.
    """
    from gough.commands.options import reading_options
    from gough.errors import InputError
    from gough.plot.histograms import histogram_figure, read_errors
    from gough.plot.style import length_unit

    if not files:
        raise InputError("FILE: expected a .csv or .parquet file that gough solve wrote")
    machine = _machine(platform, out, "errors")
    reading = reading_options(platform, "", keep_bad_rows, ignore_platform, block_rows)
    unit = length_unit(machine)
    labels = {
        "residual": f"residual: largest leg error [{unit}]",
        "position": f"position error [{unit}]",
        "rotation": "rotation error [deg]",
    }
    panels: dict[str, dict[str, Any]] = {}
    for file in files:
        found = read_errors(
            file, machine, truth, all_rows=all_rows, reading=reading, tick=_check_signals
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


def _pose(
    machine: Platform, given: tuple[str, ...], legs: tuple[str, ...] | None, row: int
) -> Pose:
    """Pose that the command line gives."""
    import numpy as np

    from gough.errors import InputError
    from gough.fk.solve import solve
    from gough.plot.pose import read_pose
    from gough.pose import Pose

    if legs is not None:
        if given:
            raise InputError("POSE, --legs: pass one of them, not both")
        values = six_numbers("--legs", legs, "readings")
        solution = solve(machine, values)
        print(f"{solution.status.label}: {solution.status.text}")
        return solution.pose
    if not given:
        return machine.home
    if len(given) == 1 and (given[0] == "-" or given[0].lower().endswith((".csv", ".parquet"))):
        return read_pose(given[0], machine, row)
    values = six_numbers("POSE", given, "numbers x y z rx ry rz, or a .csv or .parquet file")
    if not np.all(np.isfinite(values)):
        raise InputError(f"POSE: expected six finite numbers, found {' '.join(given)}")
    return Pose.from_euler(values[:3], np.radians(values[3:]))


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

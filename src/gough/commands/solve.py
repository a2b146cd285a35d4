"""gough solve: poses from a file of leg readings."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from tyro.conf import arg

from gough.commands.folder import FolderOptions, JobOptions
from gough.commands.given import Legs
from gough.commands.options import (
    AllowFailures,
    FileOptions,
    Frame,
    Head,
    Json,
    Keep,
    Out,
    PlatformName,
    ReadingOptions,
    option,
)


def run(
    legs: Legs = (),
    *,
    platform: PlatformName,
    out: Out = None,
    frame: Frame = None,
    seed: Annotated[str, arg(metavar="NAME")] = "auto",
    tolerance: Annotated[float, arg(metavar="T")] = 1e-12,
    max_iterations: Annotated[int, arg(metavar="N")] = 60,
    workers: Annotated[int | None, option(metavar="N")] = None,
    leg_noise: Annotated[float | None, option(metavar="S")] = None,
    limits: Annotated[bool, option()] = False,
    angles: Annotated[
        Literal["deg", "rad", "uvw", "abc", "rpy"] | None,
        option(metavar="deg|rad|uvw|abc|rpy"),
    ] = None,
    keep: Keep = "",
    follow: Annotated[bool, option()] = False,
    max_shift: Annotated[float | None, option(metavar="S")] = None,
    max_turn: Annotated[float | None, option(metavar="DEG")] = None,
    allow_failures: AllowFailures = False,
    head: Head = 5,
    json: Json = False,
    reading: FileOptions = ReadingOptions(),
    folder: FolderOptions = JobOptions(),
) -> int:
    """Calculate poses from leg readings.

    gough solve 652.1 660.3 655.0 648.8 671.2 639.9 -p reference

    gough solve legs.parquet -p rubin_camera -o poses.parquet

    gough solve logs/ -p mine.toml -o poses/

    Every row of readings gives a row of output with its status. A folder of files, or one large
    file with a folder for -o, goes on where it was stopped when the command is given again.

    Exit code 0: all poses are usable; 1: some are not; 2: nothing was written, or not for every
    file of a folder.

    Args:
        legs: Solve these six readings, or the columns of the six legs in this file, .csv, .txt,
            .tsv, .xlsx or .parquet, or in text on standard input (-); or those in every file of a
            folder, a glob or a list, also of an object store (s3://, gs://, abfs://, hdfs://).
        seed: Start from this first guess: home, polynomial, polynomial-5 (another degree), the
            name of a network that comes with gough, or the folder of a trained one. auto is
            polynomial where the platform states a workspace, else home.
        tolerance: Accept a row when its largest leg error is below this share of the platform's
            size.
        max_iterations: Take at most this many Newton steps from each start; 0 writes the first
            guess.
        workers: Use this many threads, or processes for many files; without it all cores.
        leg_noise: Add the standard deviations of the pose that readings with this standard
            deviation (in their unit) cause; those of rotations are in the unit of --angles, else
            in radians.
        limits: Add the margin that is left of the tightest limit of joints, legs, forces, stroke
            and workspace, as a share (1 in the middle, 0 at the limit), and its name. A platform
            whose file has a table [limits] needs no option for that.
        angles: Write Euler angles instead of quaternions: R = Rx Ry Rz in this unit; or U, V, W as
            PI, A, B, C as LinuxCNC, roll, pitch, yaw as ROS writes them.
        follow: Take rows for consecutive: start each at the pose before, and write an event of
            each, such as followed, found or jumped. Rows whose pose is not taken have none.
        max_shift: With --follow allow this translation from row to row, in the platform's unit;
            2 % of its size without it.
        max_turn: With --follow allow this rotation from row to row, in degrees; 5.7 without it.
    """
    import math

    from gough.commands import as_json, show
    from gough.commands.folder import is_job, run_folder
    from gough.commands.given import legs_given
    from gough.errors import InputError
    from gough.files import solve_file
    from gough.platform import Platform

    allowed = {"max_shift": max_shift, "max_turn": max_turn and math.radians(max_turn)}
    allowed = {name: value for name, value in allowed.items() if value is not None}
    if allowed and not follow:
        raise InputError("--max-shift, --max-turn: limits of --follow; pass it, or leave them out")
    settings: dict[str, Any] = {
        "angles": angles, "leg_noise": leg_noise, "seed": seed, "tolerance": tolerance,
        "max_iterations": max_iterations, "frame": frame, "limits": limits or None,
        "follow": allowed if follow else None,
    }  # fmt: skip
    read = reading.of(platform, keep)
    if is_job(legs, out, folder):
        return run_folder(
            "solve", legs, Platform.load(platform), out, folder, workers=workers, json=json,
            allow_failures=allow_failures, reading=read, **settings,
        )  # fmt: skip
    given = legs_given(legs)
    machine = Platform.load(platform)
    with show.progress_bar() as progress:
        report = solve_file(
            given, out, machine, progress=progress, reading=read, head=0 if out else head,
            workers=workers, **settings,
        )  # fmt: skip
    if json:
        poses = as_json.first_poses(report, angles)
        as_json.print_json(as_json.report_facts(report, machine, poses), out)
        return show.exit_code(report, allow_failures)
    return show.print_report(report, machine, given, out, head, show.print_poses, allow_failures)

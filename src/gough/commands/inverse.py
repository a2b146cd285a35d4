"""gough inverse: leg readings from a file of poses."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import Positional

from gough.commands.folder import FolderOptions, JobOptions
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
    poses: Annotated[Positional[tuple[str, ...]], option(metavar="[POSES]")] = (),
    *,
    platform: PlatformName,
    out: Out = None,
    frame: Frame = None,
    keep: Keep = "",
    allow_failures: AllowFailures = False,
    head: Head = 5,
    json: Json = False,
    workers: Annotated[int | None, option(metavar="N")] = None,
    reading: FileOptions = ReadingOptions(),
    folder: FolderOptions = JobOptions(),
) -> int:
    """Calculate leg readings from poses.

    gough inverse 20 -10 610 5 3 -4 -p reference

    gough inverse poses.csv -p rubin_camera -o legs.parquet

    gough inverse poses/ -p mine.toml -o legs/

    Columns of a pose in a file are x, y, z in the platform's unit, and its rotation: qw, qx, qy,
    qz, or rx, ry, rz [rad], or rx_deg, ry_deg, rz_deg (R = Rx Ry Rz), or as makers write it:
    U, V, W (PI), A, B, C (LinuxCNC) [deg], or roll, pitch, yaw [rad] (ROS).

    A folder of files goes on where it was stopped when the command is given again.

    Exit code 0: all rows have readings; 1: some have none; 2: nothing was written, or not for
    every file of a folder.

    Args:
        poses: Take this pose, six numbers x y z rx ry rz with angles in degrees, or the poses in
            this file, .csv, .txt, .tsv, .xlsx or .parquet, or in text on standard input (-); or
            those in every file of a folder, a glob or a list, also of an object store (s3://,
            gs://, abfs://, hdfs://).
        workers: Use this many processes for many files; without it all cores.
    """
    from gough.commands import as_json, show
    from gough.commands.folder import is_job, run_folder
    from gough.commands.given import pose_given
    from gough.files import inverse_file
    from gough.platform import Platform

    read = reading.of(platform, keep)
    if is_job(poses, out, folder):
        return run_folder(
            "inverse", poses, Platform.load(platform), out, folder, workers=workers, json=json,
            allow_failures=allow_failures, reading=read, frame=frame,
        )  # fmt: skip
    given = pose_given(poses)
    machine = Platform.load(platform)
    with show.progress_bar() as progress:
        report = inverse_file(
            given, out, machine, frame=frame, progress=progress, head=0 if out else head,
            reading=read,
        )  # fmt: skip
    if json:
        rows = as_json.first_legs(report)
        as_json.print_json(as_json.report_facts(report, machine, rows), out)
        return show.exit_code(report, allow_failures)
    return show.print_report(report, machine, given, out, head, show.print_legs, allow_failures)

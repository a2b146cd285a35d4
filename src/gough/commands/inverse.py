"""gough inverse: leg readings from a file of poses."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional, arg

from gough.commands.options import (
    AllowFailures,
    BlockRows,
    Head,
    IgnorePlatform,
    Keep,
    KeepBadRows,
    LogOptions,
    Out,
    PlatformName,
    reading_options,
)


def run(
    poses: Annotated[Positional[str], arg(metavar="POSES")],
    *,
    platform: PlatformName,
    out: Out = None,
    keep: Keep = "",
    keep_bad_rows: KeepBadRows = False,
    allow_failures: AllowFailures = False,
    ignore_platform: IgnorePlatform = False,
    head: Head = 5,
    block_rows: BlockRows = 65536,
    log: OmitArgPrefixes[LogOptions] = LogOptions(),  # noqa: B008 - frozen
) -> int:
    """Calculate leg readings from a file of poses.

    gough inverse poses.csv -p rubin_camera -o legs.parquet

    Columns of a pose: x, y, z in the platform's unit, and its rotation:

    qw, qx, qy, qz, or rx, ry, rz [rad], or rx_deg, ry_deg, rz_deg (R = Rx Ry Rz).

    Exit code 0: all rows have readings; 1: some have none; 2: nothing was written.

    Args:
        poses: Read this .csv or .parquet file with these columns, or CSV from standard input (-).
    """
    from gough.commands import show
    from gough.files import inverse_file
    from gough.platform import Platform

    machine = Platform.load(platform)
    with show.progress_bar() as progress:
        report = inverse_file(
            poses, out, machine, progress=progress, head=0 if out else head,
            reading=reading_options(
                platform, keep, keep_bad_rows, ignore_platform, block_rows, log
            ),
        )  # fmt: skip
    return show.print_report(report, machine, poses, out, head, show.print_legs, allow_failures)

"""gough solve: poses from a file of leg readings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from gough.commands.options import (
    AllowFailures,
    BlockRows,
    Head,
    IgnorePlatform,
    Keep,
    KeepBadRows,
    Out,
    PlatformName,
    reading_options,
)

if TYPE_CHECKING:
    from gough.platform import Platform

PREFERRED = "disgnet"


def run(
    legs: Annotated[Positional[str], arg(metavar="LEGS")],
    *,
    platform: PlatformName,
    out: Out = None,
    seed: Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")] = None,
    tolerance: Annotated[float | None, arg(metavar="T", help_behavior_hint="")] = None,
    max_iterations: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None,
    leg_noise: Annotated[float | None, arg(metavar="S", help_behavior_hint="")] = None,
    angles: Annotated[
        Literal["deg", "rad"] | None, arg(metavar="deg|rad", help_behavior_hint="")
    ] = None,
    keep: Keep = "",
    keep_bad_rows: KeepBadRows = False,
    allow_failures: AllowFailures = False,
    ignore_platform: IgnorePlatform = False,
    head: Head = 5,
    block_rows: BlockRows = 65536,
) -> int:
    """Poses from a file of leg readings.

    gough solve legs.parquet -p rubin_camera -o poses.parquet

    Every row of readings gives a row of output with its status.

    Exit code 0: all poses are usable; 1: some are not; 2: nothing was written.

    Args:
        legs: .csv or .parquet with columns leg_1 to leg_6, or - for CSV on standard input.
        seed: the first guess: home, polynomial, polynomial-5, the name of a network that comes
            with gough, or the folder of a trained one. Without it: the network that comes with
            gough for this platform (reference: disgnet); if none does, polynomial where the
            platform states a workspace, else home.
        tolerance: largest leg error of a converged row, as a share of the platform's size.
        max_iterations: Newton steps before a row is given up; 0 writes the first guess.
        leg_noise: standard deviation of the readings, in their unit; adds six columns with
            those of the pose.
        angles: write Euler angles, R = Rx Ry Rz, in place of quaternions.
    """
    from gough.commands import show
    from gough.files import solve_file
    from gough.platform import Platform

    machine = Platform.load(platform)
    solver = {
        "seed": seed or default_seed(machine),
        "tol": tolerance,
        "max_iterations": max_iterations,
    }
    given = {name: value for name, value in solver.items() if value is not None}
    with show.progress_bar() as progress:
        report = solve_file(
            legs, out, machine, angles=angles, leg_noise=leg_noise, progress=progress,
            reading=reading_options(keep, keep_bad_rows, ignore_platform, block_rows),
            head=0 if out else head, **given,
        )  # fmt: skip
    screen = show.console_beside(out)
    if not out and head:
        show.print_poses(report, machine, screen)
    show.print_invalid(report, legs)
    show.print_summary(report, machine, out, screen)
    return 1 if report.failures and not allow_failures else 0


def default_seed(machine: Platform) -> str:
    """The network that comes with the package for a machine, or what `solve` takes by itself."""
    from gough.seeds.network import shipped_names

    return PREFERRED if PREFERRED in shipped_names(machine) else "auto"

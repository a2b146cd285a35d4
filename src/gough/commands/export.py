"""gough export: a platform written out for other programs."""

from __future__ import annotations

from typing import Annotated, Literal

from tyro.conf import arg

from gough.commands.options import PlatformName


def c(
    *,
    platform: PlatformName,
    out: Annotated[str, arg(aliases=["-o"], metavar="FOLDER")],
    prefix: Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")] = None,
    real: Literal["double", "float"] = "double",
    linuxcnc: Annotated[bool, arg(help_behavior_hint="")] = False,
    unit: Annotated[Literal["mm", "inch"], arg()] = "mm",
    force: Annotated[bool, arg(help_behavior_hint="")] = False,
) -> int:
    """C99 for this one machine: poses from readings in bounded time, without any library.

    gough export c -p reachy_mini -o reachy

    gough export c -p my_machine.toml -o kins --linuxcnc

    Writes NAME.h, NAME.c, an example, a test with what gough's tracker makes of the same readings,
    CMakeLists.txt and README.md. The files may be used and linked with anything (MIT-0).

    Args:
        out: folder to write to; it is made if it is missing.
        prefix: what all C names and file names begin with; without it the platform's name.
        real: type of all numbers; float for processors that compute no other fast.
        linuxcnc: write one file instead, NAMEkins.comp, for LinuxCNC's halcompile --install.
        unit: with --linuxcnc: LINEAR_UNITS of the configuration, which lengths are converted to.
        force: replace files that exist.
    """
    from gough.export.c import c_files
    from gough.export.folder import write_folder
    from gough.export.linuxcnc import linuxcnc_files
    from gough.platform import Platform

    machine = Platform.load(platform)
    files = linuxcnc_files(machine, prefix, unit) if linuxcnc else c_files(machine, prefix, real)
    for path in write_folder(out, files, force):
        print(path)
    return 0


FORMATS = {"c": c}

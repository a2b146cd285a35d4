"""gough export: a platform written out for other programs."""

from __future__ import annotations

from typing import Annotated, Literal

from gough.commands.options import PlatformName, option


def c(
    *,
    platform: PlatformName,
    out: Annotated[str, option(metavar="FOLDER", aliases=["-o"])],
    prefix: Annotated[str | None, option(metavar="NAME")] = None,
    real: Literal["double", "float"] = "double",
    linuxcnc: Annotated[bool, option()] = False,
    unit: Literal["mm", "inch"] = "mm",
    force: Annotated[bool, option()] = False,
) -> int:
    """Write C99 for one machine: poses from readings in bounded time, without any library.

    gough export c -p reachy_mini -o reachy

    gough export c -p my_machine.toml -o kins --linuxcnc

    Writes NAME.h, NAME.c, an example, a test with what gough's tracker makes of the same readings,
    CMakeLists.txt and README.md. The files may be used and linked with anything (MIT-0).

    Args:
        out: Write to this folder, which is made if it is missing.
        prefix: Begin all C names and file names with this; without it with the platform's name.
        real: Use this type for all numbers; float for processors that compute no other fast.
        linuxcnc: Write one file instead, NAMEkins.comp, for LinuxCNC's halcompile --install.
        unit: Convert lengths to this unit for --linuxcnc, LINEAR_UNITS of the configuration.
        force: Replace files that exist.
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


def mjcf(
    *,
    platform: PlatformName,
    out: Annotated[str, option(metavar="FILE.xml", aliases=["-o"])],
    gravity: Annotated[bool, option()] = False,
    force: Annotated[bool, option()] = False,
) -> int:
    """Write a model for MuJoCo: legs, closed loops, servos, sensors and a keyframe at home.

    gough export mjcf -p rubin_camera -o rubin.xml

    python -m mujoco.viewer --mjcf=rubin.xml

    Lengths are in metres. Controls are leg readings; in steady state the platform has the pose
    that gough solve finds for them. Masses are not the machine's: put its own in.

    Args:
        out: Write this file.
        gravity: Give the bodies weight, by which the servos sag as springs do.
        force: Replace a file that exists.
    """
    from gough.export.folder import write_file
    from gough.export.mjcf import to_mjcf
    from gough.platform import Platform

    print(write_file(out, to_mjcf(Platform.load(platform), gravity), force))
    return 0


def sdf(
    *,
    platform: PlatformName,
    out: Annotated[str, option(metavar="FILE.sdf", aliases=["-o"])],
    force: Annotated[bool, option()] = False,
) -> int:
    """Write a model for Gazebo: legs, and loops closed by ball joints.

    gough export sdf -p rubin_camera -o model.sdf

    Lengths are in metres. Joints leg1 to leg6 are 0 at home. Not every physics engine of Gazebo
    keeps loops closed; see docs/simulators.md. Masses are not the machine's: put its own in.

    Args:
        out: Write this file.
        force: Replace a file that exists.
    """
    from gough.export.folder import write_file
    from gough.export.sdf import to_sdf
    from gough.platform import Platform

    print(write_file(out, to_sdf(Platform.load(platform)), force))
    return 0


def urdf(
    *,
    platform: PlatformName,
    out: Annotated[str, option(metavar="FILE.urdf", aliases=["-o"])],
    force: Annotated[bool, option()] = False,
) -> int:
    """Refuse: URDF describes trees, and a hexapod has five loops. Use mjcf or sdf.

    gough export mjcf -p rubin_camera -o rubin.xml

    Args:
        platform: Not used.
        out: Not written.
        force: Not used.
    """
    from gough.errors import InputError

    raise InputError(
        "URDF gives each link one parent, so it cannot state that six legs hold one platform; a "
        "tree without the loops would let the legs fall apart. Use gough export mjcf (for MuJoCo) "
        "or gough export sdf (for Gazebo)"
    )


FORMATS = {"c": c, "mjcf": mjcf, "sdf": sdf, "urdf": urdf}

"""gough import: a platform found in a model for a simulator."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional

from gough.commands.options import option

if TYPE_CHECKING:
    from gough.importers.bodies import Model


def mjcf(
    file: Annotated[Positional[str], option(metavar="FILE.xml")],
    *,
    out: Annotated[str, option(metavar="FILE.toml", aliases=["-o"])],
    force: Annotated[bool, option()] = False,
) -> int:
    """Find a hexapod in a model of MuJoCo and write its platform file.

    gough import mjcf machine.xml -o machine.toml

    Six legs must join one body to another: chains of a slide, or of a motor's hinge and a rod,
    between ball or universal joints (or hinges whose axes meet), or tendons between two sites.
    Prints what was assumed, and writes it into the file.

    Args:
        file: A model that MuJoCo loads.
        out: Write this platform file.
        force: Replace a file that exists.
    """
    from gough.importers.mjcf import read_mjcf

    return _convert(read_mjcf, file, out, force)


def sdf(
    file: Annotated[Positional[str], option(metavar="FILE.sdf")],
    *,
    out: Annotated[str, option(metavar="FILE.toml", aliases=["-o"])],
    force: Annotated[bool, option()] = False,
) -> int:
    """Find a hexapod in an SDF file and write its platform file.

    gough import sdf model.sdf -o machine.toml

    Six legs must join one link to another: chains of a prismatic joint, or of a motor's revolute
    joint and a rod, between ball or universal joints (or revolute ones whose axes meet). Prints
    what was assumed, and writes it into the file.

    Args:
        file: A file with one model.
        out: Write this platform file.
        force: Replace a file that exists.
    """
    from gough.importers.sdf import read_sdf

    return _convert(read_sdf, file, out, force)


def _convert(read: Callable[[str], Model], file: str, out: str, force: bool) -> int:
    from gough.errors import GoughError, printable
    from gough.export.folder import write_file
    from gough.importers.legs import find_platform

    model = read(file)
    try:
        platform, notes = find_platform(model)
    except GoughError as error:
        raise GoughError(f"{file}: {error}") from None
    lines = [printable(f"Found in {Path(file).name}."), *map(printable, notes)]
    comment = "".join(f"# {line}\n" for line in lines)
    print(write_file(out, comment + platform.to_toml(), force))
    print("\n".join(lines))
    return 0


FORMATS = {"mjcf": mjcf, "sdf": sdf}

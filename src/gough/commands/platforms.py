"""gough platforms: the machines of the catalog."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional

from gough.commands.options import Json, option

if TYPE_CHECKING:
    from gough.platform import Platform


def run(
    name: Annotated[Positional[str], option(metavar="[NAME]")] = "", *, json: Json = False
) -> int:
    """List the machines that come with gough, or print one as TOML to copy and edit.

    gough platforms rubin_camera > mine.toml

    Args:
        name: Print this machine of the catalog, or check this .toml file.
    """
    from gough.platform import Platform
    from gough.platform_file import catalog_names, catalog_text

    if json:
        from gough.commands import as_json

        names = [name] if name else catalog_names()
        facts = [Platform.load(one).to_dict() for one in names]
        as_json.print_json(facts[0] if name else dict(zip(names, facts, strict=True)))
    elif name.endswith(".toml"):
        sys.stdout.write(Platform.load(name).to_toml())
    elif name:
        sys.stdout.write(catalog_text(name))
    else:
        _print_table([(n, Platform.load(n)) for n in catalog_names()])
    return 0


def _print_table(platforms: list[tuple[str, Platform]]) -> None:
    from rich.table import Table

    from gough.commands.show import console, plain_table

    table: Table = plain_table("name", "unit", "readings", ">size", ">stroke")
    for name, platform in platforms:
        unit = "rad" if platform.legs == "rotary" else platform.unit
        table.add_row(
            name, platform.unit, platform.legs, f"{platform.size:.4g}", _stroke(platform, unit)
        )
    console().print(table)


def _stroke(platform: Platform, unit: str) -> str:
    if platform.stroke is None:
        return "not stated"
    low, high = platform.stroke[:, 0].min(), platform.stroke[:, 1].max()
    return f"{low:.4g} to {high:.4g} {unit}"

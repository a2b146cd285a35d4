"""Options that several commands share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

if TYPE_CHECKING:
    from gough.files import Reading

PlatformName = Annotated[
    str,
    arg(
        aliases=["-p"],
        metavar="PLATFORM",
        help="a machine of the catalog (gough platforms), or a .toml file.",
    ),
]
Out = Annotated[
    str | None,
    arg(
        aliases=["-o"],
        metavar="OUT",
        help="file to write, .csv or .parquet, or - for CSV on standard output; without it the "
        "first rows are printed.",
        help_behavior_hint="",
    ),
]
Keep = Annotated[
    str,
    arg(
        metavar="COLUMNS",
        help="columns to copy to the output, such as time,id.",
        help_behavior_hint="",
    ),
]
KeepBadRows = Annotated[
    bool,
    arg(
        help="mark rows with text in a number column or a wrong width as invalid and go on.",
        help_behavior_hint="",
    ),
]
IgnorePlatform = Annotated[
    bool,
    arg(
        help="take the numbers of a file that was written for another platform or unit.",
        help_behavior_hint="",
    ),
]
AllowFailures = Annotated[
    bool, arg(help="exit with 0 although some rows have no answer.", help_behavior_hint="")
]
Head = Annotated[int, arg(metavar="N", help="rows to print where nothing is written.")]
BlockRows = Annotated[int, arg(metavar="N", help="rows held in memory at a time.")]


def reading_options(
    keep: str, keep_bad_rows: bool, ignore_platform: bool, block_rows: int
) -> Reading:
    """The options of reading, from the command line's text."""
    from gough.files import Reading

    names = tuple(name.strip() for name in keep.split(",") if name.strip())
    return Reading(names, keep_bad_rows, ignore_platform, block_rows)

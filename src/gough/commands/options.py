"""Options that several commands share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import arg

if TYPE_CHECKING:
    from gough.files import Reading


def option(text: str | None = None, metavar: str | None = None, **settings: Any) -> Any:
    """An option without a remark on its default value.

    Args:
        text: the help text; without it the docstring's.
        metavar: the name of the value.
        settings: of `tyro.conf.arg`, such as aliases.
    """
    return arg(help=text, metavar=metavar, help_behavior_hint="", **settings)


PlatformName = Annotated[
    str,
    arg(
        aliases=["-p"],
        metavar="PLATFORM",
        help="Use this machine: a name in the catalog (gough platforms) or a .toml file.",
    ),
]
Out = Annotated[
    str | None,
    option(
        "Write to this file, .csv or .parquet, or as CSV to standard output (-). Without it the "
        "first rows are printed.",
        "OUT",
        aliases=["-o"],
    ),
]
Keep = Annotated[str, option("Copy these columns to the output, such as time,id.", "COLUMNS")]
KeepBadRows = Annotated[
    bool,
    option(
        "Mark rows with text in a number column, or with too few or too many fields, as invalid "
        "and go on."
    ),
]
IgnorePlatform = Annotated[
    bool, option("Accept a file that was written for another platform or unit.")
]
AllowFailures = Annotated[bool, option("Exit with 0 even if some rows have no usable result.")]
Head = Annotated[int, arg(metavar="N", help="Print this many rows where no file is written.")]
BlockRows = Annotated[int, arg(metavar="N", help="Hold this many rows in memory at a time.")]


def reading_options(
    keep: str, keep_bad_rows: bool, ignore_platform: bool, block_rows: int
) -> Reading:
    """The options for reading a file, from the text of the command line."""
    from gough.files import Reading

    names = tuple(name.strip() for name in keep.split(",") if name.strip())
    return Reading(names, keep_bad_rows, ignore_platform, block_rows)

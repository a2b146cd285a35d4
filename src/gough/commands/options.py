"""Options that several commands share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import OmitArgPrefixes, arg

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
Frame = Annotated[
    str | None,
    option(
        "Take poses as those of this frame of the platform's file, such as 'tool in work', "
        "instead of those of the platform.",
        metavar="'A in B'",
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
AllowFailures = Annotated[bool, option("Exit with 0 even if some rows have no usable result.")]
Head = Annotated[int, arg(metavar="N", help="Print this many rows where no file is written.")]
Json = Annotated[bool, option("Print the answer as JSON on standard output instead of text.")]
RandomSeed = Annotated[int, arg(metavar="N", help="Draw from this seed of the random numbers.")]
WorkspaceBox = Annotated[
    tuple[float, float] | None,
    option(
        "Use another workspace about home: +-LENGTH [platform unit] and +-DEG on each axis.",
        "LENGTH DEG",
    ),
]
SameAssembly = Annotated[
    bool, option("Use only poses that are reached without crossing a singularity.")
]


@dataclass(frozen=True)
class ReadingOptions:
    """Reading of files; columns to decimal go before the platform file's [readings]."""

    columns: Annotated[
        str,
        option(
            "Read legs 1 to 6 from these columns: 1:6, six names in order, or NAME=LEG,... "
            "Without it they are found by names such as leg_1, L1 or actuator 1 (mm).",
            "COLUMNS",
        ),
    ] = ""
    unit: Annotated[
        str,
        option("Convert readings from this unit of length: m, cm, mm, um, in or ft.", "UNIT"),
    ] = ""
    angle_unit: Annotated[
        Literal["deg", "rad"] | None, option("Read motor angles in this unit.", "deg|rad")
    ] = None
    scale: Annotated[
        str,
        option("Multiply the values by this number, or by six numbers separated by commas.", "S"),
    ] = ""
    offset: Annotated[
        str, option("Then add this number, or six numbers, in the readings' unit.", "B")
    ] = ""
    decimal: Annotated[
        Literal[".", ","] | None, option("Read numbers with this decimal sign.", ".|,")
    ] = None
    keep_bad_rows: Annotated[
        bool,
        option(
            "Mark rows with text in a number column, or with too few or too many fields, as "
            "invalid and go on."
        ),
    ] = False
    ignore_platform: Annotated[
        bool, option("Accept a file that was written for another platform or unit.")
    ] = False
    block_rows: Annotated[
        int, arg(metavar="N", help="Hold this many rows in memory at a time.")
    ] = 65536

    def of(self, platform: str, keep: str = "") -> Reading:
        """Options for reading a file of a platform, by its name or file.

        Args:
            keep: names of columns to copy, with commas between them.
        """
        from gough.files import LogFormat, Reading

        form = vars(self).copy()
        rows = {name: form.pop(name) for name in ("keep_bad_rows", "ignore_platform", "block_rows")}
        names = tuple(name.strip() for name in keep.split(",") if name.strip())
        return Reading(names, log=LogFormat.of(platform, **form), **rows)


FileOptions = OmitArgPrefixes[ReadingOptions]

"""C99 for one machine: header, source, example, test and what builds them."""

from __future__ import annotations

import gough
from gough.export import vectors
from gough.export.precision import Precision, precision
from gough.export.tables import MAX_STEPS, START_COUNT, constant_lines
from gough.export.template import LICENCE, as_prefix, check_prefix, comment_text, fill
from gough.platform import Platform
from gough.status import Event, Status

# those that take neither a proof nor a search
STATUSES = tuple(s for s in Status if s not in (Status.CERTIFIED, Status.AMBIGUOUS))
TEMPLATES = ("hexapod.h", "hexapod.c", "hexapod_example.c", "hexapod_test.c")
READINGS = {
    "telescopic": "leg lengths [{unit}]",
    "length_change": "leg lengths minus those at home [{unit}]",
    "rotary": "motor angles [rad]",
}


def c_files(platform: Platform, prefix: str | None = None, real: str = "double") -> dict[str, str]:
    """The files of `gough export c`: text by file name.

    Args:
        prefix: begins every C name and file name; made from the platform's name unless given.
        real: "double" or "float", the type of all numbers.

    Raises:
        GoughError: a prefix that is no C name, or another type.
    """
    kind = precision(real)
    prefix = as_prefix(platform.name) if prefix is None else check_prefix(prefix)
    places = places_of(platform, prefix, kind) | vectors.lines(platform, kind)
    names = [*TEMPLATES, "CMakeLists.txt", "README.md"]
    return {name.replace("hexapod", prefix, 1): fill(name, prefix, places) for name in names}


def places_of(platform: Platform, prefix: str, kind: Precision) -> dict[str, str]:
    """Text for the marked places of the templates."""
    unit = comment_text(platform.unit) or "platform unit"
    pivot = ", ".join(f"{value:g}" for value in platform.pivot_point)
    return {
        "facts": _facts(platform, unit),
        "license": LICENCE,
        "version": gough.__version__,
        "digest": platform.digest,
        "platform": comment_text(platform.name),
        "unit": unit,
        "real": kind.real,
        "suffix": kind.suffix,
        "home_readings": " ".join(f"{reading:.6g}" for reading in platform.home_legs),
        "reading": READINGS[platform.legs].format(unit=unit),
        "pivot": f"({pivot})",
        "max_steps": str(MAX_STEPS),
        "starts": str(START_COUNT),
        "status": _members(STATUSES, prefix),
        "event": _members(tuple(Event), prefix),
        "status_labels": ", ".join(f'"{status.label}"' for status in Status),
        "event_labels": ", ".join(f'"{event.label}"' for event in Event),
        "constants": constant_lines(platform, kind),
    }


def _facts(platform: Platform, unit: str) -> str:
    rows = {
        "Platform": comment_text(platform.name),
        "Readings": READINGS[platform.legs].format(unit=unit),
        "Digest": platform.digest,
        "Written by": f"gough {gough.__version__}; do not edit",
    }
    return "\n".join(f"{key + ':':12}{value}" for key, value in rows.items())


def _members(members: tuple, prefix: str) -> str:
    return ",\n".join(f"    {prefix.upper()}_{member.name} = {int(member)}" for member in members)

"""Kinematics for LinuxCNC: one .comp file for its halcompile."""

from __future__ import annotations

import re
from dataclasses import replace

from gough.export.c import places_of
from gough.export.precision import precision
from gough.export.template import LICENCE, as_prefix, check_prefix, fill
from gough.platform import Platform
from gough.units import in_unit

LAST_SECTION = "/* ---- velocities "  # and what follows is for other controllers


def linuxcnc_files(
    platform: Platform, prefix: str | None = None, unit: str = "mm"
) -> dict[str, str]:
    """The file of `gough export c --linuxcnc`: text by file name.

    The workspace is left out: LinuxCNC has its own limits, and a pose outside the box must not
    stop its position display. A pose across a singularity from home still fails.

    Args:
        prefix: the component is called PREFIXkins; made from the platform's name unless given.
        unit: "mm" or "inch", which all lengths are converted to.

    Raises:
        GoughError: a prefix that is no C name, or a platform whose unit is not in `units.LENGTHS`.
    """
    prefix = as_prefix(platform.name) if prefix is None else check_prefix(prefix)
    machine = replace(in_unit(platform, unit), workspace=None)
    places = places_of(machine, prefix, precision("double"))
    rotary = platform.rotary is not None
    places |= {
        "digest": platform.digest,
        "joints": "angles [deg]" if rotary else f"lengths [{unit}]",
        "joint_unit": "DEGREE" if rotary else "1",
        "license_comment": "/* " + LICENCE.replace("\n", "\n * ") + " */",
    }
    header, source = (_code(fill(f"hexapod.{e}", prefix, places)) for e in "hc")
    places["source"] = f"{header}\n\n{source[: source.index(LAST_SECTION)]}".strip()
    return {f"{prefix}kins.comp": fill("hexapodkins.comp", prefix, places)}


def _code(text: str) -> str:
    """A filled template without its first comment, and without what joins it to its header."""
    text = text[text.index("*/") + 2 :]
    return re.sub(r'#include "\w+\.h"\n', "", text).strip()

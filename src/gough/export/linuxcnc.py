"""Kinematics for LinuxCNC: one .comp file for its halcompile."""

from __future__ import annotations

import re
from dataclasses import replace

from gough.errors import GoughError
from gough.export.c import places_of
from gough.export.precision import precision
from gough.export.template import LICENCE, as_prefix, check_prefix, fill
from gough.platform import Platform
from gough.pose import Pose

MILLIMETRES = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1e3, "in": 25.4, "inch": 25.4, "ft": 304.8}
LAST_SECTION = "/* ---- velocities "  # and what follows is for other controllers


def linuxcnc_files(
    platform: Platform, prefix: str | None = None, unit: str = "mm"
) -> dict[str, str]:
    """The file of `gough export c --linuxcnc`: text by file name.

    The workspace is left out: LinuxCNC has limits of its own, and a pose outside the box must not
    stop its position display. A pose across a singularity from home still fails.

    Args:
        prefix: the component is called PREFIXkins; made from the platform's name unless given.
        unit: "mm" or "inch", which all lengths are converted to.

    Raises:
        GoughError: a prefix that is no C name, or a platform whose unit is not in `MILLIMETRES`.
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


def in_unit(platform: Platform, unit: str) -> Platform:
    """The same machine with its lengths in another unit.

    Raises:
        GoughError: the platform's unit is not one of `MILLIMETRES`.
    """
    if platform.unit not in MILLIMETRES:
        raise GoughError(
            f"unit: cannot convert {platform.unit!r} to {unit}; the platform file must say one of "
            f"{', '.join(MILLIMETRES)}"
        )
    factor = MILLIMETRES[platform.unit] / MILLIMETRES[unit]
    arms, box, stroke = platform.rotary, platform.workspace, platform.stroke
    if arms is not None:
        arms = replace(
            arms, arm_length=factor * arms.arm_length, rod_length=factor * arms.rod_length
        )
    elif stroke is not None:
        stroke = factor * stroke
    return replace(
        platform,
        base=factor * platform.base,
        moving=factor * platform.moving,
        home=Pose(factor * platform.home.position, platform.home.wxyz),
        pivot=None if platform.pivot is None else factor * platform.pivot,
        unit=unit,
        stroke=stroke,
        offset=platform.offset if arms is not None else factor * platform.offset,
        workspace=None if box is None else replace(box, translation=factor * box.translation),
        rotary=arms,
        frames=platform.frames and platform.frames.scaled(factor),
    )

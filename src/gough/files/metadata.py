"""The platform that a Parquet file belongs to, in the file's metadata."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

import gough
from gough.errors import InputError
from gough.platform import Platform


def geometry_digest(platform: Platform) -> str:
    """SHA-256 of what relates readings to poses: joints, unit, kind of leg, pivot, motor arms.

    `Platform.digest` also covers stroke, workspace and home. A file of readings stays valid when
    those are edited, except that home is the zero of length changes.
    """
    facts = platform.to_dict()
    for key in ("name", "stroke", "workspace"):
        facts.pop(key, None)
    if platform.legs != "length_change":
        facts.pop("home")
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def describe(platform: Platform) -> dict[str, str]:
    """Metadata for a file of this platform's readings or poses."""
    return {
        "gough.platform": platform.name,
        "gough.unit": platform.unit,
        "gough.digest": platform.digest,
        "gough.geometry": geometry_digest(platform),
        "gough.version": gough.__version__,
    }


def check_same(metadata: Mapping[str, str], platform: Platform) -> None:
    """Raise if a file was written for another platform; a file that names none passes.

    Raises:
        InputError: another unit or another geometry.
    """
    unit, name = metadata.get("gough.unit"), metadata.get("gough.platform")
    override = "pass that platform with -p, or --ignore-platform to take the numbers as they are"
    if unit is not None and unit != platform.unit:
        raise InputError(
            f"its lengths are in [{unit}] (platform {name!r}), those of platform "
            f"{platform.name!r} in [{platform.unit}]; {override}"
        )
    geometry = metadata.get("gough.geometry")
    if geometry is not None and geometry != geometry_digest(platform):
        whose = f"platform {name!r}" if name != platform.name else "another geometry"
        raise InputError(
            f"was written for {whose}, not for {platform.name!r} as it is now; {override}"
        )

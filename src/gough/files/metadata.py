"""The platform and the frame that a Parquet file belongs to, in the file's metadata."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

import gough
from gough.errors import InputError
from gough.frames import FramePose
from gough.platform import Platform

FRAME, FRAME_DIGEST = "gough.frame", "gough.frame_digest"


def geometry_digest(platform: Platform) -> str:
    """SHA-256 of what relates readings to poses: joints, unit, kind of leg, pivot, motor arms.

    `Platform.digest` also covers stroke, workspace and home. A file of readings stays valid when
    those are edited, except that home is the zero of length changes.
    """
    facts = platform.to_dict()
    for key in ("name", "stroke", "workspace", "frames"):
        facts.pop(key, None)
    if platform.legs != "length_change":
        facts.pop("home")
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def describe(platform: Platform, frame: str | None = None) -> dict[str, str]:
    """Metadata for a file of this platform's readings or poses.

    Args:
        frame: whose poses the file holds, such as "tool in work"; the platform's unless given.
    """
    stated = {} if frame is None else {FRAME: frame, FRAME_DIGEST: platform.frame(frame).digest}
    return stated | {
        "gough.platform": platform.name,
        "gough.unit": platform.unit,
        "gough.digest": platform.digest,
        "gough.geometry": geometry_digest(platform),
        "gough.version": gough.__version__,
    }


def pose_frame(
    metadata: Mapping[str, str], platform: Platform, frame: str | None
) -> FramePose | None:
    """The frame whose poses a file holds, None for those of the platform.

    Args:
        frame: as the user states it; the one that the file states unless given.

    Raises:
        InputError: the file states another frame, or one that was elsewhere when it was written.
        GoughError: no such frame.
    """
    stated = metadata.get(FRAME)
    if stated is not None and frame not in (None, stated):
        raise InputError(f"its poses are those of {stated!r}, not of {frame!r}")
    name = frame or stated
    if name is None:
        return None
    found = platform.frame(name)
    if stated is not None and metadata.get(FRAME_DIGEST) != found.digest:
        raise InputError(
            f"its poses are those of {name!r} as it was when the file was written; the platform's "
            "file states other [frames] now"
        )
    return found


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

"""Platforms as TOML text: read, written, and the catalog of known machines."""

from __future__ import annotations

import json
import logging
import tomllib
from difflib import get_close_matches
from importlib import resources
from pathlib import Path

import numpy as np

from gough import quaternion
from gough.checks import platform_field, platform_numbers
from gough.errors import GoughError, PlatformError, suggestion
from gough.frames import Frames
from gough.kinematics import home_sign, singularity_distance
from gough.machine_limits import KEYS, MachineLimits, known_keys
from gough.platform import Platform
from gough.pose import Pose
from gough.rotary import RotaryArms
from gough.screws import Screws
from gough.whole_file import write_whole
from gough.workspace import Workspace

log = logging.getLogger("gough")
REQUIRED = ("base", "moving", "home")
PLAIN = ("name", "unit", "legs", "stroke", "pivot", "offset", "gain")
ANGLE_UNITS = {"rad": 1.0, "deg": np.pi / 180}
OPTIONAL = (*PLAIN, "angle_unit", "workspace", "rotary", "screw", "frames", "limits", "readings")
POSE = ("position", "wxyz", "euler_deg", "order")
TABLES = {
    "home": POSE,
    "workspace": ("translation", "rotation_deg"),
    "rotary": ("arm_length", "rod_length", "axis_x", "axis_y", "branch"),
    "screw": ("lead", "base_axis", "moving_axis"),
    "limits": KEYS,
}


def catalog_names() -> list[str]:
    """Names of the machines that come with the package, sorted."""
    files = resources.files("gough").joinpath("catalog").iterdir()
    return sorted(f.name.removesuffix(".toml") for f in files if f.name.endswith(".toml"))


def catalog_text(name: str) -> str:
    """Text of a catalog machine's TOML file, with its comments.

    Raises:
        PlatformError: no such machine; the text lists those there are.
    """
    names = catalog_names()
    if name not in names:
        raise PlatformError(
            f"no platform is called {name!r}{suggestion(name, names)} the catalog has "
            f"{', '.join(names)}. "
            "The path of a platform of your own must end in .toml"
        )
    return resources.files("gough").joinpath("catalog", f"{name}.toml").read_text("utf-8")


def load(name_or_path: str | Path) -> Platform:
    """Load a platform; see `Platform.load`."""
    text_name = str(name_or_path)
    if not text_name.endswith(".toml"):
        return _warned(text_name, from_toml(catalog_text(text_name), where=text_name))
    path = Path(name_or_path)
    try:
        text = path.read_text("utf-8")
    except UnicodeDecodeError:
        raise PlatformError(f"{path}: not a text file; expected TOML") from None
    except OSError as error:
        raise PlatformError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:  # a NUL in the path
        raise PlatformError(f"{text_name!r}: cannot be read: {error}") from None
    return _warned(str(path), from_toml(text, where=str(path)))


def _warned(where: str, platform: Platform) -> Platform:
    """Return the platform, after a warning if its home is singular."""
    if not home_sign(platform):
        distance = singularity_distance(platform, platform.home)
        log.warning(
            "%s: the home pose is singular (distance %.1g): the legs do not hold the platform "
            "there, and the sign of det J cannot tell assembly modes apart, so every row is "
            "compared with all its modes, which is slow; choose another home", where, distance,
        )  # fmt: skip
    return platform


def from_toml(text: str, where: str = "platform") -> Platform:
    """Make a platform from TOML text; errors begin with `where`."""
    try:
        return from_dict(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise PlatformError(f"{where}: not valid TOML: {error}") from None
    except GoughError as error:
        raise PlatformError(f"{where}: {error}") from None
    except RecursionError:
        raise PlatformError(f"{where}: lists are nested too deeply for a platform") from None
    except ValueError as error:  # an integer of thousands of digits
        raise PlatformError(f"{where}: {error}") from None


def to_toml(platform: Platform) -> str:
    """Write a platform as TOML text; see `Platform.to_toml`."""
    facts = platform.to_dict()
    top = {k: v for k, v in facts.items() if not isinstance(v, dict)}
    lines = [f"{key} = {_value(value)}" for key, value in top.items()]
    for name, table in facts.items():
        if isinstance(table, dict):
            lines += ["", f"[{name}]", *(f"{k} = {_value(v)}" for k, v in table.items())]
    return "\n".join(lines) + "\n"


def save(platform: Platform, path: str | Path) -> None:
    """Write a platform's TOML file; see `Platform.save`."""
    try:
        write_whole(path, to_toml(platform).encode())
    except GoughError as error:
        raise PlatformError(str(error)) from None


def from_dict(facts: dict) -> Platform:
    """Make a platform from the tables of its TOML file.

    Raises:
        PlatformError: a field that is missing, unknown or wrong.
    """
    for key in REQUIRED:
        if key not in facts:
            what = "a [home] table" if key == "home" else "six rows [x, y, z]"
            near = get_close_matches(key, set(facts) - {*REQUIRED, *OPTIONAL}, n=1)
            misspelt = f" (is {near[0]!r} meant as {key}?)" if near else ""
            raise PlatformError(f"{key}: missing{misspelt}; expected {what}")
    known_keys("", facts, REQUIRED + OPTIONAL)
    for name, keys in TABLES.items():
        if name in facts:
            if not isinstance(facts[name], dict):
                raise PlatformError(
                    f"{name}: expected a table with {', '.join(keys)}; found {facts[name]!r}"
                )
            known_keys(f"{name}.", facts[name], keys)
    options = {k: facts[k] for k in PLAIN if k in facts} | _in_radians(facts)
    return Platform(
        facts["base"],
        facts["moving"],
        _pose("home", facts["home"]),
        workspace=_table(Workspace, "workspace", facts),
        rotary=_table(RotaryArms, "rotary", facts),
        screw=_table(Screws, "screw", facts),
        frames=_frames(facts["frames"]) if "frames" in facts else None,
        limits=MachineLimits(**facts["limits"]) if "limits" in facts else None,
        **options,
    )


def _in_radians(facts: dict) -> dict:
    """Stroke and offset of motors in radians, where `angle_unit` states their unit."""
    unit = facts.get("angle_unit", "rad")
    if not isinstance(unit, str) or unit not in ANGLE_UNITS:
        raise PlatformError(f"angle_unit: expected 'deg' or 'rad', found {unit!r}")
    if "angle_unit" in facts and facts.get("legs") != "rotary":
        raise PlatformError("angle_unit: is for the stroke and offset of rotary legs only")
    given = [key for key in ("stroke", "offset") if key in facts and unit != "rad"]
    return {key: ANGLE_UNITS[unit] * platform_numbers(key, facts[key]) for key in given}


def _table(kind, name: str, facts: dict):
    """Make an instance of `kind` from the table `name`, all of whose keys must be there."""
    if name not in facts:
        return None
    missing = [k for k in TABLES[name] if k not in facts[name]]
    if missing:
        raise PlatformError(f"{name}.{missing[0]}: missing; see the catalog for an example")
    return kind(**facts[name])


def _frames(table: object) -> Frames:
    if not isinstance(table, dict):
        raise PlatformError(f"frames: expected a table of poses, found {table!r}")
    for key, pose in table.items():
        if not isinstance(pose, dict):
            raise PlatformError(
                f"frames.{key}: expected a pose such as {{position = [0, 0, 120], "
                f"euler_deg = [0, 0, 90]}}, found {pose!r}"
            )
        known_keys(f"frames.{key}.", pose, POSE)
    return Frames({key: _pose(f"frames.{key}", pose) for key, pose in table.items()})


def _pose(where: str, table: dict) -> Pose:
    """Pose of a table with position and wxyz, or euler_deg and the order of its axes."""
    if "position" not in table:
        raise PlatformError(f"{where}.position: missing; expected [x, y, z]")
    position = platform_field(f"{where}.position", table["position"], (3,))
    if "wxyz" in table and "euler_deg" in table:
        raise PlatformError(f"{where}: give wxyz or euler_deg, not both")
    if "order" in table and "euler_deg" not in table:
        raise PlatformError(f"{where}.order: states the axes of euler_deg, which is missing")
    try:
        if "euler_deg" in table:
            angles = platform_field(f"{where}.euler_deg", table["euler_deg"], (3,))
            if "order" not in table:
                return Pose.from_euler(position, np.radians(angles))
            wxyz = quaternion.from_axes(np.radians(angles), table["order"])
        else:
            wxyz = platform_field(f"{where}.wxyz", table.get("wxyz", [1, 0, 0, 0]), (4,))
        return Pose(position, wxyz)
    except PlatformError:
        raise
    except GoughError as error:
        raise PlatformError(f"{where}.{error}") from None


def _value(value: object) -> str:
    """Write one TOML value; rows of numbers one to a line."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n" + "".join(f"  {_value(row)},\n" for row in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k} = {_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(repr(float(v)) for v in value) + "]"
    return repr(value)

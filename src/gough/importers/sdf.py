"""Bodies and joints of an SDF file, read from its XML."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from gough.checks import Array
from gough.errors import GoughError
from gough.importers.bodies import FARTHEST, WORLD, Joint, Kind, Model
from gough.pose import Pose

KINDS: dict[str, Kind] = {
    "revolute": "hinge", "continuous": "hinge", "prismatic": "slide", "ball": "ball",
    "universal": "universal", "fixed": "fixed",
}  # fmt: skip
ENDLESS = 1e15  # limits above it are none


def read_sdf(path: str | Path) -> Model:
    """Bodies and joints of the one model of a file, in the file's configuration.

    Raises:
        GoughError: a file that cannot be read, is no SDF, or uses what is not read here.
    """
    try:
        text = Path(path).read_text("utf-8")
    except UnicodeDecodeError:
        raise GoughError(f"{path}: not a text file; expected SDF") from None
    except OSError as error:
        raise GoughError(f"{path}: cannot be read: {error.strerror}") from None
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise GoughError(f"{path}: declares entities, which SDF has no use for; remove them")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise GoughError(f"{path}: not valid XML: {error}") from None
    models = [m for m in root.iter("model") if m.find("link") is not None]
    if root.tag != "sdf" or len(models) != 1:
        found = f"a <{root.tag}> with {len(models)} models that have links"
        raise GoughError(f"{path}: expected an <sdf> with one model, found {found}")
    try:
        version = tuple(int(part) for part in root.get("version", "").split("."))
    except ValueError:
        raise GoughError(f"{path}: <sdf version>: expected such as 1.7") from None
    return _Reader(models[0], axes_in_model=version < (1, 5)).read()


class _Reader:
    """One model, in its own coordinates."""

    def __init__(self, model: ET.Element, axes_in_model: bool) -> None:
        self.model, self.axes_in_model = model, axes_in_model
        self.named = {
            e.get("name", ""): e for tag in ("link", "joint", "frame") for e in model.findall(tag)
        }
        self.placed: dict[str, Pose] = {"__model__": Pose.identity(), WORLD: Pose.identity()}

    def read(self) -> Model:
        bodies = {WORLD: Pose.identity()} | {
            link.get("name", ""): self._place(link.get("name", ""))
            for link in self.model.findall("link")
        }
        joints = [self._joint(joint) for joint in self.model.findall("joint")]
        for joint in joints:
            for body in (joint.parent, joint.child):
                if body not in bodies:
                    raise GoughError(f"joint {joint.name}: there is no link {body}")
        notes = ["Lengths: metres, as in all SDF.", "Home: the configuration of the file."]
        return Model(self.model.get("name") or "imported", bodies, joints, notes)

    def _place(self, name: str, above: tuple[str, ...] = ()) -> Pose:
        """Pose in the model of a link, joint or frame."""
        if name in self.placed:
            return self.placed[name]
        if name not in self.named or name in above:
            raise GoughError(f"poses: there is no frame {name!r}, or it hangs on itself")
        element, deeper = self.named[name], (*above, name)
        pose = element.find("pose")
        usual = element.findtext("child", "").strip() if element.tag == "joint" else "__model__"
        usual = element.get("attached_to") or usual
        relative = usual if pose is None else pose.get("relative_to") or usual
        values = _numbers(name, pose, 6)
        local = Pose.from_rpy(values[:3], values[3:])
        self.placed[name] = self._place(relative, deeper) @ local
        return self.placed[name]

    def _joint(self, element: ET.Element) -> Joint:
        name, kind = element.get("name", ""), element.get("type", "")
        if kind not in KINDS:
            raise GoughError(f"joint {name}: type {kind!r}; expected one of {', '.join(KINDS)}")
        parent, child = (element.findtext(tag, "").strip() for tag in ("parent", "child"))
        place = self._place(name)
        axes = [self._axis(name, place, axis) for axis in element.findall("axis")
                + element.findall("axis2")]  # fmt: skip
        if KINDS[kind] in ("hinge", "slide") and len(axes) != 1:
            raise GoughError(f"joint {name}: expected one <axis>, found {len(axes)}")
        limits = [-np.inf, np.inf]
        for k, end in enumerate(("lower", "upper")):
            found = element.find(f"axis/limit/{end}")
            value = limits[k] if found is None else float(_numbers(name, found, 1)[0])
            limits[k] = value if abs(value) < ENDLESS else limits[k]
        return Joint(
            name, KINDS[kind], parent, child, place.position,
            np.reshape(axes, (-1, 3)), limits=(limits[0], limits[1]),
        )  # fmt: skip

    def _axis(self, name: str, place: Pose, axis: ET.Element) -> Array:
        """Unit vector of an axis, in the model."""
        xyz = axis.find("xyz")
        direction = np.array([0.0, 0, 1]) if xyz is None else _numbers(name, xyz, 3)
        frame = place
        if xyz is not None and xyz.get("expressed_in"):
            frame = self._place(xyz.get("expressed_in", ""))
        flag = axis.findtext("use_parent_model_frame", "0").strip()
        if self.axes_in_model or flag in ("1", "true"):
            frame = Pose.identity()
        length = np.linalg.norm(direction)
        if not length > 0:
            raise GoughError(f"joint {name}: expected a direction, found three zeros")
        return frame.rotation @ (direction / length)


def _numbers(where: str, element: ET.Element | None, count: int) -> Array:
    """Numbers of an element, zeros where it is missing or empty."""
    text = "" if element is None else element.text or ""
    if not text.strip():
        return np.zeros(count)
    degrees = element is not None and element.get("degrees", "false") in ("1", "true")
    try:
        values = np.array(text.split(), float)
    except ValueError:
        raise GoughError(f"{where}: expected numbers, found {text.strip()!r}") from None
    if values.shape != (count,) or not np.all(np.abs(values) < FARTHEST):
        raise GoughError(f"{where}: expected {count} finite numbers, found {text.strip()!r}")
    if degrees:
        values[3:] = np.radians(values[3:])
    return values

"""Bodies and joints of an MJCF file, as MuJoCo compiles it."""

# MuJoCo ships no types.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gough.errors import GoughError
from gough.importers.bodies import FARTHEST, WORLD, Joint, Kind, Model
from gough.pose import Pose

CLOSED = 1e-6  # share of the model's extent by which a loop may be open


def read_mjcf(path: str | Path) -> Model:
    """Bodies and joints of a file, in its first keyframe if that closes all loops.

    Two joints of one body are joints with a body between them, and a tendon between two sites is
    a slide between two ball joints.

    Raises:
        GoughError: MuJoCo is not installed or refuses the file, or the loops are open.
    """
    try:
        import mujoco
    except ModuleNotFoundError:
        raise GoughError("reading MJCF needs MuJoCo; install it with: pip install mujoco") from None
    try:
        Path(path).read_bytes()
        model = mujoco.MjModel.from_xml_path(str(path))
    except OSError as error:
        raise GoughError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise GoughError(f"{path}: MuJoCo refuses it: {error}") from None
    return _Reader(mujoco, model).read()


class _Reader:
    """A compiled model at home."""

    def __init__(self, mujoco: Any, model: Any) -> None:
        self.mujoco, self.model, self.data = mujoco, model, mujoco.MjData(model)
        self.bodies = {WORLD: Pose.identity()}
        self.joints: list[Joint] = []
        self.names = [model.body(k).name or f"body {k}" for k in range(model.nbody)]
        self.names[0] = WORLD

    def read(self) -> Model:
        notes = ["Lengths: metres, as in MuJoCo's own units.", self._go_home()]
        for body in range(1, self.model.nbody):
            self._add_body(body)
        for k in range(self.model.neq):
            self._add_equality(k)
        for k in range(self.model.ntendon):
            self._add_tendon(k)
        name = self._text_at(0)
        return Model(name or "imported", self.bodies, self.joints, notes, self._pivot())

    def _text_at(self, at: int) -> str:
        """The text in the model's names that begins at a byte; the first is the model's."""
        return bytes(self.model.names[at:]).split(b"\0", 1)[0].decode("utf-8", "replace")

    def _go_home(self) -> str:
        """Take the first keyframe, or else the configuration of the file; say which."""
        for key in range(min(self.model.nkey, 1)):
            self.mujoco.mj_resetDataKeyframe(self.model, self.data, key)
            self.mujoco.mj_kinematics(self.model, self.data)
            if self._is_finite() and self._open() <= CLOSED * self.model.stat.extent:
                return f"Home: keyframe {self.model.key(key).name or key}."
        self.mujoco.mj_resetData(self.model, self.data)
        self.mujoco.mj_kinematics(self.model, self.data)
        if not self._is_finite():
            raise GoughError("positions: expected finite numbers in the configuration of the file")
        gap = self._open()
        if gap > CLOSED * self.model.stat.extent:
            raise GoughError(
                f"the loops are open by {gap:.3g} m in the configuration of the file; expected a "
                "first keyframe, or a configuration, in which the legs meet the platform"
            )
        return "Home: the configuration of the file."

    def _is_finite(self) -> bool:
        data = self.data
        places = data.xpos, data.xquat, data.xanchor, data.xaxis, data.site_xpos, data.qpos
        return all(np.all(np.abs(array) < FARTHEST) for array in places)

    def _ends(self, k: int) -> tuple[int, int, Any, Any]:
        """The two bodies of an equality constraint, and its point in the world seen from each."""
        model, data = self.model, self.data
        first, second = int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
        if int(model.eq_objtype[k]) == self.mujoco.mjtObj.mjOBJ_SITE:
            a, b = (int(model.site_bodyid[site]) for site in (first, second))
            return a, b, data.site_xpos[first].copy(), data.site_xpos[second].copy()
        anchors = model.eq_data[k, :6].reshape(2, 3)
        here, there = (
            data.xpos[body] + data.xmat[body].reshape(3, 3) @ anchor
            for body, anchor in zip((first, second), anchors, strict=True)
        )
        return first, second, here, there

    def _open(self) -> float:
        """Largest gap of the point constraints [m]."""
        gaps = [0.0]
        for k in range(self.model.neq):
            if int(self.model.eq_type[k]) == self.mujoco.mjtEq.mjEQ_CONNECT:
                _, _, a, b = self._ends(k)
                gaps.append(float(np.linalg.norm(a - b)))
        return max(gaps)

    def _add_body(self, body: int) -> None:
        model, data, kinds = self.model, self.data, self.mujoco.mjtJoint
        name, parent = self.names[body], self.names[model.body_parentid[body]]
        pose = Pose(data.xpos[body].copy(), data.xquat[body].copy())
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        self.bodies[name] = pose
        if not count:
            self.joints.append(Joint(f"{name} on {parent}", "fixed", parent, name, pose.position))
        for k in range(first, first + count):
            kind = int(model.jnt_type[k])
            if kind == kinds.mjJNT_FREE:
                continue
            child = name if k == first + count - 1 else f"{name}, joint {k - first + 1}"
            self.bodies.setdefault(child, pose)
            point = data.xanchor[k].copy()
            label = model.joint(k).name or f"joint {k - first + 1} of {name}"
            if kind == kinds.mjJNT_BALL:
                self.joints.append(Joint(label, "ball", parent, child, point))
            else:
                made: Kind = "slide" if kind == kinds.mjJNT_SLIDE else "hinge"
                position = float(data.qpos[model.jnt_qposadr[k]])
                limited, limits = bool(model.jnt_limited[k]), model.jnt_range[k]
                drive = self._drive(self.mujoco.mjtTrn.mjTRN_JOINT, k, limited, limits)
                axes = data.xaxis[k].copy()[None]
                self.joints.append(
                    Joint(label, made, parent, child, point, axes, position, **drive)
                )
            parent = child

    def _drive(self, kind: Any, index: int, limited: bool, limits: Any) -> dict[str, Any]:
        """Gain, limits and rank of the actuator of a joint or tendon, in units of its reading."""
        model = self.model
        found = [
            k for k in range(model.nu)
            if int(model.actuator_trntype[k]) == kind and model.actuator_trnid[k, 0] == index
        ]  # fmt: skip
        gain, rank = 1.0, None
        if found:
            rank = found[0]
            gear = float(model.actuator_gear[rank, 0])
            if gear == 0:
                raise GoughError(f"actuator {model.actuator(rank).name}: its gear is 0")
            gain = 1 / gear
            servo = float(model.actuator_biasprm[rank, 1]) < 0  # controls are readings
            if servo and model.actuator_ctrllimited[rank]:
                low, high = model.actuator_ctrlrange[rank]
                return {"gain": gain, "rank": rank, "limits": (float(low), float(high))}
        low, high = sorted(np.asarray(limits, float) / gain) if limited else (-np.inf, np.inf)
        return {"gain": gain, "rank": rank, "limits": (float(low), float(high))}

    def _add_equality(self, k: int) -> None:
        kinds, kind = self.mujoco.mjtEq, int(self.model.eq_type[k])
        if kind not in (int(kinds.mjEQ_CONNECT), int(kinds.mjEQ_WELD)):
            return
        first, second, point, _ = self._ends(k)
        made: Kind = "ball" if kind == kinds.mjEQ_CONNECT else "fixed"
        label = self.model.equality(k).name or f"constraint {k + 1}"
        self.joints.append(Joint(label, made, self.names[first], self.names[second], point))

    def _add_tendon(self, k: int) -> None:
        """Add a tendon between two sites as a slide between two ball joints."""
        model, data = self.model, self.data
        first, count = int(model.tendon_adr[k]), int(model.tendon_num[k])
        wraps = range(first, first + count)
        site = self.mujoco.mjtWrap.mjWRAP_SITE
        if count != 2 or any(int(model.wrap_type[w]) != site for w in wraps):
            return
        sites = [int(model.wrap_objid[w]) for w in wraps]
        ends = [data.site_xpos[s].copy() for s in sites]
        bodies = [self.names[model.site_bodyid[s]] for s in sites]
        name, way = model.tendon(k).name or f"tendon {k + 1}", ends[1] - ends[0]
        length = float(np.linalg.norm(way))
        if length == 0:
            return
        halves = [f"{name}, half {half}" for half in (1, 2)]
        self.bodies |= dict.fromkeys(halves, Pose.identity())
        limited, limits = bool(model.tendon_limited[k]), model.tendon_range[k]
        drive = self._drive(self.mujoco.mjtTrn.mjTRN_TENDON, k, limited, limits)
        axes = (way / length)[None]
        self.joints += [
            Joint(f"{name}, end 1", "ball", bodies[0], halves[0], ends[0]),
            Joint(name, "slide", halves[0], halves[1], ends[0], axes, length, **drive),
            Joint(f"{name}, end 2", "ball", halves[1], bodies[1], ends[1]),
        ]

    def _pivot(self) -> Any:
        """What a sensor called position refers to, as in gough's own exports; None for zero."""
        model = self.model
        for k in range(model.nsensor):
            seen_from_site = int(model.sensor_reftype[k]) == self.mujoco.mjtObj.mjOBJ_SITE
            if seen_from_site and model.sensor(k).name == "position":
                point = self.data.site_xpos[model.sensor_refid[k]].copy()
                return point if np.any(point != 0) else None
        return None

"""MJCF: a platform as a model of MuJoCo, with its six loops closed by constraints.

Each leg is a chain with its own joints, whose rod a point constraint ties to the platform:

    telescopic, length change   base - two hinges - cylinder - driven slide - rod
    rotary                      base - driven hinge - arm - two hinges - rod

The two hinges are a universal joint, about axes at right angles to the leg at home. The platform
is a free body whose frame is at the pivot. A driven joint counts from where the leg's sensor reads
0 (`Platform.true_at_zero`), and its actuator has a gear of 1 / gain: so controls, sensors and the
keyframe are readings as the platform's file has them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

import gough
from gough.checks import Array
from gough.export.template import comment_text
from gough.kinematics import (
    equivalent_struts,
    joint_positions,
    normalised_jacobian,
    strut_vectors,
)
from gough.platform import Platform
from gough.struts import arm_directions, rods_and_rates
from gough.units import LENGTHS, in_unit

TIMESTEP = 0.002  # [s]
FASTEST = 0.3 / TIMESTEP  # [rad/s] of the servos' oscillations, which the steps must resolve
PLATFORM_MASS, PART_MASS = 1.0, 0.02  # [kg] of the platform, and of each part of a leg
STIFFEST = 0.9999, 0.9999  # impedance of constraints: the largest that MuJoCo takes
LEG_RADIUS = 0.01  # of legs as drawn, as a share of the size


def to_mjcf(platform: Platform, gravity: bool = False) -> str:
    """Model of a platform at home for MuJoCo, the text of an XML file.

    Lengths are in metres where the platform's unit is known, and as they are where it is not.

    Args:
        gravity: with weight, by which the legs' servos sag as springs do. Without it the steady
            state is the pose of the commanded readings.

    Returns:
        A model with actuators leg1 to leg6, whose controls are readings [m] or [rad]; sensors
        leg1 to leg6 (readings), position and wxyz (the pose); and the keyframe home.

    Example:
        >>> import gough
        >>> from gough.export.mjcf import to_mjcf
        >>> to_mjcf(gough.Platform.load("reference")).splitlines()[0]
        '<mujoco model="reference">'
    """
    machine = in_unit(platform, "m") if platform.unit in LENGTHS else platform
    root = ET.Element("mujoco", model=comment_text(platform.name))
    root.append(ET.Comment(_facts(platform, machine)))
    _add_settings(root, machine, gravity)
    world = _add(root, "worldbody")
    stiffness, damping = _servos(machine)
    _add_base(world, machine)
    _add_legs(world, machine, damping)
    _add_platform(world, machine)
    _add_loops(root, machine)
    _add_drives(root, machine, stiffness, damping)
    _add_home(root, machine)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


LEGS = [f"leg{number}" for number in range(1, 7)]


def _facts(platform: Platform, machine: Platform) -> str:
    unit = (
        f"metres (the platform's file: {platform.unit})" if machine is not platform else "as given"
    )
    return (
        f" Written by gough {gough.__version__} from a platform with digest {platform.digest}. "
        f"Lengths: {unit}. Masses, stiffness and damping are not the machine's: put its own in. "
    ).replace("--", "- -")  # which a comment of XML must not hold


def _add_settings(root: ET.Element, machine: Platform, gravity: bool) -> None:
    """Steps, camera and light; bodies as they are drawn, which touch nothing; stiff loops."""
    _add(root, "compiler", angle="radian")
    down = [0, 0, -9.81 if gravity else 0]
    _add(root, "option", timestep=TIMESTEP, integrator="implicitfast", gravity=down)
    points = np.concatenate([machine.base, joint_positions(machine, machine.home)])
    _add(root, "statistic", center=points.mean(axis=0), extent=1.2 * machine.size)
    default = _add(root, "default")
    _add(default, "geom", type="capsule", contype="0", conaffinity="0", rgba=[0.45, 0.5, 0.58, 1])
    _add(default, "equality", solref=[2 * TIMESTEP, 1], solimp=[*STIFFEST, 0.001, 0.5, 2])
    sky = {"type": "skybox", "builtin": "flat", "rgb1": [1, 1, 1], "width": "16", "height": "16"}
    _add(_add(root, "asset"), "texture", **sky)


def _servos(machine: Platform) -> tuple[Array, Array]:
    """Stiffness and damping of the six servos, each (6,), force or torque per unit of reading.

    With k and c along each strut and the platform's mass m, taken at the joints' radius, a mode
    of singular value s of the Jacobian without units swings at s sqrt(k / m). The fastest may be
    `FASTEST`. The slowest decays by s^2 c / 2 m, overdamped ones by k / c: the two agree at
    c = sqrt(2 k m) / s. A reading moves the strut by lever_i, so its servo has lever_i^2 k.
    """
    rods, rates = rods_and_rates(strut_vectors(machine, machine.home), machine.gain, machine.rotary)
    squared_lever = (rates / np.linalg.norm(rods, axis=-1)) ** 2
    values = np.linalg.svd(normalised_jacobian(machine, machine.home), compute_uv=False)
    k = PLATFORM_MASS * (FASTEST / values[0]) ** 2
    c = np.sqrt(2 * k * PLATFORM_MASS) / values[-1]
    return squared_lever * k, squared_lever * c


def _add_base(world: ET.Element, machine: Platform) -> None:
    radius = LEG_RADIUS * machine.size
    _add(world, "light", directional="true", dir=[0.3, 0.4, -1], diffuse=[0.6, 0.6, 0.6])
    _add(world, "site", name="zero", pos=machine.pivot_point, rgba=[0, 0, 0, 0])
    for a, b in _edges(machine.base):
        _add(world, "geom", size=[radius], fromto=[*a, *b])


def _add_legs(world: ET.Element, machine: Platform, damping: Array) -> None:
    tips, lengths = equivalent_struts(machine, machine.home_legs)
    rods = joint_positions(machine, machine.home) - tips
    travel = machine.gain * machine.home_legs  # of the driven joints at home
    # MuJoCo finds the forces of constraints without the damping of servos, which its steps take
    # implicitly; a joint lighter than damping times step then makes the loop unstable.
    armature = TIMESTEP * damping / machine.gain**2
    driven = [{"ref": q, "armature": m} for q, m in zip(travel, armature, strict=True)]
    for i, name in enumerate(LEGS):
        if machine.rotary is not None:
            arms = machine.rotary
            along, across = arm_directions(arms, travel + machine.true_at_zero)
            axes = np.stack([along[i], across[i], np.cross(along[i], across[i])])
            arm = _add(world, "body", name=f"{name}_arm", pos=machine.base[i], xyaxes=axes[:2])
            _add(arm, "joint", name=name, type="hinge", axis=[0, 0, 1], **driven[i])
            _add_bar(arm, machine, [arms.arm_length[i], 0, 0])
            place = {"pos": [arms.arm_length[i], 0, 0], "zaxis": axes @ rods[i]}
            _add_bar(_add_universal(arm, f"{name}_rod", place), machine, [0, 0, lengths[i]])
        else:
            place = {"pos": machine.base[i], "zaxis": rods[i]}
            cylinder = _add_universal(world, f"{name}_cylinder", place)
            _add_bar(cylinder, machine, [0, 0, 0.5 * lengths[i]], 1.6)
            rod = _add(cylinder, "body", name=f"{name}_rod")
            _add(rod, "joint", name=name, type="slide", axis=[0, 0, 1], **driven[i])
            _add_bar(rod, machine, [0, 0, lengths[i]])


def _add_universal(parent: ET.Element, name: str, place: dict[str, Any]) -> ET.Element:
    body = _add(parent, "body", name=name, **place)
    for axis in ([1, 0, 0], [0, 1, 0]):
        _add(body, "joint", type="hinge", axis=axis)
    return body


def _add_bar(body: ET.Element, machine: Platform, end: list, width: float = 1.0) -> None:
    radius = width * LEG_RADIUS * machine.size
    _add(body, "geom", size=[radius], mass=PART_MASS, fromto=[0, 0, 0, *end])


def _add_platform(world: ET.Element, machine: Platform) -> None:
    position = machine.home.position + machine.pivot_point
    body = _add(world, "body", name="platform", pos=position, quat=machine.home.wxyz)
    _add(body, "freejoint", name="platform")
    _add(body, "site", name="pose", rgba=[0, 0, 0, 0])
    joints = machine.moving - machine.pivot_point
    edges = [
        (a, b) for a, b in zip(joints, np.roll(joints, -1, axis=0), strict=True) if any(a != b)
    ]
    for a, b in edges:
        edge = {"size": [1.6 * LEG_RADIUS * machine.size], "mass": PLATFORM_MASS / len(edges)}
        _add(body, "geom", **edge, fromto=[*a, *b], rgba=[0.85, 0.5, 0.2, 1])


def _edges(joints: Array) -> list[tuple[Array, Array]]:
    """Sides of the hexagon through six joints, without those of length 0."""
    pairs = zip(joints, np.roll(joints, -1, axis=0), strict=True)
    return [(a, b) for a, b in pairs if np.any(a != b)]


def _add_loops(root: ET.Element, machine: Platform) -> None:
    """Points that tie the upper ends of the rods to the platform."""
    loops = _add(root, "equality")
    lengths = equivalent_struts(machine, machine.home_legs)[1]
    for name, length in zip(LEGS, lengths, strict=True):
        _add(loops, "connect", body1=f"{name}_rod", body2="platform", anchor=[0, 0, length])


def _add_drives(root: ET.Element, machine: Platform, stiffness: Array, damping: Array) -> None:
    """Servos of the legs, and sensors of their readings and of the pose."""
    drives, sensors = _add(root, "actuator"), _add(root, "sensor")
    for i, name in enumerate(LEGS):
        servo = {"kp": stiffness[i], "kv": damping[i], "gear": 1 / machine.gain[i]}
        stroke = {} if machine.stroke is None else {"ctrlrange": machine.stroke[i]}
        _add(drives, "position", name=name, joint=name, **servo, **stroke)
        _add(sensors, "actuatorpos", name=name, actuator=name)
    pose = {"objtype": "site", "objname": "pose", "reftype": "site", "refname": "zero"}
    _add(sensors, "framepos", name="position", **pose)
    _add(sensors, "framequat", name="wxyz", **pose)


def _add_home(root: ET.Element, machine: Platform) -> None:
    travel = machine.gain * machine.home_legs
    chains = [[q, 0, 0] if machine.rotary is not None else [0, 0, q] for q in travel]
    pose = [*(machine.home.position + machine.pivot_point), *machine.home.wxyz]
    places = [value for chain in chains for value in chain] + pose
    _add(_add(root, "keyframe"), "key", name="home", qpos=places, ctrl=machine.home_legs)


def _add(parent: ET.Element, tag: str, **attributes: Any) -> ET.Element:
    """Add an element; numbers are written so that they are read as the same numbers."""
    texts = {
        key: value if isinstance(value, str) else _numbers(value)
        for key, value in attributes.items()
    }
    return ET.SubElement(parent, tag, texts)


def _numbers(value: Any) -> str:
    return " ".join(f"{number!r}" for number in np.ravel(value).astype(float).tolist())

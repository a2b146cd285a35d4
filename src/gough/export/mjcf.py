"""MJCF: a platform as a model of MuJoCo, with its six loops closed by constraints.

Bodies and joints are those of `gough.export.mechanism`; two hinges make a universal joint. A
driven joint counts from where the leg's sensor reads 0 (`Platform.true_at_zero`), and its actuator
has a gear of 1 / gain: so controls, sensors and the keyframe are readings as the platform's file
has them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from gough.checks import Array
from gough.export.mechanism import (
    BASE,
    LEGS,
    PLATFORM_MASS,
    Bar,
    Mechanism,
    facts,
    mechanism,
)
from gough.export.template import comment_text
from gough.export.xml import add, written
from gough.kinematics import joint_positions, normalised_jacobian, strut_vectors
from gough.platform import Platform
from gough.struts import rods_and_rates

TIMESTEP = 0.002  # [s]
FASTEST = 0.3 / TIMESTEP  # [rad/s] of the servos' oscillations, which the steps must resolve
STIFFEST = 0.9999, 0.9999  # impedance of constraints: the largest that MuJoCo takes
STEEL, ORANGE = [0.45, 0.5, 0.58, 1], [0.85, 0.5, 0.2, 1]  # of legs and base, of the platform


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
    model = mechanism(platform)
    root = ET.Element("mujoco", model=comment_text(platform.name))
    _add_settings(root, model.machine, gravity)
    stiffness, damping = _servos(model.machine)
    _add_bodies(root, model, damping)
    _add_loops(root, model)
    _add_drives(root, model.machine, stiffness, damping)
    _add_home(root, model)
    no_facts = "Masses, stiffness and damping are not the machine's: put its own in."
    return written(root, f"{facts(platform)} {no_facts}")


def _add_settings(root: ET.Element, machine: Platform, gravity: bool) -> None:
    """Steps, camera and light; bodies as they are drawn, which touch nothing; stiff loops."""
    add(root, "compiler", angle="radian")
    down = [0, 0, -9.81 if gravity else 0]
    add(root, "option", timestep=TIMESTEP, integrator="implicitfast", gravity=down)
    points = np.concatenate([machine.base, joint_positions(machine, machine.home)])
    add(root, "statistic", center=points.mean(axis=0), extent=1.2 * machine.size)
    default = add(root, "default")
    add(default, "geom", type="capsule", contype="0", conaffinity="0", rgba=STEEL)
    add(default, "equality", solref=[2 * TIMESTEP, 1], solimp=[*STIFFEST, 0.001, 0.5, 2])
    sky = {"type": "skybox", "builtin": "flat", "rgb1": [1, 1, 1], "width": "16", "height": "16"}
    add(add(root, "asset"), "texture", **sky)


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


def _add_bodies(root: ET.Element, model: Mechanism, damping: Array) -> None:
    world = add(root, "worldbody")
    add(world, "light", directional="true", dir=[0.3, 0.4, -1], diffuse=[0.6, 0.6, 0.6])
    add(world, "site", name="zero", pos=model.machine.pivot_point, rgba=[0, 0, 0, 0])
    _add_bars(world, model.base)
    # MuJoCo finds the forces of constraints without the damping of servos, which its steps take
    # implicitly; a joint lighter than damping times step then makes the loop unstable.
    armature = TIMESTEP * damping / model.machine.gain**2
    elements = {BASE: world}
    for body in model.bodies:
        place = {"name": body.name, "pos": body.pose.position, "quat": body.pose.wxyz}
        element = elements[body.name] = add(elements[body.parent], "body", **place)
        if body.leg is not None:
            driven = {"ref": model.travel[body.leg], "armature": armature[body.leg]}
            add(element, "joint", name=LEGS[body.leg], type=body.joint, axis=[0, 0, 1], **driven)
        elif body.joint == "universal":
            add(element, "joint", type="hinge", axis=[1, 0, 0])
            add(element, "joint", type="hinge", axis=[0, 1, 0])
        else:
            add(element, "freejoint", name=body.name)
            add(element, "site", name="pose", rgba=[0, 0, 0, 0])
        _add_bars(element, body.bars, {"rgba": ORANGE} if body.joint == "free" else {})


def _add_bars(element: ET.Element, bars: list[Bar], colour: dict | None = None) -> None:
    for bar in bars:
        ends = [*bar.start, *bar.end]
        add(element, "geom", size=[bar.radius], mass=bar.mass, fromto=ends, **(colour or {}))


def _add_loops(root: ET.Element, model: Mechanism) -> None:
    """Points that tie the upper ends of the rods to the platform."""
    loops = add(root, "equality")
    for rod, point, _ in model.loops:
        add(loops, "connect", body1=rod, body2="platform", anchor=point)


def _add_drives(root: ET.Element, machine: Platform, stiffness: Array, damping: Array) -> None:
    """Servos of the legs, and sensors of their readings and of the pose."""
    drives, sensors = add(root, "actuator"), add(root, "sensor")
    for i, name in enumerate(LEGS):
        servo = {"kp": stiffness[i], "kv": damping[i], "gear": 1 / machine.gain[i]}
        stroke = {} if machine.stroke is None else {"ctrlrange": machine.stroke[i]}
        add(drives, "position", name=name, joint=name, **servo, **stroke)
        add(sensors, "actuatorpos", name=name, actuator=name)
    pose = {"objtype": "site", "objname": "pose", "reftype": "site", "refname": "zero"}
    add(sensors, "framepos", name="position", **pose)
    add(sensors, "framequat", name="wxyz", **pose)


def _add_home(root: ET.Element, model: Mechanism) -> None:
    places = []
    for body in model.bodies:
        if body.leg is not None:
            places.append(model.travel[body.leg])
        else:
            free = [*body.pose.position, *body.pose.wxyz]
            places += [0.0, 0.0] if body.joint == "universal" else free
    home = model.machine.home_legs
    add(add(root, "keyframe"), "key", name="home", qpos=places, ctrl=home)

"""SDF: a platform as a model for Gazebo, with its six loops closed by ball joints.

Bodies and joints are those of `gough.export.mechanism`. Joint positions of SDF are 0 in the file's
own configuration, so driven joints count from home.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from gough.checks import Array
from gough.export.mechanism import (
    BASE,
    LEGS,
    NOT_STATED,
    Bar,
    Body,
    Mechanism,
    along,
    facts,
    inertia,
    mechanism,
)
from gough.export.template import as_prefix
from gough.export.xml import add, written
from gough.platform import Platform

VERSION = "1.7"  # the newest that Gazebo Classic 11 loads; Gazebo loads it, too
ENDLESS = 1e16  # limit of a joint that has none
STEEL, ORANGE = [0.45, 0.5, 0.58, 1], [0.85, 0.5, 0.2, 1]  # of legs and base, of the platform


def to_sdf(platform: Platform) -> str:
    """Model of a platform at home for Gazebo, the text of an SDF file.

    Lengths are in metres where the platform's unit is known, and as they are where it is not.

    Returns:
        A model with links base, platform, and of each leg leg1_cylinder (rotary: leg1_arm) and
        leg1_rod; driven joints leg1 to leg6, whose positions are 0 at home; and ball joints
        leg1_platform to leg6_platform.

    Example:
        >>> import gough
        >>> from gough.export.sdf import to_sdf
        >>> to_sdf(gough.Platform.load("reference")).splitlines()[0]
        '<sdf version="1.7">'
    """
    model = mechanism(platform)
    root = ET.Element("sdf", version=VERSION)
    inside = add(root, "model", name=as_prefix(platform.name))
    _add_link(inside, BASE, None, model.base, STEEL)
    fixed = add(inside, "joint", name="ground", type="fixed")
    _add_pair(fixed, "world", BASE)
    for body in model.bodies:
        colour = ORANGE if body.joint == "free" else STEEL
        _add_link(inside, body.name, body, body.bars, colour)
        if body.joint != "free":
            _add_joint(inside, model, body)
    for name, (rod, _, point) in zip(LEGS, model.loops, strict=True):
        ball = add(inside, "joint", name=f"{name}_platform", type="ball")
        add(ball, "pose", [*point, 0, 0, 0])  # in the child, the platform
        _add_pair(ball, rod, "platform")
    return written(root, f"{facts(platform)} {NOT_STATED}")


def _add_link(
    model: ET.Element, name: str, body: Body | None, bars: list[Bar], colour: list
) -> None:
    link = add(model, "link", name=name)
    if body is not None:
        relative = {} if body.parent == BASE else {"relative_to": body.parent}
        add(link, "pose", [*body.pose.position, *body.pose.rpy], **relative)
    _add_inertia(link, *inertia(bars))
    for number, bar in enumerate(bars, start=1):
        way, middle = bar.end - bar.start, (bar.start + bar.end) / 2
        visual = add(link, "visual", name=f"bar{number}")
        add(visual, "pose", [*middle, *along(way).rpy])
        cylinder = add(add(visual, "geometry"), "cylinder")
        add(cylinder, "radius", bar.radius)
        add(cylinder, "length", np.linalg.norm(way))
        material = add(visual, "material")
        add(material, "ambient", colour)
        add(material, "diffuse", colour)


def _add_inertia(link: ET.Element, mass: float, centre: Array, tensor: Array) -> None:
    inertial = add(link, "inertial")
    add(inertial, "pose", [*centre, 0, 0, 0])
    add(inertial, "mass", mass)
    values = add(inertial, "inertia")
    for i, a in enumerate("xyz"):
        for j, b in enumerate("xyz"[i:], start=i):
            add(values, f"i{a}{b}", tensor[i, j])


def _add_joint(parent: ET.Element, model: Mechanism, body: Body) -> None:
    """The joint that holds a body, at its origin; a driven one is named after its leg."""
    kinds = {"universal": "universal", "slide": "prismatic", "hinge": "revolute"}
    name = f"{body.name}_joint" if body.leg is None else LEGS[body.leg]
    joint = add(parent, "joint", name=name, type=kinds[body.joint])
    _add_pair(joint, body.parent, body.name)
    if body.leg is None:
        for tag, axis in (("axis", [1, 0, 0]), ("axis2", [0, 1, 0])):
            _add_axis(joint, tag, axis, [-ENDLESS, ENDLESS])
        return
    machine, limits = model.machine, np.array([-ENDLESS, ENDLESS])
    if machine.stroke is not None:
        away = machine.gain[body.leg] * (machine.stroke[body.leg] - machine.home_legs[body.leg])
        limits = np.clip(np.sort(away), -ENDLESS, ENDLESS)
    _add_axis(joint, "axis", [0, 0, 1], limits)


def _add_axis(joint: ET.Element, tag: str, direction: list, limits: list | Array) -> None:
    axis = add(joint, tag)
    add(axis, "xyz", direction)
    limit = add(axis, "limit")
    add(limit, "lower", limits[0])
    add(limit, "upper", limits[1])


def _add_pair(joint: ET.Element, parent: str, child: str) -> None:
    add(joint, "parent", parent)
    add(joint, "child", child)

"""The same machine in MuJoCo: legs are spatial tendons between two sites, motor arms are hinges.

MuJoCo measures lengths and derives its own tendon Jacobian; nothing of gough is used but the
platform's numbers. The moving body's frame has its origin at the pivot, so that the velocity of a
free joint is (velocity of the pivot in world axes, angular velocity in body axes).
"""

# MuJoCo ships no types.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np
from support import Floats

from gough import Platform, Pose


def measure(platform: Platform, pose: Pose, angles: Floats | None = None) -> tuple[Floats, Floats]:
    """Tendon lengths (6,) and their Jacobian (6, 6), or (6, 12) with arms at `angles` in front.

    The last six columns are for the twist of `gough.jacobian`, in base axes.
    """
    model = mujoco.MjModel.from_xml_string(_mjcf(platform))
    data = mujoco.MjData(model)
    arms = [] if angles is None else angles
    data.qpos[:] = [*arms, *(pose.position + platform.pivot_point), *pose.wxyz]
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)
    rows = _dense_tendon_jacobian(model, data)
    rows[:, -3:] = rows[:, -3:] @ pose.rotation.T  # angular velocity: body axes to base axes
    return data.ten_length.copy(), rows


def accelerations(
    platform: Platform, pose: Pose, load: Floats, forces: Floats, angles: Floats | None = None
) -> Floats:
    """Accelerations of the machine, at rest, under actuator forces and a wrench on the platform.

    The platform has mass 1 and inertia 1 about the pivot, each arm inertia 1.

    Args:
        load: (6,) force and moment about the pivot, in world axes.
        forces: (6,) of actuators at the tendons, or at the hinges at `angles`, whose rods then
            carry what keeps the arms at rest.

    Returns:
        (6,) of the platform, or (12,) with those of the arms in front.
    """
    model = mujoco.MjModel.from_xml_string(_mjcf(platform))
    data = mujoco.MjData(model)
    arms = [] if angles is None else angles
    data.qpos[:] = [*arms, *(pose.position + platform.pivot_point), *pose.wxyz]
    data.xfrc_applied[model.body("moving").id] = load
    data.ctrl[:6] = forces
    mujoco.mj_forward(model, data)
    if angles is not None:
        rods = np.diagonal(_dense_tendon_jacobian(model, data)[:, :6])
        data.ctrl[6:] = -forces / rods
        mujoco.mj_forward(model, data)
    return data.qacc.copy()


def joint_angles(
    platform: Platform, pose: Pose, angles: Floats | None = None, home: Floats | None = None
) -> tuple[Floats, Floats]:
    """Angles (6,) [rad] between each leg and its direction at home, at its two joints.

    Directions are those between MuJoCo's sites, seen from the bodies that carry the sites; the
    angle is that of the quaternion which MuJoCo finds to turn one into the other.

    Args:
        angles, home: of the motors, at the pose and at home.
    """
    model = mujoco.MjModel.from_xml_string(_mjcf(platform))
    data = mujoco.MjData(model)
    seen = []
    for place, arms in ((platform.home, home), (pose, angles)):
        motors = [] if arms is None else arms
        data.qpos[:] = [*motors, *(place.position + platform.pivot_point), *place.wxyz]
        mujoco.mj_kinematics(model, data)
        seen.append(np.array([[_seen(model, data, a, b, i) for i in range(6)]
                              for a, b in (("b", "p"), ("p", "b"))]))  # fmt: skip
    lower, upper = (
        np.array([_turn(a, b) for a, b in zip(*side, strict=True)])
        for side in zip(*seen, strict=True)
    )
    return lower, upper


def spring_forces(platform: Platform, pose: Pose, away: Pose, springs: Floats) -> Floats:
    """Wrench (6,) that six springs in place of the legs, at rest at `pose`, exert at `away`.

    Force and moment about the pivot, in world axes.
    """
    model = mujoco.MjModel.from_xml_string(_mjcf(platform))
    data = mujoco.MjData(model)
    for place in (pose, away):
        data.qpos[:] = [*(place.position + platform.pivot_point), *place.wxyz]
        mujoco.mj_forward(model, data)
        if place is pose:
            model.tendon_stiffness[:] = springs
            model.tendon_lengthspring[:] = data.ten_length[:, None]
    force = data.qfrc_passive.copy()
    return np.concatenate([force[:3], away.rotation @ force[3:]])


def leg_velocities(platform: Platform, pose: Pose, twist: Floats) -> Floats:
    """Velocities (6,) of tendons in place of the legs, as MuJoCo has them."""
    model = mujoco.MjModel.from_xml_string(_mjcf(platform))
    data = mujoco.MjData(model)
    data.qpos[:] = [*(pose.position + platform.pivot_point), *pose.wxyz]
    data.qvel[:] = [*twist[:3], *(pose.rotation.T @ twist[3:])]
    mujoco.mj_forward(model, data)
    return data.ten_velocity.copy()


def _seen(model: mujoco.MjModel, data: mujoco.MjData, start: str, end: str, i: int) -> Floats:
    """Unit vector from one site of leg i to the other, in the frame of the first one's body."""
    site = model.site(f"{start}{i}").id
    way = data.site_xpos[model.site(f"{end}{i}").id] - data.site_xpos[site]
    seen = data.xmat[model.site_bodyid[site]].reshape(3, 3).T @ way
    return seen / np.linalg.norm(seen)


def _turn(a: Floats, b: Floats) -> float:
    """Angle [rad] of the shortest rotation that takes a to b, by MuJoCo's quaternions."""
    first, second, back = (np.zeros(4) for _ in range(3))
    axis = np.zeros(3)
    mujoco.mju_quatZ2Vec(first, a)
    mujoco.mju_negQuat(back, first)
    mujoco.mju_rotVecQuat(axis, b, back)
    mujoco.mju_quatZ2Vec(second, axis)
    mujoco.mju_quat2Vel(axis, second, 1.0)
    return float(np.linalg.norm(axis))


def _mjcf(platform: Platform) -> str:
    base, moving = platform.base, platform.moving - platform.pivot_point
    if platform.rotary is None:
        fixed = "".join(f'<site name="b{i}" pos="{_text(p)}"/>' for i, p in enumerate(base))
    else:
        fixed = "".join(_arm(platform, i) for i in range(6))
    sites = "".join(f'<site name="p{i}" pos="{_text(p)}"/>' for i, p in enumerate(moving))
    tendons = "".join(
        f'<spatial name="t{i}"><site site="b{i}"/><site site="p{i}"/></spatial>' for i in range(6)
    )
    mass = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    motors = "".join(f'<motor tendon="t{i}"/>' for i in range(6))
    if platform.rotary is not None:
        motors = "".join(f'<motor joint="h{i}"/>' for i in range(6)) + motors
    return (
        '<mujoco><compiler angle="radian"/><option gravity="0 0 0"/><worldbody>'
        f'{fixed}<body name="moving"><freejoint/>{mass}{sites}</body>'
        f"</worldbody><tendon>{tendons}</tendon><actuator>{motors}</actuator></mujoco>"
    )


def _arm(platform: Platform, i: int) -> str:
    """A hinge whose body's x axis points along the arm; the site is the arm's tip."""
    arms = platform.rotary
    assert arms is not None
    axes = f"{_text(arms.axis_x[i])} {_text(arms.axis_y[i])}"
    hinge = f'<joint name="h{i}" type="hinge" axis="0 0 1"/>'
    return (
        f'<body pos="{_text(platform.base[i])}" xyaxes="{axes}">{hinge}'
        f'<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        f'<site name="b{i}" pos="{float(arms.arm_length[i])!r} 0 0"/></body>'
    )


def _text(vector: Floats) -> str:
    return " ".join(repr(float(v)) for v in vector)


def _dense_tendon_jacobian(model: mujoco.MjModel, data: mujoco.MjData) -> Floats:
    rows = np.zeros((model.ntendon, model.nv))
    for i in range(model.ntendon):
        start, count = model.ten_J_rowadr[i], model.ten_J_rownnz[i]
        entries = slice(start, start + count)
        rows[i, model.ten_J_colind[entries]] = data.ten_J[entries]
    return rows

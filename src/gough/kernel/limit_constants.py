"""The limits of a platform as one flat array of numbers, in its units: what `margins` works on."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gough.checks import Array
from gough.kernel.constants import solving_order
from gough.kinematics import joint_radius, normalised_jacobian
from gough.limit_geometry import PAIRS, joint_axes, least_gaps, leg_gaps, shared_joints
from gough.limit_rules import SLACK
from gough.machine_limits import MachineLimits
from gough.platform import Platform
from gough.platform_checks import refuse_screws

# Kinds of limits: columns of margins and shares.
NAMES = (
    "stroke", "arm", "base joint", "platform joint", "clearance", "leg force", "workspace",
    "singularity",
)  # fmt: skip
STROKE, ARM, BASE_JOINT, MOVING_JOINT, CLEARANCE, FORCE, WORKSPACE, SINGULARITY = np.arange(8)
KINDS = np.int64(8)

# Parts: the number of the first leg, pair of legs or axis of each kind.
FIRST_PART = (0, 6, 12, 18, 24, 39, 45, 51)
LABELS = (
    *(f"leg {leg}: {name}" for name in NAMES[:4] for leg in range(1, 7)),
    *(f"legs {a + 1} and {b + 1}: clearance" for a, b in PAIRS),
    *(f"leg {leg}: leg force" for leg in range(1, 7)),
    *(f"{axis}: workspace" for axis in ("x", "y", "z", "rx", "ry", "rz")),
    "singularity",
)
NO_PART = np.int64(255)  # of a pose of NaN

# The constants. Margins times PER_... are shares; they are 0 for parts that do not count.
STATED = 0  # 1 for limits that the machine has: KINDS
SLACKS = 8  # how far margins may be below 0 and not count as broken: KINDS
SIZE, RADIUS, HOME_DETERMINANT, ROTARY = 16, 17, 18, 19  # RADIUS: / size; legs in solving order
SAME_CONES = 20  # 1 for six equal base cones, platform cones: 2
ORDER = 22  # of legs, in which elimination at home needs no pivoting: 6
BASE = 28  # 6 x 3
MOVING = 46  # from the pivot: 6 x 3
PIVOT = 64  # 3
ARM_LENGTH, ROD_LENGTH, BRANCH = 67, 73, 79  # 6 each
AXIS_X, AXIS_Y, AXIS_Z = 85, 103, 121  # of the motors: 6 x 3 each
ZERO, PER_GAIN = 139, 145  # 6 each
STROKES = 151  # lowest and highest reading: 6 x 2
PER_STROKE = 163  # 6
BASE_AXIS, MOVING_AXIS = 169, 187  # of the joints: 6 x 3 each
BASE_CONE, MOVING_CONE = 205, 211  # [rad]: 6 each
BASE_COSINE, MOVING_COSINE = 217, 218  # of the cones, widened by the slack, where they are equal
GAP, PER_GAP = 219, 234  # 15 each
FORCES, PER_FORCE = 249, 261  # lowest and highest: 6 x 2; 6
WEIGHT, CENTRE = 267, 270  # mass times gravity; centre of mass from the pivot: 3 each
HOME_POSITION, HOME_QUATERNION = 273, 276  # 3, 4
BOX_MIDDLE, BOX_HALF = 280, 286  # 6 each
CONSTANTS = 292


@lru_cache(maxsize=256)
def limit_constants(platform: Platform) -> Array:
    """Return the constants (CONSTANTS,) of a platform, which may state any of the limits."""
    refuse_screws(platform)
    limits = platform.limits or MachineLimits()
    size, order = platform.size, solving_order(platform)
    determinant = np.linalg.det(normalised_jacobian(platform, platform.home)[order])
    c = np.zeros(CONSTANTS)

    def put(at: int, values) -> None:
        flat = np.ravel(values)
        c[at : at + flat.size] = flat

    stated = {
        STROKE: platform.stroke, ARM: platform.rotary, BASE_JOINT: limits.base_joint_cone,
        MOVING_JOINT: limits.moving_joint_cone, CLEARANCE: limits.leg_radius,
        FORCE: limits.leg_force, WORKSPACE: platform.workspace,
    }  # fmt: skip
    for kind, value in stated.items():
        c[STATED + kind] = value is not None
    c[STATED + SINGULARITY] = determinant != 0
    for kind in (ARM, CLEARANCE):
        c[SLACKS + kind] = SLACK * size
    for kind in (BASE_JOINT, MOVING_JOINT, WORKSPACE):
        c[SLACKS + kind] = SLACK
    put(SIZE, [size, joint_radius(platform) / size, determinant, platform.rotary is not None])
    put(ORDER, order)
    put(BASE, platform.base)
    put(MOVING, platform.moving - platform.pivot_point)
    put(PIVOT, platform.pivot_point)
    put(ZERO, platform.true_at_zero)
    put(PER_GAIN, 1 / platform.gain)
    for at, axes in zip((BASE_AXIS, MOVING_AXIS), joint_axes(platform), strict=True):
        put(at, axes)
    put(HOME_POSITION, platform.home.position)
    put(HOME_QUATERNION, platform.home.wxyz)
    _put_arms(put, platform)
    _put_stroke(put, platform)
    _put_cones(put, limits)
    _put_gaps(put, platform, limits)
    _put_forces(put, platform, limits)
    _put_box(put, platform)
    return c


def _put_arms(put, platform: Platform) -> None:
    arms = platform.rotary
    if arms is not None:
        put(ARM_LENGTH, arms.arm_length)
        put(ROD_LENGTH, arms.rod_length)
        put(BRANCH, arms.branch)
        put(AXIS_X, arms.axis_x)
        put(AXIS_Y, arms.axis_y)
        put(AXIS_Z, np.cross(arms.axis_x, arms.axis_y))


def _put_stroke(put, platform: Platform) -> None:
    if platform.stroke is None:
        return
    unit = 1.0 if platform.rotary is not None else platform.size
    half = (platform.stroke[:, 1] - platform.stroke[:, 0]) / 2
    put(STROKES, platform.stroke)
    put(PER_STROKE, 1 / np.where(np.isfinite(half), half, unit))
    put(SLACKS + STROKE, SLACK * unit / np.min(np.abs(platform.gain)))


def _put_cones(put, limits: MachineLimits) -> None:
    for k, (cone, at, cosine) in enumerate((
        (limits.base_joint_cone, BASE_CONE, BASE_COSINE),
        (limits.moving_joint_cone, MOVING_CONE, MOVING_COSINE),
    )):  # fmt: skip
        if cone is not None:
            put(at, np.radians(cone))
            put(SAME_CONES + k, np.ptp(cone) == 0)
            put(cosine, np.cos(np.radians(cone[0]) + SLACK))


def _put_gaps(put, platform: Platform, limits: MachineLimits) -> None:
    """Store least gaps, and one over what is left of them at home."""
    if limits.leg_radius is not None:
        least = least_gaps(limits)
        left = np.maximum(leg_gaps(platform, platform.home) - least, SLACK * platform.size)
        put(GAP, least)
        put(PER_GAP, np.where(shared_joints(platform), 0.0, 1 / left))


def _put_forces(put, platform: Platform, limits: MachineLimits) -> None:
    if limits.payload is not None:
        put(WEIGHT, limits.payload.mass * limits.payload.gravity)
        put(CENTRE, limits.payload.centre - platform.pivot_point)
    if limits.leg_force is not None:
        put(FORCES, limits.leg_force)
        put(PER_FORCE, 2 / (limits.leg_force[:, 1] - limits.leg_force[:, 0]))
        put(SLACKS + FORCE, SLACK * np.max(np.abs(limits.leg_force)))


def _put_box(put, platform: Platform) -> None:
    """Store middle and half width of the workspace, from home [platform unit], [rad]."""
    if platform.workspace is not None:
        space = platform.workspace
        box = np.concatenate([space.translation, np.radians(space.rotation_deg)])
        least = SLACK * np.repeat([platform.size, 1.0], 3)
        middle = box.mean(axis=1)
        middle[3:] = np.arctan2(np.sin(middle[3:]), np.cos(middle[3:]))
        put(BOX_MIDDLE, middle)
        put(BOX_HALF, np.maximum((box[:, 1] - box[:, 0]) / 2, least))

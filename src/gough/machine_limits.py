"""Limits of a machine's parts, as stated in the table [limits] of its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from gough.checks import Array, frozen, one_or_six, platform_field, platform_numbers
from gough.errors import PlatformError, suggestion

STANDARD_GRAVITY = 9.80665  # [m/s^2]


@dataclass(frozen=True, eq=False, init=False)
class Payload:
    """Body that the platform carries, the platform's own included.

    Attributes:
        mass: [kg]
        centre: (3,) its centre of mass in platform coordinates [platform unit].
        gravity: (3,) acceleration of free fall in base coordinates [m/s^2]; down the base's z axis
            unless given.

    Raises:
        PlatformError: naming the field, what was found and what was expected.
    """

    mass: float
    centre: Array
    gravity: Array

    def __init__(
        self,
        mass: float,
        centre: ArrayLike = (0.0, 0.0, 0.0),
        gravity: ArrayLike = (0.0, 0.0, -STANDARD_GRAVITY),
    ) -> None:
        object.__setattr__(self, "mass", _number("payload.mass", mass, least=0.0))
        for name, value in (("centre", centre), ("gravity", gravity)):
            object.__setattr__(self, name, platform_field(f"limits.payload.{name}", value, (3,)))


@dataclass(frozen=True, eq=False, init=False)
class MachineLimits:
    """Limits of joints, legs and motors. All are optional; what is not stated is None.

    One number stands for six equal ones. Forces are of the actuators and positive where they push,
    [N] if the mass is in kg; of rotary legs they are torques of the motors [N x platform unit].

    Attributes:
        base_joint_cone: (6,) largest angle of each leg from the axis of its base joint [deg]. The
            base joint of a rotary leg is the one between arm and rod.
        moving_joint_cone: (6,) largest angle of each leg from the axis of its platform joint [deg].
        base_joint_axis: (6, 3) axes of the base joints in base coordinates; the leg directions at
            home unless given. Those of rotary legs are seen at home and swing with the arm.
        moving_joint_axis: (6, 3) axes of the platform joints in platform coordinates; the leg
            directions at home unless given. An axis and its opposite are one: the one on the
            leg's side at home counts.
        leg_radius: (6,) radius of each leg, a cylinder with round ends; of rotary legs that of arm
            and rod [platform unit].
        clearance: gap between two legs that must remain [platform unit]; 0 unless given.
        leg_force: (6, 2) lowest and highest force of each leg while the payload is held still.
        payload: what the platform carries.
        leg_speed: (6,) largest speed of each leg [platform unit / s], of motors [rad / s].
        leg_acceleration: (6,) largest acceleration of each leg [platform unit / s^2], of motors
            [rad / s^2].

    Raises:
        PlatformError: naming the field, what was found and what was expected.
    """

    base_joint_cone: Array | None
    moving_joint_cone: Array | None
    base_joint_axis: Array | None
    moving_joint_axis: Array | None
    leg_radius: Array | None
    clearance: float
    leg_force: Array | None
    payload: Payload | None
    leg_speed: Array | None
    leg_acceleration: Array | None

    def __init__(
        self,
        *,
        base_joint_cone: ArrayLike | None = None,
        moving_joint_cone: ArrayLike | None = None,
        base_joint_axis: ArrayLike | None = None,
        moving_joint_axis: ArrayLike | None = None,
        leg_radius: ArrayLike | None = None,
        clearance: float = 0.0,
        leg_force: ArrayLike | None = None,
        payload: Payload | Mapping | None = None,
        leg_speed: ArrayLike | None = None,
        leg_acceleration: ArrayLike | None = None,
    ) -> None:
        stated = {
            "base_joint_cone": _six("base_joint_cone", base_joint_cone, most=180.0),
            "moving_joint_cone": _six("moving_joint_cone", moving_joint_cone, most=180.0),
            "base_joint_axis": _axes("base_joint_axis", base_joint_axis),
            "moving_joint_axis": _axes("moving_joint_axis", moving_joint_axis),
            "leg_radius": _six("leg_radius", leg_radius),
            "clearance": _number("clearance", clearance, least=0.0),
            "leg_force": _force(leg_force),
            "payload": _payload(payload),
            "leg_speed": _six("leg_speed", leg_speed),
            "leg_acceleration": _six("leg_acceleration", leg_acceleration),
        }
        for name, value in stated.items():
            object.__setattr__(self, name, value)
        for name, needed in NEEDS.items():
            without = stated[name] is None or (name == "clearance" and self.clearance == 0)
            if not without and stated[needed] is None:
                raise PlatformError(f"limits.{name}: means nothing without {needed}; state it too")

    def with_origin_at(self, point: Array) -> MachineLimits:
        """Copy for platform coordinates whose origin is moved to `point` (3,)."""
        if self.payload is None:
            return self
        return replace(self, payload=replace(self.payload, centre=self.payload.centre - point))

    def scaled(self, factor: float, *, rotary: bool) -> MachineLimits:
        """Return the same limits with lengths in a unit of which `factor` are one of now.

        Args:
            rotary: of motors, whose torques have the unit of length in them and whose speeds have
                not.
        """
        lengths = ["leg_radius", "clearance"]
        lengths += ["leg_force"] if rotary else ["leg_speed", "leg_acceleration"]
        new = {k: factor * v for k in lengths if (v := getattr(self, k)) is not None}
        if self.payload is not None:
            new["payload"] = replace(self.payload, centre=factor * self.payload.centre)
        return replace(self, **new)

    def to_dict(self) -> dict:
        """Return what is stated as plain lists and numbers, as `MachineLimits(**...)` takes it."""
        out: dict = {}
        for name, value in vars(self).items():
            if isinstance(value, Payload):
                out[name] = {key: _plain(part) for key, part in vars(value).items()}
            elif value is not None and (name != "clearance" or self.leg_radius is not None):
                out[name] = _plain(value)
        return out


KEYS = tuple(field.name for field in fields(MachineLimits))
PAYLOAD_KEYS = tuple(field.name for field in fields(Payload))
NEEDS = {
    "clearance": "leg_radius",
    "leg_force": "payload",
    "base_joint_axis": "base_joint_cone",
    "moving_joint_axis": "moving_joint_cone",
}


def _plain(value: Array | float) -> list | float:
    """An array as lists; six equal numbers as one, six equal pairs as one pair."""
    array = np.asarray(value)
    if len(array.shape) and len(array) == 6 and array.shape != (6, 3) and np.all(array == array[0]):
        array = array[0]
    return array.tolist()


def _number(name: str, value: ArrayLike, least: float) -> float:
    number = float(platform_field(f"limits.{name}", value, ()))
    if number < least:
        raise PlatformError(f"limits.{name}: expected {least:g} or more, found {number:g}")
    return number


def _six(name: str, value: ArrayLike | None, most: float = np.inf) -> Array | None:
    """Six numbers above 0, from one or six; None stays None."""
    if value is None:
        return None
    six = one_or_six(f"limits.{name}", value)
    for leg, number in enumerate(six):
        if not 0 < number <= most:
            upper = "" if np.isinf(most) else f" and at most {most:g}"
            raise PlatformError(
                f"limits.{name}[{leg}]: expected a number above 0{upper}, found {number:g}"
            )
    return six


def _axes(name: str, value: ArrayLike | None) -> Array | None:
    if value is None:
        return None
    axes = platform_field(f"limits.{name}", value, (6, 3))
    lengths = np.linalg.norm(axes, axis=-1)
    if np.any(lengths == 0):
        leg = int(np.argmin(lengths))
        raise PlatformError(f"limits.{name}[{leg}]: expected a direction, found three zeros")
    return axes


def _force(value: ArrayLike | None) -> Array | None:
    """Lowest and highest force (6, 2), from one pair or six."""
    if value is None:
        return None
    given = platform_numbers("limits.leg_force", value)
    if given.shape not in ((2,), (6, 2)):
        raise PlatformError(
            "limits.leg_force: expected [lowest, highest] or six such pairs, got shape "
            f"{given.shape}"
        )
    pairs = platform_field("limits.leg_force", np.broadcast_to(given, (6, 2)), (6, 2))
    for leg, (low, high) in enumerate(pairs):
        if not low < high:
            raise PlatformError(
                f"limits.leg_force[{leg}]: expected lowest below highest, found [{low:g}, {high:g}]"
            )
    return frozen(pairs)


def _payload(value: Payload | Mapping | None) -> Payload | None:
    if value is None or isinstance(value, Payload):
        return value
    if not isinstance(value, Mapping):
        raise PlatformError(
            f"limits.payload: expected a table with {', '.join(PAYLOAD_KEYS)}; found {value!r}"
        )
    known_keys("limits.payload.", value, PAYLOAD_KEYS)
    if "mass" not in value:
        raise PlatformError("limits.payload.mass: missing; expected a mass [kg]")
    return Payload(**value)


def known_keys(prefix: str, table: Mapping, keys: tuple[str, ...]) -> None:
    """Raise PlatformError for the first key of a table that is not among `keys`."""
    for key in table:
        if key not in keys:
            raise PlatformError(
                f"{prefix}{key}: unknown field{suggestion(key, keys)} fields are {', '.join(keys)}"
            )

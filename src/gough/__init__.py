"""Where a hexapod is: poses of Gough-Stewart platforms from the lengths of their legs."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

__version__ = "0.1.0"

# Public names and where they live; loaded when first used, so that `import gough` is quick.
_HOMES = {
    "Platform": "gough.platform",
    "RotaryArms": "gough.rotary",
    "Workspace": "gough.workspace",
    "Pose": "gough.pose",
    "GoughError": "gough.errors",
    "InputError": "gough.errors",
    "PlatformError": "gough.errors",
    "NetworkSeed": "gough.fk.network",
    "PolynomialSeed": "gough.fk.seeds",
    "PoseSeed": "gough.fk.seeds",
    "Seed": "gough.fk.seeds",
    "Event": "gough.fk.tracker",
    "Solution": "gough.fk.status",
    "Status": "gough.fk.status",
    "Tracker": "gough.fk.tracker",
    "solve": "gough.fk.solve",
    "assembly_sign": "gough.kinematics",
    "jacobian": "gough.kinematics",
    "joint_positions": "gough.kinematics",
    "leg_lengths": "gough.kinematics",
    "pose_covariance": "gough.kinematics",
    "singularity_distance": "gough.kinematics",
    "AssemblyModes": "gough.modes.result",
    "Certificate": "gough.fk.certificate",
    "Choice": "gough.modes.choose",
    "ModesStatus": "gough.modes.result",
    "assembly_modes": "gough.modes.assembly",
    "certify": "gough.fk.certificate",
    "choose_mode": "gough.modes.choose",
}

__all__ = ["__version__", *sorted(_HOMES)]  # pyright: ignore[reportUnsupportedDunderAll]

if TYPE_CHECKING:
    from gough.errors import GoughError, InputError, PlatformError
    from gough.fk.certificate import Certificate, certify
    from gough.fk.network import NetworkSeed
    from gough.fk.seeds import PolynomialSeed, PoseSeed, Seed
    from gough.fk.solve import solve
    from gough.fk.status import Solution, Status
    from gough.fk.tracker import Event, Tracker
    from gough.kinematics import (
        assembly_sign,
        jacobian,
        joint_positions,
        leg_lengths,
        pose_covariance,
        singularity_distance,
    )
    from gough.modes.assembly import assembly_modes
    from gough.modes.choose import Choice, choose_mode
    from gough.modes.result import AssemblyModes, ModesStatus
    from gough.platform import Platform
    from gough.pose import Pose
    from gough.rotary import RotaryArms
    from gough.workspace import Workspace


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'gough' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

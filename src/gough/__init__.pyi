# The public names, once: type checkers read this file, and so does `__init__.py` when it runs.

from .calibration.fit import calibrate as calibrate
from .calibration.plan import Plan as Plan
from .calibration.plan import plan_poses as plan_poses
from .calibration.result import Calibration as Calibration
from .certificate import Certificate as Certificate
from .certificate import certify as certify
from .errors import GoughError as GoughError
from .errors import InputError as InputError
from .errors import PlatformError as PlatformError
from .examination.machine import Check as Check
from .examination.machine import check as check
from .fk.solution import Solution as Solution
from .fk.solve import Solver as Solver
from .fk.solve import solve as solve
from .fk.tracker import Tracker as Tracker
from .frames import FramePose as FramePose
from .frames import Frames as Frames
from .kinematics import assembly_sign as assembly_sign
from .kinematics import jacobian as jacobian
from .kinematics import joint_positions as joint_positions
from .kinematics import leg_lengths as leg_lengths
from .kinematics import pose_covariance as pose_covariance
from .kinematics import singularity_distance as singularity_distance
from .limit_geometry import joint_angles as joint_angles
from .limit_geometry import leg_gaps as leg_gaps
from .limit_geometry import payload_forces as payload_forces
from .machine_limits import MachineLimits as MachineLimits
from .machine_limits import Payload as Payload
from .margins import Limits as Limits
from .margins import Reach as Reach
from .margins import limits as limits
from .margins import reach as reach
from .modes.assembly import assembly_modes as assembly_modes
from .modes.choose import Choice as Choice
from .modes.choose import choose_mode as choose_mode
from .modes.result import AssemblyModes as AssemblyModes
from .platform import Platform as Platform
from .pose import Pose as Pose
from .rotary import RotaryArms as RotaryArms
from .seeds.base import PoseSeed as PoseSeed
from .seeds.base import Seed as Seed
from .seeds.network import NetworkSeed as NetworkSeed
from .seeds.polynomial import PolynomialSeed as PolynomialSeed
from .status import Event as Event
from .status import ModesStatus as ModesStatus
from .status import Status as Status
from .velocities import leg_accelerations as leg_accelerations
from .velocities import leg_forces as leg_forces
from .velocities import leg_rates as leg_rates
from .velocities import twist as twist
from .velocities import wrench as wrench
from .workspace import Workspace as Workspace

__all__: list[str]
__version__: str

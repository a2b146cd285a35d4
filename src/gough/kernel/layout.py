"""Positions of all quantities in the two flat arrays that the compiled code works on.

One array each keeps the argument count down (a call from Python pays for every argument) and
lets LLVM see that loads and stores do not overlap.
"""

import numpy as np

# The buffer: component c of pose k is at buffer[c * stride + k].
POSITION = 0  # s: 3
QUATERNION = 3  # w, x, y, z: 4
STEP = 7  # |v|^2 + |w|^2 of the last Newton step
DETERMINANT = 8  # of the matrix with rows (d_i, a_i x d_i), legs in solving order
LENGTH = 9  # l: 6
SQUARE = 15  # l^2: 6
BASE = 21  # b: 6 x 3
RESIDUAL = 39  # largest | |d_i| - l_i |
INSIDE = 40  # 0 outside the workspace; in it 1 where the determinant has home's sign, else 0.5
REGULAR = 41  # 1 where the distance to singularity is surely above the threshold, else 0
COUNT = 42  # Newton steps taken
USER_POSITION = 43  # position as the user sees it [platform unit]: 3
COMPONENTS = 46

# Arguments of compiled functions are NumPy's integers: each Python literal would be a type of
# its own to Numba, and the function compiled once for every one of them.
LEG_1, LEG_2, LEG_3, LEG_4, LEG_5, LEG_6 = np.arange(6)
FIRST, SINGLE = np.arange(2)  # k and stride of a buffer that holds one pose
WIDTH = np.int64(64)  # poses in a block: enough for vector loops, few enough for the cache
YES = np.bool_(True)

# The constants of a platform, made in `constants.py`. Lengths are divided by its size.
JOINTS = 0  # q: platform joints from their centre, legs in solving order: 6 x 3
RADIUS = 18  # root mean square of |q_i|
HOME_SIGN = 19  # sign of the determinant at home, 0 where home is singular
REGULAR_DETERMINANT = 20  # of the unit-free Jacobian: above it a pose is surely regular
HOME_POSITION = 21  # origin of the workspace's box, in its axes: 3
PIVOT = 24  # pivot from the centre of the platform joints: 3
BOX_LOW = 27  # workspace, widened by the slack of `limit_rules`: 3
BOX_HIGH = 30  # workspace, widened: 3
HOME_QUATERNION = 33  # 4
BOX_X, BOX_Y, BOX_Z = np.array([37, 40, 43])  # of each Euler angle: cos mid, sin mid, cos half
ORDER = 46  # which reading each leg in solving order has: 6
FIXED = 52  # base joints from their centre (arm centres, for rotary legs): 6 x 3
GAIN = 70  # length or angle = gain times reading + zero; see `gough.struts`: 6
ZERO = 76  # [platform unit], or [rad]: 6
ROTARY = 82  # 1 for rotary legs, else 0
ROD = 83  # rod lengths: 6
ARM_X = 89  # arm length times axis_x: 6 x 3
ARM_Y = 107  # arm length times axis_y: 6 x 3
SIZE = 125  # of the platform [platform unit]
ORIGIN = 126  # centre of the base joints minus pivot [platform unit]: 3
HOME_POSE = 129  # in internal coordinates: position 3, quaternion 4
HOME_READINGS = 136  # as they come: 6
STROKE = 142  # lowest and highest reading, as they come, widened: 6 x 2
PER_SIZE = 154  # 1 / SIZE, made once: compilers may turn x (1 / y) into x / y in one loop only
BRANCH = 155  # +1 or -1, see `gough.RotaryArms`: 6
STATED = 161  # 1 where the platform states its workspace, else 0
CONSTANTS = 162

OPEN = 100  # in place of a status: the row still needs the row solver

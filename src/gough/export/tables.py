"""A platform as C constants: the numbers that the compiled solver itself works on."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gough import home_mode, quaternion
from gough.checks import Array
from gough.export.precision import Precision
from gough.kernel import cycle, descent, layout, rows
from gough.kernel.constants import SINGULAR, kernel_constants
from gough.limit_rules import SLACK
from gough.platform import Platform
from gough.seeds.base import further_starts

DESCENT_STEPS = 33  # in one call, beside the Newton steps of `cycle`
MAX_STEPS = cycle.STEPS + DESCENT_STEPS
SWEEPS = 6  # of rotations for the smallest singular value: its error is then far below SINGULAR
START_COUNT = 8  # home, and poses about it, one tried a cycle


def constant_lines(platform: Platform, precision: Precision) -> str:
    """Definitions of all constants that the template `hexapod.c` uses.

    Their values come from `kernel.constants`, their names say what they are.
    """
    constants = kernel_constants(platform)
    order = constants[layout.ORDER : layout.ORDER + 6].astype(int)
    integers = {"ROTARY": platform.rotary is not None, "STATED": platform.workspace is not None}
    lines = [*_arithmetic(precision), "", *_limits(precision), ""]
    lines += [f"#define {name} {int(value)}" for name, value in integers.items()]
    lines.append(f"static const int LEG_ORDER[6] = {{{', '.join(map(str, order))}}};")
    for name, value in _tables(platform, _loosened(constants, platform, precision), order).items():
        lines.append(_definition(name, np.asarray(value), precision))
    return "\n".join(lines)


def _tables(platform: Platform, c: Array, order: NDArray[np.intp]) -> dict[str, ArrayLike]:
    """Constants by their names in C, cut out of the flat array `c`."""

    def cut(at: int, *shape: int) -> Array:
        return c[at : at + int(np.prod(shape))].reshape(shape)

    tables: dict[str, ArrayLike] = {
        "SIZE": c[layout.SIZE],
        "PER_SIZE": c[layout.PER_SIZE],
        "RADIUS": c[layout.RADIUS],
        "HOME_SIGN": c[layout.HOME_SIGN],
        "ENOUGH": c[layout.REGULAR_DETERMINANT],
        "PLATFORM_JOINTS": cut(layout.JOINTS, 6, 3),
        "BASE_JOINTS": cut(layout.FIXED, 6, 3),
        "PIVOT": cut(layout.PIVOT, 3),
        "ORIGIN": cut(layout.ORIGIN, 3),
        "GAIN": cut(layout.GAIN, 6),
        "ZERO": cut(layout.ZERO, 6),
        "STROKE": cut(layout.STROKE, 6, 2),
        "HOME_SHIFT": cut(layout.HOME_POSITION, 3),
        "HOME_INVERSE": quaternion.to_matrix(cut(layout.HOME_QUATERNION, 4)).T.ravel(),
        "SHIFT_LOW": cut(layout.BOX_LOW, 3),
        "SHIFT_HIGH": cut(layout.BOX_HIGH, 3),
        "TURN_RANGE": cut(layout.BOX_X, 3, 3),
        "STARTS": further_starts(platform, START_COUNT),
    }
    if platform.rotary is not None:
        arms = platform.rotary
        squares = (arms.arm_length**2 - arms.rod_length**2) / platform.size**2
        tables |= {
            "ROD": cut(layout.ROD, 6),
            "ARM_X": cut(layout.ARM_X, 6, 3),
            "ARM_Y": cut(layout.ARM_Y, 6, 3),
            "ARM_ROD": squares[order],  # for the law of cosines
            "BRANCH": arms.branch[order],
        }
    return tables


def _definition(name: str, value: Array, precision: Precision) -> str:
    if value.ndim == 0:
        return f"#define {name} {precision.literal(float(value))}"
    dimensions = "".join(f"[{n}]" for n in value.shape)
    return f"static const real {name}{dimensions} = {_braces(value, precision)};"


def _arithmetic(precision: Precision) -> list[str]:
    """Spelling of C literals and names of C functions for one kind of number."""
    names = ("sqrt", "fabs", "sin", "cos")
    functions = [f"#define {name.upper()} {name}{precision.suffix}" for name in names]
    return [
        "#define R(x) ((real)(x))",
        "#define INFINITE R(INFINITY)",
        "#define PI R(3.14159265358979323846)",
        *functions,
    ]


def _limits(precision: Precision) -> list[str]:
    """Limits of steps, and what counts as small."""
    steps = {
        "NEWTON_STEPS": cycle.STEPS,
        "DESCENT_STEPS": DESCENT_STEPS,
        "SWEEPS": SWEEPS,
        "MOST_MISSED": 1_000_000,
        "MOST_POINTS": home_mode.MOST_POINTS,
        "START_COUNT": START_COUNT,
    }
    numbers = {
        "TOLERANCE": precision.tolerance,
        "SMALL_STEP": precision.small_step,
        "SINGULAR": SINGULAR,
        "LONGEST_SHIFT": descent.LONGEST_TRANSLATION,
        "LARGEST_TURN": descent.LARGEST_ROTATION,
        "NEGLIGIBLE": precision.negligible,
        "HOPELESS": descent.HOPELESS,
        "FLAT": descent.FLAT,
        "TINY": precision.tiny,
        "FARTHEST": rows.FARTHEST,
        "SHIFT_STEP": home_mode.TRANSLATION_STEP,
        "TURN_STEP": home_mode.ROTATION_STEP,
        "SAME_TIP": precision.tip_slack,
    }
    return [f"#define {name} {value}" for name, value in steps.items()] + [
        f"#define {name} {precision.literal(value)}" for name, value in numbers.items()
    ]


def _loosened(c: Array, platform: Platform, precision: Precision) -> Array:
    """The constants with workspace and stroke widened by what numbers of this kind round away."""
    loose = c.copy()
    extra = precision.slack - SLACK
    loose[layout.BOX_LOW : layout.BOX_LOW + 3] -= extra
    loose[layout.BOX_HIGH : layout.BOX_HIGH + 3] += extra
    unit = 1.0 if platform.rotary is not None else platform.size
    outward = np.tile([-1.0, 1.0], 6) / np.repeat(np.abs(platform.gain), 2)
    loose[layout.STROKE : layout.STROKE + 12] += extra * unit * outward
    box = platform.workspace or home_mode.sure_workspace(platform)
    if extra > 0 and box is not None:
        low, high = np.radians(box.rotation_deg.T)
        half = (high - low) / 2 + precision.slack
        cosine = np.cos(np.minimum(half, np.pi)) - precision.cosine_slack
        loose[layout.BOX_X + 2 : layout.BOX_X + 9 : 3] = np.where(half >= np.pi, -2.0, cosine)
    return loose


def _braces(values: Array, precision: Precision) -> str:
    """Nested C initialisers."""
    if values.ndim == 0:
        return precision.literal(float(values))
    inner = [_braces(value, precision) for value in values]
    if values.ndim == 1:
        return "{" + ", ".join(inner) + "}"
    return "{\n    " + ",\n    ".join(inner) + "}"

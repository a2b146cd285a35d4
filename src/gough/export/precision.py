"""Tolerances of the exported C, for each of its two kinds of number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gough import home_mode
from gough.errors import GoughError
from gough.fk.solve import Solver
from gough.kernel import descent, equations
from gough.limit_rules import SLACK

RealName = Literal["double", "float"]


@dataclass(frozen=True)
class Precision:
    """Constants that depend on how many digits a number has.

    Lengths are shares of the platform's size.
    """

    real: RealName
    suffix: str  # of literals, and of sqrt, sin and cos
    tolerance: float  # largest strut error of a pose that counts as found
    small_step: float  # squared Newton step after which the error is at rounding
    negligible: float  # damping below which the pivoted solve takes over
    tiny: float  # stands for a strut of length zero
    slack: float  # keeps poses on the faces of the workspace inside, [1] and [rad]
    tip_slack: float  # within which two places of a motor arm's tip are the same
    cosine_slack: float  # rounding of a cosine that is compared with that of a limit
    rounding: float  # of a strut's length, at most
    pose_error: float  # of a pose far from singularities, at most: share of the size, and [rad]

    def literal(self, value: float) -> str:
        """A number as C text that reads back as the nearest number of this kind."""
        if np.isnan(value):
            return "NOT_A_NUMBER"
        if np.isinf(value):
            return "INFINITE" if value > 0 else "-INFINITE"
        if self.real == "double":
            return repr(float(value))
        text = str(np.float32(value))
        return f"{text if '.' in text or 'e' in text else text + '.0'}f"

    def rounded(self, values):
        """Values as numbers of this kind hold them, in float64."""
        kind = np.float64 if self.real == "double" else np.float32
        return np.asarray(values, dtype=kind).astype(np.float64)


PRECISIONS = {
    # what the Python solver uses
    "double": Precision(
        "double", "", tolerance=Solver.tolerance, small_step=equations.SETTLED,
        negligible=descent.NEGLIGIBLE, tiny=1e-300, slack=SLACK,
        tip_slack=home_mode.SAME_TIP, cosine_slack=4e-16, rounding=1e-14, pose_error=1e-12,
    ),
    # chosen so that rounding (6e-8) neither stops a good pose nor lets a bad one pass: see
    # tests/export/test_c.py
    "float": Precision(
        "float", "f", tolerance=2e-6, small_step=1e-9, negligible=1e-6,
        tiny=1e-30, slack=2e-6, tip_slack=1e-3, cosine_slack=4e-7, rounding=1e-6, pose_error=2e-6,
    ),
}  # fmt: skip


def precision(real: str) -> Precision:
    """The constants for "double" or "float".

    Raises:
        GoughError: another name.
    """
    if real not in PRECISIONS:
        raise GoughError(f"real: expected one of {', '.join(PRECISIONS)}; found {real!r}")
    return PRECISIONS[real]

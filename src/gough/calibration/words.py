"""Numbers of a calibration as a person reads them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gough.calibration.prediction import Error


def error_text(error: Error, unit: str) -> str:
    """Position and rotation of an error, as far as there are."""
    parts = []
    if np.isfinite(error.position):
        parts.append(f"{error.position:.3g} {unit}".strip())
    if np.isfinite(error.rotation):
        parts.append(f"{np.degrees(error.rotation):.3g} deg")
    return ", ".join(parts)


def row_numbers(numbers: NDArray[np.integer]) -> str:
    """The first of some row numbers, such as "rows 3, 12"."""
    shown = ", ".join(map(str, numbers[:10])) + (", ..." if len(numbers) > 10 else "")
    return f"row{'s' * (len(numbers) > 1)} {shown}"

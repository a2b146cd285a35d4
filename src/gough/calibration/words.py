"""Numbers of a calibration as a person reads them."""

from __future__ import annotations

import numpy as np

from gough.calibration.prediction import Error


def error_text(error: Error, unit: str) -> str:
    """Position and rotation of an error, as far as there are."""
    parts = []
    if np.isfinite(error.position):
        parts.append(f"{error.position:.3g} {unit}".strip())
    if np.isfinite(error.rotation):
        parts.append(f"{np.degrees(error.rotation):.3g} deg")
    return ", ".join(parts)

"""The type of this package's arrays: what NumPy's linear algebra gives back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

"""Types of numpy arrays, named once for the whole package."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
"""Array of 64-bit floating-point numbers."""
IntArray = npt.NDArray[np.int64]
"""Array of 64-bit integers."""
BoolArray = npt.NDArray[np.bool_]
"""Array of truth values."""
SingleArray = npt.NDArray[np.float32]
"""Array of 32-bit floating-point numbers, for what is only multiplied and takes much memory."""

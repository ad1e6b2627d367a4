"""Matrix products over many residuals, in blocks.

A product of tall matrices is short work, but a BLAS that shares it among threads makes them wait
for each other on a busy machine, and its last bits then depend on their number. Blocks are small
enough for one thread and always summed in the same order.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
BLOCK = 64


def inner(a: FloatArray, b: FloatArray) -> FloatArray:
    """``a.T @ b`` of tall matrices (D, n) and (D, m)."""
    count = len(a) // BLOCK
    whole = count * BLOCK
    rows_a = a[:whole].T.reshape(a.shape[1], count, BLOCK).transpose(1, 0, 2)
    rows_b = b[:whole].T.reshape(b.shape[1], count, BLOCK).transpose(1, 2, 0)
    return np.asarray((rows_a @ rows_b).sum(axis=0) + a[whole:].T @ b[whole:])

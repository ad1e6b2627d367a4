"""Matrix products over many residuals, in blocks.

A product of tall matrices is short work, but a BLAS that shares it among threads makes them wait
for each other on a busy machine, and its last bits then depend on their number: whoever diagnoses
gives it one thread. Blocks stay in the processor's caches, and single numbers are summed in 64 bits
from block to block.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from fish_env.arrays import FloatArray, SingleArray
from fish_env.inference.parallel import side_by_side

BLOCK = 512


def inner(a: FloatArray | SingleArray, b: FloatArray | SingleArray) -> FloatArray:
    """``a.T @ b`` of tall matrices (D, n) and (D, m), the blocks summed in 64 bits."""
    total: FloatArray = np.zeros((a.shape[1], b.shape[1]))
    for first in range(0, len(a), BLOCK):
        total += a[first : first + BLOCK].T @ b[first : first + BLOCK]
    return total


def gram(parts: Sequence[FloatArray | SingleArray]) -> FloatArray:
    """``A.T @ A`` of columns that lie in several arrays, which are never side by side as a whole.

    Args:
        parts: (D, k) each.
    """
    if not parts:
        return np.zeros((0, 0))
    firsts = range(0, len(parts[0]), BLOCK)
    halves = [firsts[: len(firsts) // 2], firsts[len(firsts) // 2 :]]
    return sum(side_by_side([partial(_gram_of_rows, parts, half) for half in halves]), np.zeros(1))


def _gram_of_rows(parts: Sequence[FloatArray | SingleArray], firsts: range) -> FloatArray:
    """The share of some rows, ``BLOCK`` from each first one on."""
    total: FloatArray = np.zeros((width := sum(part.shape[1] for part in parts), width))
    for first in firsts:
        rows = np.concatenate([part[first : first + BLOCK] for part in parts], axis=1)
        total += rows.T @ rows
    return total

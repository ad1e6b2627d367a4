"""Matrix products over many residuals, in blocks.

A product of tall matrices is short work, but a BLAS that shares it among threads makes them wait
for each other on a busy machine, and its last bits then depend on their number. Blocks are small
enough for one thread and always summed in the same order.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from fish_env.arrays import FloatArray, SingleArray
from fish_env.inference.parallel import side_by_side

BLOCK = 64
TOGETHER = 64 * BLOCK
"""Rows that are put side by side at a time."""
AT_ONCE = 1_000_000
"""Numbers of the blocks' products held at a time."""


def inner(
    a: FloatArray | SingleArray, b: FloatArray | SingleArray, at_once: int = AT_ONCE
) -> FloatArray:
    """``a.T @ b`` of tall matrices (D, n) and (D, m), the blocks summed in 64 bits.

    Args:
        a: (D, n) tall.
        b: (D, m) tall.
        at_once: numbers of the blocks' products held at a time.
    """
    count = len(a) // BLOCK
    whole = count * BLOCK
    rows_a = a[:whole].T.reshape(a.shape[1], count, BLOCK).transpose(1, 0, 2)
    rows_b = b[:whole].T.reshape(b.shape[1], count, BLOCK).transpose(1, 2, 0)
    total: FloatArray = np.zeros((a.shape[1], b.shape[1]))
    step = max(1, at_once // max(1, total.size))
    for first in range(0, count, step):
        block = slice(first, first + step)
        products = np.matmul(rows_a[block], rows_b[block]).astype(np.float64, copy=False)
        products[0] += total  # so that the order of the sum does not depend on the step
        total = products.sum(axis=0)
    return np.asarray(total + a[whole:].T @ b[whole:])


def gram(parts: Sequence[FloatArray | SingleArray]) -> FloatArray:
    """``A.T @ A`` of columns that lie in several arrays, which are never side by side as a whole.

    Args:
        parts: (D, k) each.
    """
    if not parts:
        return np.zeros((0, 0))
    firsts = range(0, len(parts[0]), TOGETHER)
    halves = [firsts[: len(firsts) // 2], firsts[len(firsts) // 2 :]]
    return sum(side_by_side([partial(_gram_of_rows, parts, half) for half in halves]), np.zeros(1))


def _gram_of_rows(parts: Sequence[FloatArray | SingleArray], firsts: range) -> FloatArray:
    """The share of some rows, ``TOGETHER`` from each first one on."""
    total: FloatArray = np.zeros((width := sum(part.shape[1] for part in parts), width))
    for first in firsts:
        rows = np.concatenate([part[first : first + TOGETHER] for part in parts], axis=1)
        total += inner(rows, rows)
    return total

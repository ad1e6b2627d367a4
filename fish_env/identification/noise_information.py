"""Products of what changes of a noise model change in innovations, compiled.

A fit of the noise forms them some dozens of times from thousands of samples, and hardly needs the
changes themselves.
"""

from __future__ import annotations

import math

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.model.jit import entry_point_of_file, kernel

ROOT_TWO = math.sqrt(2.0)


@kernel
def invert_lower(w: FloatArray, inverse: FloatArray) -> None:
    """Inverse of a lower triangular matrix (C, C); what is above the diagonal stays."""
    for i in range(w.shape[0]):
        for j in range(i):
            total = 0.0
            for k in range(j, i):
                total += w[i, k] * inverse[k, j]
            inverse[i, j] = -total / w[i, i]
        inverse[i, i] = 1.0 / w[i, i]


@kernel
def add_products(rows: FloatArray, first: int, last: int, into: FloatArray) -> None:
    """Add the inner products of the columns of some rows (P, n), in place (n, n)."""
    n = into.shape[0]
    for p in range(first, last):
        for a in range(n):
            factor = rows[p, a]
            for b in range(n):
                into[a, b] += factor * rows[p, b]


@entry_point_of_file
def products_of_changes(
    here: FloatArray,
    w_here: FloatArray,
    there: FloatArray,
    w_there: FloatArray,
    by: FloatArray,
    means: FloatArray,
    spreads: FloatArray,
    seen: FloatArray,
) -> None:
    """Add inner products of changes, summed over all samples.

    Changes of the covariance of innovations are seen in the whitened coordinates of the present
    noise model, and so are those of their mean.

    Args:
        here: (T, C) whitened innovations of the present noise model.
        w_here: (T, C, C) inverse Cholesky factors of their covariances.
        there: (n, T, C) the same of n other noise models.
        w_there: (n, T, C, C).
        by: (n,) how far the parameter of each was moved.
        means: (n, n) those of the mean, changed in place; so are the next two.
        spreads: (n, n) of the covariance.
        seen: (n, n) of the covariance along the innovations.
    """
    models, samples, channels = there.shape
    pairs = channels * (channels + 1) // 2
    inverse, back = np.zeros((channels, channels)), np.zeros((channels, channels))
    # Means, then the lower triangle of the symmetric change, then that along the innovations.
    rows = np.zeros((channels + pairs + channels, models))
    for t in range(samples):
        invert_lower(w_here[t], inverse)
        for m in range(models):
            for i in range(channels):
                for j in range(i + 1):
                    total = 0.0
                    for k in range(j, i + 1):
                        total += w_there[m, t, i, k] * inverse[k, j]
                    back[i, j] = ((1.0 if i == j else 0.0) - total) / by[m]
            p = channels
            for i in range(channels):
                mean = (there[m, t, i] - here[t, i]) / by[m]
                along = 2.0 * back[i, i] * here[t, i]
                for j in range(i + 1):
                    mean += back[i, j] * there[m, t, j]
                for j in range(i):
                    along += back[i, j] * here[t, j]
                    rows[p, m] = ROOT_TWO * back[i, j]
                    p += 1
                for j in range(i + 1, channels):
                    along += back[j, i] * here[t, j]
                rows[p, m] = 2.0 * back[i, i]
                p += 1
                rows[i, m] = mean
                rows[channels + pairs + i, m] = along
        add_products(rows, 0, channels, means)
        add_products(rows, channels, channels + pairs, spreads)
        add_products(rows, channels + pairs, rows.shape[0], seen)

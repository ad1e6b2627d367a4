"""Evaluation of one whole run at one point."""

from __future__ import annotations

from dataclasses import dataclass

from fish_env.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class RunEvaluation:
    """Evaluation of one run at a point.

    Attributes:
        own: (K,) the run's own numbers, fitted.
        errors: (T, C) measured less simulated, SI, NaN where nothing was measured.
        residuals: (D_r,) the same whitened, then the prior of the run's own numbers.
        basis: (D_r, k) orthonormal directions that the run's own numbers follow.
        log_likelihood: without the constant.
    """

    own: FloatArray
    errors: FloatArray
    residuals: FloatArray
    basis: FloatArray
    log_likelihood: float

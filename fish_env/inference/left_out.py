"""How well an explanation predicts a run that it was not fitted to.

Of a problem that is linear in its parameters, the fit to all runs but one, and what it says about
that one, follow from the fit to all runs without another simulation. Slopes at the estimates make
it so here. Source: leave-one-out prediction of a linear model with normal priors (Bishop, Pattern
Recognition and Machine Learning, 2006, section 3.3.2), with a run in the place of a sample.
"""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.information import information
from fish_env.inference.explanation import Explanation, known_before


def left_out_scores(explanation: Explanation) -> FloatArray:
    """Log density of each run (runs,) as predicted by a fit to all others.

    The fit to the others goes to their minimum also where the fit to all ended short of its own.

    Args:
        explanation: a fit to at least two runs.
    """
    fit = explanation.fit
    lin, known = fit.linearised, known_before(explanation)
    whole, remaining = information(lin.slopes, known), fit.remaining_gradient
    scores = []
    for run, filtered in enumerate(fit.filtered):
        mine = lin.run_of == run
        slopes, residuals = lin.slopes[mine], lin.residuals[mine]
        others = whole - slopes.T @ slopes
        step = np.linalg.solve(others, slopes.T @ residuals - remaining)
        predicted = residuals + slopes @ step
        # Predicted residuals scatter by I + S C S': by the matrix inversion lemma.
        projected = slopes.T @ predicted
        squares = predicted @ predicted - projected @ np.linalg.solve(whole, projected)
        spread = np.linalg.slogdet(whole)[1] - np.linalg.slogdet(others)[1]
        own, varied = residuals, 0.0
        if lin.marginal is not None:
            own, varied = filtered.residuals, float(lin.marginal.log_dets[run])
        fitted = filtered.log_likelihood + 0.5 * own @ own
        scores.append(fitted - 0.5 * (squares + spread + varied))
    return np.array(scores)

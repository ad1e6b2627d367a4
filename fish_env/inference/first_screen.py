"""The first screen: causes against the baseline, or against it and what its runs differ in.

Where both a cause and differences between runs would explain a misfit, the one that explains more
comes first. What one cause does in all runs may look like differences between them, and what was
fitted for these has to be fitted again once the cause is found.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.inference.adequacy import disturbance_at_limit
from fish_env.inference.estimate.again import differences, finished
from fish_env.inference.explanation import Explanation
from fish_env.inference.probes import Cause
from fish_env.inference.screening import Screen, screen


def first_screen(
    nothing: Explanation, causes: Sequence[Cause], rng: np.random.Generator
) -> tuple[Explanation, Screen]:
    """The baseline, with what its runs differ in if that explains more than any cause; its screen.

    Args:
        nothing: the baseline.
        causes: causes to consider.
        rng: for null distributions.
    """
    first = screen(nothing.fit, causes, rng, keep_changes=True)
    found = None if _are_hidden(nothing) else differences(nothing.fit)
    most = max((signal.uncorrected for signal in first.signals), default=0.0)
    if found is None or found.gain <= most:
        return nothing, first
    varied = with_differences(nothing)
    if varied is nothing:
        return nothing, first
    return varied, screen(varied.fit, causes, rng, keep_changes=True)


def with_differences(nothing: Explanation) -> Explanation:
    """The baseline with what its runs differ in; itself where that is no better, or hidden.

    Args:
        nothing: the baseline.
    """
    varied = nothing if _are_hidden(nothing) else nothing.varied()
    if varied is nothing or disturbance_at_limit(varied.fit):
        return varied
    return Explanation((), finished(varied.fit))


def _are_hidden(nothing: Explanation) -> bool:
    """Whether a drive known to be out of step hides what runs differ in."""
    own = nothing.fit
    return bool(own.problem.drive.in_step) and bool(disturbance_at_limit(own))

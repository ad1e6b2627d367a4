"""Reward terms: one bounded, smooth tolerance shape for all goals, and two small costs."""

from __future__ import annotations

from fish_env.model.jit import kernel


@kernel
def tolerance(error, margin):
    """1 at zero error, 1/2 at the margin, falling like 1/error^2 with a gradient everywhere."""
    ratio = error / margin
    return 1.0 / (1.0 + ratio * ratio)


@kernel
def saturating(cost, scale):
    """0 at no cost, 1/2 at the scale, below 1 always: a cost that cannot drown the goals."""
    return cost / (cost + scale)

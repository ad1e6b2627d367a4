"""What the information in the data allows: the filter at the truth, with the truth's own noise.

Fisher's information about one parameter of one effect is what its signal leaves when the
coefficients of the fish follow it as far as their priors let them; the noise is known, the cause
is known, and nothing else is looked for. From it follows the size at which a test of that
parameter alone has power 0.8.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.series import SeriesProblem
from fish_env.inference.detectability import changes
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.hypotheses import EffectName
from fish_env.inference.probes import Cause, probes_of
from fish_env.inference.problem import Point
from fish_env.inference.projection import Projector
from fish_env.model.effect import Effect
from tests.hidden.disturbances import MOMENT_PER_FORCE
from tests.hidden.truth import Truth

NEAR_NOTHING = (0.2, 0.1)
"""Shares of the published size between which a signal's slope is taken."""
ALONE = 0.05
"""Level of a test that looks for one cause only."""


def noncentrality(level: float, freedom: int = 1, power: float = 0.8) -> float:
    """What a chi-squared test of this level needs for this power."""
    bound = float(chi2.isf(level, freedom))
    return float(brentq(lambda nc: ncx2.sf(bound, freedom, nc) - power, 1e-3, 4.0 * bound + 100.0))


def oracle(problem: SeriesProblem, truth: Truth) -> Fit:
    """The filter at the true coefficients and the true noise, as a fit that takes no step."""
    baseline = problem.baseline
    values = np.array([truth.coefficients[path] for path in baseline.paths])
    point = Point(np.linalg.solve(baseline.factor, values - baseline.mean), {})
    force, memory = truth.disturbance["force"], truth.disturbance["time_constant"]
    sensors = np.array([truth.noise[name] for name in problem.channels])
    noise = NoiseModel(sensors, force, MOMENT_PER_FORCE * force, memory)
    return fit(problem, (), point, noise, refit_noise=False, iterations=0)


def limits(
    problem: SeriesProblem, truth: Truth, published: Mapping[str, float], threshold: float
) -> dict[str, dict[str, float]]:
    """effect.parameter -> smallest sizes that the information in the data allows.

    ``same``: at the level that the screen leaves each of its tests. ``alone``: at 5 %, as if no
    other cause had to be looked for. ``known``: as ``same``, with the coefficients known.

    Left out are effects with a shape, which may be any, and those whose published size is bounded
    by the simulation's step.

    Args:
        problem: the runs, without any effect in them.
        truth: what made them.
        published: effect.parameter -> size, near which the information is computed.
        threshold: log p-value that a test of the screen has to pass.
    """
    found = oracle(problem, truth)
    jobs = {
        name: [
            (name.split(".")[0], probe_at(problem, name, share * size)) for share in NEAR_NOTHING
        ]
        for name, size in published.items()
        if suits(problem.known[name.split(".")[0]])
    }
    small = changes(found, [pair[0] for pair in jobs.values()])
    smaller = changes(found, [pair[1] for pair in jobs.values()])
    projector, result = Projector(found), {}
    for name, change in zip(jobs, small - smaller, strict=True):
        slope = change / (NEAR_NOTHING[0] - NEAR_NOTHING[1])
        signal = projector.signal(Cause(EffectName(name)), 0, slope[:, None])
        if signal is not None:
            result[name] = _sizes(published[name], signal, threshold)
    return result


def suits(effect: Effect) -> bool:
    """Whether the information about an effect is a number that one can compute."""
    return effect.time_scale is None and not any(p.shapes for p in effect.parameters)


def _sizes(size: float, signal: Any, threshold: float) -> dict[str, float]:
    """A signal at some size, scaled to the sizes that are just found."""
    left, whole = float(signal.projected[0, 0]), signal.energy
    same, alone = noncentrality(float(np.exp(threshold))), noncentrality(ALONE)
    return {
        "same": size * float(np.sqrt(same / left)),
        "alone": size * float(np.sqrt(alone / left)),
        "known": size * float(np.sqrt(same / whole)),
    }


def probe_at(problem: SeriesProblem, name: str, size: float) -> dict[str, float]:
    """An effect at a size, on the side on which the screen probes it."""
    effect_name, parameter = name.split(".")
    effect = problem.known[effect_name]
    neutral = effect.neutral[parameter]
    probes = probes_of(effect, problem.longest_step)[0]
    there = next(p[parameter] for p in probes if p[parameter] != neutral)
    side = float(np.sign(there - neutral))
    return {**effect.neutral, parameter: neutral + side * size}

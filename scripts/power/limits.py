"""What the information in the data allows: the filter at the truth, with the truth's own noise.

Fisher's information about one parameter of one effect is what its signal leaves when the
coefficients of the fish follow it as far as their priors let them; the noise is known, the cause
is known, and nothing else is looked for. From it follows the size at which a test of that
parameter alone has power 0.8.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

from fish_env.diagnosis.causes import Cause
from fish_env.diagnosis.detectable import changes
from fish_env.diagnosis.preconditions import Precondition
from fish_env.diagnosis.screening import Projector, Screen
from fish_env.identification.filtering import NoiseModel
from fish_env.identification.free import Free, linearise, objective
from fish_env.identification.problem import Point, Problem
from tests.hidden.disturbances import MOMENT_PER_FORCE
from tests.hidden.truth import Truth

ALONE = 0.05
"""Level of a test that looks for one cause only."""


def noncentrality(level: float, freedom: int = 1, power: float = 0.8) -> float:
    """What a chi-squared test of this level needs for this power."""
    bound = float(chi2.isf(level, freedom))
    return float(brentq(lambda nc: ncx2.sf(bound, freedom, nc) - power, 1e-3, 4.0 * bound + 100.0))


def oracle(problem: Problem, truth: Truth) -> Any:
    """The filter at the true coefficients and the true noise, as a projector reads a fit."""
    baseline = problem.baseline
    values = np.array([truth.coefficients[path] for path in baseline.paths])
    point = Point(np.linalg.solve(baseline.factor, values - baseline.mean), {})
    force, memory = truth.disturbance["force"], truth.disturbance["time_constant"]
    sensors = np.array([truth.noise[name] for name in problem.channels])
    noise = NoiseModel(sensors, force, MOMENT_PER_FORCE * force, memory)
    free = Free(problem, (), ())
    vector = free.pack(point)
    filtered = objective(problem, free, vector, noise)[1]
    lines = linearise(problem, free, vector, noise, filtered)
    return SimpleNamespace(
        problem=problem, point=point, noise=noise, filtered=filtered, linearised=lines, released=()
    )


def limits(
    problem: Problem, truth: Truth, published: Sequence[Precondition], screen: Screen
) -> dict[str, dict[str, float]]:
    """effect.parameter -> smallest sizes that the information in the data allows.

    ``same``: at the level that the screen leaves each of its tests. ``alone``: at 5 %, as if no
    other cause had to be looked for. ``known``: as ``same``, with the coefficients known. Effects
    whose published size is bounded by the simulation's step are left out.
    """
    found = oracle(problem, truth)
    jobs = [
        (p.name, parameter, size, _probe(problem, screen, p.name, parameter, size))
        for p in published
        if problem.known[p.name].time_scale is None
        for parameter, size in p.smallest_detectable.items()
    ]
    seen = changes(found, [(name, probe) for name, _, _, probe in jobs])
    projector, result = Projector(found), {}
    for (name, parameter, size, _), change in zip(jobs, seen, strict=True):
        signal = projector.signal(Cause(name), 0, change[:, None])
        if signal is not None:
            result[f"{name}.{parameter}"] = _sizes(size, signal, screen.threshold)
    return result


def _sizes(size: float, signal: Any, threshold: float) -> dict[str, float]:
    """A signal at some size, scaled to the sizes that are just found."""
    left, whole = float(signal.projected[0, 0]), signal.energy
    same, alone = noncentrality(float(np.exp(threshold))), noncentrality(ALONE)
    return {
        "same": size * float(np.sqrt(same / left)),
        "alone": size * float(np.sqrt(alone / left)),
        "known": size * float(np.sqrt(same / whole)),
    }


def _probe(
    problem: Problem, screen: Screen, name: str, parameter: str, size: float
) -> dict[str, float]:
    """An effect at a size, with the shape and on the side that its published size is for."""
    effect = problem.known[name]
    signals = [s for s in screen.signals if s.cause.name == name]
    shaped = any(p.shapes for p in effect.parameters)
    chosen = max(signals, key=lambda s: float(np.trace(s.projected))) if shaped else signals[0]
    probes = chosen.cause.probes[chosen.probe]
    own = next(p for p in probes if p[parameter] != effect.neutral[parameter])
    neutral = effect.neutral[parameter]
    side = np.sign(own[parameter] - neutral)
    return {**own, parameter: float(neutral + side * size)}

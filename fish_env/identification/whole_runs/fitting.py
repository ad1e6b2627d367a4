"""Fits to whole runs, from a start far off and from one close by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fish_env.identification.whole_runs.noise import DRIFTS
from fish_env.identification.whole_runs.prediction import (
    whole_runs_of,
)
from fish_env.identification.whole_runs.problem import FREQUENCY_SCALE, WholeRunProblem
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.inference.progress import Report, silent

FIRST_STEPS, STEPS = 15, 40
"""Most Gauss-Newton steps under forgiving weights, and under those that count."""
KEPT = 0.5
"""Coefficients fitted without the effects have gone far to make up for them: half is kept."""
SHARE = 0.15
"""Share of an effect's plausible range to begin from: at neutral many an effect is flat."""


def fit_whole_runs(
    problem: WholeRunProblem,
    start: Point | None = None,
    report: Report = silent,
    steps: int = STEPS,
    refit_noise: bool = True,
) -> Fit:
    """Fit coefficients and the problem's effects to whole runs.

    From a start far off the tail is out of phase, and every step makes a whole-run error worse.
    Weights that let a run drift bring the fit near first.

    Args:
        problem: the runs.
        start: values of all parameters close to the estimates; default: found by such weights.
        report: told what is being done.
        steps: most Gauss-Newton steps under the weights that count.
        refit_noise: estimate how large errors are, and fit again under that.
    """
    names, noise = problem.effects, problem.default_noise()
    if start is None:
        problem, start = _near(problem, report)
    report("fitting whole runs")
    problem = problem.settled(start, noise)
    found = fit(problem, names, start, noise, refit_noise=False, iterations=steps)
    if not refit_noise:
        return found
    report("fitting the noise")
    again = _begun(found)
    return fit(again, names, found.point, noise, iterations=steps, rounds=2)


def _near(problem: WholeRunProblem, report: Report) -> tuple[WholeRunProblem, Point]:
    """A start close to the estimates, and the problem with the runs' own numbers there."""
    drifting = [
        replace(problem.default_noise(), speed_sd=speed, rate_sd=rate, memory_s=memory)
        for speed, rate, memory in DRIFTS
    ]
    report("searching for initial values")
    first = (FREQUENCY_SCALE,)
    alone = fit(problem, first, noise=drifting[0], refit_noise=False, iterations=FIRST_STEPS)
    names = problem.effects
    z = KEPT * alone.point.z if names != first else alone.point.z
    begin = Point(z, {**_effects_on(problem, names), **alone.point.effects})
    report("searching for initial values with the effects")
    near = fit(_begun(alone), names, begin, drifting[1], refit_noise=False, iterations=FIRST_STEPS)
    return _begun(near), near.point


def _effects_on(problem: WholeRunProblem, names: Sequence[str]) -> dict[EffectParameterId, float]:
    """Effects a little on, by parameter; those of the fish's file stay as they are."""
    values = problem.beginning(names)
    for name in names:
        if name in problem.fish.effects or name == FREQUENCY_SCALE:
            continue
        for p in problem.known[name].parameters:
            id = EffectParameterId(name, p.name)
            values[id] += SHARE * (p.far_end(values[id]) - values[id])
    return values


def _begun(found: Fit) -> WholeRunProblem:
    """The problem of a fit with the runs' own numbers as it found them."""
    return whole_runs_of(found).started([e.own for e in found.filtered])

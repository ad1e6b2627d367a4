"""Fits to whole runs, from a start far off and from one close by."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fish_env.data.vocabulary import COMMANDS
from fish_env.identification.whole_runs.noise import DRIFTS
from fish_env.identification.whole_runs.prediction import (
    MEANS,
    PLANAR,
    second_half,
    whole_runs_of,
)
from fish_env.identification.whole_runs.problem import FREQUENCY_SCALE, WholeRunProblem
from fish_env.identification.writing import posterior_of, with_posterior
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.hypotheses import parameter_path
from fish_env.inference.problem import Point
from fish_env.params.schema import FishParams

FIRST_STEPS, STEPS = 15, 40
"""Most Gauss-Newton steps under forgiving weights, and under those that count."""
KEPT = 0.5
"""Coefficients fitted without the effects have gone far to make up for them: half is kept."""
FEW_RUNS, SILENT = 3, 0.01
SHARE = 0.15
"""Share of an effect's plausible range to begin from: at neutral many an effect is flat."""


def fit_whole_runs(
    problem: WholeRunProblem,
    start: Point | None = None,
    report: Callable[[str], None] = lambda step: None,
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
    report("fitting the errors' size")
    again = _begun(found)
    return fit(again, names, found.point, noise, iterations=steps, rounds=2)


def _near(problem: WholeRunProblem, report: Callable[[str], None]) -> tuple[WholeRunProblem, Point]:
    """A start close to the estimates, and the problem with the runs' own numbers there."""
    drifting = [
        replace(problem.default_noise(), speed_sd=speed, rate_sd=rate, memory_s=memory)
        for speed, rate, memory in DRIFTS
    ]
    report("looking for a start")
    first = (FREQUENCY_SCALE,)
    alone = fit(problem, first, noise=drifting[0], refit_noise=False, iterations=FIRST_STEPS)
    names = problem.effects
    z = KEPT * alone.point.z if names != first else alone.point.z
    begin = Point(z, {**_effects_on(problem, names), **alone.point.effects})
    report("looking for a start with the effects")
    near = fit(_begun(alone), names, begin, drifting[1], refit_noise=False, iterations=FIRST_STEPS)
    return _begun(near), near.point


def _effects_on(problem: WholeRunProblem, names: Sequence[str]) -> dict[str, float]:
    """Effects a little on, by parameter; those of the fish's file stay as they are.

    A parameter that the runs do not show stays neutral: no slope would bring it back.
    """
    neutral = problem.beginning(names)
    values = dict(neutral)
    for name in names:
        if name in problem.fish.effects or name == FREQUENCY_SCALE:
            continue
        for p in problem.known[name].parameters:
            path, (low, high) = parameter_path(name, p.name), p.plausible
            far = high if abs(high - values[path]) >= abs(low - values[path]) else low
            values[path] += SHARE * (far - values[path])
    shown = shown_parameters(problem, values)
    return {path: value if path in shown else neutral[path] for path, value in values.items()}


def shown_parameters(problem: WholeRunProblem, values: Mapping[str, float]) -> set[str]:
    """Effect parameters whose change by a tenth changes what is measured, in units of the noise.

    Args:
        problem: the runs.
        values: effect parameter -> value, beside nominal coefficients.
    """
    few = problem.some(problem.spread(FEW_RUNS))
    count = 1 + len(values)
    effects = {path: np.full(count, value) for path, value in values.items()}
    for i, path in enumerate(values, start=1):
        effects[path][i] *= 0.9
    z = np.zeros((len(problem.baseline), count))
    own = [np.repeat(kind.guess[:, None], count, axis=1) for kind in few.own]
    moved = np.zeros(count)
    for errors in few.errors(z, effects, own):
        away = np.abs(np.nan_to_num(errors - errors[:1]) / np.array(few.default_noise().sd))
        away = away.reshape(count, -1)
        moved = np.maximum(moved, away.max(axis=1))
    return {path for path, change in zip(values, moved[1:], strict=True) if change > SILENT}


def _begun(found: Fit) -> WholeRunProblem:
    """The problem of a fit with the runs' own numbers as it found them."""
    return whole_runs_of(found).started([e.own for e in found.filtered])


def identified_fish(found: Fit, name: str) -> FishParams:
    """The fish of a fit to whole runs, with its posterior and validity.

    Args:
        found: the fit.
        name: name of the new fish.
    """
    problem = whole_runs_of(found)
    count = len(problem.baseline)
    seen = [i for i in range(len(found.names)) if i < count or _shows(found, i)]
    posterior = posterior_of(
        tuple(found.names[i] for i in seen),
        found.estimates[seen],
        found.covariance[np.ix_(seen, seen)],
        validity(found),
    )
    source = (
        f"identified from {problem.run_count} runs of {problem.dataset.name} over their whole "
        "length"
    )
    return with_posterior(problem.fish, posterior, name, source)


def _shows(found: Fit, i: int) -> bool:
    """Whether the runs show a parameter at all."""
    return bool(np.abs(found.linearised.slopes[:, i]).max() > 0.0)


def validity(found: Fit) -> dict[str, Any]:
    """Ranges of the commands and of second-half motion behind a fit, (lowest, highest), SI."""
    problem = whole_runs_of(found)
    commands = np.concatenate([run.commands[1] for run in problem.runs])
    rows = {name: commands[:, i] for i, name in enumerate(COMMANDS)}
    if set(PLANAR) <= set(problem.channels):
        columns = [problem.channels.index(name) for name in PLANAR]
        means = np.array([second_half(r.clock, r.measured[:, columns]) for r in problem.runs])
        rows |= dict(zip(MEANS, means.T, strict=True))
    return {name: [float(v.min()), float(v.max())] for name, v in rows.items()}

"""Before looking at residuals: what a table could show of each effect, and what not."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fish_env.diagnosis.preconditions import Precondition
from fish_env.diagnosis.steady.problem import SteadyProblem
from fish_env.diagnosis.steady.screening import (
    Screen,
    Signal,
    confusability,
    smallest_detectable,
)


def preconditions(
    problem: SteadyProblem, screen: Screen, names: Iterable[str]
) -> tuple[Precondition, ...]:
    """Detectability and confusability of every effect; one without a signal is not excited."""
    speaking = _representative(problem, screen)
    found = []
    for name in names:
        signal = speaking.get(name)
        if signal is None:
            found.append(Precondition(name, 1.0, {}, None, False))
            continue
        sizes = _sizes(problem, signal, screen.threshold)
        likest = _likest(signal, speaking)
        excited = _excited(problem, name, sizes)
        found.append(Precondition(name, signal.absorbed_share, sizes, likest, excited))
    return tuple(found)


def _representative(problem: SteadyProblem, screen: Screen) -> dict[str, Signal]:
    """The alternative of each effect that is nearest to what can just be detected.

    Effects saturate, so their size matters; where shapes differ, the one that shows best speaks.
    """
    alternatives: dict[str, list[Signal]] = {}
    for signal in screen.signals:
        if signal.cause.is_effect:
            alternatives.setdefault(signal.cause.name, []).append(signal)

    def multiple(signal: Signal) -> float:
        return min(smallest_detectable(signal, i, screen.threshold) for i in range(signal.freedom))

    return {
        name: min(
            signals,
            key=multiple
            if any(p.shapes for p in problem.known[name].parameters)
            else lambda s: abs(np.log(multiple(s))),
        )
        for name, signals in alternatives.items()
    }


def _sizes(problem: SteadyProblem, signal: Signal, threshold: float) -> dict[str, float]:
    """Departure of each switching parameter that is found with power 0.8, the others neutral."""
    effect = problem.known[signal.cause.name]
    sizes: dict[str, float] = {}
    for i, probe in enumerate(signal.cause.probes[signal.probe]):
        alone = smallest_detectable(signal, i, threshold)
        for name in (p.name for p in effect.switching):
            value, neutral = probe.get(name, effect.neutral[name]), effect.neutral[name]
            if value == neutral or name in sizes:
                continue
            if np.isinf(neutral):
                sizes[name] = float(value / np.sqrt(max(alone, 1e-12)))
            else:
                sizes[name] = float(alone * abs(value - neutral))
    return sizes


def _excited(problem: SteadyProblem, name: str, sizes: dict[str, float]) -> bool:
    """Whether some plausible size would have been found."""
    ranges = {p.name: p for p in problem.known[name].parameters}
    for key, size in sizes.items():
        p = ranges[key]
        if np.isinf(p.neutral):
            if size >= min(p.plausible):
                return True
        elif size <= max(abs(value - p.neutral) for value in p.plausible):
            return True
    return False


def _likest(signal: Signal, others: dict[str, Signal]) -> tuple[str, float] | None:
    pairs = [
        (name, confusability(signal, other))
        for name, other in others.items()
        if name != signal.cause.name
    ]
    return max(pairs, key=lambda pair: pair[1]) if pairs else None

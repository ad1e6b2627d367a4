"""Before looking at residuals: what these runs could show of each cause, and what not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.diagnosis.causes import Cause
from fish_env.diagnosis.screening import Screen, Signal, confusability, smallest_detectable
from fish_env.identification.problem import Problem


@dataclass(frozen=True)
class Precondition:
    """What the runs could show of one effect.

    Attributes:
        name: effect.
        absorbed_share: share of its signal that a refit of the baseline swallows.
        smallest_detectable: parameter -> departure from neutral found with power 0.8.
        most_confusable: the cause most like it, and their cosine.
        excited: whether a plausible size would have been found.
    """

    name: str
    absorbed_share: float
    smallest_detectable: dict[str, float]
    most_confusable: tuple[str, float] | None
    excited: bool


def preconditions(
    problem: Problem, screen: Screen, causes: Sequence[Cause]
) -> tuple[Precondition, ...]:
    """Detectability and confusability of every effect; a cause without a signal is not excited."""
    strongest = _representative(problem, screen)
    result = []
    for cause in causes:
        if not cause.is_effect:
            continue
        signal = strongest.get(cause.name)
        if signal is None:
            result.append(Precondition(cause.name, 1.0, {}, None, False))
            continue
        sizes = _sizes(problem, signal, screen.threshold)
        ranges = {p.name: p for p in problem.known[cause.name].parameters}
        excited = any(
            size <= max(abs(v - ranges[n].neutral) for v in ranges[n].plausible if np.isfinite(v))
            if np.isfinite(ranges[n].neutral)
            else size >= min(ranges[n].plausible)
            for n, size in sizes.items()
        )
        result.append(
            Precondition(
                cause.name, signal.absorbed_share, sizes, _nearest(signal, strongest), excited
            )
        )
    return tuple(result)


def _representative(problem: Problem, screen: Screen) -> dict[str, Signal]:
    """One alternative of each cause, to speak for it.

    A cause with shapes is judged by the shape that shows best. Without shapes the alternatives are
    sizes, and the one nearest to what can just be detected is the truest: effects saturate.
    """
    alternatives: dict[str, list[Signal]] = {}
    for signal in screen.signals:
        if signal.probe >= 0:
            alternatives.setdefault(signal.cause.name, []).append(signal)
    return {
        name: max(signals, key=lambda s: float(np.trace(s.projected)))
        if any(p.shapes for p in problem.known[name].parameters)
        else min(signals, key=lambda s: abs(np.log(_multiple(s, screen.threshold))))
        for name, signals in alternatives.items()
    }


def _multiple(signal: Signal, threshold: float) -> float:
    """Smallest detectable size in units of the alternative, of the setting that shows best."""
    return min(smallest_detectable(signal, i, threshold) for i in range(signal.freedom))


def _sizes(problem: Problem, signal: Signal, threshold: float) -> dict[str, float]:
    """Departure of each probed parameter that is found with power 0.8, the others neutral."""
    neutral = problem.known[signal.cause.name].neutral
    sizes = {}
    for i, probe in enumerate(signal.cause.probes[signal.probe]):
        alone = smallest_detectable(signal, i, threshold)
        for name, value in probe.items():
            if value == neutral[name] or name in sizes:
                continue
            if name not in problem.known[signal.cause.name].switching:
                continue
            if np.isinf(neutral[name]):
                sizes[name] = float(value / np.sqrt(max(alone, 1e-12)))
            else:
                sizes[name] = float(alone * abs(value - neutral[name]))
    return sizes


def _nearest(signal: Signal, others: dict[str, Signal]) -> tuple[str, float] | None:
    pairs = [
        (name, confusability(signal, other))
        for name, other in others.items()
        if name != signal.cause.name
    ]
    return max(pairs, key=lambda pair: pair[1]) if pairs else None

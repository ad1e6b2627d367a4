"""Before looking at residuals: what these runs could show of each cause, and what not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.inference.detectability import Setting, in_proportion, simulated
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.probes import Cause, Probe
from fish_env.inference.problem import Problem
from fish_env.inference.projection import Signal
from fish_env.inference.screening import Screen, confusability, smallest_detectable
from fish_env.inference.vehicle import Effect


@dataclass(frozen=True)
class Precondition:
    """What the runs could show of one effect.

    Attributes:
        name: effect.
        absorbed_share: share of its signal that a refit of the baseline absorbs.
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
    problem: Problem, screen: Screen, causes: Sequence[Cause], fit: Fit | None = None
) -> tuple[Precondition, ...]:
    """Detectability and confusability of every effect; a cause without a signal is not excited.

    Args:
        problem: the runs.
        screen: of the refitted baseline.
        causes: what was screened.
        fit: the refitted baseline, to simulate each effect at the size that is published; without
            it sizes are taken in proportion from plausible ones.
    """
    screen = screen.only(lambda signal: signal.tries == 1)  # a size is asked of one alternative
    strongest = _representative(problem, screen)
    sizes = _sizes(problem, screen, strongest, fit)
    result = []
    for cause in causes:
        if not cause.is_effect:
            continue
        signal = strongest.get(cause.effect)
        if signal is None:
            result.append(unseen(cause.effect))
            continue
        own = sizes[cause.effect]
        nearest = _nearest(signal, strongest)
        excited = _excited(problem.known[cause.effect], own)
        result.append(Precondition(cause.effect, signal.absorbed_share, own, nearest, excited))
    return tuple(result)


def unseen(name: str) -> Precondition:
    """Of an effect of which the data show nothing."""
    return Precondition(name, 1.0, {}, None, False)


def _excited(effect: Effect, sizes: Mapping[str, float]) -> bool:
    """Whether a plausible size of any parameter would have been found."""
    ranges = {p.name: p for p in effect.parameters}
    return any(
        size <= max(abs(v - ranges[n].neutral) for v in ranges[n].plausible if np.isfinite(v))
        if np.isfinite(ranges[n].neutral)
        else size >= min(ranges[n].plausible)
        for n, size in sizes.items()
    )


def _representative(problem: Problem, screen: Screen) -> dict[str, Signal]:
    """One alternative of each cause, to speak for it.

    A cause with shapes is judged by the shape that shows best. Without shapes the alternatives are
    sizes, and the one nearest to what can just be detected is the truest: effects saturate. One of
    its settings alone does not speak for all.
    """
    whole = {
        name: [s for s in signals if s.freedom == max(other.freedom for other in signals)]
        for name, signals in _alternatives(screen).items()
    }
    return {
        name: max(signals, key=lambda s: float(np.trace(s.projected)))
        if any(p.shapes for p in problem.known[name].parameters)
        else min(signals, key=lambda s: abs(np.log(_multiple(s, screen.threshold))))
        for name, signals in whole.items()
    }


def _alternatives(screen: Screen) -> dict[str, list[Signal]]:
    alternatives: dict[str, list[Signal]] = {}
    for signal in screen.signals:
        if signal.probe >= 0:
            alternatives.setdefault(signal.cause.effect, []).append(signal)
    return alternatives


def _multiple(signal: Signal, threshold: float) -> float:
    """Smallest detectable size in units of the alternative, of the setting that shows best."""
    return min(smallest_detectable(signal, i, threshold) for i in range(signal.freedom))


def _sizes(
    problem: Problem, screen: Screen, strongest: Mapping[str, Signal], fit: Fit | None
) -> dict[str, dict[str, float]]:
    """Departure of each switching parameter that is found with power 0.8, the others neutral."""
    settings = [s for signal in strongest.values() for s in _settings(problem, screen, signal)]
    multiples = (
        in_proportion(settings, screen.threshold)
        if fit is None
        else simulated(fit, screen, settings)
    )
    sizes: dict[str, dict[str, float]] = {name: {} for name in strongest}
    for setting, multiple in zip(settings, multiples, strict=True):
        sizes[setting.effect][setting.parameter] = setting.size(multiple)
    return sizes


def _settings(problem: Problem, screen: Screen, signal: Signal) -> list[Setting]:
    """The switching parameters of an effect, each from the mildest probe of the same shape.

    From the test of that probe alone where there is one.
    """
    effect = problem.known[signal.cause.effect]
    alternatives = _alternatives(screen)[effect.name]
    shapes = [p.name for p in effect.parameters if p.shapes]
    mildest = next(
        other
        for other in alternatives
        if all(_probe(other)[name] == _probe(signal)[name] for name in shapes)
    )
    alone = [s for s in alternatives if s.freedom == 1]
    found: dict[str, Setting] = {}  # no setting of what the channels do not show
    for i, probe in enumerate(mildest.cause.probes[mildest.probe]):
        test, at = next(((s, 0) for s in alone if _probe(s) == probe), (mildest, i))
        for p in effect.switching:
            if probe[p.name] != p.neutral:
                found.setdefault(p.name, Setting(test, at, p.name, p.neutral))
    return [found[p.name] for p in effect.switching if p.name in found]


def _probe(signal: Signal) -> Probe:
    """First setting of an alternative; all share the shape."""
    return signal.cause.probes[signal.probe][0]


def _nearest(signal: Signal, others: dict[str, Signal]) -> tuple[str, float] | None:
    pairs = [
        (name, confusability(signal, other))
        for name, other in others.items()
        if name != signal.cause.effect
    ]
    return max(pairs, key=lambda pair: pair[1]) if pairs else None

"""Causes a diagnosis may name: effects of the catalogue, and baseline coefficients set free."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from fish_env.effects.extended import PREFIX
from fish_env.identification.problem import Problem
from fish_env.model.effect import Effect, EffectParameter

Probe = Mapping[str, float]
PARAMETER = "parameter:"
Size = Callable[[EffectParameter], float]


@dataclass(frozen=True)
class Cause:
    """Something that may be wrong with the simulation.

    Attributes:
        name: effect name, or ``parameter:<path>``.
        probes: alternatives; each is a set of small settings whose signals span what the cause
            can do at that alternative (for a wave: sine and cosine at one frequency).
        path: baseline coefficient, for a parameter.
    """

    name: str
    probes: tuple[tuple[Probe, ...], ...] = ()
    path: str | None = None

    @property
    def is_effect(self) -> bool:
        """Whether it is an effect (else a baseline coefficient)."""
        return self.path is None


def causes_of(problem: Problem) -> tuple[Cause, ...]:
    """Every cause that can be considered for a problem."""
    effects = [
        Cause(effect.name, probes_of(effect))
        for effect in problem.known.values()
        if effect.acts_on_motion or effect.sample_time or effect.measure
    ]
    coefficients = [Cause(f"{PARAMETER}{p}", path=p) for p in problem.baseline.paths]
    return (*effects, *coefficients)


def probes_of(effect: Effect) -> tuple[tuple[Probe, ...], ...]:
    """Small settings that show what an effect does.

    Parameters that switch the effect on are probed one at a time; those that only shape it (a
    frequency, a phase, an anchor) take a few values of their plausible range.
    """
    switches = [p for p in effect.parameters if not p.shapes]
    shapes = [p for p in effect.parameters if p.shapes]
    settings = [
        dict(zip([s.name for s in shapes], values, strict=True))
        for values in product(*(_shape_values(s) for s in shapes))
    ]
    alternatives = []
    for setting in settings:
        for size in _sizes(switches):
            alternatives.append(
                tuple({**_off(effect, switches), **setting, p.name: size(p)} for p in switches)
            )
    return tuple(alternatives)


def _off(effect: Effect, switches: list[EffectParameter]) -> Probe:
    return {p.name: p.neutral for p in switches}


def _shape_values(parameter: EffectParameter) -> tuple[float, ...]:
    low, high = parameter.plausible
    if parameter.unit == "rad" and high - low > 6.0:
        return (0.0, np.pi / 2)
    if low > 0 and high / low > 4:
        return tuple(np.geomspace(low, high, 3).tolist())
    return tuple(np.linspace(low, high, 3).tolist())


def _sizes(switches: list[EffectParameter]) -> tuple[Size, Size]:
    """Sizes to probe, a small and a large one; where the neutral is infinite, low is strong."""
    if any(np.isinf(p.neutral) for p in switches):
        return (_weak_limit, _middling_limit)
    return (_small, _large)


def _weak_limit(p: EffectParameter) -> float:
    return p.plausible[1]


def _middling_limit(p: EffectParameter) -> float:
    return float(np.sqrt(p.plausible[0] * p.plausible[1]))


def _small(p: EffectParameter) -> float:
    low, high = p.plausible
    if low <= p.neutral <= high:
        return p.neutral + 0.1 * (high - p.neutral if high > p.neutral else low - p.neutral)
    return low if abs(low - p.neutral) < abs(high - p.neutral) else high


def _large(p: EffectParameter) -> float:
    low, high = p.plausible
    far = high if abs(high - p.neutral) >= abs(low - p.neutral) else low
    return p.neutral + 0.6 * (far - p.neutral)


def effect_values(problem: Problem, name: str, probe: Probe) -> dict[str, float]:
    """A probe as paths of the problem."""
    neutral = problem.known[name].neutral
    return {f"{PREFIX}{name}.{key}": probe.get(key, value) for key, value in neutral.items()}

"""Alternatives around one of a cause: other shapes, frequencies and directions."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from fish_env.inference.effects import EffectParameter
from fish_env.inference.probes import DIRECTIONS, QUARTER, Probe, is_direction, is_wide, phase_of
from fish_env.inference.vehicle import Effect


def finer(effect: Effect, probe: Probe, length: float) -> tuple[tuple[Probe, ...], ...]:
    """Sine and cosine at frequencies and other shapes around those of a probe.

    Between two frequencies that differ by a small part of a cycle in a run, a fit can get stuck.

    Args:
        effect: the effect; no alternatives unless it oscillates.
        probe: its parameters.
        length: of the longest run (s).
    """
    phase = phase_of(effect)
    if not phase:
        return ()
    shapes = [p for p in effect.parameters if p.shapes and p.name != phase]
    values = [_around(s, probe[s.name], length) for s in shapes]
    return tuple(
        tuple(
            {**probe, **dict(zip((s.name for s in shapes), chosen, strict=True)), phase: turn}
            for turn in QUARTER
        )
        for chosen in product(*values)
    )


def nearer(
    effect: Effect, settings: Sequence[Probe], share: float
) -> tuple[tuple[Probe, ...], ...]:
    """Settings with every shape where it is, and a little to either side; none without a shape.

    Args:
        effect: the effect.
        settings: one alternative of :func:`probes_of`.
        share: of the plausible range of each shape, or of a turn, by which it is moved.
    """
    shapes = [p for p in effect.parameters if p.shapes and p.probed]
    if not shapes:
        return ()
    values = [_beside(p, settings[0][p.name], share) for p in shapes]
    moved = [
        dict(zip((p.name for p in shapes), chosen, strict=True)) for chosen in product(*values)
    ]
    return tuple(tuple({**setting, **shape} for setting in settings) for shape in moved)


def turned(effect: Effect, alternatives: Sequence[tuple[Probe, ...]]) -> list[tuple[Probe, ...]]:
    """Alternatives of an oscillation, each in every direction that it may go.

    Args:
        effect: the effect.
        alternatives: sine and cosine of each.
    """
    phase = phase_of(effect)
    for direction in (p for p in effect.parameters if p.shapes and p.probed):
        if direction.name != phase and is_direction(direction):
            alternatives = [
                tuple({**p, direction.name: _turned(p[direction.name] + angle)} for p in own)
                for own in alternatives
                for angle in np.arange(DIRECTIONS) * 2.0 * np.pi / DIRECTIONS
            ]
    return list(alternatives)


def _turned(angle: float) -> float:
    """The same direction within half a turn of zero (rad)."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _around(parameter: EffectParameter, value: float, length: float) -> tuple[float, ...]:
    if not parameter.probed:
        return (value,)
    low, high = parameter.plausible
    if parameter.unit == "Hz":
        values = value + np.linspace(-0.7, 0.7, 15) / max(length, 1.0)
    elif parameter.unit == "rad":  # a direction: all four quarters
        values = value + np.array([-0.5, 0.0, 0.5, 1.0]) * np.pi
    else:
        values = value * np.array([0.4, 1.0, 2.5])
    return tuple(np.unique(np.clip(values, low, high)).tolist())


def _beside(parameter: EffectParameter, value: float, share: float) -> tuple[float, ...]:
    low, high = parameter.plausible
    steps = share * np.array([-1.0, 0.0, 1.0])
    if is_direction(parameter):
        return tuple(_turned(value + angle) for angle in (2.0 * np.pi * steps).tolist())
    values = value * (high / low) ** steps if is_wide(parameter) else value + (high - low) * steps
    return tuple(np.unique(np.clip(values, low, high)).tolist())

"""Where fits with one more cause begin: the linear estimate, every probe, and sizes between."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.hypotheses import EffectParameterId, of_effects
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Probe, effect_values, mirrored, phase_of
from fish_env.inference.problem import Point, Problem
from fish_env.inference.projection import Signal
from fish_env.inference.screening import zoomed
from fish_env.inference.vehicle import Effect


def starts(base: Fit, signal: Signal, z: FloatArray | None = None) -> list[Point]:
    """Where to begin: the linear estimate and every probe, with baselines near and far.

    With ``z`` given, that is the only baseline.
    """
    problem, cause = base.problem, signal.cause
    if not cause.is_effect:
        return [base.point]
    signal = zoomed(base, signal)
    linear = linear_estimate(base, signal, signal.size)
    others = [*probed(problem, signal), *_on_starting_grid(base, signal)]
    clipped = [linear, *(_clipped(base, cause.effect, values) for values in others)]
    begin = baselines(base) if z is None else (z,)
    return [Point(z, {**base.point.effects, **values}) for z in begin for values in clipped]


def linear_estimate(base: Fit, signal: Signal, size: FloatArray) -> dict[EffectParameterId, float]:
    """Parameters of an effect by the multiple (m,) of each setting, within what it may be."""
    problem, name = base.problem, signal.cause.effect
    start = {p.name: v for p, v in problem.neutral([name]).items()}
    settings = signal.cause.probes[signal.probe]
    estimate = combined(problem.known[name], settings, size.tolist(), start)
    return _clipped(base, name, effect_values(problem, name, estimate))


def _clipped(
    base: Fit, name: str, values: Mapping[EffectParameterId, float]
) -> dict[EffectParameterId, float]:
    bounds = {f.id: (f.lower, f.upper) for f in base.problem.freedoms([name])}
    return {id: float(np.clip(value, *bounds[id])) for id, value in values.items()}


def _on_starting_grid(base: Fit, signal: Signal) -> list[dict[EffectParameterId, float]]:
    """Sizes of the starting grid, unless the filter follows the drive's phase anyway."""
    problem, name = base.problem, signal.cause.effect
    if problem.follows_drive(base.noise):
        return []
    return [effect_values(problem, name, size) for size in problem.starting_grid(name)]


def baselines(base: Fit) -> tuple[FloatArray, ...]:
    """Coefficients to begin from.

    Those refitted without a cause may have gone far to make up for it, so the nominal ones are a
    start of their own.
    """
    far = np.abs(base.point.z).max() > POLICY.far_start_sd
    return (base.point.z, np.zeros_like(base.point.z)) if far else (base.point.z,)


def probed(
    problem: Problem, signal: Signal, every: bool = False
) -> list[dict[EffectParameterId, float]]:
    """Settings to begin from: as measured, of the best shape at every size, or every alternative.

    What was measured of a drive comes first. On either side of neutral where there are two: of a
    strong effect no linear estimate tells the sign. Never from neutral itself, where many an effect
    begins too flat to be left again.
    """
    cause, effect = signal.cause, problem.known[signal.cause.effect]
    shaped = len(effect.switching) < len(effect.parameters)
    alternatives = (cause.probes[signal.probe],) if shaped and not every else cause.probes
    settings = on_both_sides(effect, (p for probes in alternatives for p in probes))
    begin = [effect_values(problem, cause.effect, p) for p in settings]
    measured = of_effects(problem.drive.in_step, {cause.effect})
    return [{**begin[0], **measured}, *begin] if measured else begin


def on_both_sides(effect: Effect, probes: Iterable[Probe]) -> list[Probe]:
    """Different settings of an effect, then those on the other side of neutral.

    Args:
        effect: the effect.
        probes: some of its settings, perhaps repeated.
    """
    settings: list[Probe] = []
    for probe in probes:
        if probe not in settings:
            settings.append(probe)
    opposite = [o for o in (mirrored(effect, p) for p in settings) if o not in settings]
    return settings + [o for o in opposite if any(o[p.name] != p.neutral for p in effect.switching)]


def combined(
    effect: Effect, settings: Sequence[Probe], size: Sequence[float], start: Probe
) -> Probe:
    """Parameters that do what so many times each setting does, where effects add.

    Args:
        effect: the effect.
        settings: one alternative of :func:`probes_of`; of an oscillation perhaps once a run.
        size: multiple of each setting.
        start: values that the settings depart from.
    """
    if phase := phase_of(effect):
        return _oscillation(effect, phase, settings, size)
    values = {**start, **{p.name: settings[0][p.name] for p in effect.parameters if p.shapes}}
    for factor, setting in zip(size, settings, strict=True):
        for name in (p.name for p in effect.switching):
            endless = np.isinf(start[name])
            values[name] = (
                setting[name] if endless else values[name] + factor * (setting[name] - start[name])
            )
    return values


def _oscillation(
    effect: Effect, phase: str, settings: Sequence[Probe], size: Sequence[float]
) -> Probe:
    """Amplitude and phase of so many times each setting.

    Where settings repeat, once for each run, the amplitude is the root mean square of the runs'
    own, and the phase that of their sum. One of sine and cosine may be left out: a planar record
    may hold nothing of it.
    """
    (amplitude,) = (p.name for p in effect.switching)
    own = [setting[amplitude] * np.exp(1j * setting[phase]) for setting in settings]
    runs = sum(setting == settings[0] for setting in settings)
    waves = (np.array(own) * np.array(size)).reshape(runs, -1).sum(axis=1)
    whole, power = waves.sum(), float(np.mean(np.abs(waves) ** 2))
    return {**settings[0], amplitude: float(np.sqrt(power)), phase: float(np.angle(whole))}

"""Causes a diagnosis may name: effects of the catalogue, and baseline coefficients set free."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Protocol, TypeVar

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.effects import EffectParameter
from fish_env.inference.hypotheses import CauseId, Coefficient, EffectName, EffectParameterId
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Problem
from fish_env.inference.vehicle import Effect

Probe = Mapping[str, float]
MOST_FREQUENCIES = 96
QUARTER = (0.0, np.pi / 2)
MOST_GRID_SIZES = 96
"""Of a starting grid."""
DIRECTIONS = 6
"""How many of a turn are tried of a shape that is a direction."""
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Sizes tried between small and large."""


@dataclass(frozen=True)
class Cause:
    """Something that may be wrong with the simulation.

    Attributes:
        id: which.
        probes: alternatives; each is a set of small settings whose signals span what the cause
            can do at that alternative (for a wave: sine and cosine at one frequency).
    """

    id: CauseId
    probes: tuple[tuple[Probe, ...], ...] = ()

    @property
    def is_effect(self) -> bool:
        """Whether it is an effect (else a baseline coefficient)."""
        return not isinstance(self.id, Coefficient)

    @property
    def effect(self) -> EffectName:
        """The effect, of a cause that is one."""
        assert not isinstance(self.id, Coefficient)
        return self.id


class Knowing(Protocol):
    """A problem that knows effects by name."""

    @property
    def known(self) -> Mapping[str, Effect]:
        """Effects by name."""
        ...


class Tested(Protocol):
    """A test of a cause."""

    @property
    def cause(self) -> Cause:
        """What was tested."""
        ...


T = TypeVar("T", bound=Tested)
S = TypeVar("S")


def coefficient_sizes(
    tests: Iterable[T], smallest: Callable[[T], float]
) -> dict[Coefficient, float]:
    """How far off each coefficient is found with power 0.8, in prior standard deviations.

    One that the data know little of would have to be further off than any prior allows.
    """
    pairs = ((test, test.cause.id) for test in tests)
    return {id: smallest(test) for test, id in pairs if isinstance(id, Coefficient)}


def best_of_each(tests: Iterable[T], log_p: Callable[[T], float]) -> list[T]:
    """The most significant test of each cause, the most significant cause first."""
    chosen: dict[CauseId, T] = {}
    for test in sorted(tests, key=log_p):
        chosen.setdefault(test.cause.id, test)
    return list(chosen.values())


def of_visible(
    test: Callable[[Cause, int, FloatArray], S | None],
    cause: Cause,
    probe: int,
    columns: FloatArray,
) -> S | None:
    """The test of those settings of an alternative that change something in what is measured.

    For an alternative whose whole test finds nothing: None where no setting shows, or where each
    shows and only all at once leave nothing. A camera overhead sees the yaw of a sensor that
    is mounted askew, and nothing of its roll and pitch.

    Args:
        test: of a cause at an alternative by what its settings change; None where one of them
            leaves nothing.
        cause: the cause.
        probe: index of the alternative.
        columns: (D, m) what its m settings change.
    """
    settings = range(columns.shape[1])
    if len(settings) == 1:
        return None
    live = [i for i in settings if test(cause, probe, columns[:, [i]]) is not None]
    if not live or len(live) == len(settings):
        return None
    probes = list(cause.probes)
    probes[probe] = tuple(cause.probes[probe][i] for i in live)
    return test(replace(cause, probes=tuple(probes)), probe, columns[:, live])


def causes_of(problem: Problem) -> tuple[Cause, ...]:
    """Every cause that can be considered for a problem.

    One physical cause has one name: a coefficient that an effect equals goes by the effect's.
    """
    step = problem.longest_step
    length = problem.longest_run
    effects = [
        Cause(
            EffectName(effect.name),
            each_alone(probes_of(effect, step, length, effect.name in problem.hidden_by_drive)),
        )
        for effect in problem.known.values()
        if effect.diagnosed
    ]
    named = {path for effect in problem.known.values() for path in effect.equals}
    coefficients = [Cause(id) for id in problem.baseline.ids if id.path not in named]
    return (*effects, *coefficients)


def probes_of(
    effect: Effect, step: float = 0.0, length: float = 0.0, between: bool = False
) -> tuple[tuple[Probe, ...], ...]:
    """Small and large settings that show what an effect does.

    Parameters that switch the effect on are probed one at a time; those that only shape it (a
    depth, an anchor) take a few values of their plausible range. An oscillation is probed as its
    sine and its cosine together, at frequencies close enough to each other that none is missed.

    Args:
        effect: the effect.
        step: longest RK4 step (s); settings that are too quick for it are moved towards the large
            ones until they are not.
        length: of the longest run (s).
        between: whether it is probed at sizes between as well. A lag moves the phase of a drive,
            which a run's own phase makes up for at one size, and not at another.
    """
    if phase_of(effect):
        return _oscillations(effect, length)
    shapes = [p for p in effect.parameters if p.shapes]
    further = SHARES[1:] if between else SHARES[-1:]
    alternatives: list[tuple[Probe, ...]] = []
    for values in product(*(_shape_values(s) for s in shapes)):
        setting = dict(zip([s.name for s in shapes], values, strict=True))
        for shares in (SHARES, *((share,) for share in further)):
            slow = _first_followed(effect, setting, shares, step)
            if slow and slow not in alternatives:
                alternatives.append(slow)
    if effect.drifts_in_phase:
        alternatives.insert(0, tuple(_milder(effect, probe) for probe in alternatives[0]))
    return tuple(alternatives)


def mildest(effect: Effect, step: float = 0.0) -> tuple[Probe, ...]:
    """The smallest settings that steps (s) follow, one for each parameter that switches it on.

    With what only shapes the effect in the middle of what is plausible.
    """
    shapes = [p for p in effect.parameters if p.shapes]
    setting = {s.name: _middle(s)[0] for s in shapes}
    return _first_followed(effect, setting, SHARES, step)


def _first_followed(
    effect: Effect, setting: Probe, shares: Sequence[float], step: float
) -> tuple[Probe, ...]:
    """An alternative at the first of some sizes that steps (s) follow; empty where none is."""
    for share in shares:
        probes = _alternative(effect, setting, share)
        if all(effect.is_followed(probe, step) for probe in probes):
            return probes
    return ()


def share_of_usual(effect: Effect, probe: Probe) -> float:
    """The largest size in a setting, as a share of the farthest that is plausible.

    What is off at infinity acts by its inverse.
    """
    shares = [
        _far(p) / probe[p.name]
        if np.isinf(p.neutral)
        else (probe[p.name] - p.neutral) / (_far(p) - p.neutral)
        for p in effect.switching
    ]
    return max(map(abs, shares))


def each_alone(probes: tuple[tuple[Probe, ...], ...]) -> tuple[tuple[Probe, ...], ...]:
    """The alternatives and, where many settings are tested together, each by itself as well.

    With every setting that is tested too, one of them has to be larger to be found: six together
    ask for a quarter more of each than one alone.
    """
    mildest = probes[0] if probes else ()
    if len(mildest) < POLICY.fewest_settings_apart:
        return probes
    return (*probes, *((probe,) for probe in mildest))


def farthest(effect: Effect, probe: Probe, step: float) -> Probe | None:
    """A setting with what is switched on in it at the end of its plausible range.

    For an effect that does nothing up to some size: a limit that is never met, a surface that is
    never touched. None where simulation steps (s) do not follow it there, or it is there already.
    """
    ends = {p.name: _far(p) for p in effect.switching if probe[p.name] != p.neutral}
    there = {**probe, **ends}
    return there if there != dict(probe) and effect.is_followed(there, step) else None


def _far(p: EffectParameter) -> float:
    """The end of the plausible range that is farthest from neutral; of infinity, the near one."""
    low, high = p.plausible
    if np.isinf(p.neutral):
        return low if p.neutral > 0.0 else high
    return p.far_end(p.neutral)


def _milder(effect: Effect, probe: Probe) -> Probe:
    """A third of the setting: with more of it the drive is out of step before a run ends."""
    third = {p.name: p.neutral + (probe[p.name] - p.neutral) / 3.0 for p in effect.switching}
    return {**probe, **third}


def phase_of(effect: Effect) -> str | None:
    """The phase (rad) of an effect that oscillates with one amplitude; None of any other."""
    phases = [p.name for p in effect.parameters if p.shapes and _turns(p)]
    switches = effect.switching
    return phases[0] if len(phases) == 1 and len(switches) == 1 else None


def _turns(parameter: EffectParameter) -> bool:
    low, high = parameter.plausible
    return parameter.unit == "rad" and high - low > 6.0


def is_direction(parameter: EffectParameter) -> bool:
    """Whether a shape is a direction: plausible all around."""
    low, high = parameter.plausible
    return parameter.unit == "rad" and high - low >= 6.0


def _oscillations(effect: Effect, length: float) -> tuple[tuple[Probe, ...], ...]:
    """Sine and cosine at every frequency that runs of a length (s) can tell from its neighbours."""
    phase = phase_of(effect)
    (size,) = effect.switching
    shapes = [p for p in effect.parameters if p.shapes and p.name != phase]
    values = [_frequencies(s, length) if s.unit == "Hz" else _middle(s) for s in shapes]
    return tuple(
        tuple(
            dict(zip((s.name for s in shapes), chosen, strict=True))
            | {str(phase): turn, size.name: _small(size)}
            for turn in QUARTER
        )
        for chosen in product(*values)
    )


def _frequencies(parameter: EffectParameter, length: float) -> tuple[float, ...]:
    """Two thirds of a cycle in a run apart, but no more than :data:`MOST_FREQUENCIES`."""
    low, high = parameter.plausible
    count = int(np.clip(1.5 * (high - low) * length, 3, MOST_FREQUENCIES))
    return tuple(np.linspace(low, high, count).tolist())


def _middle(parameter: EffectParameter) -> tuple[float, ...]:
    if not parameter.probed:
        return (parameter.neutral,)
    low, high = parameter.plausible
    return (float(np.sqrt(low * high)) if low > 0.0 else 0.5 * (low + high),)


def mirrored(effect: Effect, probe: Probe) -> Probe:
    """The setting as far on the other side of neutral, within what physics allows."""
    other = dict(probe)
    for p in effect.switching:
        if np.isfinite(p.neutral):
            other[p.name] = float(np.clip(2.0 * p.neutral - probe[p.name], p.lower, p.upper))
    return other


def phase_grid(effect: Effect, cycles: float) -> tuple[Probe, ...]:
    """Starting grid of an effect that drifts in phase, on both sides of neutral; else empty.

    The spacing leaves the drive at most a small part of a cycle out of step at one of the sizes:
    from further away no slope leads to the right one.

    Args:
        effect: the effect.
        cycles: of the drive, in the run that has most.
    """
    if not effect.drifts_in_phase or len(effect.switching) != 1:
        return ()
    (size,) = effect.switching
    reach = max(abs(end - size.neutral) for end in size.plausible)
    low, high = max(size.neutral - reach, size.lower), min(size.neutral + reach, size.upper)
    count = 2 * int(np.clip(0.5 * cycles, 2, MOST_GRID_SIZES // 2))  # none of them neutral
    return tuple({size.name: float(value)} for value in np.linspace(low, high, count))


def _alternative(effect: Effect, setting: Probe, share: float) -> tuple[Probe, ...]:
    off = {p.name: p.neutral for p in effect.switching}
    return tuple({**off, **setting, p.name: _between(p, share)} for p in effect.switching)


def _shape_values(parameter: EffectParameter) -> tuple[float, ...]:
    if not parameter.probed:
        return (parameter.neutral,)
    low, high = parameter.plausible
    if is_direction(parameter):  # both ends are one direction
        return tuple((low + 2.0 * np.pi / DIRECTIONS * np.arange(DIRECTIONS)).tolist())
    if is_wide(parameter):
        return tuple(np.geomspace(low, high, 3).tolist())
    return tuple(np.linspace(low, high, 3).tolist())


def is_wide(parameter: EffectParameter) -> bool:
    """Whether a shape is known by its order of magnitude."""
    low, high = parameter.plausible
    return low > 0.0 and high / low > 4.0


def _between(p: EffectParameter, share: float) -> float:
    """A size from small (share 0) to large (share 1)."""
    small, large = _ends(p)
    if small * large > 0.0:
        return float(small * (large / small) ** share)
    return small + share * (large - small)


def _ends(p: EffectParameter) -> tuple[float, float]:
    """A small and a large departure from neutral; where neutral is infinite, low is large."""
    low, high = p.plausible
    if np.isinf(p.neutral):
        mild = high if p.neutral > 0.0 else low
        return mild, float(np.copysign(np.sqrt(low * high), mild))
    return _small(p), p.neutral + 0.6 * (p.far_end(p.neutral) - p.neutral)


def _small(p: EffectParameter) -> float:
    low, high = p.plausible
    if low <= p.neutral <= high:
        return p.neutral + 0.1 * (high - p.neutral if high > p.neutral else low - p.neutral)
    return low if abs(low - p.neutral) < abs(high - p.neutral) else high


def effect_values(problem: Knowing, name: str, probe: Probe) -> dict[EffectParameterId, float]:
    """A probe as values of the effect's parameters, those that it leaves out neutral."""
    neutral = problem.known[name].neutral
    return {EffectParameterId(name, k): probe.get(k, value) for k, value in neutral.items()}

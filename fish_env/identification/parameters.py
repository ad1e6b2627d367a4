"""Baseline coefficients of a fish under their priors, and what effects do to its sensors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import Dataset
from fish_env.data.vocabulary import COMMANDS
from fish_env.effects.extended import ExtendedModel
from fish_env.errors import ParameterError
from fish_env.identification.channels import from_above
from fish_env.identification.filtering import Measurement
from fish_env.inference.hypotheses import Coefficient, EffectParameterId, effects_of
from fish_env.inference.vehicle import Coefficients
from fish_env.model.effect import Effect
from fish_env.params.packing import PATHS
from fish_env.params.schema import FishParams
from fish_env.sensing.devices import Device
from fish_env.sensing.measurement import device_ages_s

ALIKE = (frozenset(map(Coefficient, ("body.plane_xz.drag.c0", "body.plane_xy.drag.c0"))),)
"""Coefficients that act alike: both planes' drags at zero incidence brake along the fish."""

PLANAR_PATHS = (
    "mass.static_moment_rest[0]",
    "inertia.rest[2]",
    "tail.root[0]",
    "tail.center_of_pressure",
    "tail.area",
    "tail.drag.c0",
    "tail.drag.c2",
    "tail.lift.c1",
    "body.area[0]",
    "body.area[1]",
    "body.plane_xz.drag.c0",
    "body.plane_xy.drag.c0",
    "body.plane_xy.drag.c2",
    "body.plane_xy.lift.c1",
    "body.plane_xy.impact_moment",
    "body.rotational_damping[2]",
)
"""Coefficients that a fish swimming level shows to a camera overhead; the others keep their values.
Its mass is among those: forces over mass is all that a path shows, and a mass that leaves the
buoyancy behind would let the fish sink, unseen, and so find another drag."""
LEVEL_PATHS = (
    *PLANAR_PATHS,
    "mass.static_moment_rest[1]",
    "mass.static_moment_rest[2]",
    "inertia.rest[0]",
    "body.rotational_damping[0]",
    "mass.total",
    "mass.buoyancy",
)
"""The same for steps between samples, where the mass is free too and the buoyancy follows it.

The beat rolls the fish, and a camera sees that by a marker above the axis: with the roll inertia
held, predictions of a real fish are worse by a third to a half in x and in y."""
HELD = 1e-3
"""Share of its prior standard deviation that is left to a coefficient that is held."""


class Baseline(Coefficients):
    """Baseline coefficients of a fish with a prior.

    Args:
        fish: nominal parameters and priors.
        paths: which coefficients are free; default: all with a prior that the model reads.
        held: those among ``paths`` that only follow the ones before them that their prior ties
            them to, as the buoyancy follows the mass.
    """

    def __init__(
        self, fish: FishParams, paths: Sequence[str] | None = None, held: Iterable[str] = ()
    ) -> None:
        self.fish = fish
        read = set(PATHS.values()) - {"weight_block.crank.l1", "weight_block.crank.l2"}
        free = [p for p in fish.values() if p in read and fish.prior_sd(p) > 0]
        chosen = tuple(free if paths is None else paths)
        known = [fish.info(path) for path in chosen]
        super().__init__(
            chosen,
            np.array([fish.get(path) for path in chosen]),
            _with_held(fish.prior_covariance(list(chosen)), [chosen.index(path) for path in held]),
            (np.array([i.lower for i in known]), np.array([i.upper for i in known])),
            [i.unit for i in known],
            self._is_a_fish,
        )

    def _is_a_fish(self, values: Mapping[str, float]) -> bool:
        try:
            self.fish.replace(dict(values), "identified")
        except ParameterError:
            return False
        return True


def shows_level_swimming(dataset: Dataset) -> bool:
    """Whether a camera overhead saw a fish whose weight block was never moved."""
    block = ["block" in name for name in COMMANDS]
    still = not any(run.commands.values[:, block].any() for run in dataset.runs)
    return still and from_above(dataset.channels)


def baseline_of(dataset: Dataset, fish: FishParams, paths: Sequence[str] | None = None) -> Baseline:
    """Coefficients that some data may show.

    Args:
        dataset: measured runs.
        fish: nominal parameters and priors.
        paths: which are free; default: all with a prior, or those of level swimming where a camera
            overhead saw nothing else.
    """
    if paths is None and shows_level_swimming(dataset):
        return Baseline(fish, LEVEL_PATHS, LEVEL_PATHS[-1:])
    return Baseline(fish, paths)


def _with_held(covariance: FloatArray, held: Sequence[int]) -> FloatArray:
    """A prior's covariance with hardly any of what some rows have beyond the rows before them."""
    factor = np.linalg.cholesky(covariance)
    factor[:, held] *= HELD
    return factor @ factor.T


def neutral_values(
    model: ExtendedModel, known: Mapping[str, Effect], names: Iterable[str]
) -> dict[EffectParameterId, float]:
    """Parameters of effects as the fish's file has them, neutral where it says nothing."""
    values: dict[EffectParameterId, float] = {}
    for name in names:
        own = model.effects.get(name, known[name].neutral)
        values |= {EffectParameterId(name, p): v for p, v in own.items()}
    return values


def changes_of(
    model: ExtendedModel,
    known: Mapping[str, Effect],
    baseline: Coefficients,
    z: FloatArray,
    effects: Mapping[EffectParameterId, FloatArray],
    channels: Sequence[str],
) -> tuple[dict[str, FloatArray], Measurement]:
    """Values of parameters by their text, each (N,), and what the sensors do, for N points.

    Args:
        model: the fish.
        known: effects by name.
        baseline: free coefficients.
        z: (n, N) coefficients in units of their prior.
        effects: effect parameter -> (N,).
        channels: measured channels.
    """
    values = dict(zip(baseline.paths, baseline.values(z), strict=True))
    names = effects_of(effects)
    moving = {n for n in names if known[n].acts_on_motion}
    values |= {str(id): own for id, own in effects.items() if id.effect in moving}
    sensing = [known[n] for n in sorted(names - moving)]
    own = [e for e in model.measurement if e.name not in names]
    return values, measurement_of(model, [*own, *sensing], effects, channels, z.shape[1])


def measurement_of(
    model: ExtendedModel,
    effects: Sequence[Effect],
    values: Mapping[EffectParameterId, FloatArray],
    channels: Sequence[str],
    count: int,
) -> Measurement:
    """What measurement effects do to clock and channels, for each of ``count`` lanes.

    Their functions are affine in time and channels, so two probes give factor and offset; what
    mixes channels is their geometry.

    Args:
        model: unused effects of the model keep their own values.
        effects: measurement effects in play.
        values: effect parameter -> (count,).
        channels: measured channels.
        count: number of lanes.
    """
    pace, delay, by_commands = np.ones(count), np.zeros(count), np.ones(count)
    geometry: dict[str, FloatArray] = {}
    ages, cutoff = np.zeros((len(Device), count)), np.full(count, np.inf)
    gain, bias = np.ones((len(channels), count)), np.zeros((len(channels), count))
    for effect in effects:
        base = model.effects.get(effect.name, effect.neutral)
        own = {
            p: np.broadcast_to(values.get(EffectParameterId(effect.name, p), base[p]), (count,))
            for p in base
        }
        if effect.sample_time is not None:
            zero = effect.sample_time(np.zeros(count), own)
            one = effect.sample_time(np.ones(count), own)
            slope = one - zero
            pace, delay = pace * slope, delay * slope - zero
        if effect.command_time is not None:
            by_commands = by_commands * effect.command_time(np.ones(count), own)
        if effect.geometry is not None:
            geometry |= effect.geometry(own)
        ages += device_ages_s(effect, own, count)
        if effect.low_pass is not None:
            cutoff = np.minimum(cutoff, effect.low_pass(own))
        if effect.measure is not None:
            zeros = {name: np.zeros(count) for name in channels}
            ones = {name: np.ones(count) for name in channels}
            low, high = effect.measure(zeros, own), effect.measure(ones, own)
            for i, name in enumerate(channels):
                factor = high[name] - low[name]
                gain[i] = gain[i] * factor
                bias[i] = bias[i] * factor + low[name]
    return Measurement(
        pace,
        pace / by_commands,
        delay / by_commands,
        np.ascontiguousarray(gain),
        np.ascontiguousarray(bias),
        geometry,
        ages if ages.any() else None,
        cutoff if np.isfinite(cutoff).any() else None,
    )

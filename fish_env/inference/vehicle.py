"""What a vehicle declares of itself: effects it may show, coefficients with their priors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np
from scipy.optimize import bisect

from fish_env.arrays import BoolArray, FloatArray
from fish_env.inference.effects import EffectParameter, Parts
from fish_env.inference.hypotheses import (
    Coefficient,
    EffectName,
    EffectParameterId,
    effects_of,
)


class Effect(Protocol):
    """Something a vehicle does beyond its baseline model."""

    @property
    def name(self) -> str:
        """Public name."""
        ...

    @property
    def parameters(self) -> Sequence[EffectParameter]:
        """Its parameters, those that switch it on and those that shape it."""
        ...

    @property
    def switching(self) -> Sequence[EffectParameter]:
        """The parameters that switch it on."""
        ...

    @property
    def neutral(self) -> dict[str, float]:
        """Parameter values that switch it off."""
        ...

    @property
    def nonsmooth(self) -> bool:
        """Whether it makes the motion's rate jump, so that slopes tell little of large sizes."""
        ...

    @property
    def drifts_in_phase(self) -> bool:
        """Whether a periodic drive gets ever further out of phase, so that large sizes mislead."""
        ...

    @property
    def diagnosed(self) -> bool:
        """Whether a diagnosis looks for it."""
        ...

    @property
    def equals(self) -> tuple[str, ...]:
        """Coefficients (paths) other values of which do exactly the same."""
        ...

    @property
    def confusable_with(self) -> tuple[str, ...]:
        """Names of effects with a similar signature."""
        ...

    def in_parts(self, values: Mapping[str, float]) -> Parts:
        """Other effects, with their parameters, that together do nearly the same; or none."""
        ...

    def is_followed(self, values: Mapping[str, float], step: float) -> bool:
        """Whether simulation steps (s) follow it at these values."""
        ...


STABLE = 0.45
"""Share of a step for which an effect is followed at which RK4 is stable yet. It is down to time
constants of 0.36 steps, and an effect is followed where its shortest one is about a step."""
BEYOND = 1e4
"""Multiple of the largest plausible value at which nothing is too quick that is not at any."""


@dataclass(frozen=True)
class EffectFreedom:
    """A free parameter of an effect.

    Attributes:
        id: the parameter.
        lower: smallest value allowed.
        upper: largest value allowed; of what is off at infinity, the largest that the simulation
            follows.
        step: size for finite differences, about a hundredth of what matters.
        least: values between neutral and this one are too quick to be simulated; minus infinity
            where none is.
    """

    id: EffectParameterId
    lower: float
    upper: float
    step: float
    least: float


def freedoms(effect: Effect, step: float) -> tuple[EffectFreedom, ...]:
    """All parameters of an effect, free within their physical bounds, for RK4 steps (s)."""
    return tuple(
        EffectFreedom(
            EffectParameterId(effect.name, p.name),
            p.lower,
            min(p.upper, most_followed(effect, p, step)),
            0.02 * (p.plausible[1] - p.plausible[0]),
            least_followed(effect, p, step),
        )
        for p in effect.parameters
    )


def _is_followed(effect: Effect, parameter: EffectParameter, step: float, value: float) -> bool:
    """Whether RK4 steps (s) follow an effect of which one parameter has a value."""
    return effect.is_followed({**effect.neutral, parameter.name: value}, step)


def most_followed(effect: Effect, parameter: EffectParameter, step: float) -> float:
    """Largest value of a parameter that is off at infinity which RK4 steps (s) follow.

    Infinity where they follow any, or none that is plausible, and for all other parameters. Beyond
    it predictions and extended models would diverge.
    """
    low, far = parameter.plausible[0], BEYOND * parameter.plausible[1]

    is_followed = partial(_is_followed, effect, parameter, step)
    if np.isfinite(parameter.neutral) or is_followed(far) or not is_followed(low):
        return np.inf
    return float(bisect(lambda value: is_followed(value) - 0.5, low, far))


def least_followed(effect: Effect, parameter: EffectParameter, step: float) -> float:
    """Smallest value of one parameter above neutral that RK4 steps (s) follow.

    Minus infinity where they follow any, and where the effect is as quick at every size: it then
    has short steps of its own.
    """
    is_followed = partial(_is_followed, effect, parameter, step)
    neutral, far = parameter.neutral, parameter.plausible[1]
    near = neutral + 1e-9 * (far - neutral)
    if not np.isfinite(neutral) or is_followed(near) or not is_followed(far):
        return -np.inf
    return float(bisect(lambda value: is_followed(value) - 0.5, near, far))


def diverging(effect: Effect, parameter: EffectParameter, step: float) -> tuple[float, float]:
    """Between which two values of a parameter, off and on, RK4 steps (s) diverge; equal if nowhere.

    Steps that do not follow a lag may be stable still, and are near enough to search in.
    """
    least = least_followed(effect, parameter, STABLE * step)
    return parameter.neutral, max(least, parameter.neutral)


def finite_values(
    known: Mapping[str, Effect], values: Mapping[EffectParameterId, float]
) -> dict[EffectParameterId, float]:
    """Values of effects, with the mildest plausible one where they are infinite.

    No derivative leads away from an infinite rate limit.
    """
    mildest = {
        EffectParameterId(name, p.name): p.plausible[1 if p.neutral > 0.0 else 0]
        for name in effects_of(values)
        for p in known[name].parameters
    }
    return {id: v if np.isfinite(v) else mildest[id] for id, v in values.items()}


class Coefficients:
    """Baseline coefficients with a normal prior, in units where the prior is a standard normal.

    Args:
        paths: of the coefficients in the vehicle's parameter file, n of them.
        mean: (n,) centre of the prior.
        covariance: (n, n) of the prior.
        bounds: (n,) and (n,) physical bounds.
        units: of each; default: none.
        able: whether a vehicle can have these coefficients all together.
    """

    def __init__(
        self,
        paths: Iterable[str],
        mean: FloatArray,
        covariance: FloatArray,
        bounds: tuple[FloatArray, FloatArray],
        units: Iterable[str] = (),
        able: Callable[[Mapping[str, float]], bool] = lambda values: True,
    ) -> None:
        self.paths = tuple(paths)
        self.ids = tuple(Coefficient(path) for path in self.paths)
        self._units = dict(zip(self.ids, units, strict=False))
        self.mean = np.asarray(mean, float)
        self.sd = np.sqrt(np.diag(covariance))
        correlation = covariance / np.outer(self.sd, self.sd)
        self.factor = self.sd[:, None] * np.linalg.cholesky(correlation)
        self.bounds = bounds
        self._able = able

    def __len__(self) -> int:
        """Number of coefficients."""
        return len(self.paths)

    def unit(self, coefficient: Coefficient) -> str:
        """Unit of a coefficient, ``-`` when it has none."""
        return self._units.get(coefficient, "-")

    def values(self, z: FloatArray) -> FloatArray:
        """Coefficients (n, N) of normalised ones (n, N)."""
        return self.mean[:, None] + self.factor @ z

    def possible(self, z: FloatArray) -> bool:
        """Whether a vehicle can have normalised coefficients (n,), all together."""
        values = self.values(z[:, None])[:, 0].tolist()
        return self._able(dict(zip(self.paths, values, strict=True)))

    def all_possible(self, z: FloatArray) -> BoolArray:
        """The same of many (n, N): (N,), and no longer for those that are equal."""
        distinct, which = np.unique(z, axis=1, return_inverse=True)
        return np.array([self.possible(one) for one in distinct.T])[which.ravel()]


@dataclass(frozen=True)
class Drive:
    """What was measured of a periodic drive, without a model of what it moves.

    Attributes:
        in_step: values of effect parameters that put the model's drive in step with it.
        known: whether it is in step but for these.
        certain: whether chance does not make such measurements.
        uneven: whether single runs differ in it, as they then do in other ways too.
    """

    in_step: Mapping[EffectParameterId, float] = field(default_factory=dict)
    known: bool = False
    certain: bool = False
    uneven: bool = False

    @property
    def effects(self) -> frozenset[EffectName]:
        """Names of the effects that put the model's drive in step."""
        return frozenset(map(EffectName, effects_of(self.in_step)))

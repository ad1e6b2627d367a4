"""Free parameters of a problem: baseline coefficients under their priors, and effect parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.optimize import bisect

from fish_env.effects.extended import PREFIX, ExtendedModel
from fish_env.errors import ParameterError
from fish_env.identification.filtering import Measurement
from fish_env.model.effect import Effect, EffectParameter
from fish_env.params.packing import PATHS
from fish_env.params.schema import FishParams

FloatArray = npt.NDArray[np.float64]


def effects_of(paths: Iterable[str]) -> set[str]:
    """Names of the effects that some effect parameters belong to."""
    return {path.removeprefix(PREFIX).split(".")[0] for path in paths}


@dataclass(frozen=True)
class EffectFreedom:
    """A free parameter of an effect.

    Attributes:
        path: ``effects.<effect>.<parameter>``.
        lower: smallest value allowed.
        upper: largest value allowed.
        step: size for finite differences, about a hundredth of what matters.
        least: values between neutral and this one are too quick to be simulated; minus infinity
            where none is.
    """

    path: str
    lower: float
    upper: float
    step: float
    least: float


def freedoms(effect: Effect, step: float) -> tuple[EffectFreedom, ...]:
    """All parameters of an effect, free within their physical bounds, for RK4 steps (s)."""
    return tuple(
        EffectFreedom(
            f"{PREFIX}{effect.name}.{p.name}",
            p.lower,
            p.upper,
            0.02 * (p.plausible[1] - p.plausible[0]),
            least_followed(effect, p, step),
        )
        for p in effect.parameters
    )


def least_followed(effect: Effect, parameter: EffectParameter, step: float) -> float:
    """Smallest value of one parameter above neutral that RK4 steps (s) follow.

    Minus infinity where they follow any, and where the effect is as quick at every size: it then
    has short steps of its own.
    """

    def is_followed(value: float) -> bool:
        return effect.is_followed({**effect.neutral, parameter.name: value}, step)

    neutral, far = parameter.neutral, parameter.plausible[1]
    near = neutral + 1e-9 * (far - neutral)
    if not np.isfinite(neutral) or is_followed(near) or not is_followed(far):
        return -np.inf
    return float(bisect(lambda value: is_followed(value) - 0.5, near, far))


class Baseline:
    """Baseline coefficients with a prior, in units where the prior is a standard normal.

    Args:
        fish: nominal parameters and priors.
        paths: which coefficients are free; default: all with a prior that the model reads.
    """

    def __init__(self, fish: FishParams, paths: Sequence[str] | None = None) -> None:
        self.fish = fish
        read = set(PATHS.values()) - {"weight_block.crank.l1", "weight_block.crank.l2"}
        free = [p for p in fish.values() if p in read and fish.prior_sd(p) > 0]
        self.paths = tuple(free if paths is None else paths)
        self.mean = np.array([fish.get(path) for path in self.paths])
        covariance = fish.prior_covariance(list(self.paths))
        self.sd = np.sqrt(np.diag(covariance))
        correlation = covariance / np.outer(self.sd, self.sd)
        self.factor = self.sd[:, None] * np.linalg.cholesky(correlation)

    def __len__(self) -> int:
        """Number of coefficients."""
        return len(self.paths)

    def values(self, z: FloatArray) -> FloatArray:
        """Coefficients (n, N) of normalised ones (n, N)."""
        return self.mean[:, None] + self.factor @ z

    def possible(self, z: FloatArray) -> bool:
        """Whether a fish can have normalised coefficients (n,), each by itself and all together."""
        values = self.values(z[:, None])[:, 0].tolist()
        try:
            self.fish.replace(dict(zip(self.paths, values, strict=True)), "identified")
        except ParameterError:
            return False
        return True

    def all_possible(self, z: FloatArray) -> npt.NDArray[np.bool_]:
        """The same of many (n, N): (N,), and no longer for those that are equal."""
        distinct, which = np.unique(z, axis=1, return_inverse=True)
        return np.array([self.possible(one) for one in distinct.T])[which.ravel()]

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Physical bounds (n,), (n,)."""
        known = [self.fish.info(path) for path in self.paths]
        return np.array([i.lower for i in known]), np.array([i.upper for i in known])


def measurement_of(
    model: ExtendedModel,
    effects: Sequence[Effect],
    values: Mapping[str, FloatArray],
    channels: Sequence[str],
    count: int,
) -> Measurement:
    """What measurement effects do to clock and channels, for each of ``count`` lanes.

    Their functions are affine in time and channels, so two probes give factor and offset.

    Args:
        model: unused effects of the model keep their own values.
        effects: measurement effects in play.
        values: ``effects.<name>.<parameter>`` -> (count,).
        channels: measured channels.
        count: number of lanes.
    """
    pace, delay = np.ones(count), np.zeros(count)
    gain, bias = np.ones((len(channels), count)), np.zeros((len(channels), count))
    for effect in effects:
        base = model.effects.get(effect.name, effect.neutral)
        own = {
            p: np.broadcast_to(values.get(f"{PREFIX}{effect.name}.{p}", base[p]), (count,))
            for p in base
        }
        if effect.sample_time is not None:
            zero = effect.sample_time(np.zeros(count), own)
            one = effect.sample_time(np.ones(count), own)
            slope = one - zero
            pace, delay = pace * slope, delay * slope - zero
        if effect.measure is not None:
            zeros = {name: np.zeros(count) for name in channels}
            ones = {name: np.ones(count) for name in channels}
            low, high = effect.measure(zeros, own), effect.measure(ones, own)
            for i, name in enumerate(channels):
                factor = high[name] - low[name]
                gain[i] = gain[i] * factor
                bias[i] = bias[i] * factor + low[name]
    return Measurement(pace, delay, np.ascontiguousarray(gain), np.ascontiguousarray(bias))

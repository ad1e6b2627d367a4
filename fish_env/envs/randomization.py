"""Parameters that differ from episode to episode: which, how, and their draws."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr, ndtri

from fish_env.arrays import BoolArray, FloatArray
from fish_env.effects.extended import PREFIX, ExtendedModel
from fish_env.errors import ConfigError, EffectError, ParameterError
from fish_env.params.schema import FishParams
from fish_env.reading import is_number, shown

TRUNCATE = 2.5
"""Normal draws stay within this many standard deviations."""
MOST_SD = 1e6
"""Largest standard deviation, absolute or relative; more would overflow."""
QUANTILES = 65
"""Points of each distribution at which a step that is too long is looked for."""
RARE = 1e-3
"""Share of the draws beyond the outermost of these points but the ends."""


@dataclass(frozen=True)
class Randomization:
    """Independent draws of parameters for each episode.

    Attributes:
        paths: parameter paths (``body.area[0]``, ``effects.current.north``).
        uniform: True where a parameter is uniform in ``first .. second``; else it is normal with
            mean ``first`` and standard deviation ``second``, truncated.
        first: (n,) low end or mean.
        second: (n,) high end or standard deviation.
        factor: (n, n) lower-triangular correlation of the normal draws.
        lower: (n,) physical bounds; draws are clipped to them.
        upper: (n,)
    """

    paths: tuple[str, ...]
    uniform: BoolArray
    first: FloatArray
    second: FloatArray
    factor: FloatArray
    lower: FloatArray
    upper: FloatArray

    def draw(self, uniforms: FloatArray) -> dict[str, FloatArray]:
        """Parameter values from uniform numbers (n, N): path -> (N,)."""
        edge = ndtr(TRUNCATE)
        single = ndtri((1.0 - edge) + (2.0 * edge - 1.0) * uniforms)
        # Fish by fish: a product of matrices may round otherwise than one of a single fish.
        columns = np.ascontiguousarray(single.T)
        normal = np.stack([self.factor @ column for column in columns], axis=1)
        first, second = self.first[:, None], self.second[:, None]
        values = np.where(
            self.uniform[:, None], first + (second - first) * uniforms, first + second * normal
        )
        bounded = np.clip(values, self.lower[:, None], self.upper[:, None])
        return dict(zip(self.paths, bounded, strict=True))

    def check_step(self, model: ExtendedModel, dt: float) -> None:
        """Refuse draws of an effect's time constant that a physics step cannot resolve.

        Raises:
            EffectError: says the longest step.
        """
        for drawn in self._extremes(model):
            drawn.check_step(dt)

    def substeps(self, model: ExtendedModel, dt: float) -> int:
        """Equal parts of a physics step (s) that resolve the fastest draw."""
        return max((drawn.substeps(dt) for drawn in self._extremes(model)), default=1)

    def _extremes(self, model: ExtendedModel) -> list[ExtendedModel]:
        """The model with draws all over the distributions; none where no effect is drawn."""
        if not any(path.startswith(PREFIX) for path in self.paths):
            return []
        levels = np.concatenate([np.linspace(0.0, 1.0, QUANTILES), [RARE, 1.0 - RARE]])
        drawn = self.draw(np.tile(levels, (len(self.paths), 1)))
        return [
            with_effects(model, {path: float(v[i]) for path, v in drawn.items()})
            for i in range(len(levels))
        ]


def with_effects(model: ExtendedModel, values: Mapping[str, float]) -> ExtendedModel:
    """The model with other effect parameters (paths of other parameters are passed over).

    Raises:
        EffectError: an effect that the model does not contain, or a value out of bounds.
    """
    declared = {effect.name: effect for effect in model.declared}
    changed: dict[str, dict[str, float]] = {}
    for path, value in values.items():
        if path.startswith(PREFIX):
            name, _, parameter = path.removeprefix(PREFIX).partition(".")
            if name not in declared:
                raise EffectError(
                    f"'{path}' cannot be changed: switch the effect on when the environment is "
                    f"made, with effects={{'{name}': {{...}}}}"
                )
            now = changed.get(name) or model.effects.get(name) or declared[name].neutral
            changed[name] = {**now, parameter: value}
    complete = {name: declared[name].complete(value) for name, value in changed.items()}
    return replace(model, effects={**model.effects, **complete})


def build_randomization(
    spec: str | Mapping[str, Any] | None, fish: FishParams, model: ExtendedModel
) -> Randomization | None:
    """Build draws from what a user writes.

    Args:
        spec: None; ``"prior"``: every parameter from the prior in the fish's file;
            ``"posterior"``: from the posterior that an extended model carries; or a mapping
            path -> ``{"relative": sd}``, ``{"sd": sd}``, or ``[low, high]``.
        fish: nominal parameters.
        model: the model that reads them (must contain the effects that are named).

    Raises:
        ConfigError: an unknown path or form, or a fish without a posterior.
    """
    if spec is None:
        return None
    if isinstance(spec, str) and spec == "prior":
        return _from_prior(fish, model)
    if isinstance(spec, str) and spec == "posterior":
        return _from_posterior(fish, model)
    named = isinstance(spec, Mapping) and all(isinstance(path, str) for path in spec)
    if not isinstance(spec, Mapping) or not spec or not named:
        raise ConfigError(
            "randomization: give 'prior', 'posterior' or a mapping of parameters, not "
            f"{shown(spec)}"
        )
    entries = [_entry(path, value, fish, model) for path, value in spec.items()]
    uniform, first, second = (np.array(column) for column in zip(*entries, strict=True))
    lower, upper = _bounds(tuple(spec), fish, model)
    for i in np.flatnonzero(uniform & ((first < lower) | (second > upper))):
        path = list(spec)[i]
        raise ConfigError(
            f"randomization of '{path}': {spec[path]!r} leaves its bounds {lower[i]} to {upper[i]}"
        )
    factor = np.eye(len(entries))
    drawn = Randomization(tuple(spec), uniform, first, second, factor, lower, upper)
    _check_possible(drawn, fish)
    return drawn


def _check_possible(random: Randomization, fish: FishParams) -> None:
    """Refuse draws of which the smallest or the largest make no possible fish."""
    ends = random.draw(np.tile([0.0, 1.0], (len(random.paths), 1)))
    own = {path: values for path, values in ends.items() if not path.startswith(PREFIX)}
    for path, values in own.items():
        for value in values:
            try:
                fish.replace({path: float(value)})
            except ParameterError as error:
                raise ConfigError(
                    f"randomization of '{path}': it draws {value:g}, with which no fish is "
                    f"possible ({error}); narrow it"
                ) from None


def _bounds(
    paths: tuple[str, ...], fish: FishParams, model: ExtendedModel
) -> tuple[FloatArray, FloatArray]:
    pairs = []
    effects = {
        f"{PREFIX}{effect.name}.{p.name}": (p.lower, p.upper)
        for effect in model.declared
        for p in effect.parameters
    }
    for path in paths:
        if path in effects:
            pairs.append(effects[path])
        else:
            known = fish.info(path)
            pairs.append((known.lower, known.upper))
    lower, upper = np.array(pairs).T
    return lower, upper


def _nominal(path: str, fish: FishParams, model: ExtendedModel) -> float:
    if path.startswith(PREFIX):
        name, _, parameter = path.removeprefix(PREFIX).partition(".")
        declared = {effect.name: effect for effect in model.declared}
        if name not in declared or parameter not in declared[name].neutral:
            raise ConfigError(f"randomization: no effect parameter '{path}'")
        return float(model.effects.get(name, declared[name].neutral)[parameter])
    return fish.get(path)


def _entry(
    path: str, value: Any, fish: FishParams, model: ExtendedModel
) -> tuple[bool, float, float]:
    nominal = _nominal(path, fish, model)
    if isinstance(value, Mapping) and len(value) == 1:
        key, number = next(iter(value.items()))
        scale = {"relative": abs(nominal), "sd": 1.0}.get(str(key), 0.0)
        if scale == 0.0 and key == "relative":
            raise ConfigError(
                f"randomization of '{path}': relative to its value 0 nothing varies; "
                "give {'sd': sd} or [low, high]"
            )
        if is_number(number) and 0 <= number <= MOST_SD and 0.0 < scale < np.inf:
            return False, nominal, scale * float(number)
    pair = value if isinstance(value, (list, tuple)) and len(value) == 2 else ()
    if pair and all(map(is_number, pair)) and pair[0] <= pair[1]:
        return True, float(pair[0]), float(pair[1])
    raise ConfigError(
        f"randomization of '{path}': give {{'relative': sd}}, {{'sd': sd}} or [low, high], "
        f"not {shown(value)}"
    )


def _from_prior(fish: FishParams, model: ExtendedModel) -> Randomization:
    paths = tuple(path for path in fish.values() if fish.prior_sd(path) > 0)
    mean = [fish.get(path) for path in paths]
    bounds = _bounds(paths, fish, model)
    return _correlated(paths, mean, fish.prior_covariance(list(paths)), *bounds)


def _from_posterior(fish: FishParams, model: ExtendedModel) -> Randomization:
    if fish.posterior is None:
        raise ConfigError(
            f"{fish.name} carries no posterior: use a file written by an identification, or 'prior'"
        )
    posterior = fish.posterior
    declared = {effect.name for effect in model.declared}
    # Effects on recordings alone change nothing here: their estimates are integrated out.
    kept = [i for i, path in enumerate(posterior.names) if _moves(path, declared)]
    names = tuple(posterior.names[i] for i in kept)
    mean = np.asarray(posterior.mean, float)[kept]
    covariance = np.asarray(posterior.covariance, float).reshape(2 * (len(posterior.mean),))
    if not names:
        raise ConfigError(
            "randomization: the fish's posterior names no parameter of the motion; use 'prior'"
        )
    return _correlated(names, mean, covariance[np.ix_(kept, kept)], *_bounds(names, fish, model))


def _moves(path: str, declared: Collection[str]) -> bool:
    """Whether a path is a coefficient, or belongs to one of the declared effects."""
    return not path.startswith(PREFIX) or path.removeprefix(PREFIX).partition(".")[0] in declared


def _correlated(
    paths: tuple[str, ...],
    mean: npt.ArrayLike,
    covariance: npt.ArrayLike,
    lower: FloatArray,
    upper: FloatArray,
) -> Randomization:
    matrix = np.asarray(covariance, float)
    count = len(paths)
    sd = np.sqrt(np.diag(matrix))
    scale = np.where(sd > 0.0, sd, 1.0)
    correlation = matrix / np.outer(scale, scale) + np.diag(np.where(sd > 0.0, 1e-12, 1.0))
    try:
        factor = np.linalg.cholesky(correlation)
    except np.linalg.LinAlgError:
        raise ConfigError(
            "randomization: the covariance of the fish's posterior is singular beyond rounding; "
            "use 'prior', or fit the fish again"
        ) from None
    centre = np.asarray(mean, float)
    return Randomization(paths, np.zeros(count, bool), centre, sd, factor, lower, upper)

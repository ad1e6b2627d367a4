"""Parameters that differ from episode to episode: which, how, and their draws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr, ndtri

from fish_env.effects.extended import PREFIX, ExtendedModel
from fish_env.errors import ConfigError
from fish_env.params.schema import FishParams

FloatArray = npt.NDArray[np.float64]
TRUNCATE = 2.5
"""Normal draws stay within this many standard deviations."""


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
    uniform: npt.NDArray[np.bool_]
    first: FloatArray
    second: FloatArray
    factor: FloatArray
    lower: FloatArray
    upper: FloatArray

    def draw(self, uniforms: FloatArray) -> dict[str, FloatArray]:
        """Parameter values from uniform numbers (n, N): path -> (N,)."""
        edge = ndtr(TRUNCATE)
        normal = self.factor @ ndtri((1.0 - edge) + (2.0 * edge - 1.0) * uniforms)
        first, second = self.first[:, None], self.second[:, None]
        values = np.where(
            self.uniform[:, None], first + (second - first) * uniforms, first + second * normal
        )
        bounded = np.clip(values, self.lower[:, None], self.upper[:, None])
        return dict(zip(self.paths, bounded, strict=True))


def randomization(
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
    if spec == "prior":
        return _from_prior(fish, model)
    if spec == "posterior":
        return _from_posterior(fish, model)
    if not isinstance(spec, Mapping) or not spec:
        raise ConfigError(
            f"randomization: give 'prior', 'posterior' or a mapping of parameters, not {spec!r}"
        )
    entries = [_entry(path, value, fish, model) for path, value in spec.items()]
    uniform, first, second = (np.array(column) for column in zip(*entries, strict=True))
    lower, upper = _bounds(tuple(spec), fish, model)
    return Randomization(tuple(spec), uniform, first, second, np.eye(len(entries)), lower, upper)


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
        if key in ("relative", "sd") and isinstance(number, (int, float)) and number >= 0:
            return False, nominal, abs(nominal) * number if key == "relative" else float(number)
    if isinstance(value, (list, tuple)) and len(value) == 2 and value[0] <= value[1]:
        return True, float(value[0]), float(value[1])
    raise ConfigError(
        f"randomization of '{path}': give {{'relative': sd}}, {{'sd': sd}} or [low, high], "
        f"not {value!r}"
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
    bounds = _bounds(posterior.names, fish, model)
    return _correlated(posterior.names, posterior.mean, posterior.covariance, *bounds)


def _correlated(
    paths: tuple[str, ...],
    mean: npt.ArrayLike,
    covariance: npt.ArrayLike,
    lower: FloatArray,
    upper: FloatArray,
) -> Randomization:
    matrix = np.asarray(covariance, float)
    sd = np.sqrt(np.diag(matrix))
    correlation = matrix / np.outer(sd, sd) + 1e-12 * np.eye(len(sd))
    count = len(paths)
    factor = np.linalg.cholesky(correlation)
    centre = np.asarray(mean, float)
    return Randomization(paths, np.zeros(count, bool), centre, sd, factor, lower, upper)

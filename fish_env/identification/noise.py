"""Noise floor: white sensor noise from the data, and the disturbance by maximum likelihood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from math import comb
from typing import Any, Protocol

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import Dataset
from fish_env.identification.filtering import Filtered, RunFilter
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.noise_scoring import Replayed, climb
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.runs import RunData
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point
from fish_env.params.schema import FishParams

PHASE_SD_RANGE = (IDENTIFICATION.least_phase_walk, IDENTIFICATION.largest_phase_walk)
"""Random walk of the phase of a tail whose beat is a little different in each run (rad/s^0.5)."""
JITTER_SD_RANGE = (IDENTIFICATION.least_jitter_s, IDENTIFICATION.largest_jitter_s)
"""How early or late samples may be (s)."""
JITTER_TRIALS = (1e-3, 2e-3, 4e-3)
"""Jitters (s) that are tried before one is fitted: beside twice or half its best size, it still
has most of its likelihood."""
ORDER = 4
WINDOW = 30
QUANTILE = 0.15
ROUNDS, NEAR = 3, 0.4
"""Most searches along anew filtered runs, and the relative change of the disturbance and of the
sensors by which they are not to be filtered anew."""
SHARES = (1.0, 0.5, 0.25, 0.1)
"""Of the way to the likeliest noise model along the present motion, tried one after another."""
GAIN = 0.1
"""The noise model is found when a step gains no more log likelihood."""


def white_noise_sd(dataset: Dataset, channel: str) -> float:
    """Standard deviation of the white part of a channel, from differences of high order.

    Differences of order 4 remove motion that is smooth over five samples; a quick tail beat is
    not. So the runs are cut into windows of 30 samples, and the quiet windows count: a low
    quantile of their spreads, corrected for being low by what white noise itself gives. What a
    beat still leaves makes this an upper bound, which :func:`fit_noise` may only lower.
    """
    spreads = []
    for run in dataset.runs:
        values = run.channels[channel]
        values = values[np.isfinite(values)]
        if channel in ("roll", "yaw"):
            values = np.unwrap(values)
        spreads += _window_spreads(values)
    if not spreads:
        return 1e-5
    return max(float(np.quantile(spreads, QUANTILE)) / _quantile_of_white_noise(), 1e-5)


def noise_differences(values: FloatArray, order: int) -> FloatArray:
    """Differences along the last axis, each with the spread of a sample's white noise."""
    scale = np.sqrt(sum(comb(order, k) ** 2 for k in range(order + 1)))
    return np.asarray(np.diff(values, order) / scale)


def _window_spreads(values: FloatArray) -> list[float]:
    differences = noise_differences(values, ORDER)
    window = min(WINDOW, len(differences))
    if window < 3:
        return []
    count = len(differences) // window
    blocks = differences[: count * window].reshape(count, window)
    return list(np.sqrt(np.mean(blocks**2, axis=1)))


@cache
def _quantile_of_white_noise() -> float:
    """What the low quantile is when the noise is white with unit spread (fixed draws)."""
    normals = np.random.default_rng(0).standard_normal(WINDOW * 4000 + ORDER)
    return float(np.quantile(_window_spreads(normals), QUANTILE))


@dataclass(frozen=True)
class DisturbanceRange:
    """What a disturbance without a cause may be.

    A tank at rest pushes a fish with some thousandths of its thrust. A disturbance that must be
    stronger or slower than this to explain the data is a misfit with another name.

    Attributes:
        force: smallest and largest standard deviation (N).
        moment: of the moment (N m).
        correlation: shortest and longest correlation time (s).
        jitter: of the times of samples, smallest and largest standard deviation (s).
    """

    force: tuple[float, float]
    moment: tuple[float, float]
    correlation: tuple[float, float]
    jitter: tuple[float, float] = JITTER_SD_RANGE

    def widened(self, times: float) -> DisturbanceRange:
        """The same with a disturbance so many times as strong allowed."""
        low, high = self.force[0], times * self.force[1]
        return replace(self, force=(low, high), moment=(self.moment[0], times * self.moment[1]))

    def left_by(self, noise: NoiseModel) -> tuple[str, ...]:
        """How a noise model's disturbance is at the end of this range, in words."""
        found, reached = [], IDENTIFICATION.at_limit_share
        if noise.force_sd > reached * self.force[1]:
            found.append(f"a disturbing force of {1e3 * noise.force_sd:.0f} mN or more")
        if noise.moment_sd > reached * self.moment[1]:
            found.append(f"a disturbing moment of {1e3 * noise.moment_sd:.2g} mN m or more")
        strength = max(noise.force_sd / self.force[1], noise.moment_sd / self.moment[1])
        if self._stays(noise) and strength > IDENTIFICATION.felt_disturbance:
            found.append(f"a disturbance that stays for {noise.correlation_s:.0f} s or more")
        return tuple(found)

    def passing(self, noise: NoiseModel) -> NoiseModel | None:
        """A noise model with a disturbance that passes; None where it does not stay for long.

        One that stays as long as any may hides every slow cause: weighted by it, none shows.
        """
        if not self._stays(noise):
            return None
        return replace(noise, correlation_s=float(np.sqrt(np.prod(self.correlation))))

    def _stays(self, noise: NoiseModel) -> bool:
        """Whether its disturbance stays as long as any may."""
        return noise.correlation_s > IDENTIFICATION.at_limit_share * self.correlation[1]


def disturbance_range(fish: FishParams) -> DisturbanceRange:
    """Up to a thousandth of the weight, at a quarter of the hull's width, for up to ten seconds.

    For the 2 kg fish that is 20 mN, against 150 mN of thrust; its width is taken as the edge of a
    cube of the same volume.
    """
    known, mass = IDENTIFICATION, fish.get("mass.total")
    force = known.disturbance_weight * mass * fish.get("water.gravity")
    width = float(np.cbrt(mass / fish.get("water.density")))
    moment = known.disturbance_arm * width * force
    lasting = known.shortest_correlation_s, known.longest_correlation_s
    return DisturbanceRange((1e-4, force), (1e-6, moment), lasting)


def widest_disturbance(fish: FishParams) -> DisturbanceRange:
    """As strong as a noise model may have it: what is missing has to show as large as it is."""
    return disturbance_range(fish).widened(POLICY.largest_disturbance)


def small_disturbance(sensor_sd: FloatArray) -> NoiseModel:
    """A disturbance of a few millinewton beside sensor noise (C,)."""
    return NoiseModel(sensor_sd, 3e-3, 1e-4, 1.0)


class FilteredRuns(Protocol):
    """Runs under an extended Kalman filter, as a fit of their noise needs them."""

    @property
    def fish(self) -> FishParams:
        """The fish, whose size says what a disturbance may be."""

    @property
    def largest_jitter_s(self) -> float:
        """Largest jitter of the sample times that the channels allow (s)."""

    @property
    def lean_filter(self) -> RunFilter:
        """The quickest filter that knows the runs."""

    def some(self, runs: Sequence[int]) -> FilteredRuns:
        """The same with some of its runs."""

    def filtered(
        self,
        point: Point,
        noise: NoiseModel,
        near: Sequence[Filtered] = (),
        keep_slopes: bool = False,
    ) -> list[Filtered]:
        """Filter every run at one point (see :meth:`SeriesProblem.filtered`)."""


def runs_for_noise(runs: Sequence[RunData]) -> int:
    """Of how many runs the noise is fitted to: a few, and more where these hold few samples."""
    samples = float(np.mean([len(run.clock) for run in runs]))
    enough = int(np.ceil(IDENTIFICATION.enough_noise_samples / samples))
    return max(IDENTIFICATION.fewest_noise_runs, enough)


def fitted_noise(
    problem: FilteredRuns,
    few: Sequence[int],
    point: Point,
    noise: NoiseModel,
    largest_sensor_sd: FloatArray | None,
    filtered: Sequence[Filtered] = (),
) -> NoiseModel:
    """Noise model of largest likelihood at a point.

    The search starts from the present one and from a small disturbance, so that a disturbance
    which once stood in for a misfit does not stay.

    Args:
        problem: the runs.
        few: those that tell the noise.
        point: values of the parameters.
        noise: the present noise model.
        largest_sensor_sd: as :func:`fit_noise` takes it.
        filtered: the runs filtered under the present noise model, if they are.
    """
    allowed = JITTER_SD_RANGE[0], min(JITTER_SD_RANGE[1], problem.largest_jitter_s)
    plausible = replace(disturbance_range(problem.fish), jitter=allowed)
    some = problem.some(few)
    filtered = filtered or problem.filtered(point, noise, keep_slopes=True)
    telling = [filtered[run] for run in few]
    if any(run.slopes is None for run in telling):
        telling = some.filtered(point, noise, keep_slopes=True)
    for _ in range(ROUNDS):
        # The lean filter will do: covariances are replayed, and no effect is computed again.
        replay = partial(some.lean_filter.replay, telling, noise)
        found = _searched(replay, noise, plausible, largest_sensor_sd)
        if noise.is_close(found, NEAR) and noise.sensors_are_close(found, NEAR):
            return found
        step = _confirmed(problem, point, noise, found, _likelihood(filtered))
        if step is None:
            return noise
        noise, filtered = step
        telling = [filtered[run] for run in few]
    return noise


def _confirmed(
    problem: FilteredRuns, point: Point, noise: NoiseModel, found: NoiseModel, least: float
) -> tuple[NoiseModel, list[Filtered]] | None:
    """The noise model found, or one on the way to it, if filtered runs are as likely under it.

    A replay keeps the motion that the runs were linearised along. A filter that follows the data
    more, or less, may lose a beat that another keeps.

    Args:
        problem: the runs.
        point: values of the parameters.
        noise: the noise model before.
        found: the likeliest by the replay.
        least: log likelihood of the runs under the noise model before.

    Returns:
        The noise model, and the runs filtered under it; None where each is less likely.
    """
    for share in SHARES:
        trial = found if share == 1.0 else noise.towards(found, share)
        try:
            runs = problem.filtered(point, trial, keep_slopes=True)
        except np.linalg.LinAlgError:
            continue
        if _likelihood(runs) >= least:
            return trial, runs
    return None


def _likelihood(runs: Sequence[Filtered]) -> float:
    return sum(run.log_likelihood for run in runs)


def _searched(
    replay: Callable[[NoiseModel], Replayed],
    present: NoiseModel,
    plausible: DisturbanceRange,
    largest_sensor_sd: FloatArray | None,
) -> NoiseModel:
    """Noise model of largest likelihood about one evaluation of the runs."""

    def value(noise: NoiseModel) -> float:
        return replay(noise).log_likelihood

    small = replace(
        small_disturbance(present.sensor_sd),
        phase_sd=present.phase_sd,
        jitter_sd=present.jitter_sd,
        spread=present.spread,
    )
    start = max((present, small), key=value)
    found = fit_noise(replay, start, plausible, largest_sensor_sd, False)
    without, jittery = found, jitter_worth_fitting(value, found, plausible)
    if jittery.jitter_sd != found.jitter_sd:
        found = fit_noise(replay, jittery, plausible, largest_sensor_sd, False)
    if found.jitter_sd and plausible.left_by(found):
        # Something is missing, and jitter could absorb it.
        if without.jitter_sd:
            still = replace(without, jitter_sd=0.0)
            without = fit_noise(replay, still, plausible, largest_sensor_sd, False)
        found = without
    if plausible.left_by(found):
        # What is missing shows in whitened residuals only if the noise is as large as it is.
        wide = plausible.widened(POLICY.largest_disturbance)
        start = max((found, start), key=value)
        found = fit_noise(replay, start, wide, largest_sensor_sd)
    return found


def jitter_worth_fitting(
    log_likelihood: Callable[[NoiseModel], float], noise: NoiseModel, within: DisturbanceRange
) -> NoiseModel:
    """The noise model with jitter of the sample times where the data show it, else without.

    Args:
        log_likelihood: of a noise model, the parameters of the fish being fixed.
        noise: the present noise model.
        within: what the jitter may be.
    """
    without, (least, largest) = replace(noise, jitter_sd=0.0), within.jitter
    if least >= largest:
        return without
    sizes = [noise.jitter_sd] if noise.jitter_sd else JITTER_TRIALS
    tried = [replace(noise, jitter_sd=min(size, largest)) for size in sizes]
    best = max(tried, key=log_likelihood)
    gain = 2.0 * (log_likelihood(best) - log_likelihood(without))
    return best if gain > POLICY.jitter_gain else without


def fit_noise(
    replay: Callable[[NoiseModel], Replayed],
    start: NoiseModel,
    within: DisturbanceRange,
    largest_sensor_sd: FloatArray | None = None,
    to_the_end: bool = True,
) -> NoiseModel:
    """Maximum likelihood of the noise model, from a start.

    Args:
        replay: what a noise model makes of innovations, the parameters of the fish being fixed.
        start: first guess; a phase that follows its command, or is relaxed, does so still, and
            sample times without jitter have none.
        within: what the disturbance may be.
        largest_sensor_sd: (C,) bound on each channel's noise; the noise is then fitted too.
            Without it the sensors keep theirs: a misfit of the model must not pass for noise.
        to_the_end: search to the end, also where a disturbance is far beyond its range.
    """
    names = ["force_sd", "moment_sd", "correlation_s"]
    limits = [within.force, within.moment, within.correlation]
    if PHASE_SD_RANGE[0] <= start.phase_sd <= PHASE_SD_RANGE[1]:
        names, limits = [*names, "phase_sd"], [*limits, PHASE_SD_RANGE]
    if start.jitter_sd > 0.0:
        names, limits = [*names, "jitter_sd"], [*limits, within.jitter]
    sensors = largest_sensor_sd is not None
    if largest_sensor_sd is not None:
        # A strong disturbance could follow one channel through every sample: noise of none.
        share = POLICY.least_sensor_share
        limits += [(share * largest, largest) for largest in largest_sensor_sd]

    def model(x: FloatArray) -> NoiseModel:
        # The exponential of a bound's logarithm may lie beyond the bound.
        values = [float(np.clip(np.exp(v), *b)) for v, b in zip(x, limits, strict=True)]
        numbers: dict[str, Any] = dict(zip(names, values, strict=False))
        own = np.array(values[len(names) :]) if sensors else start.sensor_sd
        return replace(start, sensor_sd=own, **numbers)

    lower, upper = np.log(limits).T
    known = [getattr(start, name) for name in names] + (list(start.sensor_sd) if sensors else [])
    begin = np.clip(np.log(known), lower, upper)
    return model(
        climb(lambda x: replay(model(x)), begin, lower, upper, GAIN, 0 if to_the_end else 2)
    )

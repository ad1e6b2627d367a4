"""Noise floor of each channel, from the data alone.

Differences of high order remove what is smooth and keep what is white. How high the order must be
depends on the motion: the spectrum of the channel says what each order would still let through.
Stretches in which nothing drives the vehicle, and repeats from rest, tell what slow noise and
disturbances add, which no difference shows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from math import comb

import numpy as np
from scipy.special import chdtri

from fish_env.arrays import FloatArray
from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.recording import RecordedRun, Recording

ORDERS = range(2, 11)
SEGMENT = 32
"""Samples of a piece whose spectrum is taken."""
WINDOW, QUIET = 30, 0.15
"""Samples of a short window, and the quantile of the windows that counts as quiet."""
UNCERTAIN_LEAKAGE = 0.5
"""Share of the motion expected in a difference that may be wrong after it has been taken off."""
SETTLING_S, SHORTEST_STILL_S = 1.0, 2.0
_TURNING = ("roll", "yaw")


@dataclass(frozen=True)
class Spread:
    """A standard deviation (SI) and the degrees of freedom behind it."""

    sd: float
    freedom: float

    @property
    def ci95(self) -> tuple[float, float]:
        """95 % interval, for Gaussian noise."""
        low, high = chdtri(self.freedom, [0.025, 0.975])
        return float(self.sd * (self.freedom / low) ** 0.5), float(
            self.sd * (self.freedom / high) ** 0.5
        )


@dataclass(frozen=True)
class Floor:
    """Noise of one channel.

    Attributes:
        channel: its name.
        unit: SI.
        white: white part, from differences; None with too few samples.
        order: of the differences.
        leakage: share of their variance that was motion by the spectrum, and was taken off.
        upper_bound: the motion reaches up to where the noise should stand alone, or samples are
            too patchy for a spectrum: the white part is at most this.
        still: spread about a cubic while nothing drives the vehicle, which holds slow noise and
            disturbances too; None without such a stretch.
        repeats: spread between runs of one condition from rest, which holds the disturbance's
            whole effect; None without such runs.
        declared: what the dataset says; None if nothing.
    """

    channel: str
    unit: str
    white: Spread | None
    order: int
    leakage: float
    upper_bound: bool
    still: Spread | None
    repeats: Spread | None
    declared: float | None

    @property
    def contradicts(self) -> bool:
        """Whether the data exclude the declared value, by more than this estimate may be off.

        Motion too quick for the sampling can only make the estimate too large, so a declared
        value that is too large shows more clearly than one that is too small.
        """
        if self.declared is None or self.white is None:
            return False
        low, high = self.white.ci95
        too_large = high < RECORDINGS.declared_too_large * self.declared
        too_small = low > RECORDINGS.declared_too_small * self.declared
        return too_large or (too_small and not self.upper_bound)


def noise_floors(recording: Recording) -> tuple[Floor, ...]:
    """Noise floor of every channel of a dataset, in its order."""
    return tuple(floor_of(recording, channel) for channel in recording.channels)


def floor_of(recording: Recording, channel: str) -> Floor:
    """Noise floor of one channel."""
    series = [samples(run, channel) for run in recording.runs]
    white, order, leakage, bound = _white(series)
    return Floor(
        channel,
        recording.units[channel],
        white,
        order,
        leakage,
        bound,
        _still(recording, channel),
        _repeats(recording, channel),
        recording.noise.get(channel),
    )


def samples(run: RecordedRun, channel: str) -> tuple[FloatArray, FloatArray]:
    """Times and values of a channel where it was measured; angles that wind are unwrapped."""
    values = run.channels[channel]
    measured = np.isfinite(values)
    kept = values[measured]
    return run.time_s[measured], np.unwrap(kept) if channel in _TURNING else kept


def _white(series: list[tuple[FloatArray, FloatArray]]) -> tuple[Spread | None, int, float, bool]:
    """White part, order of differences, share taken off, and whether it is only a bound."""
    if sum(len(values) for _, values in series) < RECORDINGS.fewest_noise_samples:
        return None, 0, 0.0, True
    spectrum = mean_spectrum(series)
    found = {order: _differences(series, order) for order in ORDERS}
    found = {order: spread for order, spread in found.items() if spread.freedom >= 3.0}
    if not found:
        return None, 0, 0.0, True
    if spectrum is None:
        order = min(found, key=lambda m: found[m].sd)
        return found[order], order, 0.0, True
    leaks = {order: spectrum.motion(order) for order in found}
    order = min(found, key=lambda m: _error(found[m], leaks[m] / spectrum.level))
    variance = found[order].sd ** 2
    share = min(leaks[order] / variance, 0.9)
    white = Spread(float(np.sqrt(variance * (1.0 - share))), found[order].freedom)
    quiet, best = _quiet(series)
    scatter = np.sqrt(0.5 / white.freedom + 0.5 / quiet.freedom) if quiet.freedom else np.inf
    if white.sd > quiet.sd * (1.0 + 4.0 * scatter):
        return quiet, best, 0.0, True
    return white, order, share, not spectrum.flat


def _error(spread: Spread, leakage: float) -> float:
    """Relative mean square error of a variance: its scatter, and the leakage mistaken."""
    return float(2.0 / spread.freedom + (UNCERTAIN_LEAKAGE * leakage) ** 2)


def _differences(series: list[tuple[FloatArray, FloatArray]], order: int) -> Spread:
    parts = [_contrasts(times, values, order) for times, values in series if len(values) > order]
    every = np.concatenate(parts) if parts else np.zeros(0)
    if not every.size:
        return Spread(0.0, 0.0)
    return Spread(float(np.sqrt(np.mean(every**2))), len(every) / _correlation(order))


def _quiet(series: list[tuple[FloatArray, FloatArray]]) -> tuple[Spread, int]:
    """Spread of the quietest stretches and its order: an upper bound where motion comes in bursts.

    A servo's jerks are too quick for any difference, but not always there. A low quantile over
    short windows leaves them out; it is corrected for being low by what white noise gives.
    """
    found = {}
    for order in ORDERS:
        spreads = _window_spreads(series, order)
        if len(spreads) >= 10:
            expected, scatter = _low_quantile(order)
            freedom = 0.5 * len(spreads) / scatter**2
            found[order] = Spread(float(np.quantile(spreads, QUIET)) / expected, freedom)
    if not found:
        return Spread(0.0, 0.0), 0
    order = min(found, key=lambda m: found[m].sd * (1.0 + (2.0 / found[m].freedom) ** 0.5))
    return found[order], order


def _window_spreads(series: list[tuple[FloatArray, FloatArray]], order: int) -> list[float]:
    spreads: list[float] = []
    for times, values in series:
        if len(values) <= order:
            continue
        contrasts = _contrasts(times, values, order)
        count = len(contrasts) // WINDOW
        blocks = contrasts[: count * WINDOW].reshape(count, WINDOW)
        spreads += np.sqrt(np.mean(blocks**2, axis=1)).tolist()
    return spreads


@cache
def _low_quantile(order: int) -> tuple[float, float]:
    """Low quantile of window spreads of unit white noise, and the relative scatter of one window.

    From fixed draws: the quantile of n windows scatters by the second number over sqrt(n).
    """
    noise = np.random.default_rng(0).standard_normal(WINDOW * 3200 + order)
    contrasts = np.diff(noise, order) / np.sqrt(comb(2 * order, order))
    spreads = np.sqrt(np.mean(contrasts.reshape(-1, WINDOW) ** 2, axis=1))
    groups = np.quantile(spreads.reshape(-1, 80), QUIET, axis=1)
    expected = float(np.quantile(spreads, QUIET))
    return expected, float(np.std(groups) / expected * np.sqrt(80))


def _contrasts(times: FloatArray, values: FloatArray, order: int) -> FloatArray:
    """Divided differences, each scaled to leave white noise as it is.

    They vanish on polynomials below the order whatever the spacing of the samples.
    """
    steps = np.diff(times)
    if np.ptp(steps) < 1e-6 * steps[0]:
        even: FloatArray = np.diff(values, order) / np.sqrt(comb(2 * order, order))
        return even
    window = np.lib.stride_tricks.sliding_window_view
    t = window(times, order + 1) / np.median(steps)
    gaps = t[:, :, None] - t[:, None, :] + np.eye(order + 1)
    weights = 1.0 / np.prod(gaps, axis=2)
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    contrasts: FloatArray = np.sum(weights * window(values, order + 1), axis=1)
    # Across a gap more of the motion gets through, so such differences count only if most are so.
    tight = t[:, -1] - t[:, 0] < order + 0.5
    return contrasts[tight] if 2 * tight.sum() >= tight.size else contrasts


def _correlation(order: int) -> float:
    """How many differences of white noise count as one: the sum of their squared correlations."""
    rho = [comb(2 * order, order + k) / comb(2 * order, order) for k in range(1, order + 1)]
    return 1.0 + 2.0 * sum(r * r for r in rho)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Mean spectrum of a channel, as shares of variance per frequency bin.

    Attributes:
        frequency: (n,) in cycles a sample.
        power: (n,), whose mean is the variance where the spectrum is white.
        level: of its flat end.
        edge: frequency above which it is flat.
    """

    frequency: FloatArray
    power: FloatArray
    level: float
    edge: float

    @property
    def flat(self) -> bool:
        """Whether enough of it is flat to tell noise from motion."""
        return self.edge < 0.4

    def motion(self, order: int) -> float:
        """Variance that motion leaves in differences of an order."""
        gain = (2.0 * np.sin(np.pi * self.frequency)) ** (2 * order) / comb(2 * order, order)
        above = np.where(self.frequency <= self.edge, self.power - self.level, 0.0)
        return float(np.mean(np.maximum(above, 0.0) * gain))


def mean_spectrum(series: list[tuple[FloatArray, FloatArray]]) -> Spectrum | None:
    """Spectrum over all evenly sampled pieces; None if there are none of some length."""
    pieces = [piece for times, values in series for piece in _even_pieces(times, values)]
    if not pieces:
        return None
    # Twice differenced and restored: the strong slow motion must not leak along the spectrum.
    taper = np.hanning(SEGMENT - 1)[:-1]
    rows = [np.abs(np.fft.rfft(taper * np.diff(piece, 2))) ** 2 for piece in pieces]
    frequency = np.fft.rfftfreq(SEGMENT - 2)[1:].astype(np.float64)
    gain = (2.0 * np.sin(np.pi * frequency)) ** 4
    power: FloatArray = np.mean(rows, axis=0)[1:] / gain / np.sum(taper**2)
    flat = frequency > 0.4
    level = float(np.mean(power[flat]))
    # Above the edge no bin stands out from the flat end by more than chance.
    smooth = np.convolve(power, np.ones(3) / 3.0, "same")
    chance = 1.0 + 4.0 * np.sqrt((1.0 / 3.0 + 1.0 / flat.sum()) / len(pieces))
    standing_out = np.flatnonzero(smooth[:-1] > chance * level)
    edge = float(frequency[standing_out[-1]]) if standing_out.size else 0.0
    return Spectrum(frequency, power, level, edge)


def _even_pieces(times: FloatArray, values: FloatArray) -> Iterator[FloatArray]:
    """Half-overlapping pieces whose samples are evenly spaced."""
    if len(times) < SEGMENT:
        return
    step = float(np.median(np.diff(times)))
    for first in range(0, len(times) - SEGMENT + 1, SEGMENT // 2):
        chosen = slice(first, first + SEGMENT)
        if np.ptp(np.diff(times[chosen])) < 0.1 * step:
            yield values[chosen]


def _still(recording: Recording, channel: str) -> Spread | None:
    """Spread about a cubic over every stretch in which nothing drives the vehicle."""
    squares, freedom = 0.0, 0
    for run in recording.runs:
        times, values = samples(run, channel)
        for begin, end in run.still_s:
            if end - begin < SHORTEST_STILL_S + SETTLING_S:
                continue
            inside = (times >= begin + SETTLING_S) & (times < end)
            if inside.sum() < RECORDINGS.fewest_noise_samples:
                continue
            t = (times[inside] - begin) / (end - begin)
            left = values[inside] - np.polyval(np.polyfit(t, values[inside], 3), t)
            squares += float(left @ left)
            freedom += int(inside.sum()) - 4
    return Spread(float(np.sqrt(squares / freedom)), float(freedom)) if freedom else None


def _repeats(recording: Recording, channel: str) -> Spread | None:
    """Spread of runs of one condition about each other, from a common start."""
    squares, freedom = 0.0, 0.0
    for first, second in combinations(recording.runs, 2):
        if first.repeats is None or first.repeats != second.repeats:
            continue
        (t1, a), (t2, b) = samples(first, channel), samples(second, channel)
        _, at1, at2 = np.intersect1d(t1 - t1[0], t2 - t2[0], return_indices=True)
        if at1.size < RECORDINGS.fewest_noise_samples:
            continue
        apart = (a[at1] - a[at1[0]]) - (b[at2] - b[at2[0]])
        squares += 0.5 * float(apart @ apart)
        freedom += at1.size
    return Spread(float(np.sqrt(squares / freedom)), freedom) if freedom else None


def as_dict(floor: Floor) -> dict[str, object]:
    """What ``diagnosis.json`` holds of a channel's noise floor."""
    return {
        "channel": floor.channel,
        "unit": floor.unit,
        "white": _plain(floor.white),
        "order": floor.order,
        "leakage_share": floor.leakage,
        "upper_bound": floor.upper_bound,
        "still": _plain(floor.still),
        "repeats": _plain(floor.repeats),
        "declared": floor.declared,
        "contradicts_declared": floor.contradicts,
    }


def _plain(spread: Spread | None) -> dict[str, object] | None:
    if spread is None:
        return None
    return {"sd": spread.sd, "freedom": spread.freedom, "ci95": list(spread.ci95)}


def sentences(floors: tuple[Floor, ...]) -> list[str]:
    """What a reader should know about the noise floors."""
    said = []
    for floor in floors:
        if floor.white is None:
            said.append(f"{floor.channel} has too few samples to estimate its noise.")
        elif floor.contradicts:
            low, high = floor.white.ci95
            said.append(
                f"{floor.channel}: the dataset declares a noise of {floor.declared:.3g} "
                f"{floor.unit}, its samples show {floor.white.sd:.3g} ({low:.3g} to {high:.3g}); "
                "correct it or leave it out."
            )
    bounds = [floor.channel for floor in floors if floor.white and floor.upper_bound]
    if bounds:
        said.append(
            f"The noise of {', '.join(bounds)} cannot be separated from the motion at this "
            "sampling rate; the given value is an upper bound."
        )
    return said

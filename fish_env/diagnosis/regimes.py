"""Where the misfit sits: residual energy by channel and regime, and what was never visited.

A regime (speed, pitch, ...) is cut into bins. The table holds the mean squared whitened residual
of each channel in each bin: 1 where nothing is left but noise. A cell stands out when its energy is
more than shuffled residuals give there. Shuffling exchanges whole runs and turns each of them
around in time, so that residuals keep their own correlation and lose only their place; the largest
departure over all cells calibrates the significance (Westfall and Young, 1993: max-T).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.data.vocabulary import COMMANDS
from fish_env.diagnosis.policy import CHECKS
from fish_env.identification.filtering import Filtered
from fish_env.identification.runs import RunData
from fish_env.identification.series import SeriesProblem
from fish_env.model.state import BASE_STATES
from fish_env.sensing import channels_from_states

STILL = 1e-3
"""rad. A tail that beats less has no phase and no frequency."""
DEG = np.pi / 180.0


@dataclass(frozen=True)
class Regime:
    """A quantity that is cut into bins.

    Attributes:
        name: ``speed``, ``pitch``, ``depth``, ``tail_phase``, ``tail_amplitude``,
            ``tail_frequency`` or ``time``.
        unit: unit of the edges when shown.
        factor: how many of them make one SI unit.
        edges: increasing, SI; bins between them.
        planned: whether the edges span what such a fish can do, so that an empty bin means
            "never visited"; else they only span the data.
    """

    name: str
    unit: str
    factor: float
    edges: tuple[float, ...]
    planned: bool

    @property
    def labels(self) -> tuple[str, ...]:
        """Each bin in words, in the shown unit."""
        shown = [f"{self.factor * edge:.3g}" for edge in self.edges]
        return tuple(f"{a} to {b}" for a, b in pairwise(shown))


PLANNED = (
    Regime("speed", "m/s", 1.0, (0.0, 0.05, 0.1, 0.15, 0.2, 0.3), True),
    Regime(
        "pitch", "deg", 1 / DEG, tuple(DEG * e for e in (-60, -30, -15, -5, 5, 15, 30, 60)), True
    ),
    Regime("tail_phase", "deg", 1 / DEG, tuple(DEG * e for e in range(0, 361, 45)), True),
    Regime("tail_amplitude", "deg", 1 / DEG, tuple(DEG * e for e in (0, 1, 10, 20, 30, 40)), True),
    Regime("tail_frequency", "Hz", 1.0, (0.0, 0.5, 1.0, 1.5, 2.0, 2.5), True),
)
"""Bins over what a fish of this kind can do; data beyond them get bins of their own."""
SPANNED = (("depth", "m", 4), ("time", "s", 5))
"""Name, unit and bins of what has no range of its own: the tank and the run decide."""


@dataclass(frozen=True, eq=False)
class RunResiduals:
    """Residuals of a run beside what the fish was doing.

    Attributes:
        residuals: (T, C) whitened, NaN where missing.
        regimes: regime -> (T,) SI, NaN where it has no value.
    """

    residuals: FloatArray
    regimes: Mapping[str, FloatArray]


@dataclass(frozen=True)
class Place:
    """A cell of the table: where misfit sits.

    Attributes:
        channel: measured channel.
        regime: name of the regime.
        bin: in words, with the unit.
        energy: mean squared whitened residual; 1 is the floor.
        p: probability of a departure as large anywhere in the table, if place meant nothing.
    """

    channel: str
    regime: str
    bin: str
    energy: float
    p: float


@dataclass(frozen=True, eq=False)
class Localisation:
    """Residual energy by channel and regime bin.

    Attributes:
        channels: names, C of them.
        regimes: with their bins.
        energy: regime -> (C, B) mean squared whitened residual, NaN in empty bins.
        counts: regime -> (C, B) samples.
        p_values: regime -> (C, B), over the whole table; NaN where too few samples.
        overall: channel -> mean squared whitened residual.
    """

    channels: tuple[str, ...]
    regimes: tuple[Regime, ...]
    energy: Mapping[str, FloatArray]
    counts: Mapping[str, IntArray]
    p_values: Mapping[str, FloatArray]
    overall: Mapping[str, float]

    @property
    def places(self) -> tuple[Place, ...]:
        """Cells that stand out, the one with most energy above its channel's mean first."""
        found = [
            self._place(c, regime, b)
            for regime in self.regimes
            for c, b in np.argwhere(self.p_values[regime.name] < CHECKS.regime_level)
        ]
        return tuple(sorted(found, key=lambda p: self.overall[p.channel] - p.energy))

    @property
    def sits_in(self) -> Place | None:
        """The place with most misfit of its own; None where none stands out."""
        return self.places[0] if self.places else None

    @property
    def never_visited(self) -> tuple[tuple[str, str], ...]:
        """(regime, bin in words) without a single sample, of what such a fish can do."""
        return tuple(
            (regime.name, f"{label} {regime.unit}")
            for regime in self.regimes
            if regime.planned
            for label, count in zip(
                regime.labels, self.counts[regime.name].sum(axis=0), strict=True
            )
            if count == 0
        )

    def words(self) -> str:
        """The location of the misfit, in two sentences."""
        worst = max(self.overall, key=lambda name: self.overall[name])
        said = (
            f"Over all samples the misfit is largest in {worst}: "
            f"{np.sqrt(self.overall[worst]):.2f} times the noise."
        )
        place = self.sits_in
        if place is None:
            return f"{said} The misfit is spread evenly over all regimes."
        there, overall = np.sqrt(place.energy), np.sqrt(self.overall[place.channel])
        return (
            f"{said} The regime with the largest excess is {place.regime.replace('_', ' ')} "
            f"{place.bin}. There the misfit in {place.channel} is {there:.2f} times the noise, "
            f"against {overall:.2f} overall (p = {place.p:.2g} over the whole table)."
        )

    def _place(self, c: int, regime: Regime, b: int) -> Place:
        name = regime.name
        return Place(
            self.channels[c],
            name,
            f"{regime.labels[b]} {regime.unit}",
            float(self.energy[name][c, b]),
            float(self.p_values[name][c, b]),
        )


def localise_fits(
    problem: SeriesProblem,
    judged: tuple[Sequence[Filtered], Sequence[Filtered]],
    rng: np.random.Generator,
) -> Localisation:
    """Where the baseline's one-step errors are larger than the noise that the accepted fit found.

    Args:
        problem: runs to look at.
        judged: the runs filtered with the refitted baseline and with the accepted explanation,
            whose noise is the yardstick and whose states are the regimes.
        rng: shuffles.
    """
    runs = [
        RunResiduals(
            np.where(np.isfinite(run.measured), r.innovations, np.nan), regime_series(run, s)
        )
        for run, r, s in zip(problem.runs, *judged, strict=True)
    ]
    return localise(problem.channels, runs, rng)


def regime_series(run: RunData, filtered: Filtered) -> dict[str, FloatArray]:
    """What the fish was doing at each sample, each (T,), SI; NaN where it has no value."""
    states = filtered.states[:, : len(BASE_STATES)].T
    channels = channels_from_states(states)
    row = np.searchsorted(run.command_times, run.clock, side="right") - 1
    commands = dict(zip(COMMANDS, run.command_values[np.maximum(row, 0)].T, strict=True))
    beats = commands["tail_amplitude"] > STILL
    phase = states[BASE_STATES.index("tail_phase")] % (2.0 * np.pi)
    return {
        "speed": np.sqrt(sum(channels[name] ** 2 for name in ("u", "v", "w"))),
        "pitch": channels["pitch"],
        "depth": channels["z"],
        "tail_phase": np.where(beats, phase, np.nan),
        "tail_amplitude": commands["tail_amplitude"],
        "tail_frequency": np.where(beats, commands["tail_frequency"], np.nan),
        "time": run.clock,
    }


def localise(
    channels: Sequence[str],
    runs: Sequence[RunResiduals],
    rng: np.random.Generator,
    draws: int = CHECKS.regime_draws,
) -> Localisation:
    """Table of residual energy by channel and regime bin, with calibrated significance.

    Args:
        channels: names of the residuals' columns.
        runs: residuals and regimes of each run.
        rng: shuffles.
        draws: number of shuffles; the smallest p is 1 / (draws + 1).
    """
    regimes = _regimes(runs)
    membership = np.concatenate([_membership(regimes, run) for run in runs])
    energies = [run.residuals**2 for run in runs]
    energy, counts = _means(membership, np.concatenate(energies))
    judged = (counts >= CHECKS.fewest_regime_samples) & np.isfinite(energy)
    null = np.array(
        [_means(membership, _shuffled(energies, rng))[0] for _ in range(draws)]
    )  # (draws, bins, C)
    p_values = _family_wise(energy, null, judged)
    ends = np.cumsum([len(regime.labels) for regime in regimes])[:-1]

    def by_regime(table: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
        parts = np.split(table, ends, axis=0)
        return {r.name: part.T for r, part in zip(regimes, parts, strict=True)}

    mean = np.nanmean(np.concatenate(energies), axis=0)
    return Localisation(
        tuple(channels),
        regimes,
        by_regime(energy),
        by_regime(counts.astype(np.int64)),
        by_regime(p_values),
        dict(zip(channels, mean.tolist(), strict=True)),
    )


def _regimes(runs: Sequence[RunResiduals]) -> tuple[Regime, ...]:
    def values(name: str) -> FloatArray:
        series: FloatArray = np.concatenate([run.regimes[name] for run in runs])
        return np.asarray(series[np.isfinite(series)])

    planned = [_widened(regime, values(regime.name)) for regime in PLANNED]
    spanned = [_spanning(values(name), name, unit, bins) for name, unit, bins in SPANNED]
    return (*planned, *spanned)


def _widened(regime: Regime, values: FloatArray) -> Regime:
    """The regime, with a bin more at an end that the data pass."""
    edges = regime.edges
    if values.size and values.min() < edges[0]:
        edges = (float(values.min()), *edges)
    if values.size and values.max() > edges[-1]:
        edges = (*edges, float(values.max()))
    return Regime(regime.name, regime.unit, regime.factor, edges, regime.planned)


def _spanning(values: FloatArray, name: str, unit: str, bins: int) -> Regime:
    low, high = float(values.min()), float(values.max())
    edges = np.linspace(low, high if high > low else low + 1e-6, bins + 1)
    return Regime(name, unit, 1.0, tuple(edges.tolist()), False)


def _membership(regimes: Sequence[Regime], run: RunResiduals) -> FloatArray:
    """(T, all bins): 1 where a sample is in a bin."""
    columns: list[FloatArray] = []
    for regime in regimes:
        values = run.regimes[regime.name]
        bins = len(regime.labels)
        index = np.searchsorted(regime.edges, values, side="right") - 1
        # The last bin holds its upper edge; its computed value may differ in the last digit.
        index = np.where(np.isfinite(values), np.clip(index, 0, bins - 1), bins)
        columns.append((index[:, None] == np.arange(bins)).astype(float))
    members: FloatArray = np.hstack(columns)
    return members


def _means(membership: FloatArray, energy: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean energy and number of samples, each (bins, C); NaN where there are none."""
    present = np.isfinite(energy)
    totals = membership.T @ np.where(present, energy, 0.0)
    counts = membership.T @ present.astype(float)
    with np.errstate(invalid="ignore", divide="ignore"):
        return totals / counts, counts


def _shuffled(energies: Sequence[FloatArray], rng: np.random.Generator) -> FloatArray:
    """Runs in another order, each turned around in time by a random shift."""
    order = rng.permutation(len(energies))
    turned = [np.roll(energies[i], rng.integers(len(energies[i])), axis=0) for i in order]
    return np.concatenate(turned)


def _family_wise(energy: FloatArray, null: FloatArray, judged: BoolArray) -> FloatArray:
    """P-value of each cell against the largest departure of all cells in each shuffle."""
    p_values: FloatArray = np.full(energy.shape, np.nan)
    # The data are one of the arrangements that could have been, so they count among them.
    every = np.concatenate([energy[None], null])
    centre, spread = every.mean(axis=0), every.std(axis=0)
    used = judged & np.isfinite(centre) & (spread > 0.0)
    if not used.any():
        return p_values
    departures = (every[:, used] - centre[used]) / spread[used]
    above = departures.max(axis=1)[:, None] >= departures[0]
    p_values[used] = above.mean(axis=0)
    return p_values


def as_plain(localisation: Localisation) -> dict[str, Any]:
    """The table, ready for JSON; NaN as null."""

    def rows(table: FloatArray) -> list[list[float | None]]:
        return [[float(v) if np.isfinite(v) else None for v in row] for row in table]

    place = localisation.sits_in
    return {
        "sits_in": None if place is None else vars(place),
        "words": localisation.words(),
        "never_visited": [{"regime": r, "bin": b} for r, b in localisation.never_visited],
        "channels": list(localisation.channels),
        "regimes": [
            {
                "name": regime.name,
                "unit": regime.unit,
                "edges": [regime.factor * edge for edge in regime.edges],
                "energy": rows(localisation.energy[regime.name]),
                "samples": localisation.counts[regime.name].tolist(),
                "p": rows(localisation.p_values[regime.name]),
            }
            for regime in localisation.regimes
        ],
    }

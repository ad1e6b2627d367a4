"""Error budget: what share of the misfit goes with each thing that an explanation changes.

The misfit of a model is the energy of its predictions' errors, in units of the sensors' noise and
beyond it, where the model runs alone over some seconds from states that the accepted model has
filtered. Channels count the same, however often each is sampled. A component's share is the mean of
what it takes away when it comes first and of what it gives back when it goes last: the first and
last terms of Shapley's value, which they equal where components do not interact. The shares are
scaled to add up to what all components together close.
Where the explanation is adequate, what it leaves is noise by the adequacy test, and nothing is
left. Elsewhere errors count from the sensors' noise: what is left then holds the random disturbance
and what was not known of the states that predictions begin from, beside what the model lacks.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeAlias

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import spread_of
from fish_env.inference.estimate.settle import evaluated, usual_runs
from fish_env.inference.hypotheses import CauseId, EffectParameterId, name_of
from fish_env.inference.over_runs import Interval, over_runs
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Problem


class Other(Enum):
    """What an explanation changes beside its causes."""

    COEFFICIENTS = "coefficients"
    RUN_VARIATION = "run_variation"


Component: TypeAlias = CauseId | Other


@dataclass(frozen=True)
class Share:
    """Part of the misfit that goes with one component.

    Attributes:
        component: a cause, or what else an explanation changes.
        share: of the nominal model's misfit.
        ci95: interval over runs; None with fewer than three.
        alone: what the component closes when it comes first.
        last: what is lost when it is left out.
        channels: channel -> share of that channel's misfit.
    """

    component: Component
    share: float
    ci95: tuple[float, float] | None
    alone: float
    last: float
    channels: dict[str, float]

    @property
    def name(self) -> str:
        """The component as files and reports write it."""
        one = self.component
        return one.value if isinstance(one, Other) else name_of(one)


@dataclass(frozen=True)
class Budget:
    """Where the misfit between the nominal simulation and the measurements goes.

    Attributes:
        runs: ids or numbers of the runs judged on.
        held_out: whether these runs chose nothing.
        misfit: energy of the nominal model beyond noise, in units of that of noise.
        shares: of the components.
        left: share that no component closes.
        left_ci95: its interval over runs; None with fewer than three.
    """

    runs: tuple[str, ...]
    held_out: bool
    misfit: float
    shares: tuple[Share, ...]
    left: float
    left_ci95: tuple[float, float] | None

    def minor(self, slow: Collection[CauseId] = ()) -> tuple[CauseId, ...]:
        """Causes that make up next to nothing of the misfit, beside others that do more.

        What the models of larger causes and of sensors get wrong looks like a further small cause,
        and with much data it is significant. Where no cause does more there is no such model.

        Args:
            slow: causes whose error hardly builds up within a prediction; none of them is minor.
        """
        largest = {
            share.component: max(share.alone, share.last, *share.channels.values())
            for share in self.shares
            if not isinstance(share.component, Other)
        }
        small = [c for c, most in largest.items() if most < POLICY.least_named_share]
        return tuple(c for c in small if c not in slow) if len(small) < len(largest) else ()


def error_budget(
    problem: Problem,
    accepted: Fit,
    causes: Sequence[CauseId],
    runs: Sequence[str],
    held_out: bool,
    adequate: bool,
) -> Budget | None:
    """Share the misfit of the nominal model among what an explanation changes.

    Args:
        problem: the runs to judge on.
        accepted: the explanation, from these or other runs.
        causes: its causes.
        runs: ids of the runs, in the problem's order.
        held_out: whether these runs chose nothing.
        adequate: whether the explanation leaves nothing but noise.

    Returns:
        The budget; None where the nominal model leaves nothing beyond noise, or diverges.
    """
    noise = problem.noise_of(accepted)
    settled, filtered = evaluated(problem, accepted.point, noise)
    windows, still, run_of_window = settled.without_feedback(filtered, noise)
    components: list[Component] = [Other.COEFFICIENTS, *causes]
    if spread_of(accepted.problem, noise).any():
        components.append(Other.RUN_VARIATION)
    everything = frozenset(components)
    sets = [frozenset[Component](), everything]
    sets += [frozenset([c]) for c in components] + [everything - {c} for c in components]
    squares = _residuals(windows, accepted, noise, still, sets) ** 2
    names, channel_of = windows.residual_channels()
    run_of = run_of_window[windows.groups()[0]]
    energy = _Energy(squares, windows.measured, run_of, channel_of, len(runs), len(names))
    if adequate:
        energy.noise = energy.table[1]
    misfit = (energy.total[0] - energy.noise.sum()) / energy.noise.sum()
    if not np.isfinite(energy.total).all() or misfit < POLICY.visible_misfit:
        return None
    return _shared(energy, components, names, runs, held_out, float(misfit))


def _residuals(
    problem: Problem,
    accepted: Fit,
    noise: Any,
    filtered: Sequence[object],
    sets: Sequence[frozenset[Component]],
) -> FloatArray:
    """Whitened residuals (sets, D) of the model with some components in place."""
    rows: list[FloatArray] = [np.zeros(0)] * len(sets)
    plain = usual_runs(problem.as_commanded(), accepted.point, noise)
    varied = spread_of(accepted.problem, noise).any()
    for chosen, of_set in ((problem, True), (plain, False)):
        own = [i for i, s in enumerate(sets) if not varied or (Other.RUN_VARIATION in s) == of_set]
        if not own or (not varied and not of_set):
            continue
        points = [_point(accepted, sets[i]) for i in own]
        z = np.column_stack([p[0] for p in points])
        effects = {id: np.array([p[1][id] for p in points]) for id in points[0][1]}
        found = chosen.innovations(z, effects, noise, filtered)
        for i, row in zip(own, found, strict=True):
            rows[i] = row
    return np.array(rows)


def _point(
    accepted: Fit, chosen: frozenset[Component]
) -> tuple[FloatArray, dict[EffectParameterId, float]]:
    """Coefficients and effects with some components at their estimates, the others nominal."""
    problem, point = accepted.problem, accepted.point
    baseline = problem.baseline
    values = baseline.values(point.z[:, None])[:, 0]
    kept = [(c if c in accepted.released else Other.COEFFICIENTS) in chosen for c in baseline.ids]
    moved = np.where(kept, values, baseline.mean)
    z = np.linalg.solve(baseline.factor, moved - baseline.mean)
    neutral = problem.neutral(accepted.effects)
    effects = {p: v if p.effect in chosen else neutral[p] for p, v in point.effects.items()}
    return np.asarray(z, float), effects


class _Energy:
    """Energies of residuals by set of components, run and channel, and what noise makes of them.

    Args:
        squares: (sets, D) squared residuals, in units of the noise.
        present: (D,) whether each is of a sample that was measured.
        run_of: (D,) run of each.
        channel_of: (D,) channel of each.
        runs: number of runs.
        channels: number of channels.
    """

    def __init__(
        self,
        squares: FloatArray,
        present: BoolArray,
        run_of: IntArray,
        channel_of: IntArray,
        runs: int,
        channels: int,
    ) -> None:
        cell, shape = run_of * channels + channel_of, (runs, channels)
        size = runs * channels
        self.table = np.array([np.bincount(cell, row, size).reshape(shape) for row in squares])
        self.noise = np.bincount(cell, present, size).reshape(shape)
        samples = np.maximum(self.noise.sum(axis=0), 1.0)
        self.table, self.noise = self.table / samples, self.noise / samples

    @property
    def total(self) -> FloatArray:
        """(sets,) over all runs and channels."""
        return np.asarray(self.table.sum(axis=(1, 2)))

    def by_channel(self) -> FloatArray:
        """(sets, channels) over all runs."""
        return np.asarray(self.table.sum(axis=1))

    def of_runs(self, runs: IntArray) -> tuple[FloatArray, float]:
        """(sets,) over some runs, and their noise."""
        return self.table.sum(axis=2)[:, runs].sum(axis=1), float(self.noise[runs].sum())


def shares_of(energy: FloatArray, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Shares of each component, what each closes alone, and what is lost without it, (count,) each.

    Args:
        energy: (2 + 2 count,) of nothing, everything, each alone, everything but each.
        count: number of components.
    """
    nothing, everything = energy[0], energy[1]
    whole = nothing - everything
    first = nothing - energy[2 : 2 + count]
    last = energy[2 + count :] - everything
    mean = 0.5 * (first + last)
    total = mean.sum()
    scaled = mean * (whole / total) if abs(total) > 1e-12 else mean
    return scaled, first, last


def _shared(
    energy: _Energy,
    components: Sequence[Component],
    names: Sequence[str],
    runs: Sequence[str],
    held_out: bool,
    misfit: float,
) -> Budget:
    count = len(components)
    nominal = energy.total[0] - energy.noise.sum()
    shares, first, last = (part / nominal for part in shares_of(energy.total, count))
    floors = energy.noise.sum(axis=0)
    reference = np.maximum(
        energy.by_channel()[0] - floors, POLICY.visible_misfit * np.maximum(floors, 1.0)
    )
    channels = [shares_of(column, count)[0] for column in energy.by_channel().T]
    intervals, left_interval = _intervals(energy, count)
    found = [
        Share(
            component,
            float(shares[i]),
            intervals[i] if intervals else None,
            float(first[i]),
            float(last[i]),
            {n: float(channels[k][i] / reference[k]) for k, n in enumerate(names)},
        )
        for i, component in enumerate(components)
    ]
    found.sort(key=lambda share: -share.share)
    left = 1.0 - float(shares.sum())
    return Budget(tuple(runs), held_out, misfit, tuple(found), left, left_interval)


def _intervals(energy: _Energy, count: int) -> tuple[list[Interval], Interval | None]:
    """Intervals of the shares and of what is left, over runs; none with fewer than three."""

    def parts(runs: IntArray) -> FloatArray:
        own, noise = energy.of_runs(runs)
        if not own[0] > noise:
            return np.full(count + 1, np.nan)
        shares = shares_of(own, count)[0] / (own[0] - noise)
        return np.append(shares, 1.0 - shares.sum())

    found = over_runs(parts, energy.table.shape[1])
    return (found[:-1], found[-1]) if found else ([], None)

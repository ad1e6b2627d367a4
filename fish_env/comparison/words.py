"""What a comparison found, in plain words with numbers."""

from __future__ import annotations

import math

import numpy as np

from fish_env.comparison.errors import unit_of
from fish_env.comparison.runs import RunComparison, RunsComparison, mean_errors
from fish_env.comparison.tables import ObservationComparison, SteadyComparison


def shown_unit(name: str) -> tuple[str, float]:
    """Unit a channel or observation is shown in, and how many of them make one SI unit."""
    unit = unit_of(name)
    return {"rad": ("deg", 180 / math.pi), "rad/s": ("deg/s", 180 / math.pi)}.get(unit, (unit, 1.0))


def in_words(comparison: RunsComparison | SteadyComparison) -> list[str]:
    """Sentences that say where and how much the simulation is wrong."""
    if isinstance(comparison, SteadyComparison):
        return [_steady_sentence(comparison, o) for o in comparison.observations.values()]
    return _run_sentences(comparison)


def _steady_sentence(comparison: SteadyComparison, observation: ObservationComparison) -> str:
    name, (unit, factor) = observation.name, shown_unit(observation.name)
    words = f"{name.replace('_', ' ')}: {_gain(observation.gain)}. "
    words += f"The typical error is {factor * observation.mae:.3g} {unit}"
    if observation.repeat_sd > 0.0:
        times = observation.mae / observation.repeat_sd
        words += (
            f", {times:.1f} times the scatter between repeats "
            f"({factor * observation.repeat_sd:.2g} {unit})"
        )
    worst = comparison.worst(name, 1)
    if worst:
        condition, _, measured, simulated = worst[0]
        words += (
            f". Largest error in {condition}: {factor * simulated:.3g} {unit} simulated, "
            f"{factor * measured:.3g} {unit} measured"
        )
    return f"{words}.{_trend(observation.trend)}"


def _gain(gain: float) -> str:
    if not math.isfinite(gain):
        return "no values to compare"
    if abs(gain - 1.0) < 0.02:
        return "right in size on average"
    size = "too small" if gain < 1.0 else "too large"
    if gain < 0.0:
        return f"of the opposite sign (factor {gain:.2f})"
    return f"simulated {100 * abs(gain - 1.0):.0f} % {size} on average"


def _trend(trend: tuple[str, float] | None) -> str:
    if trend is None:
        return ""
    name = trend[0].replace("_", " ")
    direction = "grows" if trend[1] > 0 else "falls"
    return f" Simulated minus measured {direction} with {name} (rank correlation {trend[1]:+.2f})."


def _run_sentences(comparison: RunsComparison) -> list[str]:
    sentences = []
    paths = [run for run in comparison.runs if run.path_error_m.size]
    if paths:
        overall = mean_errors(comparison.runs)
        worst = max(paths, key=lambda run: float(np.nanmax(run.path_error_m)))
        sentences.append(
            f"path: over {len(paths)} run{'s' * (len(paths) > 1)} the simulated position is off by "
            f"{overall['path_error_mean_m']:.3g} m on average, and by "
            f"{overall['path_error_largest_m']:.3g} m at most (run {worst.id})."
        )
    return sentences + [_channel_sentence(comparison, name) for name in comparison.channels]


def _channel_sentence(comparison: RunsComparison, name: str) -> str:
    unit, factor = shown_unit(name)
    overall = mean_errors(comparison.runs)["channels"][name]

    def rmse(runs: tuple[RunComparison, ...]) -> float:
        return float(np.mean([run.errors[name].rmse for run in runs]))

    groups = comparison.by_condition()
    worst = max(groups, key=lambda condition: rmse(groups[condition]))
    fit = overall["fit_percent"]
    return (
        f"{name}: RMSE {factor * overall['rmse']:.3g} {unit}, bias "
        f"{factor * overall['bias']:+.3g} {unit}"
        + (f", fit {fit:.0f} %" if fit is not None else "")
        + f" on average; largest in {worst} ({factor * rmse(groups[worst]):.3g} {unit})."
    )

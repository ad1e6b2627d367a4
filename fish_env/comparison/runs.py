"""Runs over time: each is simulated from its measured start and compared channel by channel."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.comparison.errors import ChannelError, aligned, channel_error, plain, unit_of
from fish_env.comparison.start import measured_start, opening
from fish_env.data import CommandSteps, Dataset, Run
from fish_env.data.clock import check_seconds
from fish_env.model.state import INPUTS
from fish_env.params import FishParams
from fish_env.sensing import ages_s, measured_channels, true_command_times, true_times
from fish_env.simulator import InitialState, Simulator

PHASES = 16
"""Tail phases that are tried where the phase at the start is not known."""


@dataclass(frozen=True)
class RunComparison:
    """One run, measured and simulated.

    Attributes:
        id: Name of the run.
        condition: Name that repeats share, or None.
        time_s: Sample times as measured, shape (n,).
        measured: Channels, each (n,), NaN where missing; yaw and roll continuous.
        simulated: The same channels of the simulation.
        errors: Error by channel.
        path_error_m: Distance between measured and simulated position, shape (n,); empty unless
            x and y were measured.
        start: State the simulation began with.
        start_from: In words, where that state comes from.
    """

    id: str
    condition: str | None
    time_s: FloatArray
    measured: Mapping[str, FloatArray]
    simulated: Mapping[str, FloatArray]
    errors: Mapping[str, ChannelError]
    path_error_m: FloatArray
    start: InitialState
    start_from: str

    def as_dict(self) -> dict[str, Any]:
        """Everything, ready for JSON."""
        return plain(self)  # type: ignore[no-any-return]


@dataclass(frozen=True)
class RunsComparison:
    """All runs of a dataset, measured and simulated.

    Attributes:
        dataset: Name of the dataset.
        fish: Name of the simulated fish.
        effects: Effects that were on, with their values.
        runs: One by one.
        notes: What reading the dataset left aside or converted.
    """

    dataset: str
    fish: str
    effects: Mapping[str, Mapping[str, float]]
    runs: tuple[RunComparison, ...]
    notes: tuple[str, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the compared channels."""
        return tuple(self.runs[0].errors)

    def by_condition(self) -> dict[str, tuple[RunComparison, ...]]:
        """Runs by condition; a run without one is its own."""
        groups: dict[str, list[RunComparison]] = {}
        for run in self.runs:
            groups.setdefault(run.condition or run.id, []).append(run)
        return {name: tuple(runs) for name, runs in groups.items()}

    def as_dict(self) -> dict[str, Any]:
        """Everything, ready for JSON, with units and means by condition and over all runs."""
        conditions = self.by_condition().items()
        return {
            "kind": "runs",
            "dataset": self.dataset,
            "fish": self.fish,
            "effects": plain(self.effects),
            "units": {name: unit_of(name) for name in self.channels},
            "overall": mean_errors(self.runs),
            "conditions": {name: mean_errors(runs) for name, runs in conditions},
            "runs": [run.as_dict() for run in self.runs],
            "notes": list(self.notes),
        }


def compare_runs(
    dataset: Dataset,
    fish: FishParams,
    dt: float = 0.01,
    progress: Callable[[str], None] | None = None,
) -> RunsComparison:
    """Simulates every run of a dataset from its measured start.

    Where the tail's phase is not known, sixteen phases are tried and the one with the least error
    over the first beat is kept; the errors are then those of a prediction whose phase was fitted.

    Args:
        dataset: The measured runs.
        fish: Parameters, with the effects in their file.
        dt: Longest physics step, s.
        progress: Called with the id of each finished run.

    Raises:
        DatasetError: The times of a run can hardly be in seconds.
        SimulationDiverged: A simulation did not stay finite.
    """
    check_seconds(dataset)
    simulator, compared = Simulator(fish, dt), []
    for run in dataset.runs:
        compared.append(compare_run(simulator, run))
        if progress is not None:
            progress(run.id)
    effects = simulator.model.effects
    return RunsComparison(dataset.name, fish.name, effects, tuple(compared), dataset.notes)


def compare_run(simulator: Simulator, run: Run) -> RunComparison:
    """Simulates one run from its measured start; see :func:`compare_runs`."""
    start, words = measured_start(run, simulator.model)
    start, phase_words = _with_phase(simulator, run, start)
    simulated = simulate_run(simulator, run, start)
    pairs = {name: aligned(name, run.channels[name], simulated[name]) for name in run.channels}
    measured = {name: pair[0] for name, pair in pairs.items()}
    model = {name: pair[1] for name, pair in pairs.items()}
    return RunComparison(
        id=run.id,
        condition=run.condition,
        time_s=run.time_s,
        measured=measured,
        simulated=model,
        errors={name: channel_error(measured[name], model[name]) for name in measured},
        path_error_m=_path_error(measured, model),
        start=start,
        start_from=f"{words}; {phase_words}",
    )


def simulate_run(simulator: Simulator, run: Run, start: InitialState) -> dict[str, FloatArray]:
    """The run's channels as the model's sensors would have recorded them, each (n,)."""
    times = true_times(simulator.model, run.time_s)
    given = true_command_times(simulator.model, run.commands.times_s)
    commands = CommandSteps(given, run.commands.values)
    ages = ages_s(simulator.model, [*run.channels])
    # A device that is late shows what was; before the first sample, the state there.
    shown = {age: np.maximum(times - age, times[0]) for age in {0.0, *ages.values()}}
    every = np.unique(np.concatenate([*shown.values()]))
    trajectory = simulator.run(commands, initial=start, sample_times_s=every)
    channels = dict(trajectory.channels)
    if "tail_angle" in run.channels:
        channels["tail_angle"] = simulator.outputs(trajectory)["tail_angle"]
    seen = measured_channels(simulator.model, channels)
    rows = {age: np.searchsorted(every, own) for age, own in shown.items()}
    return {name: seen[name][rows[ages[name]]] for name in run.channels}


def mean_errors(runs: tuple[RunComparison, ...]) -> dict[str, Any]:
    """Means over runs of each channel's errors and of the path error, ready for JSON."""
    channels = {
        name: {
            measure: _finite_mean([getattr(run.errors[name], measure) for run in runs])
            for measure in ("rmse", "mae", "bias", "fit_percent")
        }
        for name in runs[0].errors
    }
    paths = [run.path_error_m for run in runs if run.path_error_m.size]
    path = {
        "path_error_mean_m": _finite_mean([float(np.nanmean(path)) for path in paths]),
        "path_error_largest_m": max((float(np.nanmax(path)) for path in paths), default=None),
    }
    return {"runs": len(runs), "channels": channels, **(path if paths else {})}


def _finite_mean(values: list[float]) -> float | None:
    finite = [value for value in values if np.isfinite(value)]
    return float(np.mean(finite)) if finite else None


def _with_phase(simulator: Simulator, run: Run, start: InitialState) -> tuple[InitialState, str]:
    if run.tail_phase is not None:
        return replace(start, tail_phase=run.tail_phase), "tail phase from the file"
    if run.commands.values[0, INPUTS.index("tail_amplitude")] == 0.0:
        return start, "tail still at the start"
    early = _early(run)
    tried = [replace(start, tail_phase=2 * np.pi * i / PHASES) for i in range(PHASES)]
    errors = [_opening_error(simulator, early, state) for state in tried]
    best = tried[int(np.argmin(errors))]
    return best, f"tail phase the best of {PHASES} over the first beat"


def _early(run: Run) -> Run:
    """The first beat of a run."""
    inside = opening(run)
    channels = {name: values[inside] for name, values in run.channels.items()}
    seen = {name: values for name, values in channels.items() if np.isfinite(values).any()}
    within = run.commands.times_s <= run.time_s[inside][-1]
    steps = type(run.commands)(run.commands.times_s[within], run.commands.values[within])
    return Run(run.id, run.time_s[inside], seen or channels, steps, run.start)


def _opening_error(simulator: Simulator, early: Run, start: InitialState) -> float:
    """Sum over channels of the mean square error in units of the measured variance."""
    simulated, total = simulate_run(simulator, early, start), 0.0
    for name, values in early.channels.items():
        truth, model = aligned(name, values, simulated[name])
        scale = max(float(np.nanstd(truth)), 1e-6)
        total += float(np.nanmean((model - truth) ** 2)) / scale**2
    return total


def _path_error(
    measured: Mapping[str, FloatArray], simulated: Mapping[str, FloatArray]
) -> FloatArray:
    if not {"x", "y"} <= set(measured):
        return np.empty(0)
    axes = [name for name in "xyz" if name in measured]
    squares = [(simulated[name] - measured[name]) ** 2 for name in axes]
    return np.asarray(np.sqrt(np.sum(squares, axis=0)))

"""What the report draws, as plain series: measured, baseline and extended, run by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fish_env.arrays import BoolArray, FloatArray
from fish_env.data.schema import CommandSteps, Dataset
from fish_env.data.units import unwrap_angle
from fish_env.diagnosis.gain import ANGLES
from fish_env.diagnosis.regimes import Localisation
from fish_env.effects import catalogue
from fish_env.errors import SimulationDiverged
from fish_env.identification import open_loop
from fish_env.identification.filtering import Filtered
from fish_env.identification.runs import RunData
from fish_env.identification.series import SeriesProblem, series_of
from fish_env.identification.writing import identified_fish
from fish_env.inference.effort import FULL
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.settle import evaluated
from fish_env.inference.policy import POLICY
from fish_env.params.schema import FishParams
from fish_env.replay import Motion, motion_from_channels, motion_from_trajectory
from fish_env.replay.motion import Role
from fish_env.sensing import measured_channels, true_command_times, true_times
from fish_env.simulator import InitialState, Simulator

SETTLED_S = 1.0
"""After this time the filter knows velocities that were not measured: whole runs start here."""
LONGEST_STEP_S = 0.01


@dataclass(frozen=True, eq=False)
class RunSeries:
    """One run that the report shows.

    Attributes:
        id: the run's id.
        final: whether it was held out.
        time_s: (n,) from the run's start, s.
        measured: channel -> (n,) SI, NaN where missing; roll and yaw continuous.
        baseline: the same, predicted by the refitted baseline over windows of three seconds, each
            from the filtered state at its start; NaN where nothing is measured.
        extended: the same of the extended model; empty where nothing was added.
        motions: measured, baseline and extended fish over the whole run, for the 3-D view; the
            models swim alone from the filtered state one second after the start.
        fit_percent: model -> fit of its predictions, as :mod:`fish_env.diagnosis.gain` measures it.
        notes: what could not be drawn.
        given: the fish as it was given, before any fit, over the whole run like the models in
            `motions`; None where it cannot be simulated.
    """

    id: str
    final: bool
    time_s: FloatArray
    measured: Mapping[str, FloatArray]
    baseline: Mapping[str, FloatArray]
    extended: Mapping[str, FloatArray]
    motions: tuple[Motion, ...]
    fit_percent: Mapping[str, float]
    notes: tuple[str, ...] = ()
    given: Motion | None = None


@dataclass(frozen=True, eq=False)
class ReportSeries:
    """Everything the report draws of runs over time.

    Attributes:
        fish: its size is drawn.
        runs: those shown.
        localisation: residual energy by regime; None leaves that part out.
        window_s: length of the predicted windows.
    """

    fish: FishParams
    runs: tuple[RunSeries, ...]
    localisation: Localisation | None = None
    window_s: float = POLICY.prediction_window_s


@dataclass(frozen=True, eq=False)
class SteadySeries:
    """Everything the report draws of a table of steady motion.

    Attributes:
        conditions: name of each row.
        commands: (n, 5) SI.
        measured: observation -> (n,) SI, NaN where missing.
        baseline: the same by the refitted baseline.
        extended: the same by the extended model; empty where nothing was added.
        left_out: (n,) whether the row was held out.
    """

    conditions: tuple[str, ...]
    commands: FloatArray
    measured: Mapping[str, FloatArray]
    baseline: Mapping[str, FloatArray]
    extended: Mapping[str, FloatArray] = field(default_factory=dict)
    left_out: BoolArray = field(default_factory=lambda: np.zeros(0, bool))


def series_from(
    dataset: Dataset,
    baseline: Fit,
    accepted: Fit,
    final_runs: Sequence[str] = (),
    localisation: Localisation | None = None,
    most_runs: int = FULL.pictured,
) -> ReportSeries:
    """Series of the runs to show, from what a diagnosis has in hand.

    Args:
        dataset: all measured runs.
        baseline: refitted baseline.
        accepted: accepted explanation, from the same runs; the same object where nothing was added.
        final_runs: ids of held-out runs; they are shown first.
        localisation: of the misfit.
        most_runs: how many runs to show, the final ones first.
    """
    problem = series_of(baseline)
    kept = list(final_runs)[:most_runs]
    fitted = list(problem.runs)[: most_runs - len(kept)]
    judged = SeriesProblem(dataset, problem.fish, kept).runs if kept else ()
    shown = problem.with_runs([*judged, *fitted])
    models = {"baseline": baseline} if accepted is baseline else {
        "baseline": baseline, "extended": accepted,
    }  # fmt: skip
    settled = {name: evaluated(shown, fit.point, fit.noise) for name, fit in models.items()}
    simulators = {name: _simulator(fit, dataset) for name, fit in models.items()}
    as_given = Simulator(problem.fish, LONGEST_STEP_S, user_effects=_own_effects(problem))
    runs = []
    for i, run in enumerate(shown.runs):
        states = {name: results[i] for name, (_, results) in settled.items()}
        own = {name: varied.runs[i] for name, (varied, _) in settled.items()}
        predicted = {n: predicted_windows(shown, own[n], models[n], states[n]) for n in models}
        final = i < len(judged)
        runs.append(_series(shown, run, predicted, simulators, as_given, states, final))
    return ReportSeries(problem.fish, tuple(runs), localisation)


@dataclass(frozen=True, eq=False)
class Predicted:
    """Predictions of a run over windows.

    Attributes:
        channels: channel -> (n,) SI, NaN where nothing is measured.
        fit_percent: mean over channels of 100 (1 - error / spread within the windows).
    """

    channels: Mapping[str, FloatArray]
    fit_percent: float


def predicted_windows(
    problem: SeriesProblem, run: RunData, fit: Fit, filtered: Filtered
) -> Predicted:
    """Channels of a run, predicted over windows from filtered states.

    The same predictions as :func:`fish_env.diagnosis.gain.measure_gain` judges.
    """
    cut = problem.with_runs(open_loop.windows(run, filtered, problem.channels))
    errors = open_loop.errors(cut, fit.point, fit.noise)
    missed = np.full(run.measured.shape, np.nan)
    for window, error in zip(cut.runs, errors, strict=True):
        first = int(np.searchsorted(run.clock, window.clock[0] - 1e-9))
        missed[first : first + len(window.clock)] = error
    measured = _measured(problem, run)
    channels = {name: measured[name] - missed[:, i] for i, name in enumerate(problem.channels)}
    return Predicted(channels, _fit_percent(cut, errors))


def _fit_percent(cut: SeriesProblem, errors: Sequence[FloatArray]) -> float:
    fits = []
    for i, name in enumerate(cut.channels):
        missed = spread = 0.0
        for window, error in zip(cut.runs, errors, strict=True):
            good = np.isfinite(window.measured[:, i])
            if good.sum() >= 3:
                values = window.measured[good, i]
                values = np.unwrap(values) if name in ANGLES else values
                missed += float(np.sum(error[good, i] ** 2))
                spread += float(np.sum((values - values.mean()) ** 2))
        if spread > 0.0:
            fits.append(100.0 * (1.0 - np.sqrt(missed / spread)))
    return float(np.mean(fits)) if fits else float("nan")


def _measured(problem: SeriesProblem, run: RunData) -> dict[str, FloatArray]:
    columns = dict(zip(problem.channels, run.measured.T, strict=True))
    return {n: unwrap_angle(v) if n in ANGLES else v for n, v in columns.items()}


def _series(
    problem: SeriesProblem,
    run: RunData,
    predicted: Mapping[str, Predicted],
    simulators: Mapping[str, Simulator],
    as_given: Simulator,
    states: Mapping[str, Filtered],
    final: bool,
) -> RunSeries:
    measured, given = _measured(problem, run), None
    steps = CommandSteps(*run.commands)
    best = list(states)[-1]
    phase = float(states[best].states[0, 13])
    motions = [motion_from_channels(run.clock, measured, "measured", "measured", steps, phase)]
    notes = []
    for name, simulator in simulators.items():
        try:
            role: Role = "extended" if name == "extended" else "baseline"
            motions.append(_whole_run(simulator, run, steps, states[name], role, measured))
        except SimulationDiverged as error:
            notes.append(f"{name}: simulated over the whole run, {error}")
    extended = predicted["extended"].channels if "extended" in predicted else {}
    fits = {name: own.fit_percent for name, own in predicted.items()}
    with suppress(SimulationDiverged):
        given = _whole_run(as_given, run, steps, states["baseline"], "other", measured)
    return RunSeries(
        run.id, final, run.clock, measured, predicted["baseline"].channels, extended,
        tuple(motions), fits, tuple(notes), given,
    )  # fmt: skip


def _simulator(fit: Fit, dataset: Dataset) -> Simulator:
    """The fish of a fit, swimming alone, also where final runs leave the range of those fitted."""
    own = _own_effects(series_of(fit))
    fish = replace(identified_fish(fit), posterior=None)  # would warn of that range
    return Simulator(fish, LONGEST_STEP_S, user_effects=own)


def _own_effects(problem: SeriesProblem) -> list[Any]:
    """Effects of the user's own, which the catalogue does not have."""
    return [effect for name, effect in problem.known.items() if name not in catalogue()]


def _whole_run(
    simulator: Simulator,
    run: RunData,
    steps: CommandSteps,
    filtered: Filtered,
    role: Role,
    measured: Mapping[str, FloatArray],
) -> Motion:
    settled = np.searchsorted(run.clock, min(SETTLED_S, 0.5 * run.duration))
    first = int(settled)
    times = true_times(simulator.model, run.clock[first:])
    start = _initial(filtered.states[first])
    commands = CommandSteps(true_command_times(simulator.model, steps.times_s), steps.values)
    trajectory = simulator.run(commands, initial=start, sample_times_s=times)
    tail = simulator.outputs(trajectory)["tail_angle"]
    seen = measured_channels(simulator.model, trajectory.channels)
    for name in ANGLES:
        if name in measured:
            seen[name] = seen[name] + _turns(measured[name][first:], seen[name])
    motion = motion_from_trajectory(trajectory, role, role, tail, seen)
    return replace(motion, time_s=run.clock[first:])


def _turns(measured: FloatArray, simulated: FloatArray) -> float:
    """Whole turns that bring the simulated angle next to the first measured one."""
    present = np.flatnonzero(np.isfinite(measured))
    if not present.size:
        return 0.0
    gap = measured[present[0]] - simulated[present[0]]
    return float(2.0 * np.pi * np.round(gap / (2.0 * np.pi)))


def _initial(state: FloatArray) -> InitialState:
    yaw, pitch, roll = Rotation.from_quat(state[3:7], scalar_first=True).as_euler("ZYX")
    x, y, z = state[0:3]
    u, v, w = state[7:10]
    p, q, r = state[10:13]
    return InitialState(
        (float(x), float(y), float(z)),
        (float(roll), float(pitch), float(yaw)),
        (float(u), float(v), float(w)),
        (float(p), float(q), float(r)),
        float(state[13]),
    )

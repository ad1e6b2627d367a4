"""The friendly way in: a schedule of commands goes in, a trajectory comes out."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.data.schema import CommandSteps
from fish_env.data.validity import warn_far_outside
from fish_env.effects.extended import EffectValues, build_model
from fish_env.errors import ScheduleError, SimulationDiverged
from fish_env.model.crank_slider import CrankSlider
from fish_env.model.effect import Effect
from fish_env.model.emit import OUTPUTS
from fish_env.model.frames import quaternion_from_euler
from fish_env.model.grid import Grid
from fish_env.model.state import BASE_STATES, INPUTS
from fish_env.params.io import as_fish
from fish_env.params.schema import FishParams
from fish_env.reading import is_number, shown
from fish_env.trajectory import Trajectory

REST_COMMANDS = (0.0, 0.0, 0.0, 0.0, 0.0)
MOST_STEPS = 1e8
"""Physics steps of one simulation, some minutes."""
MOST_SAMPLES = 2_000_000
"""Samples of one simulation, half a gigabyte."""
LONGEST = 1e7
"""s. Latest sample of a simulation; later ones are fewer bits apart than a step."""


@dataclass(frozen=True)
class InitialState:
    """State at the start of a run; the default is level, at rest, at the origin.

    Attributes:
        position: (3,) m, inertial NED.
        euler: roll, pitch, yaw (rad).
        velocity_body: (3,) m/s.
        angular_velocity_body: (3,) rad/s.
        tail_phase: rad.
    """

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    euler: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity_body: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angular_velocity_body: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tail_phase: float = 0.0

    def vector(self) -> FloatArray:
        """The base states, shape (18,), running integrals at zero."""
        state = np.zeros(len(BASE_STATES))
        state[0:3] = self.position
        state[3:7] = quaternion_from_euler(self.euler)
        state[7:10] = self.velocity_body
        state[10:13] = self.angular_velocity_body
        state[13] = self.tail_phase
        if not np.all(np.isfinite(state)):
            raise ScheduleError(f"the initial state must be finite numbers, got {self}")
        return state


def schedule(rows: Iterable[Mapping[str, float]]) -> CommandSteps:
    """Commands from rows like ``{"t": 0, "tail_amplitude": 0.35, "tail_frequency": 2}``.

    Each row holds until the next; a command that a row leaves out keeps its value (first: 0).

    Raises:
        ScheduleError: no rows, an unknown command, a value that is no finite number, or times that
            do not increase.
    """
    times: list[float] = []
    values: list[list[float]] = []
    current = dict.fromkeys(INPUTS, 0.0)
    for row in _mappings(rows):
        unknown = set(row) - {"t", *INPUTS}
        if unknown or "t" not in row:
            named = shown(sorted(map(str, unknown)))
            problem = f"unknown command {named}" if unknown else "a row without 't'"
            raise ScheduleError(f"schedule: {problem}; rows have t and any of {', '.join(INPUTS)}")
        wrong = next((name for name in row if not is_number(row[name])), None)
        if wrong is not None:
            raise ScheduleError(
                f"schedule: {wrong} must be a finite number, got {shown(row[wrong])}"
            )
        current |= {name: float(row[name]) for name in INPUTS if name in row}
        times.append(float(row["t"]))
        values.append(list(current.values()))
    if not times:
        raise ScheduleError("the schedule is empty: give at least one row of commands")
    if np.any(np.diff(times) <= 0):
        raise ScheduleError(f"schedule: times must increase, got {shown(times)}")
    return CommandSteps(np.array(times), np.array(values))


def _mappings(rows: Iterable[Mapping[str, float]]) -> list[Mapping[str, float]]:
    """The rows of a schedule.

    Raises:
        ScheduleError: no list of mappings.
    """
    given = list(rows) if isinstance(rows, Iterable) else [rows]
    if not all(isinstance(row, Mapping) for row in given):
        raise ScheduleError(
            f'schedule {shown(rows)}: give rows like {{"t": 0, "tail_offset": 0.1}}'
        )
    return given


def time_grid(sample_times: FloatArray, switches: FloatArray, dt: float) -> tuple[Grid, FloatArray]:
    """Segments that meet every sample and every switch exactly, with steps of at most dt.

    Args:
        sample_times: (T,) increasing (s); the first is the start.
        switches: times at which commands change (s).
        dt: longest physics step (s).

    Returns:
        The grid, which stores one sample per sample time after the first, and the start time of
        each segment (s).
    """
    inside = switches[(switches > sample_times[0]) & (switches < sample_times[-1])]
    edges = np.union1d(sample_times, inside)
    spans = np.diff(edges)
    steps = np.maximum(1, np.ceil(spans / dt - 1e-9)).astype(np.int64)
    never = np.iinfo(np.int64).max
    every = np.where(np.isin(edges[1:], sample_times), steps, never)
    slots = np.arange(len(steps))
    return Grid(slots, edges[:-1] - edges[0], steps, spans / steps, every), edges[:-1]


class Simulator:
    """One fish in ideal water (plus its effects), driven by ideal actuators.

    Examples:
        >>> from fish_env import Simulator, schedule
        >>> swim = schedule([{"t": 0.0, "tail_amplitude": 0.35, "tail_frequency": 2.0}])
        >>> trajectory = Simulator("zheng-2021-a").run(swim, duration_s=10.0)

    Args:
        fish: name of a shipped fish, path of a parameter file, or parameters.
        dt: longest physics step (s); it is divided where an effect is faster.
        effects: effects to switch on, beside those in the fish's file: name -> parameters.
        user_effects: effects of your own (see :func:`fish_env.effects.load_effect_file`).
        trust_effects: run the effect files (Python code) beside the fish's file that it names;
            without it they are refused.

    Raises:
        EffectError: an unknown effect, a bad value, or an effect file that is not trusted.
        ScheduleError: no physics step from 1e-6 to 0.1 s.
    """

    def __init__(
        self,
        fish: str | Path | FishParams,
        dt: float = 0.01,
        effects: EffectValues | None = None,
        user_effects: Iterable[Effect] = (),
        trust_effects: bool = False,
    ) -> None:
        self.fish = as_fish(fish, trust_effects)
        self.model = build_model(self.fish, effects, user_effects)
        self.dt = dt / self.model.substeps(dt)
        self._told_range = False

    @property
    def crank(self) -> CrankSlider:
        """The linkage that moves the weight block."""
        return CrankSlider(
            self.fish.get("weight_block.crank.l1"), self.fish.get("weight_block.crank.l2")
        )

    def run(
        self,
        commands: CommandSteps | Iterable[Mapping[str, float]],
        duration_s: float | None = None,
        initial: InitialState | None = None,
        rate_hz: float = 10.0,
        sample_times_s: npt.ArrayLike | None = None,
    ) -> Trajectory:
        """Simulate a schedule.

        Args:
            commands: steps of commands, or rows for :func:`schedule`; switches are met exactly.
            duration_s: length (s), sampled at ``rate_hz``; or
            sample_times_s: (T,) increasing times (s), the first being the start.
            initial: state at the start.
            rate_hz: samples per second.

        Raises:
            ScheduleError: neither or both of duration and sample times, or a bad schedule.
            SimulationDiverged: the state stopped being finite; carries time and last good state.
        """
        steps = commands if isinstance(commands, CommandSteps) else schedule(commands)
        self._warn_reach(steps)
        self._warn_range(steps)
        times = _sample_times(duration_s, rate_hz, sample_times_s)
        _check_length(times, self.dt)
        arrivals = np.append(steps.times_s, steps.times_s[1:] + self.model.command_delay)
        grid, starts = time_grid(times, arrivals, self.dt)
        start = initial or InitialState()
        kernels = self.model.kernels
        state = np.zeros((len(kernels.state_names), 1))
        state[: len(BASE_STATES), 0] = start.vector()
        inputs = steps.at(times[:1]).T.copy()
        clock = times[:1].copy()
        kernels.initialise(state, inputs, self.model.record, clock)
        trace = np.empty((len(times) - 1, len(state), 1))
        first, failed_at = state.copy(), np.full(1, np.inf)
        kernels.advance(
            state,
            inputs,
            self.model.record,
            np.full((5, 1), np.inf),
            clock,
            steps.at(starts)[:, :, None].copy(),
            grid,
            tables=self.model.tables,
            failed_at=failed_at,
            trace=trace,
        )
        if np.isfinite(failed_at[0]):
            raise SimulationDiverged(float(failed_at[0]), state[:, 0].tolist())
        states = np.concatenate([first.T, trace[:, :, 0]])
        return Trajectory(
            times, states, kernels.state_names, steps.at(times), self.fish.name, self.dt
        )

    def state_derivative(
        self,
        state: npt.ArrayLike,
        inputs: npt.ArrayLike = REST_COMMANDS,
        time_s: float = 0.0,
        input_rates: npt.ArrayLike = REST_COMMANDS,
    ) -> FloatArray:
        """d(state)/dt at any state.

        Args:
            state: (states,) in the order of ``model.kernels.state_names``; base states suffice.
            inputs: (5,) actuator positions (rad, rad, Hz, m, rad).
            time_s: time since the run's start (s).
            input_rates: (5,) their rates.

        Returns:
            (states,), SI: velocities inertial, accelerations in the body frame. A tail whose
            command is late (``servo_delay``) is taken to have been told ``inputs`` all along.
        """
        arrays = self._columns(state, inputs, input_rates, time_s)
        return self.model.kernels.derivative(*arrays, self.model.tables)[:, 0]

    def wrench_by_term(
        self,
        state: npt.ArrayLike,
        inputs: npt.ArrayLike = REST_COMMANDS,
        time_s: float = 0.0,
        input_rates: npt.ArrayLike = REST_COMMANDS,
    ) -> dict[str, FloatArray]:
        """Force (N) and moment about O_b (N m), body frame, of each term of the model.

        Returns:
            Term name -> (6,). Their sum is what the mass matrix turns into accelerations;
            ``inertial`` holds the velocity-dependent inertia terms.
        """
        arrays = self._columns(state, inputs, input_rates, time_s)
        wrenches, _ = self.model.kernels.terms(*arrays, self.model.tables)
        names = self.model.kernels.composition.term_names
        return {name: wrenches[row, :, 0] for row, name in enumerate(names)}

    def outputs(self, trajectory: Trajectory) -> dict[str, FloatArray]:
        """Derived quantities along a trajectory of this fish, each (T,).

        ``tail_angle`` (rad), ``tail_rate`` (rad/s), ``tail_power`` (W), ``barycentre_*`` (m, body)
        and the velocity through the water (m/s, body). A tail whose command is late is taken to
        have been told the command of each sample all along.
        """
        states = np.ascontiguousarray(trajectory.states.T)
        inputs = np.ascontiguousarray(trajectory.inputs.T)
        record = np.repeat(self.model.record, len(trajectory), axis=1)
        _, outputs = self.model.kernels.terms(
            states, inputs, np.zeros_like(inputs), record, trajectory.time_s, self.model.tables
        )
        return dict(zip(OUTPUTS, outputs, strict=True))

    def _columns(
        self, state: npt.ArrayLike, inputs: npt.ArrayLike, rates: npt.ArrayLike, time_s: float
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        given = np.asarray(state, float)
        full = np.zeros((len(self.model.kernels.state_names), 1))
        if given.ndim != 1 or not 13 <= given.size <= len(full):
            raise ScheduleError(
                f"state must have between 13 and {len(full)} numbers, got shape {given.shape}"
            )
        full[: given.size, 0] = given
        columns = [np.array(values, float).reshape(5, 1) for values in (inputs, rates)]
        clock = np.full(1, time_s)
        if given.size < len(full):
            tail_states = full.copy()
            self.model.kernels.initialise(tail_states, columns[0], self.model.record, clock)
            full[len(BASE_STATES) :] = tail_states[len(BASE_STATES) :]
        return full, columns[0], columns[1], self.model.record, clock

    def _warn_range(self, steps: CommandSteps) -> None:
        """Says once that commands are far outside of the data behind the fish."""
        if not self._told_range:
            ends = np.column_stack([steps.values.min(axis=0), steps.values.max(axis=0)]).tolist()
            asked = {name: (low, high) for name, (low, high) in zip(INPUTS, ends, strict=True)}
            self._told_range = warn_far_outside(self.fish, asked, "stay near them", stacklevel=4)

    def _warn_reach(self, steps: CommandSteps) -> None:
        low, high = self.crank.reach
        stroke = steps.values[:, INPUTS.index("block_displacement")]
        beyond = stroke[(stroke < low) | (stroke > high)]
        if beyond.size:
            warnings.warn(
                f"{self.fish.name}: block displacement {beyond[0]:g} m is beyond the crank's reach "
                f"of {low:.4f} to {high:.4f} m; simulated as commanded",
                stacklevel=3,
            )


def _check_length(times: FloatArray, dt: float) -> None:
    """Refuses what would take hours, or times that a float cannot tell apart."""
    if times.size > MOST_SAMPLES or np.abs(times[[0, -1]]).max() > LONGEST:
        raise ScheduleError(
            f"{times.size:,} samples from {times[0]:g} to {times[-1]:g} s: simulate at most "
            f"{MOST_SAMPLES:,}, within {LONGEST:g} s of 0"
        )
    if (times[-1] - times[0]) / dt > MOST_STEPS:
        raise ScheduleError(
            f"{times[-1] - times[0]:g} s in steps of {dt:g} s are more than {MOST_STEPS:g} steps; "
            "lower the duration or use longer steps (dt)"
        )


def _sample_times(
    duration_s: float | None, rate_hz: float, sample_times_s: npt.ArrayLike | None
) -> FloatArray:
    if (duration_s is None) == (sample_times_s is None):
        raise ScheduleError("give either duration_s (with rate_hz) or sample_times_s")
    if sample_times_s is not None:
        times = np.array(sample_times_s, float)
        increasing = times.ndim == 1 and times.size > 1 and np.all(np.diff(times) > 0)
        if not increasing or not np.all(np.isfinite(times)):
            raise ScheduleError("sample_times_s must be at least two finite, increasing times")
        return times
    assert duration_s is not None
    if not (is_number(duration_s) and is_number(rate_hz) and duration_s > 0 and rate_hz > 0):
        raise ScheduleError(
            f"duration {shown(duration_s)} s and rate {shown(rate_hz)} Hz must be positive numbers"
        )
    if duration_s * rate_hz > MOST_SAMPLES:
        raise ScheduleError(
            f"{duration_s:g} s at {rate_hz:g} Hz are more than {MOST_SAMPLES:,} samples; lower the "
            "duration or the rate"
        )
    count = int(np.floor(duration_s * rate_hz + 1e-9))
    times = np.arange(count + 1) / rate_hz
    return times if times[-1] > duration_s - 1e-9 else np.append(times, duration_s)

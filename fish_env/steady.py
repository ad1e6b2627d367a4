"""Steady motion under held commands: the numbers that tables of measurements hold.

The tail keeps a fish oscillating, so "steady" means that the motion repeats with every tail beat
while the heading may wind on evenly. All means run over whole tail beats after the transient.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from fish_env.arrays import FloatArray
from fish_env.effects.extended import ExtendedModel, build_model
from fish_env.errors import ScheduleError
from fish_env.model.grid import Grid
from fish_env.model.state import BASE_STATES, INPUTS
from fish_env.params.schema import FishParams
from fish_env.sensing import channels_from_states, measured_channels, true_times

BEAT_WITHOUT_TAIL_S = 1.0
"""Time that counts as a beat where the tail is still."""
SHORTEST_CHUNK_S = 5.0
"""Least time between two windows that are compared."""
LANES_AT_ONCE = 256
_FREQUENCY = INPUTS.index("tail_frequency")
_PHASE = BASE_STATES.index("tail_phase")
_TRACED = _PHASE + 1


def steady_motion(
    fish: FishParams | ExtendedModel,
    commands: npt.ArrayLike,
    *,
    records: FloatArray | None = None,
    dt: float = 0.01,
    beats: int = 4,
    tolerance: float = 1e-4,
    longest_s: float = 240.0,
) -> dict[str, FloatArray]:
    """Steady motion under n sets of held commands, those of one tail frequency at once.

    Each fish starts level and at rest and swims until its means over the last `beats` tail beats
    differ from those some seconds before by less than `tolerance` (see `change` below).
    Speeds and the yaw rate are what a recorder would derive from the measured pose and its own
    clock, so effects on measurement count.

    Args:
        fish: Parameters, or a model with effects.
        commands: (n, 5), SI, in the order of :data:`fish_env.model.state.INPUTS`.
        records: (parameters, n) records where the fish differ (see `ExtendedModel.records`).
        dt: Longest physics step, s; the step used divides the tail beat.
        beats: Tail beats to average over.
        tolerance: Largest change that counts as steady.
        longest_s: Time at which to stop waiting, s.

    Returns:
        Arrays of shape (n,), NaN for a fish that diverged:

        ``surge_speed sway_speed heave_speed``: mean velocity along the body's axes, m/s.
        ``speed``: of the evenly winding path, sqrt(horizontal_speed^2 + vertical_speed^2), m/s.
        ``horizontal_speed``: |mean of the horizontal velocity seen from a frame that turns with
        the mean yaw rate|, which leaves out the swaying to and fro, m/s.
        ``vertical_speed``: mean of dz/dt, positive down, m/s.
        ``yaw_rate``: mean, rad/s. ``turn_radius``: horizontal_speed/|yaw_rate|, m; infinite on a
        straight path.
        ``roll pitch``: means, rad. ``roll_amplitude pitch_amplitude yaw_amplitude``: half the
        range about the mean (yaw: about its mean winding), rad.
        ``roll_extreme pitch_extreme``: largest magnitude, rad.
        ``roll_rate_amplitude pitch_rate_amplitude yaw_rate_amplitude``: half the range of p, q
        and r, rad/s.
        ``change``: largest relative change of speed, yaw rate and pitch between the last two
        windows; above `tolerance` where the motion did not become steady. ``swum_s``: time
        simulated, s.

    Raises:
        ScheduleError: The commands' shape or values are not as above.
    """
    model = fish if isinstance(fish, ExtendedModel) else build_model(fish)
    dt = dt / model.substeps(dt)
    asked = _checked(commands)
    frequency = asked[:, _FREQUENCY]
    slow = (frequency > 0.0) & (frequency * longest_s < beats)
    if slow.any():
        raise ScheduleError(
            f"tail_frequency {frequency[slow][0]:g} Hz: {beats} beats last longer than the "
            f"{longest_s:g} s that a steady motion is waited for; give 0 or at least "
            f"{beats / longest_s:.2g} Hz"
        )
    record = np.repeat(model.record, len(asked), axis=1) if records is None else records
    result: dict[str, FloatArray] = {}
    for lanes in _lanes_by_frequency(asked[:, _FREQUENCY]):
        lane_record = np.ascontiguousarray(record[:, lanes])
        group = _Group(model, asked[lanes], lane_record, _step(asked[lanes[0]], dt), beats)
        for name, values in group.settle(tolerance, longest_s).items():
            result.setdefault(name, np.empty(len(asked)))[lanes] = values
    return result


def _lanes_by_frequency(frequency: FloatArray) -> list[npt.NDArray[np.intp]]:
    """Fish that beat together: their beat is then a whole number of steps, and means are exact."""
    groups = [np.flatnonzero(frequency == value) for value in np.unique(frequency)]
    return [
        group[first : first + LANES_AT_ONCE]
        for group in groups
        for first in range(0, len(group), LANES_AT_ONCE)
    ]


def _step(command: FloatArray, dt: float) -> float:
    """Longest step that divides the tail beat, s."""
    frequency = float(command[_FREQUENCY])
    return 1.0 / (frequency * np.ceil(1.0 / (frequency * dt))) if frequency > 0.0 else dt


def _checked(commands: npt.ArrayLike) -> FloatArray:
    asked = np.atleast_2d(np.asarray(commands, float))
    if asked.ndim != 2 or asked.shape[1] != len(INPUTS) or not len(asked):
        raise ScheduleError(f"steady commands must have shape (n, 5), got {asked.shape}")
    if not np.isfinite(asked).all() or np.any(asked[:, _FREQUENCY] < 0.0):
        raise ScheduleError("steady commands must be finite, with no negative frequency")
    return asked


class _Group:
    """Fish that swim together until all of them are steady."""

    def __init__(
        self, model: ExtendedModel, commands: FloatArray, record: FloatArray, dt: float, beats: int
    ) -> None:
        self.model, self.record, self.dt, self.beats = model, record, dt, beats
        self.inputs = np.ascontiguousarray(commands.T)
        frequency = commands[:, _FREQUENCY]
        self.window_s = beats / np.where(frequency > 0.0, frequency, 1.0 / BEAT_WITHOUT_TAIL_S)
        # A fifth longer than asked, because effects may slow the tail.
        self.steps = int(np.ceil(max(1.2 * self.window_s.max(), SHORTEST_CHUNK_S) / dt)) + 2
        self.clock_s = 0.0
        count = len(commands)
        self.failed_at = np.full(count, np.inf)
        self.state = np.zeros((len(model.kernels.state_names), count))
        self.state[BASE_STATES.index("qw")] = 1.0
        model.kernels.initialise(self.state, self.inputs, record, np.zeros(count))

    def settle(self, tolerance: float, longest_s: float) -> dict[str, FloatArray]:
        before = self.measure()
        while True:
            now = self.measure()
            change = _change(before, now)
            if self.clock_s >= longest_s or np.max(np.nan_to_num(change)) < tolerance:
                return {**now, "change": change, "swum_s": np.full(len(change), self.clock_s)}
            before = now

    def measure(self) -> dict[str, FloatArray]:
        """Swims on for one chunk and takes the means over each fish's last beats."""
        trace = self.advance()
        true_s = self.clock_s + self.dt * np.arange(len(trace), dtype=np.float64)
        self.clock_s = float(true_s[-1])
        first_s = _window_starts(true_s, trace[:, _PHASE], self.beats, self.window_s)
        channels = measured_channels(self.model, channels_from_states(np.moveaxis(trace, 1, 0)))
        stamps = _stamps(self.model, true_s)
        summary = _Window(stamps, np.interp(first_s, true_s, stamps), channels).summary()
        lost = np.isfinite(self.failed_at)
        return {name: np.where(lost, np.nan, values) for name, values in summary.items()}

    def advance(self) -> FloatArray:
        """States over one chunk, shape (samples, rows, n), its start included."""
        count, one = self.state.shape[1], np.ones(1, np.int64)
        trace = np.empty((self.steps + 1, _TRACED, count))
        trace[0] = self.state[:_TRACED]
        self.model.kernels.advance(
            self.state,
            self.inputs.copy(),
            self.record,
            np.full((len(INPUTS), count), np.inf),
            np.full(count, self.clock_s),
            self.inputs[None].copy(),
            Grid(0 * one, np.zeros(1), self.steps * one, np.full(1, self.dt), one),
            tables=self.model.tables,
            failed_at=self.failed_at,
            trace=trace[1:],
        )
        return trace


def _window_starts(
    time_s: FloatArray, phase: FloatArray, beats: int, without_tail_s: FloatArray
) -> FloatArray:
    """When the last whole beats began, shape (n,); fewer than asked if the tail is slower.

    They end one sample before the last, so that all derivatives in them are central.
    """
    turns = np.minimum(beats, np.floor((phase[-2] - phase[1]) / (2 * np.pi) + 1e-9))
    starts = phase[-2] - 2 * np.pi * turns
    found = [np.interp(starts[i], phase[:, i], time_s) for i in range(phase.shape[1])]
    return np.where(turns > 0, found, time_s[-2] - without_tail_s)


def _stamps(model: ExtendedModel, true_s: FloatArray) -> FloatArray:
    """Time stamps that the recorder puts on states at true times."""
    if not any(effect.sample_time for effect in model.measurement):
        return true_s
    span = true_s[-1] - true_s[0]
    candidates = np.linspace(0.25 * true_s[0] - span, 4.0 * true_s[-1] + span, 4 * len(true_s))
    return np.interp(true_s, true_times(model, candidates), candidates)


@dataclass(frozen=True)
class _Window:
    """Measured channels, each (samples, n), and when each fish's window begins, (n,)."""

    time_s: FloatArray
    first_s: FloatArray
    channels: dict[str, FloatArray]

    def summary(self) -> dict[str, FloatArray]:
        rates = {name: self.rate(self.channels[name]) for name in ("x", "y", "z", "yaw")}
        yaw_rate = self.mean(rates["yaw"])
        path = self.path(rates["x"] + 1j * rates["y"], yaw_rate)
        vertical = self.mean(rates["z"])
        surge, sway, heave = self.body_velocity(rates)
        straight = np.full_like(path, np.inf)
        radius = np.divide(path, np.abs(yaw_rate), out=straight, where=yaw_rate != 0.0)
        return {
            "surge_speed": self.mean(surge),
            "sway_speed": self.mean(sway),
            "heave_speed": self.mean(heave),
            "speed": np.hypot(path, vertical),
            "horizontal_speed": path,
            "vertical_speed": vertical,
            "yaw_rate": yaw_rate,
            "turn_radius": radius,
            **self.attitude(yaw_rate),
            **self.rate_amplitudes(),
        }

    @cached_property
    def weights(self) -> FloatArray:
        """Trapezoidal weights of each sample in a mean over the window, (samples, n)."""
        spans = np.diff(self.time_s)[:, None]
        inside = np.clip((self.time_s[1:, None] - self.first_s) / spans, 0.0, 1.0)
        inside[-1] = 0.0
        weights = np.zeros((len(self.time_s), len(self.first_s)))
        weights[:-1] += spans * inside**2 / 2
        weights[1:] += spans * (inside - inside**2 / 2)
        return np.asarray(weights / np.sum(weights, axis=0))

    def mean(self, values: FloatArray) -> FloatArray:
        return np.asarray(np.sum(self.weights * values, axis=0))

    def rate(self, values: FloatArray) -> FloatArray:
        return np.asarray(np.gradient(values, self.time_s, axis=0))

    def half_range(self, values: FloatArray) -> FloatArray:
        outside = self.weights == 0.0
        highest = np.where(outside, -np.inf, values).max(axis=0)
        return np.asarray((highest - np.where(outside, np.inf, values).min(axis=0)) / 2)

    def extreme(self, values: FloatArray) -> FloatArray:
        return np.asarray(np.where(self.weights == 0.0, 0.0, np.abs(values)).max(axis=0))

    def path(self, horizontal: FloatArray, yaw_rate: FloatArray) -> FloatArray:
        """Speed along the evenly winding path."""
        turned = np.exp(-1j * yaw_rate * self.time_s[:, None])
        return np.asarray(np.abs(np.sum(self.weights * horizontal * turned, axis=0)))

    def body_velocity(self, rates: dict[str, FloatArray]) -> FloatArray:
        """Velocity along the measured body axes, (3, samples, n)."""
        angles = np.stack([self.channels[name] for name in ("yaw", "pitch", "roll")], axis=-1)
        velocity = np.stack([rates[name] for name in "xyz"], axis=-1)
        attitude = Rotation.from_euler("ZYX", angles.reshape(-1, 3))
        body = attitude.apply(velocity.reshape(-1, 3), inverse=True)
        return np.moveaxis(body.reshape(velocity.shape), -1, 0)

    def attitude(self, yaw_rate: FloatArray) -> dict[str, FloatArray]:
        roll, pitch = self.channels["roll"], self.channels["pitch"]
        swaying = self.channels["yaw"] - yaw_rate * self.time_s[:, None]
        return {
            "roll": self.mean(roll),
            "pitch": self.mean(pitch),
            "roll_amplitude": self.half_range(roll),
            "pitch_amplitude": self.half_range(pitch),
            "yaw_amplitude": self.half_range(swaying),
            "roll_extreme": self.extreme(roll),
            "pitch_extreme": self.extreme(pitch),
        }

    def rate_amplitudes(self) -> dict[str, FloatArray]:
        names = {"p": "roll", "q": "pitch", "r": "yaw"}
        return {
            f"{name}_rate_amplitude": self.half_range(self.channels[channel])
            for channel, name in names.items()
        }


def _change(before: dict[str, FloatArray], now: dict[str, FloatArray]) -> FloatArray:
    """Largest relative change; below 1 mm/s, 1 mrad/s and 0.1 rad it is relative to those."""
    floors = {"speed": 1e-3, "yaw_rate": 1e-3, "pitch": 0.1}
    changes = [
        np.abs(now[name] - before[name]) / np.maximum(np.abs(now[name]), floor)
        for name, floor in floors.items()
    ]
    return np.asarray(np.max(changes, axis=0))

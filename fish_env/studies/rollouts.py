"""A model whose coefficients and effects are free, and rollouts of it over whole runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.vocabulary import COMMANDS
from fish_env.effects.extended import PREFIX, build_model
from fish_env.effects.registry import catalogue
from fish_env.identification.parameters import Baseline, measurement_of
from fish_env.inference.estimate.bounds import LinearBounds, parameter_bounds
from fish_env.model.frames import euler_from_quaternion, quaternion_from_euler
from fish_env.model.runtime import Grid
from fish_env.model.state import BASE_STATES
from fish_env.params.schema import FishParams
from fish_env.studies.tracks import CHANNELS, FREQUENCY, Track

START = ("x", "y", "yaw", "u", "v", "r", "phase", "pace")
"""Free numbers of a run: pose (m, rad), velocities (m/s, rad/s), tail phase (rad), and the tail's
frequency over the commanded one."""
PACE = START.index("pace")
PHASE = BASE_STATES.index("tail_phase")


@dataclass(frozen=True)
class EffectPrior:
    """A free effect parameter: a normal prior about its neutral value, within bounds."""

    path: str
    neutral: float
    sd: float
    lower: float
    upper: float


class WholeRuns:
    """Model with free coefficients and effects, and rollouts of it.

    Args:
        fish: nominal parameters and priors.
        paths: free coefficients.
        effects: free effect parameters, ``<effect>.<parameter>``; the prior of each is normal,
            with half the plausible range as one sigma.
        dt: physics step, s.
    """

    def __init__(
        self, fish: FishParams, paths: Sequence[str], effects: Sequence[str] = (), dt: float = 0.02
    ) -> None:
        self.fish, self.dt = fish, dt
        self.baseline = Baseline(fish, paths)
        self.effects = tuple(_prior(name, fish) for name in effects)
        self.model = build_model(fish, whole_catalogue=bool(effects or fish.effects))

    @cached_property
    def sensing(self) -> tuple[str, ...]:
        """Free parameters of effects on what is recorded."""
        paths = [e.path for e in self.effects]
        return tuple(p for p in paths if not catalogue()[p.split(".")[1]].acts_on_motion)

    @property
    def size(self) -> int:
        """Number of common free numbers."""
        return len(self.baseline) + len(self.effects)

    @property
    def names(self) -> tuple[str, ...]:
        """Paths of the common free numbers."""
        return (*self.baseline.paths, *(e.path for e in self.effects))

    def values(self, x: FloatArray) -> FloatArray:
        """Numbers in their own units (size, n) of normalised ones (size, n)."""
        count = len(self.baseline)
        effects = [e.neutral + e.sd * x[count + i] for i, e in enumerate(self.effects)]
        return np.concatenate([self.baseline.values(x[:count]), *(e[None] for e in effects)])

    @property
    def physical_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Of the common free numbers in their own units, each (size,)."""
        low, high = self.baseline.bounds
        effects = self.effects
        return np.r_[low, [e.lower for e in effects]], np.r_[high, [e.upper for e in effects]]

    @cached_property
    def bounds(self) -> LinearBounds:
        """Where the normalised numbers may go."""
        low = [(e.lower - e.neutral) / e.sd for e in self.effects]
        high = [(e.upper - e.neutral) / e.sd for e in self.effects]
        return parameter_bounds(self.baseline, low, high)

    def roll(self, track: Track, x: FloatArray, starts: FloatArray) -> FloatArray:
        """Predicted x, y, yaw of one run for n fish, shape (n, samples, 3).

        Args:
            track: whose times and command.
            x: (size, n) normalised common numbers.
            starts: (8, n).
        """
        count = x.shape[1]
        values = dict(zip(self.names, self.values(x), strict=True))
        changes = {p: v for p, v in values.items() if p not in self.sensing}
        record = np.ascontiguousarray(self.model.records(changes))
        inputs = np.repeat(track.command[:, None], count, axis=1)
        inputs[FREQUENCY] *= starts[PACE]
        state = self._state(starts)
        self.model.kernels.initialise(state, inputs, record, np.zeros(count))
        steps = int(np.ceil(track.time_s[-1] / self.dt)) + 1
        trace = np.empty((steps + 1, PHASE, count))
        trace[0] = state[:PHASE]
        one = np.ones(1, np.int64)
        self.model.kernels.advance(
            state,
            inputs.copy(),
            record,
            np.full((len(COMMANDS), count), np.inf),
            np.zeros(count),
            inputs[None].copy(),
            Grid(0 * one, np.zeros(1), steps * one, np.full(1, self.dt), one),
            tables=self.model.tables,
            failed_at=np.full(count, np.inf),
            trace=trace[1:],
        )
        seen = self._at(trace, track.time_s)
        known = [catalogue()[name] for name in {p.split(".")[1] for p in self.sensing}]
        sensors = measurement_of(self.model, known, values, CHANNELS, count)
        return seen * sensors.gain.T[:, None] + sensors.bias.T[:, None]

    def _state(self, starts: FloatArray) -> FloatArray:
        state = np.zeros((len(self.model.kernels.state_names), starts.shape[1]))
        euler = np.zeros((starts.shape[1], 3))
        euler[:, 2] = starts[2]
        state[0], state[1] = starts[0], starts[1]
        state[3:7] = quaternion_from_euler(euler).T
        state[7], state[8], state[12] = starts[3], starts[4], starts[5]
        state[PHASE] = starts[6]
        return state

    def _at(self, trace: FloatArray, time_s: FloatArray) -> FloatArray:
        """Samples between physics steps, linearly."""
        row = np.minimum((time_s / self.dt).astype(int), len(trace) - 2)
        share = (time_s / self.dt - row)[:, None]
        yaw = np.unwrap(euler_from_quaternion(np.moveaxis(trace[:, 3:7], 1, -1))[..., 2], axis=0)
        pose = np.stack([trace[:, 0], trace[:, 1], yaw], axis=-1)
        seen = pose[row] + share[:, :, None] * (pose[row + 1] - pose[row])
        return np.moveaxis(seen, 1, 0)


def _prior(name: str, fish: FishParams) -> EffectPrior:
    effect, parameter = name.split(".")
    p = {q.name: q for q in catalogue()[effect].parameters}[parameter]
    middle = fish.effects.get(effect, {}).get(parameter, p.neutral)
    low, high = p.plausible
    if np.isinf(middle):
        middle = high
    sd = 0.5 * max(abs(high - middle), abs(low - middle))
    return EffectPrior(f"{PREFIX}{name}", middle, sd, p.lower, p.upper)

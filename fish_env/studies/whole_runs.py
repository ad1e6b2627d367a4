"""Output error over whole runs: coefficients by what they predict from start to end.

One rollout per run, no filter in between, so what is slow shows as much as what is quick. Start,
tail phase and tail frequency of every run are free. What the water does to a fish between start
and end is allowed for in the weights: errors of speed and yaw rate that die out with a time
constant, integrated, on top of the camera's noise. The runs' own free numbers are eliminated
before the common ones are solved for (separable least squares: Golub and Pereyra, 1973).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fish_env.data.vocabulary import COMMANDS
from fish_env.effects.extended import PREFIX, build_model
from fish_env.effects.registry import catalogue
from fish_env.identification.parameters import Baseline, measurement_of
from fish_env.model.frames import euler_from_quaternion, quaternion_from_euler
from fish_env.model.runtime import Grid
from fish_env.model.state import BASE_STATES
from fish_env.params.schema import FishParams
from fish_env.studies.least_squares import bounded_step, without
from fish_env.studies.tracks import CHANNELS, FREQUENCY, Track, Weights

FloatArray = npt.NDArray[np.float64]
START = ("x", "y", "yaw", "u", "v", "r", "phase", "pace")
"""Free numbers of a run: pose (m, rad), velocities (m/s, rad/s), tail phase (rad), and the tail's
frequency over the commanded one."""
START_UNITS = np.array([2e-3, 2e-3, 0.02, 5e-3, 5e-3, 0.05, 0.3, 0.01])
START_PRIOR = np.array([np.inf, np.inf, np.inf, 0.03, 0.02, 0.3, np.inf, 0.02])
"""One sigma of what is known of them beforehand, around :attr:`Track.start`."""
PHASE_AT, PACE = START.index("phase"), START.index("pace")
PHASE = BASE_STATES.index("tail_phase")
Z_STEP = 0.05
PHASES = 8
LOST = 1e3
"""m or rad. Error of a simulation that diverged."""


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

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Of normalised numbers, each (size,)."""
        baseline = self.baseline
        ends = [(b - baseline.mean) / np.diag(baseline.factor) for b in baseline.bounds]
        low = [(e.lower - e.neutral) / e.sd for e in self.effects]
        high = [(e.upper - e.neutral) / e.sd for e in self.effects]
        return (
            np.maximum(np.r_[ends[0], low], -12.0) + 1e-3,
            np.minimum(np.r_[ends[1], high], 12.0) - 1e-3,
        )

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


@dataclass(frozen=True, eq=False)
class RunFit:
    """A fit to whole runs.

    Attributes:
        model: what was fitted.
        x: normalised common numbers.
        starts: of each run, shape (runs, 8).
        objective: sum of squared whitened errors and priors.
        information: of the normalised common numbers, starts eliminated, shape (size, size).
        gradients: contribution of each run to the gradient, shape (runs, size).
    """

    model: WholeRuns
    x: FloatArray
    starts: FloatArray
    objective: float
    information: FloatArray
    gradients: FloatArray


def fit_runs(
    model: WholeRuns,
    tracks: Sequence[Track],
    weights: Weights,
    x: FloatArray | None = None,
    starts: FloatArray | None = None,
    steps: int = 15,
    common: bool = True,
    tolerance: float = 1e-4,
) -> RunFit:
    """Gauss-Newton with step control on all runs.

    Args:
        model: model and its freedom.
        tracks: runs.
        weights: of their errors.
        x: normalised common numbers to start at; default: nominal.
        starts: (runs, 8) to start at; default: from the first seconds, every phase tried.
        steps: most steps.
        common: whether the common numbers are free; if not, the starts alone are fitted.
        tolerance: relative decrease of the objective below which to stop.
    """
    x = np.zeros(model.size) if x is None else x
    white = [[weights.whitening(t.time_s, a) for a in (False, False, True)] for t in tracks]
    if starts is None:
        starts = settle_phases(model, tracks, white, x)
    damping, now = 1e-3, _Sum(model, tracks, white, x, starts)
    for _ in range(steps):
        moved = now.step(damping, common)
        after = _Sum(model, tracks, white, *moved)
        if np.isfinite(after.objective) and after.objective < now.objective:
            gained = now.objective - after.objective
            now, damping = after, max(damping / 5.0, 1e-6)
            if gained < tolerance * now.objective:
                break
        else:
            damping *= 10.0
            if damping > 1e4:
                break
    return RunFit(model, now.x, now.starts, now.objective, now.information(), now.gradients())


def settle_phases(
    model: WholeRuns,
    tracks: Sequence[Track],
    white: Sequence[Sequence[FloatArray]],
    x: FloatArray,
) -> FloatArray:
    """Starts with the likeliest of eight tail phases, shape (runs, 8)."""
    best = np.array([t.start for t in tracks])
    least = np.full(len(tracks), np.inf)
    for phase in np.arange(PHASES) * 2.0 * np.pi / PHASES:
        starts = np.array([t.start for t in tracks])
        starts[:, PHASE_AT] = phase
        for _ in range(3):
            now = _Sum(model, tracks, white, x, starts)
            starts = now.step(1e-3, False)[1]
        reached = _Sum(model, tracks, white, x, starts, slopes=False)
        better = reached.each < least
        best[better], least[better] = starts[better], reached.each[better]
    return best


class _Sum:
    """Objective and its slopes at one point."""

    def __init__(
        self,
        model: WholeRuns,
        tracks: Sequence[Track],
        white: Sequence[Sequence[FloatArray]],
        x: FloatArray,
        starts: FloatArray,
        slopes: bool = True,
    ) -> None:
        self.model, self.x, self.starts = model, x, starts
        self.parts = [
            self._part(track, w, start, slopes)
            for track, w, start in zip(tracks, white, starts, strict=True)
        ]
        self.each = np.array([residual @ residual for residual, _, _ in self.parts])
        self.objective = float(self.each.sum() + x @ x)

    def _part(
        self, track: Track, white: Sequence[FloatArray], start: FloatArray, slopes: bool
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        size, own = self.model.size, len(START)
        lanes = 1 + (size + own if slopes else 0)
        x, starts = np.repeat(self.x[:, None], lanes, 1), np.repeat(start[:, None], lanes, 1)
        upper = self.model.bounds()[1]
        step = np.where(self.x + Z_STEP > upper, -Z_STEP, Z_STEP)
        nudge = 0.02 * START_UNITS
        if slopes:
            x[:, 1 : 1 + size] += np.diag(step)
            starts[:, 1 + size :] += np.diag(nudge)
        seen = self.model.roll(track, x, starts)
        errors = np.where(np.isfinite(track.measured), seen - track.measured, 0.0)
        errors = np.where(np.isfinite(errors), errors, LOST)
        lines = np.concatenate([w @ errors[:, :, k].T for k, w in enumerate(white)])
        held = np.where(np.isfinite(START_PRIOR), (start - _usual(track)) / START_PRIOR, 0.0)
        residual = np.r_[lines[:, 0], held]
        if not slopes:
            return residual, np.empty(0), np.empty(0)
        common = (lines[:, 1 : 1 + size] - lines[:, :1]) / step
        mine = (lines[:, 1 + size :] - lines[:, :1]) / nudge * START_UNITS
        common = np.concatenate([common, np.zeros((own, size))])
        prior = np.diag(np.where(np.isfinite(START_PRIOR), START_UNITS / START_PRIOR, 0.0))
        return residual, common, np.concatenate([mine, prior])

    def step(self, damping: float, common: bool) -> tuple[FloatArray, FloatArray]:
        """Next common numbers and starts."""
        size = self.model.size
        move = np.zeros(size)
        if common:
            left, right = np.eye(size) * (1.0 + damping), -self.x
            for residual, slopes, mine in self.parts:
                kept = without(mine, np.column_stack([slopes, residual]))
                own = slopes.T @ kept[:, :-1]
                left = left + own + damping * np.diag(np.diag(own))
                right = right - slopes.T @ kept[:, -1]
            lower, upper = self.model.bounds()
            move = bounded_step(left, right, lower - self.x, upper - self.x)
        starts = self.starts.copy()
        for i, (residual, slopes, mine) in enumerate(self.parts):
            rest = residual + slopes @ move
            normal = mine.T @ mine
            normal += np.diag(1e-9 + damping * np.diag(normal))
            starts[i] -= np.clip(np.linalg.solve(normal, mine.T @ rest), -8.0, 8.0) * START_UNITS
        return self.x + move, starts

    def information(self) -> FloatArray:
        """Of the common numbers, priors included."""
        total = np.eye(self.model.size)
        for _, slopes, mine in self.parts:
            total = total + slopes.T @ without(mine, slopes)
        return total

    def gradients(self) -> FloatArray:
        """Contribution of each run to the gradient of the common numbers."""
        return np.array(
            [
                slopes.T @ without(mine, residual[:, None])[:, 0]
                for residual, slopes, mine in self.parts
            ]
        )


def _usual(track: Track) -> FloatArray:
    """Where the priors of a run's own numbers are centred."""
    usual = track.start.copy()
    usual[4] = 0.0
    return usual


def predict(
    model: WholeRuns, x: FloatArray, track: Track, weights: Weights, pace: float, first_s: float
) -> FloatArray:
    """A run from start to end, of which only the beginning is known, shape (samples, 3).

    Args:
        model: the model.
        x: its normalised common numbers.
        track: the run; its commands and times are used throughout.
        weights: of the errors of the beginning, by which the start is fitted.
        pace: tail frequency over the commanded one.
        first_s: how long a beginning is known.
    """
    early = track.until(first_s)
    white = [weights.whitening(early.time_s, angle) for angle in (False, False, True)]
    found = []
    for phase in np.arange(PHASES) * 2.0 * np.pi / PHASES:
        starts = early.start[None].copy()
        starts[:, PHASE_AT], starts[:, PACE] = phase, pace
        for _ in range(4):
            starts = _Sum(model, [early], [white], x, starts).step(1e-3, False)[1]
            starts[:, PACE] = pace
        reached = _Sum(model, [early], [white], x, starts, slopes=False)
        found.append((reached.objective, starts))
    best = min(found, key=lambda pair: pair[0])[1]
    return np.asarray(model.roll(track, x[:, None], best.T)[0])

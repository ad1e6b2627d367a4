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

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.box_qp import minimise_in_box
from fish_env.studies.rollouts import PACE, START, WholeRuns
from fish_env.studies.tracks import Track, Weights

START_UNITS = np.array([2e-3, 2e-3, 0.02, 5e-3, 5e-3, 0.05, 0.3, 0.01])
START_PRIOR = np.array([np.inf, np.inf, np.inf, 0.03, 0.02, 0.3, np.inf, 0.02])
"""One sigma of what is known of them beforehand, around :attr:`Track.start`."""
LONGEST = 8.0
"""Longest move of a run's own numbers in one step, in their units."""
PHASE_AT = START.index("phase")
Z_STEP = 5e-4
"""Step of common numbers for differences. Runs bend strongly with the static moment, by which an
unseen pitch comes: a secant of 0.05 put its minimum elsewhere, and fits stopped too early."""
PHASES = 8
START_STEPS, START_TOLERANCE = 20, 1e-4
"""Most steps to a start, and the decrease of its objective (in sigma squared) below which it has
been found."""
LOST = 1e3
"""m or rad. Error of a simulation that diverged."""


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
        tolerance: relative decrease of the objective below which to stop.
    """
    x = np.zeros(model.size) if x is None else x
    white = [[weights.whitening(t.time_s, a) for a in (False, False, True)] for t in tracks]
    if starts is None:
        runs = zip(tracks, white, strict=True)
        starts = np.array([likeliest_start(model, track, w, x) for track, w in runs])
    damping, now = 1e-3, _Sum(model, tracks, white, x, starts)
    for _ in range(steps):
        after = now.at(*now.step(damping))
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


def likeliest_start(
    model: WholeRuns,
    track: Track,
    white: Sequence[FloatArray],
    x: FloatArray,
    pace: float | None = None,
) -> FloatArray:
    """The start (8,) of a run that leaves least, from eight tail phases.

    What is known is held in the step itself. To free the tail frequency and to put it back after
    each step would move phase and yaw rate to where another frequency wants them.

    Args:
        model: the model.
        track: the run.
        white: whitening matrices of x, y and yaw.
        x: (size,) normalised common numbers.
        pace: tail frequency over the commanded one; free if absent.
    """
    longest = np.full(len(START), LONGEST)
    first = track.start.copy()
    if pace is not None:
        longest[PACE], first[PACE] = 0.0, pace
    found = []
    for phase in np.arange(PHASES) * 2.0 * np.pi / PHASES:
        first[PHASE_AT] = phase
        found.append(_descended(_Sum(model, [track], [white], x, first[None], False), longest))
    return np.asarray(min(found, key=lambda sum_: sum_.objective).starts[0])


def _descended(now: _Sum, longest: FloatArray) -> _Sum:
    """Where the starts alone come to rest, by steps with control."""
    damping = 1e-3
    for _ in range(START_STEPS):
        after = now.at(now.x, now.moved_starts(damping, np.zeros(0), longest))
        gained = now.objective - after.objective
        damping = max(damping / 5.0, 1e-6) if gained > 0.0 else damping * 10.0
        if gained > 0.0:
            now = after
            if gained < START_TOLERANCE:
                break
    return now


class _Sum:
    """Objective and its slopes at one point; without slopes by common numbers if not ``common``."""

    def __init__(
        self,
        model: WholeRuns,
        tracks: Sequence[Track],
        white: Sequence[Sequence[FloatArray]],
        x: FloatArray,
        starts: FloatArray,
        common: bool = True,
    ) -> None:
        self.model, self.tracks, self.white, self.common = model, tracks, white, common
        self.x, self.starts = x, starts
        self.scale = np.ones(model.size)
        self.parts = [
            self._part(track, w, start)
            for track, w, start in zip(tracks, white, starts, strict=True)
        ]
        self.objective = float(sum(r @ r for r, _, _ in self.parts) + x @ x)

    def at(self, x: FloatArray, starts: FloatArray) -> _Sum:
        """The same at another point, with the scale of the steps so far."""
        other = _Sum(self.model, self.tracks, self.white, x, starts, self.common)
        other.scale = self.scale
        return other

    def _part(
        self, track: Track, white: Sequence[FloatArray], start: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        size, own = self.model.size if self.common else 0, len(START)
        bounds = self.model.bounds
        ends = bounds.rows @ self.x + Z_STEP * np.diag(bounds.rows)
        step = np.where(ends > bounds.high, -Z_STEP, Z_STEP)[:size]
        nudge = 0.02 * START_UNITS
        x = np.repeat(self.x[:, None], 1 + size + own, 1)
        starts = np.repeat(start[:, None], 1 + size + own, 1)
        x[:size, 1 : 1 + size] += np.diag(step)
        starts[:, 1 + size :] += np.diag(nudge)
        seen = self.model.roll(track, x, starts)
        errors = np.where(np.isfinite(track.measured), seen - track.measured, 0.0)
        errors = np.where(np.isfinite(errors), errors, LOST)
        lines = np.concatenate([w @ errors[:, :, k].T for k, w in enumerate(white)])
        held = np.where(np.isfinite(START_PRIOR), (start - _usual(track)) / START_PRIOR, 0.0)
        common = (lines[:, 1 : 1 + size] - lines[:, :1]) / step
        mine = (lines[:, 1 + size :] - lines[:, :1]) / nudge * START_UNITS
        common = np.concatenate([common, np.zeros((own, size))])
        prior = np.diag(np.where(np.isfinite(START_PRIOR), START_UNITS / START_PRIOR, 0.0))
        return np.r_[lines[:, 0], held], common, np.concatenate([mine, prior])

    def step(self, damping: float) -> tuple[FloatArray, FloatArray]:
        """Next common numbers and starts.

        Damping goes by the largest curvature seen so far (More, 1978): a fish that lies level
        hardly responds to a static moment, and a little further on it does so strongly.
        """
        left, right = np.eye(self.model.size), -self.x
        for residual, slopes, mine in self.parts:
            kept = _without(mine, np.column_stack([slopes, residual]))
            left = left + slopes.T @ kept[:, :-1]
            right = right - slopes.T @ kept[:, -1]
        self.scale = np.maximum(self.scale, np.diag(left))
        left = left + damping * np.diag(self.scale)
        move = self.model.bounds.step(left, -right, self.x)
        return self.x + move, self.moved_starts(damping, move, np.full(len(START), LONGEST))

    def moved_starts(self, damping: float, move: FloatArray, longest: FloatArray) -> FloatArray:
        """Next starts (runs, 8).

        Args:
            damping: share of its own curvature that holds each number back.
            move: step of the common numbers, as many as there are slopes.
            longest: (8,) longest moves in :data:`START_UNITS`.
        """
        starts = self.starts.copy()
        for start, (residual, slopes, mine) in zip(starts, self.parts, strict=True):
            normal = mine.T @ mine
            normal += np.diag(1e-9 + damping * np.diag(normal))
            pull = mine.T @ (residual + slopes @ move)
            start += minimise_in_box(normal, pull, -longest, longest).step * START_UNITS
        return starts

    def information(self) -> FloatArray:
        """Of the common numbers, priors included."""
        total = np.eye(self.model.size)
        for _, slopes, mine in self.parts:
            total = total + slopes.T @ _without(mine, slopes)
        return total

    def gradients(self) -> FloatArray:
        """Contribution of each run to the gradient of the common numbers."""
        return np.array(
            [
                slopes.T @ _without(mine, residual[:, None])[:, 0]
                for residual, slopes, mine in self.parts
            ]
        )


def _without(mine: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (N, m) less what a run's own numbers, with slopes (N, k), can follow."""
    basis, triangle = np.linalg.qr(mine)
    basis = basis[:, np.abs(np.diag(triangle)) > 1e-10]
    return np.asarray(columns - basis @ (basis.T @ columns))


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
    start = likeliest_start(model, early, white, x, pace)
    return np.asarray(model.roll(track, x[:, None], start[:, None])[0])

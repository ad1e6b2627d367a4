"""Estimates of the runs' own numbers, at given values of the common parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.whole_runs.noise import SimulationNoise
from fish_env.identification.whole_runs.own_numbers import PACE, PHASE
from fish_env.identification.whole_runs.simulated_runs import SimulatedRuns
from fish_env.inference.estimate.box_qp import minimise_in_box
from fish_env.inference.estimate.gauss_newton import predicted_decrease
from fish_env.inference.problem import Point

NUDGE = 0.02
"""Step for differences, in units of what matters."""
LONGEST = 8.0
"""Longest move in one step, in those units."""
STEPS, MORE_STEPS, TOLERANCE = 20, 6, 0.01
"""Most steps from a guess and from an estimate close by, and the decrease of -2 log likelihood of a
run that is not worth another one."""
PHASES, EARLY_S, EARLY_STEPS = 8, 5.0, 8
"""Phases tried for an unknown one, on how long a beginning (s), in how many steps."""
LOST = 1e3
"""Error (SI) of a simulation that diverged."""


@dataclass(frozen=True, eq=False)
class OwnFit:
    """Own numbers of one run, fitted or on the way.

    Attributes:
        own: (K,) values.
        errors: (T, C) measured less simulated.
        residuals: (D_r,) whitened, with the prior of the own numbers.
        slopes: (D_r, K) by the own numbers in units of what matters.
    """

    own: FloatArray
    errors: FloatArray
    residuals: FloatArray
    slopes: FloatArray

    @property
    def objective(self) -> float:
        """Sum of squares."""
        return float(self.residuals @ self.residuals)

    @property
    def basis(self) -> FloatArray:
        """(D_r, k) orthonormal directions that the own numbers follow."""
        left, sizes, _ = np.linalg.svd(self.slopes, full_matrices=False)
        return np.asarray(left[:, sizes > 1e-9 * max(float(sizes[0]), 1e-300)])


def likeliest(problem: SimulatedRuns, point: Point, noise: SimulationNoise) -> list[FloatArray]:
    """The own numbers (K,) of every run that leave least, an unknown phase tried all round.

    Args:
        problem: the runs.
        point: values of the common parameters.
        noise: noise model.
    """
    first = [own.guess.copy() for own in problem.own]
    for own, kind in zip(first, problem.own, strict=True):
        at = kind.names.index(PACE)
        own[at] = own[at] / problem.scale_at(point) if problem.pace is None else problem.pace
    early = problem.until(EARLY_S)
    unknown = [i for i, own in enumerate(problem.own) if PHASE in own.names]
    tried: list[list[OwnFit]] = [[] for _ in first]
    for phase in np.arange(PHASES) * 2.0 * np.pi / PHASES if unknown else ():
        begin = [own.copy() for own in first]
        for i in unknown:
            begin[i][problem.own[i].names.index(PHASE)] = phase
        for i, found in zip(
            unknown,
            fit_own_numbers(early, point, noise, begin, unknown, EARLY_STEPS),
            strict=True,
        ):
            tried[i].append(found)
    near = [
        min(found, key=lambda f: f.objective).own if found else own
        for found, own in zip(tried, first, strict=True)
    ]
    return [found.own for found in fit_own_numbers(problem, point, noise, near)]


def fit_own_numbers(
    problem: SimulatedRuns,
    point: Point,
    noise: SimulationNoise,
    starts: Sequence[FloatArray],
    runs: Sequence[int] | None = None,
    steps: int = STEPS,
) -> list[OwnFit]:
    """Fit the own numbers of some runs by Gauss-Newton steps with control.

    Args:
        problem: the runs.
        point: values of the common parameters.
        noise: noise model.
        starts: of every run of the problem, (K,) where to begin.
        runs: which runs; default: all.
        steps: most steps.
    """
    chosen = list(range(problem.run_count)) if runs is None else list(runs)
    begin = {i: starts[i] for i in chosen}
    found = _linearised(problem, point, noise, begin)
    damping = dict.fromkeys(chosen, 1e-3)
    active = chosen
    for _ in range(steps):
        moved: dict[int, FloatArray] = {}
        for i in active:
            step, promised = _step(problem, i, found[i], damping[i])
            if promised > TOLERANCE:
                moved[i] = found[i].own + step
        if not moved:
            break
        active = []
        for i, after in _linearised(problem, point, noise, moved).items():
            gained = found[i].objective - after.objective
            damping[i] = max(damping[i] / 5.0, 1e-6) if gained > 0.0 else 10.0 * damping[i]
            if gained > 0.0:
                found[i] = after
            if damping[i] < 1e4:
                active.append(i)
    return [found[i] for i in chosen]


def _step(
    problem: SimulatedRuns, run: int, now: OwnFit, damping: float
) -> tuple[FloatArray, float]:
    """A step (K,) in SI units, and the decrease it predicts."""
    kind = problem.own[run]
    normal = now.slopes.T @ now.slopes
    normal += np.diag(1e-9 + damping * np.diag(normal))
    pull = now.slopes.T @ now.residuals
    longest = np.full(len(kind.names), LONGEST)
    if problem.pace is not None:
        # Held in the step itself: to put it back afterwards would leave the phase elsewhere.
        longest[kind.names.index(PACE)] = 0.0
    step = minimise_in_box(normal, pull, -longest, longest).step
    return step * kind.units, predicted_decrease(normal, pull, step)


def _linearised(
    problem: SimulatedRuns, point: Point, noise: SimulationNoise, own: dict[int, FloatArray]
) -> dict[int, OwnFit]:
    """Residuals and slopes of some runs at given own numbers."""
    runs = list(own)
    lanes = 1 + max(len(values) for values in own.values())
    moved = []
    for i in runs:
        values = np.repeat(own[i][:, None], lanes, axis=1)
        size = len(own[i])
        values[:, 1 : 1 + size] += np.diag(NUDGE * problem.own[i].units)
        moved.append(values)
    z = np.repeat(point.z[:, None], lanes, axis=1)
    effects = {id: np.full(lanes, value) for id, value in point.effects.items()}
    result = {}
    for i, values, errors in zip(runs, moved, problem.errors(z, effects, moved, runs), strict=True):
        finite = np.where(np.isfinite(errors), np.clip(errors, -LOST, LOST), LOST)
        rows = problem.whitened(finite, values, noise, i)
        slopes = (rows[1 : 1 + len(own[i])] - rows[0]).T / NUDGE
        if problem.pace is not None:
            slopes[:, problem.own[i].names.index(PACE)] = 0.0
        result[i] = OwnFit(own[i], finite[0], rows[0], slopes)
    return result

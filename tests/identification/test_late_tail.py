"""A tail whose command comes late: what the filter learns of its phase concerns what is on its way.

Under a command that never changes, a delay is a difference in phase and nothing else, so both
descriptions have to learn the same from the same data.
"""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset
from fish_env.identification import SeriesProblem
from fish_env.identification.state_blocks import PHASE_COLUMN
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from tests.identification.synthetic import PATHS, Setup, simulate

FREQUENCY_HZ, PHASE_SD, PHASE_ROW = 1.5, 0.3, 13
COMMAND = np.array([[0.0, 0.4, FREQUENCY_HZ, 0.0, 0.0]])


def beating(setup: Setup) -> Dataset:
    """Runs under one command, whose tails were beating before."""
    runs = []
    for run in simulate(setup, COMMAND).runs:
        steps = CommandSteps(run.time_s[:1], COMMAND)
        runs.append(replace(run, commands=steps, start="unknown", tail_phase=None))
    return replace(simulate(setup, COMMAND), runs=tuple(runs))


def starting(problem: SeriesProblem, phase: float) -> SeriesProblem:
    """The problem with its runs' phases at the start (rad) hardly known."""
    runs = []
    for run in problem.runs:
        state, covariance = run.state0.copy(), run.covariance0.copy()
        state[PHASE_ROW], covariance[PHASE_COLUMN, PHASE_COLUMN] = phase, PHASE_SD**2
        runs.append(replace(run, state0=state, covariance0=covariance))
    return problem.with_runs(runs)


@pytest.mark.parametrize("delay", [0.03, 0.1])
def test_a_late_tail_is_put_in_phase_as_one_that_is_not_late(delay):
    setup = Setup(runs=1, duration=4.0)
    noise, off = replace(setup.noise, phase_sd=0.1), 0.25
    problem = SeriesProblem(beating(setup), paths=PATHS)
    zero, turn = np.zeros(len(PATHS)), 2.0 * np.pi * FREQUENCY_HZ * delay
    (prompt,) = starting(problem, off).filtered(Point(zero, {}), noise)
    point = Point(zero, {EffectParameterId("servo_delay", "delay"): delay})
    (late,) = starting(problem, off + turn).filtered(point, noise)
    np.testing.assert_allclose(late.innovations, prompt.innovations, atol=2e-3)
    told = prompt.states[:, PHASE_ROW] + turn
    np.testing.assert_allclose(late.states[:, PHASE_ROW], told, atol=1e-4)
    assert abs(prompt.states[-1, PHASE_ROW] - 2.0 * np.pi * FREQUENCY_HZ * 4.0) < 0.5 * off


def test_lanes_of_a_late_tail_repeat_its_filter():
    setup = Setup(runs=1, duration=4.0)
    noise = replace(setup.noise, phase_sd=0.1)
    problem = starting(SeriesProblem(beating(setup), paths=PATHS), 0.7)
    zero, effects = np.zeros(len(PATHS)), {EffectParameterId("servo_delay", "delay"): 0.08}
    filtered = problem.filtered(Point(zero, effects), noise)
    lanes = {path: np.full(2, value) for path, value in effects.items()}
    rows = problem.innovations(np.zeros((len(PATHS), 2)), lanes, noise, filtered)
    for row in rows:
        np.testing.assert_allclose(row, filtered[0].residuals, atol=1e-7)

"""Sensor errors: their way through the filter is that of spoilt data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.identification.sensor_errors import innovation_slopes, sensor_slopes
from fish_env.identification.series import SeriesProblem
from fish_env.identification.variation import SENSOR_ERRORS
from fish_env.inference.estimate.fit import fit, run_variation
from fish_env.inference.problem import Point
from fish_env.simulator import Simulator
from tests.identification.synthetic import ALL, FISH, PATHS, SENSOR_SD, Setup, simulate

NAMES = [error.name for error in SENSOR_ERRORS]


@pytest.fixture(scope="module")
def filtered():
    setup = Setup(runs=1, missing=0.05)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    point = Point(np.zeros(len(PATHS)), {})
    return problem, point, setup.noise, problem.filtered(point, setup.noise, keep_slopes=True)


@pytest.mark.parametrize("name", NAMES)
def test_the_filter_takes_a_change_of_its_data_as_the_slopes_say(filtered, name):
    problem, point, noise, results = filtered
    (run,), (result,) = problem.runs, results
    changes = sensor_slopes(run.clock, result, problem.channels)
    slopes = innovation_slopes(run.clock, run.measured, result, noise.correlation_s, changes)
    k = NAMES.index(name)
    size = 0.1 * SENSOR_ERRORS[k].usual
    # The first sample also says where the run starts, which is another matter.
    measured = run.measured + size * changes[:, :, k]
    spoilt = problem.with_runs([replace(run, measured=measured)])
    z = point.z[:, None]
    before, after = (p.innovations(z, {}, noise, results)[0] for p in (problem, spoilt))
    expected = size * slopes[:, k]
    assert np.linalg.norm(expected) > 0.0
    assert np.linalg.norm(after - before - expected) < 0.05 * np.linalg.norm(expected)


def test_a_late_camera_is_what_its_regressor_says(filtered):
    problem, _, _, (result,) = filtered
    (run,) = problem.runs
    changes = sensor_slopes(run.clock, result, problem.channels)
    x = result.states[:, 0]
    delay = 0.01
    late = np.interp(run.clock - delay, run.clock, x) - x
    own = delay * changes[:, problem.channels.index("x"), NAMES.index("camera_delay")]
    assert np.linalg.norm((late - own)[1:]) < 0.15 * np.linalg.norm(late[1:])


def test_slopes_need_a_filter_that_kept_them(filtered):
    problem, point, noise, _ = filtered
    (run,), (result,) = problem.runs, problem.filtered(point, noise)
    with pytest.raises(ValueError, match="keep_slopes"):
        sensor_slopes(run.clock, result, problem.channels)


@pytest.mark.parametrize("late", [0.03, -0.03])
def test_a_camera_may_be_late_and_cannot_foresee(late):
    data = simulate(Setup(runs=5, duration=16.0))
    runs = []
    for run in data.runs:
        seen = {
            name: np.interp(run.time_s - late, run.time_s, values) if name in "xyuvw" else values
            for name, values in run.channels.items()
        }
        runs.append(replace(run, channels=seen))
    problem = SeriesProblem(replace(data, runs=tuple(runs)))
    spread = run_variation(fit(problem, rounds=2))
    delay = [v.name for v in problem.variations].index("camera_delay")
    if late > 0.0:
        assert spread.values[:, delay].mean() == pytest.approx(late, abs=0.01)
    else:
        assert spread.sd[delay] == 0.0


def carried(current: tuple[float, float, float], seed: int) -> Run:
    """A run from rest in an even current (north, east, down; m/s), with noise of the sensors."""
    rng = np.random.default_rng(seed)
    at, offset = np.arange(0.0, 20.0, 2.0), rng.uniform(-0.4, 0.4, 10)
    commands = [
        {"t": t, "tail_offset": o, "tail_amplitude": 0.4, "tail_frequency": 1.8}
        for t, o in zip(at, offset, strict=True)
    ]
    flow = dict(zip(("north", "east", "down"), current, strict=True))
    swum = Simulator(FISH, 0.005, {"current": flow}).run(commands, 20.0, rate_hz=25.0)
    shown = {n: swum[n] + SENSOR_SD[n] * rng.standard_normal(len(swum.time_s)) for n in ALL}
    values = np.zeros((len(at), 5))
    values[:, 0], values[:, 1], values[:, 2] = offset, 0.4, 1.8
    return Run(f"r{seed}", swum.time_s, shown, CommandSteps(at, values), "rest", 0.0)


def in_currents(currents: np.ndarray) -> SeriesProblem:
    """A problem whose runs swim in currents (R, 3)."""
    runs = tuple(carried(tuple(own), i) for i, own in enumerate(currents.tolist()))
    return SeriesProblem(Dataset("currents", FISH, runs, dict(SENSOR_SD)), paths=PATHS)


def test_an_even_current_is_a_drift_of_the_sensors():
    """Data without the drift are as likely in still water as all of them with the effect."""
    current = np.array([0.006, -0.008, 0.002])
    problem = in_currents(current[None])
    (run,) = problem.runs
    noise, zero = replace(Setup().noise, force_sd=5e-4, moment_sd=2e-5), np.zeros(len(PATHS))
    still = run.measured.copy()
    for column, speed in enumerate(current):
        still[:, problem.channels.index("xyz"[column])] -= speed * run.clock
    values = dict(zip(("north", "east", "down"), current, strict=True))
    point = Point(zero, {f"effects.current.{way}": value for way, value in values.items()})
    (true,) = problem.filtered(point, noise)
    (blind,) = problem.filtered(Point(zero, {}), noise)
    moved = problem.with_runs([replace(run, measured=still)])
    (undone,) = moved.filtered(Point(zero, {}), noise)
    assert undone.log_likelihood > true.log_likelihood - 5.0
    assert blind.log_likelihood < true.log_likelihood - 40.0


def test_currents_that_differ_between_runs_are_found():
    currents = 0.006 * np.random.default_rng(1).standard_normal((5, 3))
    currents -= currents.mean(axis=0)
    problem = in_currents(currents)
    spread = run_variation(fit(problem, rounds=2))
    names = [v.name for v in problem.variations]
    for column, way in enumerate(("north", "east")):
        own = names.index(f"current_{way}")
        assert 0.002 < spread.sd[own] < 0.02
        np.testing.assert_allclose(spread.values[:, own], currents[:, column], atol=0.003)

"""A wave meets every run in another phase: each has its own, and the wave is found as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.data.vocabulary import COMMANDS
from fish_env.identification.series import SeriesProblem
from fish_env.identification.variation import USUAL, WAVE
from fish_env.identification.wave_phases import AMPLITUDE
from fish_env.inference.estimate.coarse_fit import CoarseFitter
from fish_env.inference.estimate.fit import fit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.probes import causes_of
from fish_env.inference.problem import Point
from fish_env.inference.screening import screen
from fish_env.inference.starts import starts
from fish_env.params import load_fish
from fish_env.simulator import Simulator
from tests.identification.synthetic import FISH, PATHS, SENSOR_SD

TRUTH = {"amplitude": 0.03, "frequency": 0.5, "heading": 0.4}
PHASES = (0.0, 2.5, -1.2, -2.9)
DURATION, RATE = 12.0, 25.0


def run_with(phase, rng):
    fish = load_fish(FISH)
    rough = replace(fish, effects={"wave": {**TRUTH, "phase": phase}})
    times = np.arange(0.0, DURATION, 2.0)
    low, high = [-0.3, 0.2, 1.0, 0.0, 0.0], [0.3, 0.5, 2.0, 0.0, 0.0]
    values = rng.uniform(low, high, (len(times), len(COMMANDS)))
    steps = CommandSteps(times, values)
    swum = Simulator(rough).run(steps, DURATION, rate_hz=RATE)
    count = len(swum.time_s)
    shown = {n: swum[n] + sd * rng.standard_normal(count) for n, sd in SENSOR_SD.items()}
    return Run.from_steps(f"r{phase:g}", swum.time_s, shown, steps, start="rest", tail_phase=0.0)


@pytest.fixture(scope="module")
def problem():
    rng = np.random.default_rng(1)
    runs = tuple(run_with(phase, rng) for phase in PHASES)
    return SeriesProblem(Dataset("waves", FISH, runs, SENSOR_SD), paths=PATHS, effects=("wave",))


def begin(problem, **more):
    shape = {EffectParameterId("wave", name): value for name, value in {**TRUTH, **more}.items()}
    return Point(problem.start.z, {**problem.beginning(("wave",)), **shape})


def differing(problem):
    only = np.zeros_like(USUAL)
    only[WAVE] = USUAL[WAVE]
    return replace(problem.default_noise(), spread=only)


def apart(one, other):
    return np.abs((one - other + np.pi) % (2.0 * np.pi) - np.pi)


def test_every_run_gets_its_own_phase(problem):
    found = problem.settled(begin(problem), differing(problem)).variation[:, WAVE]
    assert apart(found, np.array(PHASES)).max() < np.pi / 6.0  # as near as the circle is fine
    again = problem.with_runs([*problem.runs[::-1]])
    turned = again.settled(begin(problem), differing(problem)).variation[:, WAVE]
    assert np.array_equal(turned, found[::-1]), "a run's phase is its own"


def test_without_a_wave_or_differences_nothing_is_settled(problem):
    still = problem.settled(begin(problem, amplitude=0.0), differing(problem))
    assert not still.variation.any()
    alike = problem.settled(begin(problem), problem.default_noise())
    assert not alike.variation.any()


def screened(problem, noise):
    """The best signal of a wave against a fit that knows of none."""
    still = SeriesProblem(problem.dataset, paths=PATHS)
    own = fit(still, noise=noise, refit_noise=False)
    only = [cause for cause in causes_of(still) if cause.id == "wave"]
    return own, screen(own, only, np.random.default_rng(0)).best()[0]


def test_a_wave_shows_that_meets_each_run_in_another_phase(problem):
    """Against it, and with one phase for all runs, little of it does."""
    own, shown = screened(problem, differing(problem))
    shape = shown.cause.probes[shown.probe][0]
    assert shape["frequency"] == pytest.approx(TRUTH["frequency"], abs=0.05)
    assert apart(shape["heading"], TRUTH["heading"]) < np.pi / 3.0
    assert shown.freedom == 2 * len(PHASES)
    _, alike = screened(problem, problem.default_noise())
    assert shown.log_p < -100.0
    assert alike.log_p > -5.0
    begun = starts(own, shown)
    found = CoarseFitter(own).coarse_fit(("wave",), (), begun)
    assert found.point.effects[AMPLITUDE] == pytest.approx(TRUTH["amplitude"], rel=0.1)


def test_many_tries_are_allowed_for(problem):
    _, shown = screened(problem, differing(problem))
    once = replace(shown, tries=1)
    assert shown.tries > 50
    assert shown.log_p == pytest.approx(once.log_p + np.log(shown.tries))


@pytest.mark.slow
@pytest.mark.long
def test_the_wave_is_found_as_it_is(problem):
    """With one phase for all runs it fades; with own phases size, period and heading come out."""
    start = begin(problem, amplitude=0.01, frequency=0.505, heading=0.8)
    own = fit(problem, ("wave",), start, differing(problem))
    found = {name: own.point.effects[EffectParameterId("wave", name)] for name in TRUTH}
    assert found["amplitude"] == pytest.approx(TRUTH["amplitude"], rel=0.05)
    assert found["frequency"] == pytest.approx(TRUTH["frequency"], abs=2e-3)
    assert found["heading"] == pytest.approx(TRUTH["heading"], abs=0.1)
    phases = own.problem.variation[:, WAVE] + own.point.effects[EffectParameterId("wave", "phase")]
    assert apart(phases, np.array(PHASES)).max() < 0.15
    shared = fit(problem, ("wave",), start, problem.default_noise())
    assert shared.point.effects[EffectParameterId("wave", "amplitude")] < 0.8 * TRUTH["amplitude"]
    assert own.objective < shared.objective - 1000.0

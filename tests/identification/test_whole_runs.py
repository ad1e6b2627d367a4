"""Fits to whole runs: simulation errors, own numbers, hidden effects, the shipped real fish."""

import numpy as np
import pytest

from fish_env.data import load_dataset
from fish_env.identification import WholeRunProblem
from fish_env.identification.whole_runs.fitting import (
    fit_whole_runs,
)
from fish_env.identification.whole_runs.noise import (
    SimulationNoise,
    independent_samples,
    integrated_ou,
)
from fish_env.identification.whole_runs.prediction import prediction_errors, second_half
from fish_env.identification.writing import identified_fish
from fish_env.inference.estimate.free import Free, linearise
from fish_env.inference.hypotheses import Coefficient, EffectParameterId
from fish_env.inference.problem import Point
from fish_env.params import load_fish
from fish_env.simulator import Simulator
from tests.fixtures.measured_data import measured_runs
from tests.identification.swum_runs import FISH, PACE, PATHS, START, swum

IDENTIFIED = "msu-tail-fish-identified"
TRUE_START = {"x": 0.1, "y": 0.2, "yaw": 0.3, "u": 0.02, "phase": 1.0, "pace": PACE}
GAIN, SCALE = EffectParameterId("tail_gain", "gain"), EffectParameterId("frequency_scale", "scale")


def true_start(problem):
    """The own numbers that the runs were made with."""
    return [np.array([TRUE_START.get(name, 0.0) for name in own.names]) for own in problem.own]


def nominal(problem, own, gain=None):
    """Errors of one simulation of each run."""
    effects = {} if gain is None else {GAIN: np.array([gain])}
    return problem.errors(np.zeros((len(PATHS), 1)), effects, [values[:, None] for values in own])


@pytest.mark.parametrize("switch", [False, True])
def test_errors_are_those_of_an_independent_simulation(switch):
    """Measured less simulated, by the simulator, with an effect on and commands that change."""
    data = swum(seconds=4.0, noise=0.0, switch=switch)
    problem = WholeRunProblem(data, paths=PATHS, dt=0.01)
    for run, errors in zip(data.runs, nominal(problem, true_start(problem), 0.9), strict=True):
        rows = [
            {"t": float(t), "tail_offset": v[0], "tail_amplitude": v[1], "tail_frequency": v[2]}
            for t, v in zip(run.commands.times_s, run.commands.values, strict=True)
        ]
        effects = {"frequency_scale": {"scale": PACE}, "tail_gain": {"gain": 0.9}}
        swim = Simulator(FISH, 0.005, effects).run(rows, sample_times_s=run.time_s, initial=START)
        expected = np.column_stack([run.channels[n] - swim[n] for n in ("x", "y", "yaw")])
        assert np.abs(expected).max() > 5e-3
        np.testing.assert_allclose(errors[0], expected, atol=2e-4)
        assert np.abs(nominal(problem, true_start(problem), 0.88)[0] - errors).max() > 1e-3


def test_residuals_are_errors_in_units_of_the_noise_and_the_prior():
    problem = WholeRunProblem(swum(seconds=4.0, noise=0.0), paths=PATHS)
    noise = SimulationNoise((0.01, 0.02, 0.05), (15.0, 10.0, 1e9))
    run, kind, own = problem.runs[0], problem.own[0], true_start(problem)[0]
    errors = nominal(problem, true_start(problem), 0.9)[0]
    rows = problem.whitened(errors, own[:, None], noise, 0)[0]
    count = len(run.clock)
    scale = np.array([0.01 * np.sqrt(count / 15), 0.02 * np.sqrt(count / 10), 0.05])
    prior = (own - kind.centre) * kind.precision
    np.testing.assert_allclose(rows, np.r_[(errors[0] / scale).ravel(), prior], atol=1e-9)


def test_starts_and_tail_frequencies_are_found():
    problem = WholeRunProblem(swum(), paths=PATHS)
    found = problem.filtered(problem.start, SimulationNoise((1e-3, 1e-3, 5e-3), (80.0,) * 3))
    for kind, evaluation in zip(problem.own, found, strict=True):
        values = dict(zip(kind.names, evaluation.own, strict=True))
        scale = problem.start.effects[SCALE]
        assert values["pace"] * scale == pytest.approx(PACE, abs=5e-3)
        assert values["u"] == pytest.approx(0.02, abs=4e-3)
        assert np.cos(values["phase"] - 1.0) > 0.99


def test_own_numbers_are_eliminated_from_the_slopes():
    """What a start can follow is no evidence for a coefficient: slopes are those of refits."""
    problem = WholeRunProblem(swum(), paths=PATHS)
    noise = SimulationNoise((1e-3, 1e-3, 5e-3), (80.0,) * 3)
    problem = problem.settled(problem.start, noise)
    near = problem.filtered(problem.start, noise)
    for evaluation in near:
        assert np.abs(evaluation.basis.T @ evaluation.residuals).max() < 0.3
    free = Free(problem, problem.effects, ())
    lin = linearise(problem, free, free.pack(problem.start), noise, near)
    step = 0.02
    point = Point(np.array([step, 0.0]), problem.start.effects)
    refitted = np.concatenate([e.residuals for e in problem.filtered(point, noise, near)])
    centre = np.concatenate([e.residuals for e in near])
    fall = refitted @ refitted - centre @ centre
    predicted = 2 * step * lin.slopes[:, 0] @ centre + step**2 * np.sum(lin.slopes[:, 0] ** 2)
    assert fall == pytest.approx(predicted, rel=0.15, abs=0.05)


@pytest.fixture(scope="module")
def found():
    """A fit to runs of a fish whose tail swings less far than commanded."""
    data = swum({"tail_gain": {"gain": 0.85}})
    problem = WholeRunProblem(data, paths=PATHS, effects=["tail_gain"])
    return fit_whole_runs(problem, steps=10)


def test_a_hidden_effect_is_found_with_the_truth_in_its_interval(found):
    low, high = found.interval(GAIN)
    assert low < 0.85 < high
    assert high - low < 0.1
    for path in PATHS:
        low, high = found.interval(Coefficient(path))
        assert low < load_fish(FISH).get(path) < high
    assert found.noise.sd[0] < 2e-3


def test_a_run_is_predicted_from_its_beginning(found):
    errors = [p.errors for p in prediction_errors(found.problem, found)]
    assert max(e["path"] for e in errors) < 0.01
    assert max(e["surge"] for e in errors) < 3e-3


def test_the_fish_carries_what_was_found(found):
    fish = identified_fish(found, "pool")
    assert fish.info(PATHS[0]).status == "identified"
    assert fish.posterior.names == (*PATHS, str(SCALE), str(GAIN))
    assert fish.effects["frequency_scale"]["scale"] == pytest.approx(PACE, abs=5e-3)
    assert fish.posterior.validity["ranges"]["tail_offset"] == [-0.35, 0.35]


def test_parameters_that_no_channel_shows_are_not_free():
    """A camera overhead sees no heave: drag there would be anything."""
    problem = WholeRunProblem(swum(seconds=5.0), paths=PATHS, effects=["linear_drag"])
    free = {freedom.id for freedom in problem.freedoms(["linear_drag"])}
    assert free == {
        EffectParameterId("linear_drag", "surge"),
        EffectParameterId("linear_drag", "sway"),
    }


def test_effects_of_either_sign_are_free_where_channels_show_them():
    """The middle of a range that is alike on both sides would be no effect."""
    problem = WholeRunProblem(swum(seconds=4.0), paths=PATHS)
    free = problem.freedoms(["tail_bias", "tail_asymmetry", "depth_bias", "gyro_bias"])
    assert {one.id for one in free} == {
        EffectParameterId("tail_bias", "offset"),
        EffectParameterId("tail_asymmetry", "ratio"),
    }


def test_forces_can_be_looked_for_in_whole_runs(found):
    terms = found.problem.generic_terms(found)
    changes = terms.changes(terms.columns[:2])
    assert changes.shape == (len(found.linearised.residuals), 2)
    assert np.isfinite(changes).all()
    assert np.abs(changes).max() > 0.0


def test_errors_of_speed_and_position_have_the_covariance_assumed():
    rng = np.random.default_rng(0)
    dt, memory, count = 0.02, 0.5, 4000
    keep = np.exp(-dt / memory)
    speed = rng.standard_normal(count)
    total, values = np.zeros(count), []
    for _ in range(100):
        total += speed * dt
        values.append(total.copy())
        speed = keep * speed + np.sqrt(1 - keep**2) * rng.standard_normal(count)
    time = dt * np.arange(1, 101)
    drawn = np.cov(np.array(values)[[24, 99]])
    np.testing.assert_allclose(integrated_ou(time, memory)[[24, 99]][:, [24, 99]], drawn, rtol=0.1)


def test_independent_samples_are_counted():
    rng = np.random.default_rng(1)
    white = [rng.standard_normal(400) for _ in range(10)]
    assert independent_samples(white) == pytest.approx(400, rel=0.2)
    kernel = np.ones(10) / np.sqrt(10)
    slow = [np.convolve(rng.standard_normal(409), kernel, "valid") for _ in range(10)]
    assert independent_samples(slow) == pytest.approx(40, rel=0.3)


def test_second_halves_are_those_of_a_circle():
    time = np.linspace(0.0, 10.0, 200)
    yaw = 0.1 * time
    pose = np.column_stack([0.5 * np.sin(yaw), 0.5 * (1 - np.cos(yaw)), yaw])
    assert second_half(time, pose) == pytest.approx([0.05, 0.0, 0.1], abs=1e-4)


def test_the_identified_fish_is_shipped_with_its_intervals():
    fish = load_fish(IDENTIFIED)
    assert fish.posterior is not None
    assert "tail.lift.c1" in fish.posterior.names
    assert fish.info("tail.lift.c1").status == "identified"
    assert np.linalg.eigvalsh(np.array(fish.posterior.covariance)).min() > -1e-9
    assert 0.967 < fish.effects["frequency_scale"]["scale"] < 0.982  # measured straight ahead
    assert 0.02 < fish.effects["side_load"]["beat"] < 0.08


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.measured
def test_the_identified_fish_predicts_the_measured_runs():
    problem = WholeRunProblem(load_dataset(measured_runs()), load_fish(IDENTIFIED))
    start = Point(np.zeros(len(problem.baseline)), problem.neutral(problem.effects))
    found = fit_whole_runs(problem, start, steps=0, refit_noise=False)
    errors = [p.errors for p in prediction_errors(problem, found)]
    mean = {name: np.mean([e[name] for e in errors]) for name in errors[0]}
    assert mean["surge"] < 2.7e-3
    assert mean["yaw_rate"] < 11e-3
    assert mean["path"] < 0.014

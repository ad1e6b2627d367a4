"""A phase that the record does not say, and a tail that follows it late."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.identification import SeriesProblem
from fish_env.identification.noise_model import LARGEST_TURN, NoiseModel
from fish_env.identification.phases import settle_phases
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.simulator import Simulator
from tests.identification.synthetic import PATHS, Setup, simulate

FISH = "zheng-2021-a"
CHANNELS = ("x", "y", "z", "yaw")
SD = {"x": 0.002, "y": 0.002, "z": 0.002, "yaw": 0.008}
SOFT = {"tail_flexibility": {"natural_frequency": 4.5, "damping_ratio": 0.25}}
BEFORE = 6.0
TRUTH = Point(
    np.zeros(0),
    {EffectParameterId("tail_flexibility", n): v for n, v in SOFT["tail_flexibility"].items()},
)


@pytest.fixture(scope="module")
def swum() -> tuple[SeriesProblem, tuple[float, float]]:
    """A fish with a soft tail, seen by a camera from the midst of its swim; its phase and angle."""
    values = np.array([[0.1, 0.3, 1.7, 0.0, 0.0], [-0.1, 0.35, 1.4, 0.0, 0.0]])
    commands = [
        {"t": t, "tail_offset": row[0], "tail_amplitude": row[1], "tail_frequency": row[2]}
        for t, row in zip((0.0, BEFORE + 5.0), values, strict=True)
    ]
    trajectory = Simulator(FISH, 0.002, SOFT).run(commands, BEFORE + 10.0, rate_hz=15.0)
    seen = trajectory.time_s >= BEFORE - 1e-9
    rng = np.random.default_rng(0)
    time_s = trajectory.time_s[seen] - BEFORE
    shown = {n: trajectory[n][seen] + SD[n] * rng.standard_normal(seen.sum()) for n in CHANNELS}
    run = Run("swim", time_s, shown, CommandSteps(np.array([0.0, 5.0]), values), "unknown", None)
    problem = SeriesProblem(Dataset("soft", FISH, (run,), SD), paths=(), effects=SOFT)
    return problem, tuple(
        float(trajectory[name][seen][0]) for name in ("tail_phase", "tail_flexibility.angle")
    )


def noise_of(problem: SeriesProblem) -> NoiseModel:
    return NoiseModel(problem.sensor_sd, 5e-4, 2e-5, 0.5)


def off(phase: float, truth: float) -> float:
    """Difference of two phases (rad), the shorter way round."""
    return abs((phase - truth + np.pi) % (2 * np.pi) - np.pi)


def test_the_phase_behind_a_soft_tail_is_found(swum):
    """As is the phase that the run then starts from, and what is left is noise."""
    problem, (truth, _) = swum
    settled = settle_phases(problem, TRUTH, noise_of(problem))
    assert off(settled.runs[0].state0[13], truth) < 0.15
    errors = settled.filtered(TRUTH, noise_of(problem))[0].innovations
    assert np.sqrt(np.nanmean(errors**2)) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("away", [0.0, 0.5, 2.5])
def test_a_phase_nearby_is_found_as_all_round(swum, away):
    """Also from so far that it is not among the phases tried near: then all are tried."""
    problem, (truth, _) = swum
    state = problem.runs[0].state0.copy()
    state[13] = truth + away
    begun = problem.with_runs([replace(problem.runs[0], state0=state)])
    near = settle_phases(begun, TRUTH, noise_of(problem), nearby=True)
    assert off(near.runs[0].state0[13], truth) < 0.15


def test_a_tail_that_beat_before_its_run_does_not_begin_unbent(swum):
    """It stands where the simulated one stood, a hundredth of a radian from its root."""
    problem, (phase, bent) = swum
    names = problem.filter_for(TRUTH.effects).kernels.state_names
    row = names.index("tail_flexibility.angle")
    state = problem.runs[0].state0.copy()
    state[13] = phase
    (began,) = problem.with_runs([replace(problem.runs[0], state0=state)]).runs
    covariance = began.covariance0.copy()
    covariance[18, 18] = 0.0

    def first(swimming: bool) -> float:
        run = replace(began, covariance0=covariance, swimming=swimming)
        filtered = problem.with_runs([run]).filtered(TRUTH, noise_of(problem))[0]
        return float(filtered.states[0, row])

    assert first(True) == pytest.approx(bent, abs=2e-3)
    assert abs(first(False) - bent) > 0.005


@pytest.mark.parametrize("wrong", [-0.2, 0.2])
def test_a_phase_that_is_a_little_off_is_put_right(swum, wrong):
    """The tail's own states go with it: else it would be turned by what they have not followed."""
    problem, (truth, _) = swum
    (run,) = problem.runs
    state, covariance = run.state0.copy(), run.covariance0.copy()
    state[13], covariance[18, 18] = truth + wrong, 0.2**2
    began = problem.with_runs([replace(run, state0=state, covariance0=covariance)])
    states = began.filtered(TRUTH, noise_of(problem))[0].states
    time_s = run.clock[-1]
    told = truth + 2 * np.pi * (1.7 * 5.0 + 1.4 * (time_s - 5.0))
    assert off(states[-1, 13], told) < 0.5 * abs(wrong)


def test_a_tail_that_is_late_does_not_put_the_filter_out_of_step():
    """Where a command changes, what a delay leaves looks like half a beat to the phase."""
    setup = Setup(runs=4, duration=16.0)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    late = [replace(run, command_times=run.command_times - 0.06) for run in problem.runs]
    random_walk = replace(setup.noise, phase_sd=0.2)
    early = problem.with_runs(late)
    results = early.filtered(problem.start, random_walk, keep_slopes=True)
    turns = [np.einsum("tc,tc->t", r.gains[:, -1], np.nan_to_num(r.slopes.raw)) for r in results]
    assert np.abs(np.concatenate(turns)).max() <= LARGEST_TURN + 1e-12
    assert min(r.shares.min() for r in results) < 0.5
    again = early.lean_filter.replay(results, random_walk, random_walk).log_likelihood
    assert again == pytest.approx(sum(r.log_likelihood for r in results), rel=1e-9)
    free = early.filtered(problem.start, replace(random_walk, phase_sd=0.3))
    assert min(r.shares.min() for r in free) == 1.0, "relaxed noise finds a phase wherever it is"

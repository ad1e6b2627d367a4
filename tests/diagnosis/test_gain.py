"""Gain on final runs: share of the reachable gap, and predictions without feedback."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.diagnosis.gain import Gain, Pair, measure_gain
from fish_env.identification import SeriesProblem, open_loop
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.runs import RunData
from fish_env.identification.variation import CURRENT, SENSOR_ERRORS
from fish_env.inference.gain import by_window, gap_closed, reachable_share, squared_errors
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point
from fish_env.params import load_fish
from fish_env.simulator import Simulator
from tests.identification.synthetic import ALL, FISH, PATHS, Setup, simulate
from tests.inference.stated import fit_of


def squares(level, runs=3, windows=10, seed=0):
    rng = np.random.default_rng(seed)
    return [level * rng.chisquare(200, windows) / 200 for _ in range(runs)]


@pytest.mark.parametrize(("extended", "share"), [(1.0, 1.0), (3.0, 0.5), (5.0, 0.0), (7.0, -0.5)])
def test_share_of_the_gap_between_baseline_and_floor(extended, share):
    found, interval = reachable_share(squares(5.0, runs=8), squares(extended, runs=8, seed=1))
    assert found == pytest.approx(share, abs=0.06)
    assert interval[0] < found < interval[1]
    assert interval[1] - interval[0] < 0.3


def test_a_baseline_at_the_floor_leaves_no_gap():
    level = [np.full(10, 1.0)] * 2
    assert reachable_share(level, level) == (None, None)


def test_runs_that_differ_widen_the_interval():
    even = reachable_share([np.full(5, 5.0)] * 3, [np.full(5, 2.0)] * 3)[1]
    odd = reachable_share([np.full(5, 5.0)] * 3, [np.full(5, v) for v in (1.0, 1.0, 4.0)])[1]
    assert odd[1] - odd[0] > 0.3 > even[1] - even[0]


def run_of(seconds=10.0, rate=10.0):
    clock = np.arange(0.0, seconds + 1e-9, 1.0 / rate)
    return RunData(
        id="r", condition=None, clock=clock, substeps=np.ones(len(clock), np.int64),
        fresh=np.zeros(len(clock), bool),
        command_times=np.array([0.0, 4.0, 7.0]), command_values=np.arange(15.0).reshape(3, 5),
        measured=np.arange(len(clock), dtype=float)[:, None], state0=np.zeros(18),
        covariance0=np.eye(19), phase_known=True,
    )  # fmt: skip


def test_windows_cover_a_run_once_and_start_from_filtered_states():
    run = run_of()
    states = np.arange(len(run.clock))[:, None] * np.ones(20)
    filtered = open_loop.without_feedback(run)
    filtered = type(filtered)(**{**filtered.__dict__, "states": states})
    pieces = open_loop.windows(run, filtered, ("z",))
    assert [piece.clock[0] for piece in pieces] == pytest.approx([0.0, 3.0, 6.0])
    assert [piece.state0[0] for piece in pieces] == [0.0, 30.0, 60.0]
    for piece in pieces:
        first = round(piece.clock[0] * 10)
        assert piece.measured[:, 0] == pytest.approx(np.arange(first, first + len(piece.clock)))
        assert len(piece.state0) == 18


def test_windows_know_the_command_that_holds_when_they_begin():
    run = run_of()
    filtered = open_loop.without_feedback(run, states=20)
    begun = [piece.command_values[0, 0] for piece in open_loop.windows(run, filtered, ("z",))]
    assert begun == [0.0, 0.0, 5.0]


def test_a_window_begins_where_a_current_has_carried_the_fish():
    """Without the current it is off by what this does within the window, not since the start."""
    run, north = run_of(), 0.02
    errors = np.zeros(len(SENSOR_ERRORS))
    errors[CURRENT[0]] = north
    drift = north * run.clock[:, None]
    run = replace(run, sensor_errors=errors, distortion=drift)
    filtered = open_loop.without_feedback(run, states=20)
    for piece in open_loop.windows(run, filtered, ("x",)):
        since = piece.clock - piece.clock[0]
        np.testing.assert_allclose(piece.distortion[:, 0], north * since, atol=1e-12)
        assert piece.state0[0] == pytest.approx(north * piece.clock[0])


def test_a_window_does_not_begin_with_a_soft_tail_unbent():
    """It would take a good part of the window to bend as it has for long."""
    soft = {"natural_frequency": 3.0, "damping_ratio": 0.1}
    beat = np.array([[0.1, 0.3, 1.7, 0.0, 0.0]])
    command = {"t": 0.0, "tail_offset": 0.1, "tail_amplitude": 0.3, "tail_frequency": 1.7}
    swum = Simulator(FISH, 0.0025, {"tail_flexibility": soft}).run([command], 9.0, rate_hz=25.0)
    shown = {name: np.asarray(swum[name]) for name in ALL}
    run = Run("r", swum.time_s, shown, CommandSteps(np.zeros(1), beat), "rest", 0.0)
    sd = dict.fromkeys(ALL, 1e-3)
    problem = SeriesProblem(
        Dataset("soft", FISH, (run,), sd), paths=(), effects=["tail_flexibility"]
    )
    truth = Point(
        np.zeros(0), {EffectParameterId("tail_flexibility", n): v for n, v in soft.items()}
    )
    noise = NoiseModel(np.full(len(problem.channels), 1e-3), 1e-4, 1e-6, 1.0)

    pieces = open_loop.windows(
        problem.runs[0], problem.filtered(truth, noise)[0], problem.channels
    )[1:]
    unbent = [replace(piece, swimming=False) for piece in pieces]
    left, before = (  # the last rows, which count for nothing, have no errors
        np.sqrt(np.nanmean(np.vstack(open_loop.errors(problem.with_runs(w), truth, noise)) ** 2))
        for w in (pieces, unbent)
    )
    assert left < 0.3 * before


def test_runs_of_unknown_phase_are_judged_in_step():
    """Half a beat off, a filter spends the run on catching up, whatever the model."""
    path, fish = "tail.lift.c1", load_fish(FISH)
    data = simulate(
        Setup(runs=4, changes={path: fish.get(path) + 3.0 * fish.prior_sd(path)},
              phase=2.8, phase_known=False, channels=("x", "y", "z", "yaw"))
    )  # fmt: skip
    problem = SeriesProblem(data, paths=(path,))
    noise = Setup(channels=problem.channels).noise
    baseline, extended = (
        fit_of(problem, point=Point(np.array([z]), {}), noise=noise) for z in (0.0, 3.0)
    )
    gap = gap_closed(problem, baseline, extended)
    found = measure_gain(problem, baseline, extended, gap)
    assert all(pair.extended == pytest.approx(1.0, abs=0.15) for pair in found.misfit.values())
    assert found.share == pytest.approx(1.0, abs=0.2)
    out_of_step = problem.filtered(extended.point, noise)
    left = np.concatenate([r.innovations.ravel() for r in out_of_step])
    assert np.nanmean(left**2) > 1.2 * np.mean([p.extended**2 for p in found.misfit.values()])


class Diverging(SeriesProblem):
    """A problem whose predictions end in infinity after half a run."""

    def filtered(self, *args, **options):
        found = super().filtered(*args, **options)
        for own in found:
            own.residuals[len(own.residuals) // 2 :] = np.inf
        return found


def test_a_model_that_diverges_on_final_runs_loses_by_a_finite_amount():
    data = simulate(Setup(runs=3, duration=8.0, channels=("x", "y", "z", "yaw")))
    good, bad = SeriesProblem(data, paths=()), Diverging(data, paths=())
    noise = Setup(channels=good.channels).noise
    point = Point(np.zeros(0), {})
    usual, spoilt = (squared_errors(problem, point, noise) for problem in (good, bad))
    assert np.nanmax(spoilt) == POLICY.largest_squared_error
    assert np.isfinite(spoilt).sum() == np.isfinite(usual).sum()
    before, after = (by_window(good, values, np.nanmean) for values in (usual + 1.0, spoilt))
    share, interval = reachable_share(before, after)
    assert share < -10.0
    assert np.isfinite(interval).all()


@pytest.mark.parametrize(
    ("percent", "useless"), [(50.0, False), (0.1, False), (-3.0, True), (float("nan"), True)]
)
def test_a_model_no_better_than_the_mean_is_useless(percent, useless):
    assert Gain((), Pair(-5.0, percent), {}, {}, None, None).is_useless is useless


def test_a_window_begins_where_a_quick_lag_beside_corners_has_settled():
    """Steps before the window are as short as within it: in longer ones such a lag diverges."""
    setup = Setup(runs=1)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    quick = {
        EffectParameterId("servo_lag", "time_constant"): 0.003,
        EffectParameterId("servo_rate_limit", "rate"): 50.0,
    }
    point = Point(np.zeros(len(PATHS)), quick)
    (filtered,) = problem.filtered(point, setup.noise)
    cut = problem.with_runs(open_loop.windows(problem.runs[0], filtered, problem.channels))
    gyro = problem.channels.index("r")
    assert len(cut.runs) > 1
    for run, error in zip(cut.runs, open_loop.errors(cut, point, setup.noise), strict=True):
        seen = np.isfinite(run.measured[:, gyro])
        assert np.abs(error[seen, gyro]).max() < 10.0  # where it diverges it is no number

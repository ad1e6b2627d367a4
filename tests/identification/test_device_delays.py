"""Devices that are late: what they show is the state that was, and no sample is interpolated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps
from fish_env.identification.command_jumps import jump_times
from fish_env.identification.open_loop import without_feedback
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.series import SeriesProblem
from fish_env.identification.variation_slopes import leave_diverged
from fish_env.inference.estimate.fit import fit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.sensing.devices import Device, devices_of
from tests.identification.synthetic import PATHS, Setup, simulate

DELAYS = ("camera_delay", "inertial_delay", "depth_delay")
STEP_S = 0.04


@pytest.fixture(scope="module")
def problem():
    return SeriesProblem(simulate(Setup(runs=1)), paths=PATHS)


def numbers_of(problem, **own):
    found = np.zeros_like(problem.variation)
    names = [v.name for v in problem.variations]
    for name, value in own.items():
        found[:, names.index(name)] = value
    return found


def predicted(problem, run):
    """Channels (T, C) as the model alone predicts them."""
    silent = replace(run, measured=np.zeros_like(run.measured), distortion=None)
    one = problem.with_runs([silent])
    z = np.zeros((len(PATHS), 1))
    flat = one.innovations(z, {}, one.default_noise(), [without_feedback(silent)])
    return -flat[0].reshape(run.measured.shape)


def dense(run, step_s):
    clock = np.arange(0.0, run.clock[-1] + 1e-9, step_s)
    rows = len(clock)
    return replace(
        run,
        clock=clock,
        substeps=np.ones(rows, np.int64),
        fresh=np.zeros(rows, bool),
        measured=np.zeros((rows, run.measured.shape[1])),
    )


@pytest.mark.parametrize("age", [0.003, 0.013, 0.027, 0.0399])
def test_a_late_device_shows_the_state_that_was(problem, age):
    (run,) = problem.runs
    fine = dense(run, 0.002)
    truth, now = predicted(problem, fine), predicted(problem, run)
    late = problem.with_variation(
        numbers_of(problem, **dict.fromkeys(DELAYS, age)), problem.start, problem.default_noise()
    )
    shown = predicted(problem, late.runs[0])
    inside = run.clock > 0.1
    for i in range(len(problem.channels)):
        was = np.interp(run.clock - age, fine.clock, truth[:, i])
        off, moved = (np.std((each[:, i] - was)[inside]) for each in (shown, now))
        assert off < 0.01 * moved


def test_only_the_channels_of_a_device_are_late(problem):
    (run,) = problem.runs
    now = predicted(problem, run)
    values = numbers_of(problem, depth_delay=0.02)
    late = problem.with_variation(values, problem.start, problem.default_noise())
    apart = np.abs(predicted(problem, late.runs[0]) - now).max(axis=0)
    assert {n for n, gap in zip(problem.channels, apart, strict=True) if gap > 1e-12} == {"z"}


def test_rows_are_moved_by_whole_samples_and_as_many_always_count(problem):
    (run,) = problem.runs
    assert run.most_rows == 2
    inertial = [i for i, d in enumerate(devices_of(problem.channels)) if d == Device.INERTIAL]
    counts = {int(np.isfinite(run.measured).sum())}
    for delay, rows in ((0.03, 0), (0.05, 1), (0.09, 2), (0.2, 2)):
        values = numbers_of(problem, inertial_delay=delay)
        moved = problem.with_variation(values, problem.start, problem.default_noise()).runs[0]
        assert moved.moved[Device.INERTIAL] == rows
        np.testing.assert_array_equal(
            moved.measured[4:-2, inertial],
            run.recorded[4 + rows : len(run.clock) - 2 + rows, inertial],
        )
        ages = moved.ages(moved.variation[:, None])[:, 0]
        assert ages[Device.INERTIAL] == pytest.approx(delay - rows * STEP_S)
        counts.add(int(np.isfinite(moved.measured).sum()))
    assert len(counts) == 1


@pytest.mark.parametrize("end_s", [1.0, np.inf])
def test_rows_of_the_beginning_of_a_run_may_be_moved_too(problem, end_s):
    begun = problem.until(end_s)
    assert np.isnan(begun.runs[0].measured[-2:]).all()
    values = numbers_of(problem, inertial_delay=0.05)
    noise = problem.default_noise()
    early = begun.with_variation(values, problem.start, noise).runs[0]
    whole = problem.with_variation(values, problem.start, noise).runs[0]
    assert early.moved[Device.INERTIAL] == 1
    kept = len(early.clock) - 2
    np.testing.assert_array_equal(early.measured[:kept], whole.measured[:kept])


def test_what_a_sensor_does_to_a_sample_goes_with_it(problem):
    """By a step from 1 ms below a whole row to one above it, as a descent takes it."""
    noise, at = problem.default_noise(), Point(np.zeros(len(PATHS)), {})
    below, above = (
        numbers_of(problem, inertial_delay=STEP_S + off, inertial_smoothing=1.0)
        for off in (-1e-3, 1e-3)
    )
    late = problem.with_variation(below, at, noise)
    later = late.with_variation(above, at, noise, late.filtered(at, noise, keep_slopes=True))
    (before,), (after,) = late.runs, later.runs
    inertial = [i for i, d in enumerate(devices_of(problem.channels)) if d == Device.INERTIAL]
    assert (before.moved[Device.INERTIAL], after.moved[Device.INERTIAL]) == (0, 1)
    assert np.std(before.distortion[:, inertial]) > 0.0
    np.testing.assert_allclose(
        after.distortion[:-1, inertial], before.distortion[1:, inertial], atol=1e-12
    )


def test_the_likelihood_hardly_leaps_where_a_row_is_moved(problem):
    noise, at = problem.default_noise(), Point(np.zeros(len(PATHS)), {})

    def value(delay):
        values = numbers_of(problem, inertial_delay=delay)
        moved = problem.with_variation(values, at, noise)
        return -2.0 * moved.filtered(at, noise)[0].log_likelihood

    below, above = value(STEP_S - 1e-4), value(STEP_S + 1e-4)
    far = value(0.0)
    assert abs(below - above) < 0.1 * abs(above - far)


def test_numbers_by_which_a_run_diverges_get_no_slope():
    slopes = np.array([[1.0, 1e200, np.nan, -3.0], [2.0, 1.0, 0.0, np.inf]])
    leave_diverged(slopes)
    np.testing.assert_array_equal(slopes, [[1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0]])


def test_a_gyro_says_nothing_just_after_a_jump(problem):
    """What a filter inside it makes of a jump nobody knows."""
    (run,) = problem.runs
    silent = run.without_smeared_gyros(problem.channels)
    since = run.clock[:, None] - jump_times(*run.commands)
    after = ((since >= 0.0) & (since < IDENTIFICATION.smeared_gyro_s)).any(axis=1)
    gyro = np.isin(problem.channels, ["p", "q", "r"])
    kept = np.isfinite(silent.recorded)
    assert 0 < after.sum() < 0.5 * len(after)
    assert not kept[np.ix_(after, gyro)].any()
    assert np.array_equal(kept[~after], np.isfinite(run.recorded[~after]))
    assert np.array_equal(kept[:, ~gyro], np.isfinite(run.recorded[:, ~gyro]))


def test_what_makes_devices_late_in_all_runs_is_as_numbers_of_each_run(problem):
    """Two ways to the same prediction: the effect's parameters, and the runs' own numbers."""
    noise, none = problem.default_noise(), numbers_of(problem)
    values = numbers_of(problem, camera_delay=0.056, depth_delay=0.013)
    own = problem.with_variation(values, problem.start, noise)
    shared = Point(
        np.zeros(len(PATHS)),
        {EffectParameterId("sensor_delay", name): value
         for name, value in {"delay": 0.0, "camera_later": 0.056, "depth_later": 0.013}.items()},
    )  # fmt: skip
    common = problem.with_variation(none, shared, noise)
    np.testing.assert_array_equal(common.runs[0].moved, own.runs[0].moved)
    np.testing.assert_allclose(common.runs[0].own_ages, own.runs[0].own_ages, atol=1e-15)
    by_effect = common.filtered(shared, noise)[0].log_likelihood
    by_numbers = own.filtered(problem.start, noise)[0].log_likelihood
    assert by_effect == pytest.approx(by_numbers, rel=1e-12)
    back = common.settled(problem.start, noise)
    np.testing.assert_array_equal(back.runs[0].moved, problem.runs[0].moved)


def test_a_fit_finds_how_late_camera_and_depth_sensor_are():
    """Samples of a finer simulation, taken as late as the effect says."""
    fine = simulate(Setup(seed=3, runs=2, rate=200.0, force_sd=1e-4, moment_sd=1e-6))
    late = {"x": 0.065, "y": 0.065, "z": 0.035}
    runs = []
    for run in fine.runs:
        rows = np.arange(40, len(run.time_s), 8)
        shown = {
            name: values[rows - round(200.0 * (0.02 + late.get(name, 0.0)))]
            for name, values in run.channels.items()
        }
        clock, told = run.time_s[rows], run.commands
        later = told.times_s > clock[0]
        steps = CommandSteps(
            np.r_[clock[0], told.times_s[later]],
            np.vstack([told.at(clock[:1]), told.values[later]]),
        )
        run = replace(run, time_s=clock, channels=shown, commands=steps, start="unknown")
        runs.append(replace(run, tail_phase=None))
    dataset = replace(fine, runs=tuple(runs))
    series = SeriesProblem(dataset, paths=PATHS, effects=("sensor_delay",))
    found = fit(series)
    for name, truth, width in (("delay", 0.02, 0.003), ("camera_later", 0.065, 0.04)):
        low, high = found.interval(EffectParameterId("sensor_delay", name))
        assert low < truth < high
        assert high - low < width
    low, high = found.interval(EffectParameterId("sensor_delay", "depth_later"))  # it hardly dives
    assert low < 0.035 < high


def test_a_tail_has_begun_to_beat_where_the_commands_are_ahead():
    """A camera that starts late shows a tail that has beaten since the commands began."""
    late_s, rows = 0.12, 3
    setup = Setup(runs=1, duration=6.0, channels=("x", "y", "yaw"))
    prompt = simulate(setup)
    (run,) = prompt.runs
    shown = {name: values[rows:] for name, values in run.channels.items()}
    late = replace(run, time_s=run.time_s[:-rows], channels=shown)
    problem = SeriesProblem(replace(prompt, runs=(late,)), paths=PATHS)
    point = Point(np.zeros(len(PATHS)), {})
    numbers = np.zeros_like(problem.variation)
    numbers[:, [v.name for v in problem.variations].index("clock_offset")] = -late_s

    def misfit(one):
        (found,) = one.filtered(point, setup.noise)
        return float(np.mean(found.innovations[5:] ** 2))

    right = misfit(SeriesProblem(prompt, paths=PATHS))
    assert misfit(problem.with_variation(numbers, point, setup.noise)) < 1.3 * right
    assert misfit(problem) > 2.0 * right

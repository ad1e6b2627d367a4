"""Sensor errors: their way through the filter is that of spoilt data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.identification.sensor_errors import (
    USUAL_CUTOFF_HZ,
    innovation_slopes,
    known_slopes,
    sensor_slopes,
)
from fish_env.identification.series import SeriesProblem
from fish_env.identification.variation import IN_SAMPLES, SENSOR_ERRORS
from fish_env.inference.estimate.again import run_variation
from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.settle import predicted_variation
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.sensing.devices import late_s
from tests.identification.synthetic import (
    PATHS,
    Setup,
    simulate,
    through_low_pass,
    with_calm_gyros,
)

NAMES = [error.name for error in SENSOR_ERRORS]


@pytest.fixture(scope="module")
def filtered():
    setup = Setup(runs=1, missing=0.05)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    point = Point(np.zeros(len(PATHS)), {})
    return problem, point, setup.noise, problem.filtered(point, setup.noise, keep_slopes=True)


@pytest.mark.parametrize("name", np.array(NAMES)[IN_SAMPLES])
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


@pytest.mark.parametrize("name", NAMES)
def test_a_run_with_an_error_of_its_own_shows_it_as_the_slopes_say(filtered, name):
    """Where it begins too: a marker aside does not put the fish elsewhere."""
    problem, point, noise, results = filtered
    steps = np.array([0.3 * v.usual for v in problem.variations])
    k = [v.name for v in problem.variations].index(name)
    slopes = problem.variation_slopes(point, noise, results, steps)[:, k]
    size = 0.1 * problem.variations[k].usual
    numbers = np.zeros_like(problem.variation)
    numbers[:, k] = size
    moved = problem.with_variation(numbers, point, noise, results)
    z = point.z[:, None]
    before, after = (p.innovations(z, {}, noise, results)[0] for p in (problem, moved))
    expected = size * slopes
    assert np.linalg.norm(expected) > 0.0
    assert np.linalg.norm(after - before - expected) < 0.05 * np.linalg.norm(expected)


def test_what_errors_do_is_worked_out_once_for_a_motion(filtered):
    """And again for another one, or where devices have become later."""
    problem, _, _, (result,) = filtered
    (run,) = problem.runs
    first = known_slopes(run, result, problem.channels)
    np.testing.assert_array_equal(
        first, sensor_slopes(run.clock, result, problem.channels, run.own_ages)
    )
    assert known_slopes(run, result, problem.channels) is first
    late = replace(run, late=run.late + 0.05)
    assert np.any(known_slopes(late, result, problem.channels) != first)
    other = replace(result, states=result.states + 0.01)
    assert np.any(known_slopes(run, other, problem.channels) != first)


def test_samples_put_right_do_not_depend_on_the_way_there(filtered):
    problem, point, noise, _ = filtered
    numbers = np.zeros_like(problem.variation)
    own = {"compass_sin_yaw": 0.2, "inertial_smoothing": 2.0, "current_north": 0.01}
    for i, variation in enumerate(problem.variations):
        numbers[:, i] = own.get(variation.name, 0.0)
    at_once = problem.with_variation(numbers, point, noise)
    part = problem.with_variation(0.3 * numbers, point, noise)
    in_steps = part.with_variation(numbers, point, noise)
    apart = (at_once.runs[0].corrected - in_steps.runs[0].corrected) / problem.sensor_sd
    moved = (at_once.runs[0].corrected - problem.runs[0].measured) / problem.sensor_sd
    assert np.sqrt(np.nanmean(apart**2)) < 0.1
    assert np.sqrt(np.nanmean(moved**2)) > 1.0
    assert at_once.with_variation(numbers, point, noise).runs == at_once.runs


def test_a_motion_that_diverged_is_refused_by_name(filtered):
    problem, _, _, (result,) = filtered
    states = result.states.copy()
    states[100:] = np.nan
    with pytest.raises(np.linalg.LinAlgError, match="diverges"):
        sensor_slopes(problem.runs[0].clock, replace(result, states=states), problem.channels)


def test_samples_put_right_by_a_motion_nearby_come_to_the_same(filtered):
    """Each time from the motion that the last ones show: one filter a time, not up to four."""
    problem, point, noise, _ = filtered
    numbers = np.zeros_like(problem.variation)
    own = {"compass_sin_yaw": 0.2, "inertial_smoothing": 2.0, "current_north": 0.01}
    for i, variation in enumerate(problem.variations):
        numbers[:, i] = own.get(variation.name, 0.0)
    exact = problem.with_variation(numbers, point, noise)
    apart, moved = [], problem
    for _ in range(7):
        near = moved.filtered(point, noise, keep_slopes=True)
        moved = moved.with_variation(numbers, point, noise, near)
        off = (moved.runs[0].corrected - exact.runs[0].corrected) / problem.sensor_sd
        apart.append(float(np.sqrt(np.nanmean(off**2))))
    assert apart[-1] < 0.1 < apart[0]


def test_a_run_that_stays_keeps_what_errors_do_to_its_samples(filtered):
    problem, point, noise, _ = filtered
    numbers = np.zeros_like(problem.variation)
    numbers[:, [v.name for v in problem.variations].index("compass_sin_yaw")] = 0.2
    (run,) = problem.with_variation(numbers, point, noise).runs
    off = replace(run, distortion=run.distortion + 3.0 * problem.sensor_sd)
    both = problem.with_runs([off, off])
    seen = both.filtered(point, noise, keep_slopes=True)
    stays, follows = both.with_variation(both.variation, point, noise, [None, seen[1]]).runs
    np.testing.assert_array_equal(stays.corrected, off.corrected)
    assert np.nanmax(np.abs(follows.corrected - off.corrected) / problem.sensor_sd) > 1.0


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


def test_a_camera_alone_has_no_inertial_unit_and_sees_no_depth():
    channels = ("x", "y", "yaw")
    problem = SeriesProblem(simulate(Setup(runs=1, channels=channels)), paths=PATHS)
    noise = problem.default_noise()
    (run,), (result,) = problem.runs, problem.filtered(problem.start, noise, keep_slopes=True)
    changes = sensor_slopes(run.clock, result, channels)
    acting = {
        name for name, part in zip(NAMES, np.abs(changes).max(axis=(0, 1)), strict=True) if part
    }
    assert acting == {"marker_x", "marker_y", "marker_z", "current_north", "current_east"}
    steps = np.array([0.3 * v.usual for v in problem.variations])
    slopes = problem.variation_slopes(problem.start, noise, [result], steps)
    named = {
        v.name: np.abs(part).max() for v, part in zip(problem.variations, slopes.T, strict=True)
    }
    assert named["inertial_delay"] == named["depth_delay"] == 0.0 < named["camera_delay"]
    by_channel = slopes.reshape(len(run.clock), len(channels), -1)
    late = by_channel[:, channels.index("yaw"), list(named).index("camera_delay")]
    assert np.abs(late).max() > 0.0


@pytest.mark.parametrize(("channels", "floats"), [(("x", "y", "yaw"), False), (("x", "z"), True)])
def test_a_camera_above_tells_nothing_of_how_a_fish_floats(channels, floats):
    problem = SeriesProblem(simulate(Setup(runs=1, channels=channels)), paths=PATHS)
    noise = problem.default_noise()
    filtered = problem.filtered(problem.start, noise, keep_slopes=True)
    steps = np.array([0.3 * v.usual for v in problem.variations])
    slopes = problem.variation_slopes(problem.start, noise, filtered, steps)
    named = {
        v.name: np.abs(part).max() for v, part in zip(problem.variations, slopes.T, strict=True)
    }
    assert (named["trim_x"] > 0.0) == (named["buoyancy"] > 0.0) == floats
    assert named["clock_offset"] > 0.0


def test_a_filter_in_the_inertial_unit_is_a_delay_and_a_little_smoothing():
    """The delay is exact whatever its size, and what else the filter takes away is small."""
    data = simulate(Setup(runs=5, duration=16.0))
    problem = with_calm_gyros(SeriesProblem(through_low_pass(data, USUAL_CUTOFF_HZ)))
    at, plain = Point(np.zeros(len(problem.baseline)), {}), problem.default_noise()
    names = [v.name for v in problem.variations]
    late, smooth = names.index("inertial_delay"), names.index("inertial_smoothing")
    spread = np.zeros(len(names))
    spread[[late, smooth]] = [problem.variations[k].usual for k in (late, smooth)]
    noise = replace(plain, spread=spread)

    def misfit(one):
        return sum(-2.0 * f.log_likelihood for f in one.filtered(at, plain))

    spoilt = misfit(problem)
    for _ in range(6):
        problem, _ = predicted_variation(problem, at, noise)
    found = problem.variation
    assert found[:, late].mean() == pytest.approx(late_s(USUAL_CUTOFF_HZ), abs=0.002)
    assert found[:, smooth].mean() == pytest.approx(1.0, abs=0.25)
    best = misfit(with_calm_gyros(SeriesProblem(data)))
    assert misfit(problem) - best < 0.02 * (spoilt - best)


def test_a_late_gyro_has_the_gain_of_what_it_shows(filtered):
    """The gain of a gyro as an effect and as an error of its unit are one thing at any delay."""
    problem, point, noise, _ = filtered
    numbers = np.zeros_like(problem.variation)
    names = [variation.name for variation in problem.variations]
    numbers[:, names.index("inertial_delay")] = 0.03
    late = problem.with_variation(numbers, point, noise)
    results = late.filtered(point, noise, keep_slopes=True)
    (run,), (result,) = late.runs, results
    gain = 0.01
    effects = {EffectParameterId("gyro_scale", axis): np.array([1.0]) for axis in "pqr"}
    more = effects | {EffectParameterId("gyro_scale", "r"): np.array([1.0 + gain])}
    z = point.z[:, None]
    before, after = (late.innovations(z, e, noise, results)[0] for e in (effects, more))

    def slope(ages):
        changes = sensor_slopes(run.clock, result, late.channels, ages)
        of_all = innovation_slopes(run.clock, run.measured, result, noise.correlation_s, changes)
        return -gain * of_all[:, NAMES.index("gyro_gain_r")]

    size = np.linalg.norm(after - before)
    assert np.linalg.norm(after - before - slope(run.own_ages)) < 0.1 * size
    assert np.linalg.norm(after - before - slope(None)) > 0.2 * size

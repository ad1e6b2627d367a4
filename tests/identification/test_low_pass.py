"""A low-pass inside the inertial unit that all runs share, against the filter of scipy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.identification.series import SeriesProblem
from fish_env.inference.estimate.fit import fit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from tests.identification.synthetic import PATHS, Setup, simulate, through_low_pass, with_calm_gyros

CUTOFF = EffectParameterId("imu_lowpass", "cutoff")


def problem_of(data):
    return with_calm_gyros(SeriesProblem(data, paths=PATHS))


@pytest.fixture(scope="module")
def clean():
    return simulate(Setup(runs=3, duration=16.0))


@pytest.mark.parametrize("cutoff_hz", [4.0, 8.0])
def test_its_cutoff_is_found_and_a_mere_delay_explains_less(clean, cutoff_hz):
    problem = problem_of(through_low_pass(clean, cutoff_hz))
    begin = Point(np.zeros(len(PATHS)), {CUTOFF: 6.0})
    found = fit(problem, ["imu_lowpass"], begin, rounds=2)
    low, high = found.interval(CUTOFF, level=0.999)
    assert low < cutoff_hz < high
    assert high - low < 0.1 * cutoff_hz
    late = fit(problem, ["sensor_delay"], rounds=2)
    assert found.objective < late.objective - 100.0


@pytest.fixture(scope="module")
def settled(clean):
    """A problem, where it is settled, and its motion."""
    problem = problem_of(through_low_pass(clean, 5.0))
    noise, point = problem.default_noise(), Point(np.zeros(len(PATHS)), {CUTOFF: 5.0})
    own = problem.settled(point, noise)
    return own, point, noise, own.filtered(point, noise, keep_slopes=True)


def test_slopes_by_its_cutoff_are_those_of_samples_put_right_again(settled):
    problem, point, noise, filtered = settled
    z, near = point.z[:, None], Point(point.z, {CUTOFF: 5.02})
    both = {CUTOFF: np.array([5.0, 5.02])}
    twice = np.repeat(z, 2, axis=1)
    (slope,) = problem.changes(twice, both, noise, filtered)
    (delay,) = problem.changes(twice, both, noise, [replace(f, slopes=None) for f in filtered])
    again = problem.settled(near, noise)
    (before,) = problem.innovations(z, {CUTOFF: np.array([5.0])}, noise, filtered)
    (after,) = again.innovations(z, {CUTOFF: np.array([5.02])}, noise, filtered)
    moved = after - before
    assert np.linalg.norm(moved - slope) < 0.1 * np.linalg.norm(moved)
    assert np.linalg.norm(moved - delay) > 0.1 * np.linalg.norm(moved)


def test_samples_that_suit_a_motion_stay_as_they_are(settled):
    problem, point, noise, _ = settled
    again = problem.settled(point, noise)
    for run, before in zip(again.runs, problem.runs, strict=True):
        np.testing.assert_array_equal(run.corrected, before.corrected)
    off = again.settled(Point(point.z, {CUTOFF: np.inf}), noise)
    assert not off.samples_follow
    assert all(run.distortion is None for run in off.runs)

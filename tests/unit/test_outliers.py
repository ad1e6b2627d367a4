"""Outliers are found where they stand alone, whatever the beat; motion and noise are left alone."""

from __future__ import annotations

import numpy as np
import pytest

from fish_env.rigidbody.outliers import outliers_of
from fish_env.rigidbody.recording import RecordedRun, Recording

STEP_S, SIGMA = 0.04, 0.01
TIMES = np.arange(0.0, 60.0, STEP_S)


def motion(beat_hz):
    return 0.5 * np.sin(2.0 * np.pi * beat_hz * TIMES) + 0.2 * np.cos(0.7 * TIMES)


def recording(*series, unit="rad/s", jumps=()):
    runs = tuple(
        RecordedRun(f"r{i}", TIMES, {"r": values}, np.zeros(1), jumps_s=np.array(jumps))
        for i, values in enumerate(series)
    )
    return Recording("trial", runs, {"r": unit})


def noisy(beat_hz, seed):
    return motion(beat_hz) + SIGMA * np.random.default_rng(seed).standard_normal(len(TIMES))


def dirty(values, share, size, seed):
    """With outliers of a size in sigmas; and which samples they are."""
    rng = np.random.default_rng(seed)
    chosen = rng.random(len(values)) < share
    return values + chosen * size * SIGMA * rng.choice((-1.0, 1.0), len(values)), chosen


@pytest.mark.parametrize("beat_hz", [0.5, 2.0, 5.0])
def test_no_sample_of_good_data_is_an_outlier(beat_hz):
    (found,) = outliers_of(recording(*(noisy(beat_hz, seed) for seed in range(8))))
    assert found.count == 0
    assert found.noise_sd == pytest.approx(SIGMA, rel=0.05)


@pytest.mark.parametrize("beat_hz", [0.5, 2.0, 5.0])
@pytest.mark.parametrize(("share", "size", "least"), [(0.002, 10.0, 0.7), (0.01, 20.0, 0.9)])
def test_outliers_are_found(beat_hz, share, size, least):
    pairs = [dirty(noisy(beat_hz, seed), share, size, seed) for seed in range(8)]
    (found,) = outliers_of(recording(*(values for values, _ in pairs)))
    planted = np.concatenate([chosen for _, chosen in pairs])
    flagged = np.concatenate(found.flagged)
    assert np.mean(flagged[planted]) > least
    # Next to a large one a good sample may be taken for it.
    assert np.sum(flagged & ~planted) <= 0.03 * planted.sum()
    assert found.noise_sd == pytest.approx(SIGMA, rel=0.1)
    assert np.median(found.sizes) == pytest.approx(size * SIGMA, rel=0.15)


def test_a_step_of_the_motion_is_no_outlier():
    step = np.where(TIMES > 30.0, 0.5, 0.0)
    (found,) = outliers_of(recording(*(noisy(2.0, seed) + step for seed in range(4))))
    assert found.count == 0


def test_a_spike_after_a_command_jumps_is_motion():
    spike = np.where(np.abs(TIMES - 30.0) < 0.5 * STEP_S, 0.3, 0.0)
    runs = [noisy(2.0, seed) + spike for seed in range(4)]
    assert outliers_of(recording(*runs))[0].count == 4
    assert outliers_of(recording(*runs, jumps=[30.0]))[0].count == 0
    # A pose has not moved yet when a command jumps.
    assert outliers_of(recording(*runs, unit="rad", jumps=[30.0]))[0].count == 4


def test_noise_that_rises_with_the_motion_is_noise():
    rng = np.random.default_rng(1)
    louder = np.where(TIMES > 20.0, 3.0, 1.0) * SIGMA * rng.standard_normal(len(TIMES))
    (found,) = outliers_of(recording(motion(2.0) + louder))
    assert found.noise_sd == pytest.approx(SIGMA * np.sqrt((1.0 + 2.0 * 9.0) / 3.0), rel=0.1)


def test_a_short_record_says_nothing():
    few = {"r": noisy(2.0, 0)[:20]}
    (found,) = outliers_of(Recording("trial", (RecordedRun("a", TIMES[:20], few, np.zeros(1)),)))
    assert found.count == 0
    assert found.noise_sd is None

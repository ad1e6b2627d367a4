"""Noise alone shows no sign of motion, and a weak motion in one channel does."""

import numpy as np
import pytest

from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.recording import RecordedRun, Recording
from fish_env.rigidbody.silence import sign_of_motion

CHANNELS = "abcdefghi"


def recording_of(rng, runs=4, samples=400, missing=0.0, sway=0.0):
    """Noise with an offset of its own in each run and channel; the last channel may sway too."""
    made = []
    for number in range(runs):
        time = np.arange(samples) * 0.04
        values = rng.standard_normal((len(CHANNELS), samples)) + rng.normal(size=(len(CHANNELS), 1))
        values[-1] += sway * np.sin(2.0 * np.pi * 1.1 * time + number)
        values[rng.random(values.shape) < missing] = np.nan
        channels = dict(zip(CHANNELS, values, strict=True))
        made.append(RecordedRun(str(number), time, channels, np.zeros(0)))
    return Recording("made", tuple(made))


@pytest.mark.parametrize("missing", [0.0, 0.3])
def test_noise_shows_a_motion_about_as_rarely_as_the_level_says(missing):
    rng = np.random.default_rng(1)
    found = [sign_of_motion(recording_of(rng, missing=missing)) for _ in range(300)]
    assert np.mean(np.array(found) < RECORDINGS.silent_level) < 0.04
    assert 0.3 < np.mean(np.array(found) < 0.6) < 0.8  # no p-value that is always large


def test_a_sway_of_half_of_the_noise_in_one_channel_of_nine_is_seen():
    """Its variance is an eighth of that of the noise."""
    rng = np.random.default_rng(2)
    found = [sign_of_motion(recording_of(rng, sway=0.5)) for _ in range(100)]
    assert np.mean(np.array(found) < RECORDINGS.silent_level) > 0.98


def test_a_drift_is_seen_though_its_channel_is_nearly_noise():
    rng = np.random.default_rng(3)
    made = recording_of(rng)
    for run in made.runs:
        run.channels["c"][:] += np.linspace(0.0, 1.0, len(run.time_s))
    assert sign_of_motion(made) < RECORDINGS.silent_level


def test_a_few_samples_or_a_single_value_tell_nothing():
    assert sign_of_motion(recording_of(np.random.default_rng(4), samples=8)) is None
    made = recording_of(np.random.default_rng(4))
    for run in made.runs:
        run.channels["c"][:] = 1.0
    assert sign_of_motion(made) is None

"""Which rows a fit keeps of samples that come faster than a beat needs."""

import numpy as np
import pytest

from fish_env.identification.thinning import kept_rows

NAN = np.nan


def rows(rate, seconds=10.0, channels=3):
    """Clock and samples of all channels at one rate (1/s)."""
    clock = np.arange(round(seconds * rate) + 1) / rate
    return clock, np.zeros((len(clock), channels))


@pytest.mark.parametrize(
    ("rate", "beat", "every"),
    [(15, 2, 1), (25, 2, 1), (30, 2, 1), (50, 2, 2), (50, 6, 1), (60, 2, 2), (100, 3, 4),
     (200, 2, 8), (200, 12, 2)],
)  # fmt: skip
def test_evenly_spaced_rows_stay_evenly_spaced(rate, beat, every):
    clock, measured = rows(rate)
    kept = kept_rows(clock, measured, beat)
    np.testing.assert_array_equal(kept, np.arange(0, len(clock), every))


def test_jitter_of_the_times_and_gaps_do_not_shift_the_rows_kept():
    clock, measured = rows(100)
    rng = np.random.default_rng(0)
    clock[1:-1] += rng.uniform(-2e-3, 2e-3, len(clock) - 2)
    measured[200:240] = NAN
    measured[rng.choice(len(clock), 20), 0] = NAN
    kept = kept_rows(clock, measured, 2.0)
    assert np.all(kept % 4 == 0)
    assert np.isin(np.arange(0, 200, 4), kept).all()


def test_a_slow_device_beside_a_fast_one_keeps_its_samples():
    clock, measured = rows(100)
    measured[np.arange(len(clock)) % 4 != 0, 0] = NAN
    assert np.all(kept_rows(clock, measured, 2.0) % 4 == 0)
    measured[:, 0] = NAN
    measured[2::4, 0] = 0.0  # between the rows that would be kept
    assert len(kept_rows(clock, measured, 2.0)) == len(clock)


def test_rows_that_only_tell_a_command_do_not_count():
    clock, measured = rows(50)
    told = np.sort(np.r_[clock, 3.333, 7.777])
    extra = np.isin(told, (3.333, 7.777))
    wider = np.full((len(told), 3), NAN)
    wider[~extra] = measured
    kept = kept_rows(told, wider, 2.0)
    np.testing.assert_allclose(told[kept], clock[::2])

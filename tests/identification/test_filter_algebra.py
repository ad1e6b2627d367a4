"""The filter's small dense algebra against the formulas of a textbook, whatever its layout."""

import numpy as np
import pytest

from fish_env.identification.filter_algebra import (
    N_ERROR,
    N_MOVING,
    predict_covariance,
    room,
    share_taken,
    take_into_covariance,
    whitened_gain,
    widened,
)

PHASE = N_ERROR - 1


def covariance(rng):
    root = rng.standard_normal((N_ERROR, N_ERROR))
    return root @ root.T + np.eye(N_ERROR)


def test_prediction_is_the_lyapunov_step():
    rng = np.random.default_rng(0)
    before, slopes = covariance(rng), rng.standard_normal((N_MOVING, N_ERROR))
    variance, keep, phase_walk = rng.uniform(1.0, 2.0, 6), 0.8, 0.3
    transition = np.diag([0.0] * N_MOVING + [keep] * 6 + [1.0])
    transition[:N_MOVING] = slopes
    added = np.zeros(N_ERROR)
    added[N_MOVING:PHASE], added[PHASE] = variance * (1.0 - keep**2), phase_walk
    p = widened(before)
    scratch, turned, *_ = room(1)
    predict_covariance(p, slopes, keep, variance, phase_walk, scratch, turned)
    expected = transition @ before @ transition.T + np.diag(added)
    np.testing.assert_allclose(p[:, :N_ERROR], expected, rtol=1e-12, atol=1e-12)
    assert not p[:, N_ERROR:].any()


@pytest.mark.parametrize("share", [1.0, 0.3])
@pytest.mark.parametrize("channels", [1, 4, 9, 11])
def test_update_is_that_of_kalman_by_a_share(channels, share):
    rng = np.random.default_rng(channels)
    before = covariance(rng)
    rows = np.zeros((channels, N_ERROR))
    rows[:, :N_MOVING] = rng.standard_normal((channels, N_MOVING))
    measured, noise = np.zeros(channels), rng.uniform(0.1, 1.0, channels)
    smear = rng.standard_normal(channels)
    lost = channels // 2 if channels > 1 else None
    if lost is not None:
        measured[lost], rows[lost] = np.nan, 0.0
    p = widened(before)
    _, _, s, w, seen, gain = room(channels)
    log_det = whitened_gain(p, rows, measured, noise, smear, s, w, seen, gain)
    take_into_covariance(p, w, share, gain)
    told = np.isfinite(measured)
    together = np.where(told, smear, 0.0)
    spread = rows @ before @ rows.T + np.diag(np.where(told, noise, 1.0))
    spread += np.outer(together, together)
    kalman = share * before @ rows.T @ np.linalg.inv(spread)
    np.testing.assert_allclose(gain[:channels, :N_ERROR].T, kalman, rtol=1e-9, atol=1e-11)
    kept = np.eye(N_ERROR) - kalman @ rows
    noisy = spread - rows @ before @ rows.T
    joseph = kept @ before @ kept.T + kalman @ noisy @ kalman.T
    np.testing.assert_allclose(p[:, :N_ERROR], joseph, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(w.T @ w, np.linalg.inv(spread), rtol=1e-9, atol=1e-11)
    assert log_det == pytest.approx(np.linalg.slogdet(spread)[1])
    assert not gain[channels:].any()
    assert not p[:, N_ERROR:].any()


def test_one_sample_turns_the_phase_no_further_than_its_slopes_hold():
    gain = np.zeros((3, 24))
    gain[:, N_ERROR - 1] = 0.5, -0.2, 0.1
    near, far = np.array([0.3, 0.1, -0.2]), np.array([5.0, 1.0, 3.0])
    assert share_taken(gain, near, 0.3) == 1.0
    assert share_taken(gain, far, 0.3) * abs(gain[:, N_ERROR - 1] @ far) == pytest.approx(0.3)
    assert share_taken(gain, far, np.inf) == 1.0

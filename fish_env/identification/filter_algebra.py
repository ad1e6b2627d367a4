"""Small dense algebra of the Kalman filter: kernels that know nothing of fish."""

from __future__ import annotations

import math

from fish_env.model.jit import kernel

N_ERROR = 19
"""Error state: position 3, rotation 3, velocity 3, rates 3, wrench 6, tail phase."""
N_MOVING = 12
"""Its first rows, which the equations of motion move; wrench and phase follow by themselves."""


@kernel
def angle(sine, cosine):
    """atan2 to 1e-11 without branches or library calls, so that lanes are computed together.

    Halving the angle three times leaves a tangent below 0.2, for which the series is short.
    """
    t = sine / (math.sqrt(sine * sine + cosine * cosine) + abs(cosine) + 1e-300)
    t = t / (1.0 + math.sqrt(1.0 + t * t))
    t = t / (1.0 + math.sqrt(1.0 + t * t))
    q = t * t
    series = 1.0 / 9.0 - q * (1.0 / 11.0 - q * (1.0 / 13.0 - q / 15.0))
    series = t * (1.0 - q * (1.0 / 3.0 - q * (1.0 / 5.0 - q * (1.0 / 7.0 - q * series))))
    half_turn = math.pi if sine >= 0.0 else -math.pi
    return 8.0 * series if cosine >= 0.0 else half_turn - 8.0 * series


@kernel
def innovation(measured, predicted, turns):
    """Measured minus predicted, the short way round where it ``turns``; zero if not measured."""
    gap = measured - predicted
    if turns:
        gap -= 2.0 * math.pi * math.floor(gap / (2.0 * math.pi) + 0.5)
    return gap if measured == measured else 0.0


@kernel
def cholesky_inverse(s, w):
    """w = inverse of the lower Cholesky factor of s (small, in place); returns log det s."""
    n = s.shape[0]
    log_det = 0.0
    for i in range(n):
        for j in range(i + 1):
            total = s[i, j]
            for k in range(j):
                total -= s[i, k] * s[j, k]
            if i == j:
                s[i, i] = math.sqrt(max(total, 1e-30))
                log_det += 2.0 * math.log(s[i, i])
            else:
                s[i, j] = total / s[j, j]
    for i in range(n):
        for j in range(n):
            w[i, j] = 0.0
        w[i, i] = 1.0 / s[i, i]
        for j in range(i):
            total = 0.0
            for k in range(j, i):
                total += s[i, k] * w[k, j]
            w[i, j] = -total / s[i, i]
    return log_det


@kernel
def predict_covariance(p, f, keep, variance, wander, scratch):
    """p = F p F' + Q in place, F = [f; keep on the wrench; 1 on the phase].

    Args:
        p: (19, 19) covariance of the error state.
        f: (12, 19) slopes of the moving rows.
        keep: what is left of the wrench after the interval.
        variance: (6,) stationary variance of the wrench.
        wander: variance that the tail phase gains over the interval (rad^2).
        scratch: (19, 19).
    """
    for i in range(N_MOVING):
        for j in range(N_ERROR):
            scratch[i, j] = 0.0
        for m in range(N_ERROR):
            slope = f[i, m]
            for j in range(N_ERROR):
                scratch[i, j] += slope * p[m, j]
    for i in range(N_MOVING, N_ERROR):
        factor = keep if i < N_ERROR - 1 else 1.0
        for j in range(N_ERROR):
            scratch[i, j] = factor * p[i, j]
    for i in range(N_ERROR):
        for j in range(min(i + 1, N_MOVING)):
            total = 0.0
            for m in range(N_ERROR):
                total += scratch[i, m] * f[j, m]
            p[i, j] = total
            p[j, i] = total
        for j in range(N_MOVING, i + 1):
            total = scratch[i, j] * (keep if j < N_ERROR - 1 else 1.0)
            p[i, j] = total
            p[j, i] = total
    for j in range(6):
        p[N_MOVING + j, N_MOVING + j] += variance[j] * (1.0 - keep * keep)
    p[N_ERROR - 1, N_ERROR - 1] += wander


@kernel
def update_covariance(p, rows, measured, noise_variance, s, w, ph, gain):
    """Take a sample into the covariance, in place.

    Args:
        p: (19, 19) covariance.
        rows: (C, 19) slopes of the channels.
        measured: (C,) NaN where missing; such a channel must have a row of zeros.
        noise_variance: (C,).
        s: (C, C) scratch.
        w: (C, C) becomes the inverse Cholesky factor of the innovations' covariance.
        ph: (19, C) scratch.
        gain: (19, C) becomes the Kalman gain.

    Returns:
        Logarithm of the determinant of the innovations' covariance.
    """
    channels = rows.shape[0]
    for i in range(N_ERROR):
        for j in range(channels):
            total = 0.0
            for m in range(N_MOVING):
                total += p[i, m] * rows[j, m]
            ph[i, j] = total
    for i in range(channels):
        for j in range(channels):
            total = 0.0
            for m in range(N_MOVING):
                total += rows[i, m] * ph[m, j]
            s[i, j] = total
        present = measured[i] == measured[i]
        s[i, i] += noise_variance[i] if present else 1.0
    log_det = cholesky_inverse(s, w)
    for i in range(N_ERROR):
        # gain = ph w' w, through the whitened columns ph w' (kept in s's place row by row)
        for j in range(channels):
            total = 0.0
            for m in range(j + 1):
                total += ph[i, m] * w[j, m]
            gain[i, j] = total
    for i in range(N_ERROR):
        for j in range(i + 1):
            total = p[i, j]
            for m in range(channels):
                total -= gain[i, m] * gain[j, m]
            p[i, j] = total
            p[j, i] = total
    for i in range(N_ERROR):
        for j in range(channels):
            total = 0.0
            for m in range(j, channels):
                total += gain[i, m] * w[m, j]
            gain[i, j] = total
    return log_det

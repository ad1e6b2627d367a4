"""Small dense algebra of the Kalman filter: kernels that know nothing of fish."""

from __future__ import annotations

import math

import numpy as np

from fish_env.identification.state_blocks import N_ERROR, N_MOVING
from fish_env.model.jit import kernel
from fish_env.model.state import BASE_STATES

PHASE = BASE_STATES.index("tail_phase")
BASE = len(BASE_STATES)  # rows of the fish itself, before those of effects
WIDE, MOVING_WIDE = -(-N_ERROR // 8) * 8, -(-N_MOVING // 8) * 8
"""The same as whole vector registers. Columns beyond are zero: sums over a row are taken column by
column at once, in registers, which pays only if no column is left over."""
TOGETHER = 3
"""Channels that the covariance loses at once."""


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
    """w = inverse of the lower Cholesky factor of s (small, in place); returns log det s.

    Only the lower triangle of s is read. Rows innermost, so that the compiler takes them at once.
    """
    n = s.shape[0]
    log_det = 0.0
    for j in range(n):
        s[j, j] = math.sqrt(max(s[j, j], 1e-30))
        log_det += 2.0 * math.log(s[j, j])
        for i in range(j + 1, n):
            s[i, j] = s[i, j] / s[j, j]
        for i in range(j + 1, n):
            factor = s[i, j]
            for k in range(j + 1, i + 1):
                s[i, k] -= factor * s[k, j]
    for i in range(n):
        for j in range(n):
            w[i, j] = 0.0
        for k in range(i):
            factor = s[i, k]
            for j in range(k + 1):
                w[i, j] += factor * w[k, j]
        for j in range(i):
            w[i, j] = -w[i, j] / s[i, i]
        w[i, i] = 1.0 / s[i, i]
    return log_det


@kernel
def room(channels):
    """What the kernels below write on: scratch, turned; s, w, seen and gain, as they say."""
    return (
        np.zeros((N_ERROR, WIDE)),
        np.zeros((N_ERROR, MOVING_WIDE)),
        np.zeros((channels, channels)),
        np.zeros((channels, channels)),
        np.zeros((channels, WIDE)),
        np.zeros((-(-channels // TOGETHER) * TOGETHER, WIDE)),
    )


@kernel
def multiply(a, rows, b, columns, product):
    """product = a b: so many rows of a (., 19) and columns of b (19, .)."""
    for i in range(rows):
        for j in range(columns):
            total = 0.0
            for m in range(N_ERROR):
                total += a[i, m] * b[m, j]
            product[i, j] = total


@kernel
def widened(covariance):
    """A covariance (19, 19) in the layout of these kernels (19, 24)."""
    p = np.zeros((N_ERROR, WIDE))
    for i in range(N_ERROR):
        for j in range(N_ERROR):
            p[i, j] = covariance[i, j]
    return p


@kernel
def predict_covariance(p, f, keep, variance, phase_walk, scratch, turned):
    """p = F p F' + Q in place, F = [f; keep on the wrench; 1 on the phase].

    Args:
        p: (19, 24) covariance of the error state.
        f: (12, 19) slopes of the moving rows.
        keep: what is left of the wrench after the interval.
        variance: (6,) stationary variance of the wrench.
        phase_walk: variance that the tail phase gains over the interval (rad^2).
        scratch: (19, 24).
        turned: (19, 16) becomes f transposed; the columns beyond the moving rows are zero.
    """
    for j in range(N_MOVING):
        for m in range(N_ERROR):
            turned[m, j] = f[j, m]
    multiply(f, N_MOVING, p, WIDE, scratch)
    for i in range(N_MOVING, N_ERROR):
        factor = keep if i < N_ERROR - 1 else 1.0
        for j in range(WIDE):
            scratch[i, j] = factor * p[i, j]
    multiply(scratch, N_ERROR, turned, MOVING_WIDE, p)
    for i in range(N_ERROR):
        for j in range(N_MOVING, N_ERROR):
            p[i, j] = scratch[i, j] * (keep if j < N_ERROR - 1 else 1.0)
    for i in range(N_ERROR):
        for j in range(i):
            p[j, i] = p[i, j]
    for j in range(6):
        p[N_MOVING + j, N_MOVING + j] += variance[j] * (1.0 - keep * keep)
    p[N_ERROR - 1, N_ERROR - 1] += phase_walk


@kernel
def whitened_gain(p, rows, measured, noise_variance, smear, s, w, seen, gain):
    """Covariance of a sample's innovations, and what :func:`take_into_covariance` needs of it.

    Channels first, error states last: the innermost loops run over rows of memory.

    Args:
        p: (19, 24) covariance.
        rows: (C, 19) slopes of the channels.
        measured: (C,) NaN where missing; such a channel must have a row of zeros.
        noise_variance: (C,).
        smear: (C,) standard deviation that all channels have together, as from a sample that is
            taken early or late.
        s: (C, C) scratch.
        w: (C, C) becomes the inverse Cholesky factor of the innovations' covariance.
        seen: (C, 24) scratch: covariance of channels and error states.
        gain: (C to the next multiple of 3, 24) becomes the gain of whitened innovations,
            transposed; the rows beyond the channels are zero.

    Returns:
        Logarithm of the determinant of the innovations' covariance.
    """
    channels = rows.shape[0]
    for j in range(channels):
        for i in range(WIDE):
            seen[j, i] = 0.0
        for m in range(N_ERROR):
            slope = rows[j, m]
            if slope != 0.0:  # a channel shows one to three of them
                for i in range(WIDE):
                    seen[j, i] += slope * p[m, i]
    for i in range(channels):
        for j in range(i + 1):
            s[i, j] = 0.0
        for m in range(N_ERROR):
            slope = rows[i, m]
            if slope != 0.0:
                for j in range(i + 1):
                    s[i, j] += slope * seen[j, m]
        present = measured[i] == measured[i]
        s[i, i] += noise_variance[i] if present else 1.0
        if present:
            for j in range(i + 1):
                if measured[j] == measured[j]:
                    s[i, j] += smear[i] * smear[j]
    log_det = cholesky_inverse(s, w)
    for j in range(channels):
        for i in range(WIDE):
            gain[j, i] = 0.0
        for m in range(j + 1):
            factor = w[j, m]
            for i in range(WIDE):
                gain[j, i] += factor * seen[m, i]
    return log_det


@kernel
def share_taken(gain, white, reach):
    """Share of a correction by which the tail's phase is turned no more than the slopes hold.

    Where a command changes, a small error of the motion may look like half a beat. Taken whole, it
    puts the filter out of step for seconds.

    Args:
        gain: (., 24) of whitened innovations, transposed.
        white: (C,) whitened innovations.
        reach: largest turn (rad).
    """
    turn = 0.0
    for j in range(white.shape[0]):
        turn += gain[j, N_ERROR - 1] * white[j]
    return reach / abs(turn) if abs(turn) > reach else 1.0


@kernel
def take_into_covariance(p, w, share, gain):
    """Take a sample into the covariance, in place.

    Args:
        p: (19, 24) covariance.
        w: (C, C) inverse Cholesky factor of the innovations' covariance.
        share: of the correction that is made. The covariance becomes that of the error after such
            a correction (Joseph's form).
        gain: (., 24) of whitened innovations, transposed; becomes that of innovations.
    """
    lost = share * (2.0 - share)
    channels = w.shape[0]
    for first in range(0, gain.shape[0], TOGETHER):
        for i in range(N_ERROR):
            for j in range(WIDE):
                total = p[i, j]
                for m in range(TOGETHER):
                    total -= lost * gain[first + m, i] * gain[first + m, j]
                p[i, j] = total
    for j in range(channels):
        factor = share * w[j, j]
        for i in range(WIDE):
            gain[j, i] *= factor
        for m in range(j + 1, channels):
            factor = share * w[m, j]
            for i in range(WIDE):
                gain[j, i] += factor * gain[m, i]

"""Likelihood of a noise model from a linearised run, without moving the fish again.

The slopes of motion and channels along a filtered run do not depend on the noise to first order.
So the covariances of another noise model, and how far its estimate strays from the stored one,
follow by linear algebra alone. Completed by :mod:`fish_env.model.compose`.
"""

from __future__ import annotations

import math

import numpy as np

from fish_env.identification.filter_algebra import (
    MOVING_WIDE,
    predict_covariance,
    room,
    take_into_covariance,
    whitened_gain,
    widened,
)
from fish_env.identification.state_blocks import N_ERROR, N_MOVING

# --- completed by compose ---
from fish_env.model.composed import entry_point

# --- end ---


@entry_point
def replay_run(
    clock, measured, f_in, h_in, raw_in, k_in, share_in, d_in, decay_in_s, noise_variance,
    smear, covariance0, wrench_variance, wrench_decay_s, phase_walk, e_out, w_out,
):  # fmt: skip
    """Log likelihood (without its constant) of a run under another noise model.

    Args:
        clock: (T,) sample times (s).
        measured: (T, C), NaN where missing.
        f_in: (T, 12, 19) slopes of the motion as ``ekf_run`` stored them.
        h_in: (T, C, 19) slopes of the channels.
        raw_in: (T, C) innovations.
        k_in: (T, 19, C) gains they were made with.
        share_in: (T,) shares of the corrections that were made, which are made again.
        d_in: (T, 6) filtered wrench.
        decay_in_s: correlation time of the wrench they were made with (s).
        noise_variance: (C,).
        smear: (T, C) standard deviations that the channels of a sample have together.
        covariance0: (19, 19) of the initial error state.
        wrench_variance: (6,) stationary variance of the wrench.
        wrench_decay_s: its correlation time (s).
        phase_walk: variance that the tail phase gains in a second (rad^2/s).
        e_out: (T, C) whitened innovations.
        w_out: (T, C, C) whitening.
    """
    channels = measured.shape[1]
    p = widened(covariance0)
    scratch, turned, s, w, seen, gain = room(channels)
    e = np.zeros(channels)
    stray = np.zeros(N_ERROR)
    moved = np.zeros(N_ERROR)
    log_likelihood = 0.0
    for sample in range(clock.shape[0]):
        if sample > 0:
            span = clock[sample] - clock[sample - 1]
            keep = math.exp(-span / wrench_decay_s)
            kept = math.exp(-span / decay_in_s)
            predict_covariance(
                p, f_in[sample], keep, wrench_variance, phase_walk * span, scratch, turned
            )
            for i in range(MOVING_WIDE):
                total = 0.0
                for j in range(N_ERROR):
                    total += turned[j, i] * stray[j]
                moved[i] = total
            for j in range(6):
                i = N_MOVING + j
                moved[i] = keep * stray[i] + (keep - kept) * d_in[sample - 1, j]
            moved[N_ERROR - 1] = stray[N_ERROR - 1]
            stray[:] = moved
        log_det = whitened_gain(
            p, h_in[sample], measured[sample], noise_variance, smear[sample], s, w, seen, gain
        )  # fmt: skip
        take_into_covariance(p, w, share_in[sample], gain)
        w_out[sample] = w
        log_likelihood -= 0.5 * log_det
        for i in range(channels):
            total = raw_in[sample, i]
            for j in range(N_ERROR):
                total -= h_in[sample, i, j] * stray[j]
            e[i] = total
        for i in range(channels):
            total = 0.0
            for j in range(i + 1):
                total += w[i, j] * e[j]
            e_out[sample, i] = total
            log_likelihood -= 0.5 * total * total
        for i in range(N_ERROR):
            total = stray[i]
            for j in range(channels):
                total += gain[j, i] * e[j] - k_in[sample, i, j] * raw_in[sample, j]
            stray[i] = total
    return log_likelihood

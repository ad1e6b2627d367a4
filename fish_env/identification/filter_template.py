"""Compiled extended Kalman filter over one measured run, and its sensitivity to parameters.

Completed and compiled by :mod:`fish_env.model.compose` behind the rollout and error-state
templates. The state of the fish is estimated together with an unknown wrench (Ornstein-Uhlenbeck);
what remains, the whitened one-step prediction errors (innovations), is what all estimates and
tests are made of.
"""

from __future__ import annotations

import math

import numpy as np

from fish_env.identification.filter_algebra import (
    PHASE,
    predict_covariance,
    room,
    share_taken,
    take_into_covariance,
    whitened_gain,
    widened,
)
from fish_env.identification.state_blocks import N_ERROR, N_MOVING, PHASE_COLUMN

# --- completed by compose ---
from fish_env.model.composed import (
    BLOCK,
    DX,
    LATE_TAIL,
    N_STATES,
    PERTURB,
    TAIL_ROWS,
    TURN,
    WORK_ROWS,
    WRENCH,
    X0,
    begin_step,
    difference,
    entry_point,
    innovations_of,
    keep_step,
    kernel,
    load_lane,
    move,
    observation_rows,
    room_for_path,
    secants_of_phase,
    set_commands,
    share_told,
    start_effects,
    step_lanes_once,
    whole_vectors,
)

# --- end ---


@kernel
def slopes_of_interval(
    work, width, steps, h, begin, times, values, at, pace, skew, delay, late, history, tables,
    error, per_phase, gap, path, f,
):  # fmt: skip
    """Advance the estimate by one sample interval; f (12, 19) becomes its slopes.

    And ``per_phase`` (F,) what the tail's states change with its phase, all along.

    Slopes by the phase are secants to both sides. Where a limit or play makes the tail's rate jump,
    a tangent jumps whenever a corner passes a sample, and gains and likelihood jump with it.
    Source: Norgaard, Poulsen and Ravn (2000), Automatica 36, 1627.
    """
    for j in range(N_STATES):
        for k in range(1, width):
            work[(X0 + j) * width + k] = work[(X0 + j) * width]
            work[(DX + j) * width + k] = work[(DX + j) * width]
    for j in range(6):
        for k in range(1, width):
            work[(WRENCH + j) * width + k] = work[(WRENCH + j) * width]
    if late:
        share_told(width, history)
    for j in range(N_ERROR):
        for k in range(width):
            error[j, k] = PERTURB if k == j + 1 else 0.0
    error[PHASE_COLUMN, PHASE_COLUMN + 1] = TURN
    error[PHASE_COLUMN, N_ERROR + 1] = -TURN
    move(work, width, error, per_phase, late, history)
    for i in range(steps):
        start = begin + i * h
        set_commands(work, width, times, values, at, start, h, pace, skew, delay, True)
        begin_step(work, width, 1, path, i)
        step_lanes_once(work, start, h, pace, late, history, tables)
        keep_step(work, width, 1, pace, path, i)
    secants_of_phase(work, width, per_phase)
    difference(work, width, gap)
    for j in range(N_MOVING):
        for k in range(N_ERROR):
            f[j, k] = gap[j, k + 1] * (1.0 / PERTURB)
        turned = gap[j, PHASE_COLUMN + 1] - gap[j, N_ERROR + 1]
        f[j, PHASE_COLUMN] = turned * (0.5 / TURN)


@kernel
def carry(work, width, known, sample, sign, count):
    """Add a known wrench (T, 6) to the disturbance of the first lanes; no rows for none."""
    if known.shape[0] > 0:
        for j in range(6):
            for k in range(count):
                work[(WRENCH + j) * width + k] += sign * known[sample, j]


@entry_point
def ekf_run(
    state0, swimming, par, pace_one, skew_one, delay_one, gain, bias, ages_one, lens_one, clock,
    substeps, times, values, measured, codes, noise_variance, smear, covariance0, wrench_variance,
    wrench_decay_s, phase_walk, reach, history_rows, known, tables, k_out, w_out, e_out, share_out,
    turn_out, x_out, d_out, f_out, h_out, raw_out,
):  # fmt: skip
    """Extended Kalman filter over one run, relinearised at every sample.

    Args:
        state0: (states,) at the first sample.
        swimming: whether the tail was beating before it.
        par: (parameters, 1) record, the wrench last.
        pace_one: true seconds per recorded second.
        skew_one: seconds of the commands' clock per recorded second.
        delay_one: age of the measurements, on the commands' clock (s).
        gain: (C,) factor of each measured channel.
        bias: (C,) offset of each measured channel.
        ages_one: (devices,) how much older than its row a sample of each device is (s).
        lens_one: (rows, 1) how sensors sit and look (see ``sensing.geometry``).
        clock: (T,) recorded sample times, the first is 0 (s).
        substeps: (T,) RK4 steps up to each sample.
        times: (m,) command times (s).
        values: (m, 5) commands.
        measured: (T, C), NaN where missing.
        codes: (C, 4) kind, index, column and device of each channel.
        noise_variance: (C,).
        smear: (T, C) standard deviations that the channels of a sample have together.
        covariance0: (19, 19) of the initial error state.
        wrench_variance: (6,) stationary variance of the wrench.
        wrench_decay_s: its correlation time (s).
        phase_walk: variance that the tail phase gains in a second (rad^2/s).
        reach: largest turn of the tail phase by one sample (rad).
        history_rows: room for late tail commands, 0 for none.
        known: (T, 6) known force and moment from each sample to the next, or no rows.
        tables: packed coefficient curves.
        k_out: (T, 19, C) gains.
        w_out: (T, C, C) whitening.
        e_out: (T, C) whitened innovations.
        share_out: (T,) share of the correction that was made.
        turn_out: (T, F) change of the tail's states with its phase.
        x_out: (T, states) filtered states.
        d_out: (T, 6) filtered wrench.
        f_out: (T, 12, 19) slopes of the moving part over the interval before, or no rows.
        h_out: (T, C, 19) slopes of the channels, or no rows.
        raw_out: (T, C) innovations in units, or no rows.

    Returns:
        Log likelihood without its constant.
    """
    width = BLOCK
    work = np.zeros(WORK_ROWS * width)
    pace, skew = np.full(width, pace_one), np.full(width, skew_one)
    delay = np.full(width, delay_one)
    lens = np.zeros((lens_one.shape[0], width))
    for i in range(lens.shape[0]):
        lens[i, :] = lens_one[i, 0]
    ages = np.zeros((ages_one.shape[0], width))
    for i in range(ages.shape[0]):
        ages[i, :] = ages_one[i]
    at = np.zeros(width, np.int64)
    for k in range(width):
        load_lane(work, width, k, state0, par, 0, values[0])
    work[(X0 + PHASE) * width + PHASE_COLUMN + 1] += TURN
    work[(X0 + PHASE) * width + N_ERROR + 1] -= TURN
    late = LATE_TAIL & (history_rows > 0)
    history = np.zeros((history_rows, width))
    start_effects(work, N_ERROR + 2, width, clock[0], swimming, pace, late, history, tables)
    per_phase = np.zeros(TAIL_ROWS.shape[0])
    secants_of_phase(work, width, per_phase)
    channels = codes.shape[0]
    p = widened(covariance0)
    scratch, turned, s, w, seen, k_gain = room(channels)
    f = np.zeros((N_MOVING, N_ERROR))
    gap = np.zeros((N_MOVING, width))
    error = np.zeros((N_ERROR, width))
    rows = np.zeros((channels, N_ERROR))
    e = np.zeros((channels, width))
    gains, biases = np.ones((channels, width)), np.zeros((channels, width))
    for i in range(channels):
        gains[i, :] = gain[i]
        biases[i, :] = bias[i]
    path = room_for_path(ages, substeps)
    log_likelihood, h, steps = 0.0, 0.0, 0
    for sample in range(clock.shape[0]):
        if sample > 0:
            begin = clock[sample - 1]
            span = clock[sample] - begin
            steps = substeps[sample]
            h = span / steps
            carry(work, width, known, sample - 1, 1.0, 1)
            slopes_of_interval(
                work, width, steps, h, begin, times, values, at,
                pace, skew, delay, late, history, tables, error, per_phase, gap, path, f,
            )  # fmt: skip
            carry(work, width, known, sample - 1, -1.0, 1)
            keep = math.exp(-span / wrench_decay_s)
            for j in range(6):
                work[(WRENCH + j) * width] *= keep
            predict_covariance(p, f, keep, wrench_variance, phase_walk * span, scratch, turned)
        observation_rows(
            work, width, codes, gain, ages, h, steps, path, lens, measured[sample], rows
        )
        innovations_of(
            work, width, 1, measured[sample], codes, gains, biases, ages, h, steps, path, lens, e
        )
        log_det = whitened_gain(
            p, rows, measured[sample], noise_variance, smear[sample], s, w, seen, k_gain
        )  # fmt: skip
        log_likelihood -= 0.5 * log_det
        for i in range(channels):
            total = 0.0
            for j in range(i + 1):
                total += w[i, j] * e[j, 0]
            e_out[sample, i] = total
            log_likelihood -= 0.5 * total * total
        share_out[sample] = share_taken(k_gain, e_out[sample], reach)
        take_into_covariance(p, w, share_out[sample], k_gain)
        for i in range(N_ERROR):
            total = 0.0
            for j in range(channels):
                total += k_gain[j, i] * e[j, 0]
                k_out[sample, i, j] = k_gain[j, i]
            error[i, 0] = total
        move(work, width, error, per_phase, late, history)
        w_out[sample] = w
        turn_out[sample] = per_phase
        for j in range(N_STATES):
            x_out[sample, j] = work[(X0 + j) * width]
        for j in range(6):
            d_out[sample, j] = work[(WRENCH + j) * width]
        if f_out.shape[0] > 0:
            f_out[sample] = f
            h_out[sample] = rows
            raw_out[sample] = e[:, 0]
    return log_likelihood


@kernel
def push(work, width, basis, sample, column, size, sign, first, count):
    """Add a prescribed wrench to each lane: ``column`` = 6 * basis function + direction."""
    for k in range(count):
        lane = first + k
        function, direction = column[lane] // 6, column[lane] % 6
        work[(WRENCH + direction) * width + k] += sign * size[lane] * basis[sample, function]


@kernel
def take_sample(
    work, width, lanes, measured, codes, gain, bias, ages, h, steps, path, lens, k_in, w_in,
    turn_in, e, error, white, late, history,
):  # fmt: skip
    """Innovations of all lanes at one sample, whitened into white (C, width); states corrected."""
    channels = codes.shape[0]
    innovations_of(work, width, lanes, measured, codes, gain, bias, ages, h, steps, path, lens, e)
    for i in range(channels):
        for k in range(lanes):
            white[i, k] = w_in[i, 0] * e[0, k]
        for j in range(1, i + 1):
            factor = w_in[i, j]
            for k in range(lanes):
                white[i, k] += factor * e[j, k]
    for i in range(N_ERROR):
        for k in range(lanes):
            error[i, k] = k_in[i, 0] * e[0, k]
        for j in range(1, channels):
            factor = k_in[i, j]
            for k in range(lanes):
                error[i, k] += factor * e[j, k]
    move(work, width, error, turn_in, late, history)


@kernel
def filter_block(
    states0, swimming, par, pace_all, skew_all, delay_all, gain_all, bias_all, ages_all, lens_all,
    clock, substeps, times, values, measured, codes, k_in, w_in, turn_in, wrench_decay_s,
    history_rows, known, push_basis, push_column, push_size, tables, out, place, first, count,
):  # fmt: skip
    """Lanes first..first+count through a run with given gains (see :func:`filter_lanes`)."""
    width = BLOCK
    channels = codes.shape[0]
    work = np.zeros(WORK_ROWS * width)
    pace, skew, delay = np.ones(width), np.ones(width), np.zeros(width)
    lens = np.zeros((lens_all.shape[0], width))
    gain, bias = np.ones((channels, width)), np.zeros((channels, width))
    ages = np.zeros((ages_all.shape[0], width))
    at = np.zeros(width, np.int64)
    shared, lanes = True, whole_vectors(count, width)
    for k in range(width):
        lane = first + min(k, count - 1)
        load_lane(work, width, k, states0[:, lane], par, lane, values[0])
        pace[k], skew[k], delay[k] = pace_all[lane], skew_all[lane], delay_all[lane]
        shared &= (skew[k] == skew[0]) & (delay[k] == delay[0])
        for i in range(lens.shape[0]):
            lens[i, k] = lens_all[i, lane]
        for i in range(ages.shape[0]):
            ages[i, k] = ages_all[i, lane]
        for i in range(channels):
            gain[i, k], bias[i, k] = gain_all[i, lane], bias_all[i, lane]
    late = LATE_TAIL & (history_rows > 0)
    history = np.zeros((history_rows, width))
    start_effects(work, count, width, clock[0], swimming, pace, late, history, tables)
    pushed = push_basis.shape[0] > 0
    e = np.zeros((channels, width))
    white = np.zeros((channels, width))
    error = np.zeros((N_ERROR, width))
    path = room_for_path(ages, substeps)
    h, steps = 0.0, 0
    for sample in range(clock.shape[0]):
        if sample > 0:
            span = clock[sample] - clock[sample - 1]
            steps = substeps[sample]
            h = span / steps
            carry(work, width, known, sample - 1, 1.0, width)
            if pushed:
                push(work, width, push_basis, sample - 1, push_column, push_size, 1.0, first, count)
            for i in range(steps):
                begin = clock[sample - 1] + i * h
                set_commands(work, width, times, values, at, begin, h, pace, skew, delay, shared)
                begin_step(work, width, lanes, path, i)
                step_lanes_once(work, begin, h, pace, late, history, tables)
                keep_step(work, width, lanes, pace, path, i)
            if pushed:
                push(
                    work, width, push_basis, sample - 1, push_column, push_size, -1.0, first, count
                )
            carry(work, width, known, sample - 1, -1.0, width)
            keep = math.exp(-span / wrench_decay_s)
            for n in range(WRENCH * width, (WRENCH + 6) * width):
                work[n] *= keep
        take_sample(
            work, width, lanes, measured[sample], codes, gain, bias, ages, h, steps, path, lens,
            k_in[sample], w_in[sample], turn_in[sample], e, error, white, late, history,
        )  # fmt: skip
        for k in range(count):
            for i in range(channels):
                out[first + k, place + sample * channels + i] = white[i, k]


@entry_point
def filter_lanes(
    states0, swimming, par, pace, skew, delay, gain, bias, ages, lens, clock, substeps, times,
    values, measured, codes, k_in, w_in, turn_in, wrench_decay_s, history_rows, known, push_basis,
    push_column, push_size, tables, out, place, first, last,
):  # fmt: skip
    """Whitened innovations of many parameter sets on one run, with the gains of one of them.

    Args:
        states0: (states, N) initial states.
        swimming: whether the tail was beating before the run.
        par: (parameters, N) records, the wrench last (zero).
        pace: (N,) true seconds per recorded second.
        skew: (N,) seconds of the commands' clock per recorded second.
        delay: (N,) age of the measurements, on the commands' clock (s).
        gain: (C, N) factor of each measured channel.
        bias: (C, N) offset of each measured channel.
        ages: (devices, N) how much older than its row a sample of each device is (s).
        lens: (rows, N) how sensors sit and look (see ``sensing.geometry``).
        clock: (T,) sample times.
        substeps: (T,) RK4 steps up to each sample.
        times: (m,) command times (s).
        values: (m, 5) commands.
        measured: (T, C), NaN where missing.
        codes: (C, 4) kind, index, column and device of each channel.
        k_in: (T, 19, C) gains.
        w_in: (T, C, C) whitening.
        turn_in: (T, F) change of the tail's states with its phase; zero, or no columns, for none.
        wrench_decay_s: correlation time of the wrench.
        history_rows: room for late tail commands, 0 for none.
        known: (T, 6) known force and moment from each sample to the next, or no rows.
        push_basis: (T, J) functions of time that scale an extra wrench, or no rows.
        push_column: (N,) 6 * function + direction for each lane.
        push_size: (N,) N or N m; zero for none.
        tables: packed coefficient curves.
        out: (N, residuals of all runs) whitened innovations; those of the channels at one sample
            come one after another.
        place: where those of this run begin.
        first: first lane.
        last: one past the last.
    """
    for block in range(first, last, BLOCK):
        filter_block(
            states0, swimming, par, pace, skew, delay, gain, bias, ages, lens, clock, substeps,
            times, values, measured, codes, k_in, w_in, turn_in, wrench_decay_s, history_rows,
            known, push_basis, push_column, push_size, tables, out, place, block,
            min(BLOCK, last - block),
        )  # fmt: skip
    return 0

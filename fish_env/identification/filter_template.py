"""Compiled extended Kalman filter over one measured run, and its sensitivity to parameters.

Completed and compiled by :mod:`fish_env.model.compose` behind the rollout template. The state of
the fish is estimated together with an unknown wrench (Ornstein-Uhlenbeck); what remains, the
whitened one-step prediction errors (innovations), is what all estimates and tests are made of.

Error state, 19 numbers: position (3, inertial), small rotation (3, body), velocity (3, body),
angular velocity (3), wrench (6, body), tail phase.
"""

from __future__ import annotations

import numpy as np

import math

# --- completed by compose ---
from fish_env.model.composed import (  # type: ignore[import-not-found]
    LATE_TAIL,
    N_PARAMETERS,
    N_STATES,
    PAR,
    TIME,
    U,
    U_RATE,
    WORK_ROWS,
    X0,
    X,
    entry_point,
    kernel,
    lane_initialise,
    rk4_step,
)

# --- end ---

N_ERROR = 19
WRENCH = PAR + N_PARAMETERS - 6
FILTER_LANES = 16
PERTURB = 1e-5


@kernel
def set_commands(work, width, times, values, at, start, length, pace, delay):
    """Mean command over each lane's own (true) time interval, so that switches act smoothly."""
    for k in range(width):
        begin = pace[k] * start - delay[k]
        end = begin + pace[k] * length
        row = at[k]
        while (row + 1 < times.shape[0]) and (times[row + 1] <= begin + 1e-9):
            row += 1
        at[k] = row
        for j in range(5):
            work[(U + j) * width + k] = values[row, j]
        last = row
        while (last + 1 < times.shape[0]) and (times[last + 1] < end - 1e-9):
            last += 1
        if last > row:
            for j in range(5):
                work[(U + j) * width + k] = 0.0
            left = begin
            for i in range(row, last + 1):
                right = times[i + 1] if i < last else end
                weight = (right - left) / (end - begin)
                for j in range(5):
                    work[(U + j) * width + k] += weight * values[i, j]
                left = right


@kernel
def step_lanes_once(work, width, elapsed, h, pace, late, history, tables):
    """One RK4 step of every lane, kept where it stays finite."""
    rk4_step(work, width, elapsed, h, tables, late, history, 0, width, pace)
    for k in range(width):
        norm = 0.0
        for j in range(3, 7):
            norm += work[(X + j) * width + k] ** 2
        scale = 1.0 / math.sqrt(norm)
        for j in range(N_STATES):
            value = work[(X + j) * width + k]
            value = value * scale if (j >= 3) & (j < 7) else value
            good = abs(value) < 1e4
            work[(X0 + j) * width + k] = value if good else work[(X0 + j) * width + k]


@kernel
def channel(work, width, k, code):
    """Predicted value of a channel: 0-2 x y z, 3-5 roll pitch yaw, 6-8 u v w, 9-11 p q r."""
    if code < 3:
        return work[(X0 + code) * width + k]
    if code >= 6:
        return work[(X0 + code + 1) * width + k]
    qw = work[(X0 + 3) * width + k]
    qx = work[(X0 + 4) * width + k]
    qy = work[(X0 + 5) * width + k]
    qz = work[(X0 + 6) * width + k]
    if code == 3:
        return math.atan2(2.0 * (qy * qz + qw * qx), 1.0 - 2.0 * (qx * qx + qy * qy))
    if code == 4:
        return math.asin(min(max(2.0 * (qw * qy - qx * qz), -1.0), 1.0))
    return math.atan2(2.0 * (qx * qy + qw * qz), 1.0 - 2.0 * (qy * qy + qz * qz))


@kernel
def innovation(measured, predicted, code):
    """Measured minus predicted; angles the short way round; zero for a missing sample."""
    if measured != measured:
        return 0.0
    gap = measured - predicted
    if (code == 3) | (code == 5):
        turns = math.floor(gap / (2.0 * math.pi) + 0.5)
        gap -= 2.0 * math.pi * turns
    return gap


@kernel
def move(work, width, k, error, scale):
    """Apply an error state (times scale) to a lane."""
    for j in range(3):
        work[(X0 + j) * width + k] += scale * error[j]
    ax, ay, az = 0.5 * scale * error[3], 0.5 * scale * error[4], 0.5 * scale * error[5]
    qw = work[(X0 + 3) * width + k]
    qx = work[(X0 + 4) * width + k]
    qy = work[(X0 + 5) * width + k]
    qz = work[(X0 + 6) * width + k]
    nw = qw - qx * ax - qy * ay - qz * az
    nx = qx + qw * ax + qy * az - qz * ay
    ny = qy + qw * ay + qz * ax - qx * az
    nz = qz + qw * az + qx * ay - qy * ax
    norm = 1.0 / math.sqrt(nw * nw + nx * nx + ny * ny + nz * nz)
    work[(X0 + 3) * width + k] = nw * norm
    work[(X0 + 4) * width + k] = nx * norm
    work[(X0 + 5) * width + k] = ny * norm
    work[(X0 + 6) * width + k] = nz * norm
    for j in range(6):
        work[(X0 + 7 + j) * width + k] += scale * error[6 + j]
    for j in range(6):
        work[(WRENCH + j) * width + k] += scale * error[12 + j]
    work[(X0 + 13) * width + k] += scale * error[18]


@kernel
def difference(work, width, k, into):
    """Error state of lane k relative to lane 0."""
    for j in range(3):
        into[j] = work[(X0 + j) * width + k] - work[(X0 + j) * width]
    aw = work[(X0 + 3) * width]
    ax = -work[(X0 + 4) * width]
    ay = -work[(X0 + 5) * width]
    az = -work[(X0 + 6) * width]
    bw = work[(X0 + 3) * width + k]
    bx = work[(X0 + 4) * width + k]
    by = work[(X0 + 5) * width + k]
    bz = work[(X0 + 6) * width + k]
    sign = 2.0 if aw * bw - ax * bx - ay * by - az * bz > 0.0 else -2.0
    into[3] = sign * (aw * bx + ax * bw + ay * bz - az * by)
    into[4] = sign * (aw * by + ay * bw + az * bx - ax * bz)
    into[5] = sign * (aw * bz + az * bw + ax * by - ay * bx)
    for j in range(6):
        into[6 + j] = work[(X0 + 7 + j) * width + k] - work[(X0 + 7 + j) * width]
    for j in range(6):
        into[12 + j] = work[(WRENCH + j) * width + k] - work[(WRENCH + j) * width]
    into[18] = work[(X0 + 13) * width + k] - work[(X0 + 13) * width]


@kernel
def observation_rows(work, width, codes, gain, rows):
    """d(channel)/d(error state) of lane 0, shape (channels, 19)."""
    qw = work[(X0 + 3) * width]
    qx = work[(X0 + 4) * width]
    qy = work[(X0 + 5) * width]
    qz = work[(X0 + 6) * width]
    zx = 2.0 * (qx * qz - qw * qy)
    zy = 2.0 * (qy * qz + qw * qx)
    zz = 1.0 - 2.0 * (qx * qx + qy * qy)
    level = max(1.0 - zx * zx, 1e-6)
    cosine = math.sqrt(level)
    sin_roll, cos_roll, tan_pitch = zy / cosine, zz / cosine, -zx / cosine
    for i in range(codes.shape[0]):
        for j in range(N_ERROR):
            rows[i, j] = 0.0
        code = codes[i]
        if code < 3:
            rows[i, code] = gain[i]
        elif code == 3:
            rows[i, 3] = gain[i]
            rows[i, 4] = gain[i] * sin_roll * tan_pitch
            rows[i, 5] = gain[i] * cos_roll * tan_pitch
        elif code == 4:
            rows[i, 4] = gain[i] * cos_roll
            rows[i, 5] = -gain[i] * sin_roll
        elif code == 5:
            rows[i, 4] = gain[i] * sin_roll / cosine
            rows[i, 5] = gain[i] * cos_roll / cosine
        else:
            rows[i, code] = gain[i]


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
def load_lane(work, width, k, state, par, row, first_command):
    """Put a state and a parameter record into a lane."""
    for j in range(N_STATES):
        work[(X0 + j) * width + k] = state[j]
    for j in range(N_PARAMETERS):
        work[(PAR + j) * width + k] = par[j, row]
    for j in range(5):
        work[(U + j) * width + k] = first_command[j]
        work[(U_RATE + j) * width + k] = 0.0
    work[TIME * width + k] = 0.0


@kernel
def start_effects(work, width):
    """Effect states where the start of a run leaves them (they live in the X rows)."""
    for n in range(N_STATES * width):
        work[X * width + n] = work[X0 * width + n]
    for k in range(width):
        lane_initialise(k, width, work)
    for n in range(N_STATES * width):
        work[X0 * width + n] = work[X * width + n]


@entry_point
def ekf_run(
    state0, par, pace_one, delay_one, gain, bias, clock, substeps, times, values, measured, codes,
    noise_variance, covariance0, wrench_variance, wrench_decay_s, history_rows, tables, k_out,
    w_out, e_out, x_out, d_out,
):  # fmt: skip
    """Extended Kalman filter over one run, relinearised at every sample.

    Args:
        state0: (states,) at the first sample.
        par: (parameters, 1) record, the wrench last.
        pace_one: true seconds per recorded second.
        delay_one: age of the measurements (s).
        gain: (C,) factor and ...
        bias: (C,) offset of each measured channel.
        clock: (T,) recorded sample times, the first is 0 (s).
        substeps: (T,) RK4 steps up to each sample.
        times: (m,) command times (s); values: (m, 5).
        values: commands.
        measured: (T, C), NaN where missing.
        codes: (C,) channel codes.
        noise_variance: (C,).
        covariance0: (19, 19) of the initial error state.
        wrench_variance: (6,) stationary variance of the wrench.
        wrench_decay_s: its correlation time (s).
        history_rows: room for late tail commands, 0 for none.
        tables: packed coefficient curves.
        k_out: (T, 19, C) gains; w_out: (T, C, C) whitening; e_out: (T, C) innovations;
        w_out: see k_out.
        e_out: see k_out.
        x_out: (T, states) filtered states.
        d_out: (T, 6) filtered wrench.

    Returns:
        Log likelihood without its constant.
    """
    width = N_ERROR + 1
    work = np.zeros(WORK_ROWS * width)
    pace = np.full(width, pace_one)
    delay = np.full(width, delay_one)
    at = np.zeros(width, np.int64)
    for k in range(width):
        load_lane(work, width, k, state0, par, 0, values[0])
    start_effects(work, width)
    late = LATE_TAIL & (history_rows > 0)
    history = np.zeros((history_rows, width))
    channels = codes.shape[0]
    p = covariance0.copy()
    f = np.zeros((N_ERROR, N_ERROR))
    column = np.zeros(N_ERROR)
    unit = np.zeros(N_ERROR)
    rows = np.zeros((channels, N_ERROR))
    s = np.zeros((channels, channels))
    e = np.zeros(channels)
    log_likelihood = 0.0
    for sample in range(clock.shape[0]):
        if sample > 0:
            span = clock[sample] - clock[sample - 1]
            h = span / substeps[sample]
            for k in range(1, width):
                for j in range(N_STATES):
                    work[(X0 + j) * width + k] = work[(X0 + j) * width]
                for j in range(6):
                    work[(WRENCH + j) * width + k] = work[(WRENCH + j) * width]
                unit[:] = 0.0
                unit[k - 1] = 1.0
                move(work, width, k, unit, PERTURB)
            for i in range(substeps[sample]):
                begin = clock[sample - 1] + i * h
                set_commands(work, width, times, values, at, begin, h, pace, delay)
                step_lanes_once(work, width, begin, h, pace, late, history, tables)
            for k in range(1, width):
                difference(work, width, k, column)
                for j in range(N_ERROR):
                    f[j, k - 1] = column[j] / PERTURB
            keep = math.exp(-span / wrench_decay_s)
            for j in range(6):
                work[(WRENCH + j) * width] *= keep
                for i in range(N_ERROR):
                    f[12 + j, i] *= keep
            p = f @ p @ f.T
            for j in range(6):
                p[12 + j, 12 + j] += wrench_variance[j] * (1.0 - keep * keep)
        observation_rows(work, width, codes, gain, rows)
        for i in range(channels):
            present = measured[sample, i] == measured[sample, i]
            if not present:
                rows[i, :] = 0.0
            predicted = gain[i] * channel(work, width, 0, codes[i]) + bias[i]
            e[i] = innovation(measured[sample, i], predicted, codes[i])
        ph = p @ rows.T
        hph = rows @ ph
        for i in range(channels):
            for j in range(channels):
                s[i, j] = hph[i, j]
            present = measured[sample, i] == measured[sample, i]
            s[i, i] += noise_variance[i] if present else 1.0
        log_det = cholesky_inverse(s, w_out[sample])
        whitened = w_out[sample] @ e
        k_gain = ph @ (w_out[sample].T @ w_out[sample])
        log_likelihood -= 0.5 * ((whitened * whitened).sum() + log_det)
        p = p - k_gain @ ph.T
        p = 0.5 * (p + p.T)
        move(work, width, 0, k_gain @ e, 1.0)
        k_out[sample] = k_gain
        e_out[sample] = whitened
        for j in range(N_STATES):
            x_out[sample, j] = work[(X0 + j) * width]
        for j in range(6):
            d_out[sample, j] = work[(WRENCH + j) * width]
    return log_likelihood


@kernel
def push(work, width, basis, sample, column, size, first, count):
    """Add a prescribed wrench to each lane: ``column`` = 6 * basis function + direction."""
    for k in range(count):
        lane = first + k
        function, direction = column[lane] // 6, column[lane] % 6
        work[(WRENCH + direction) * width + k] += size[lane] * basis[sample, function]


@kernel
def filter_block(
    states0, par, pace_all, delay_all, gain, bias, clock, substeps, times, values, measured, codes,
    k_in, w_in, wrench_decay_s, history_rows, push_basis, push_column, push_size, tables, out,
    first, count,
):  # fmt: skip
    """Lanes first..first+count through a run with given gains (see :func:`filter_lanes`)."""
    width = FILTER_LANES
    work = np.zeros(WORK_ROWS * width)
    pace = np.ones(width)
    delay = np.zeros(width)
    at = np.zeros(width, np.int64)
    for k in range(width):
        lane = first + min(k, count - 1)
        load_lane(work, width, k, states0[:, lane], par, lane, values[0])
        pace[k] = pace_all[lane]
        delay[k] = delay_all[lane]
    start_effects(work, width)
    late = LATE_TAIL & (history_rows > 0)
    history = np.zeros((history_rows, width))
    pushed = push_basis.shape[0] > 0
    channels = codes.shape[0]
    e = np.zeros(channels)
    error = np.zeros(N_ERROR)
    for sample in range(clock.shape[0]):
        if sample > 0:
            span = clock[sample] - clock[sample - 1]
            h = span / substeps[sample]
            if pushed:
                push(work, width, push_basis, sample - 1, push_column, push_size, first, count)
            for i in range(substeps[sample]):
                begin = clock[sample - 1] + i * h
                set_commands(work, width, times, values, at, begin, h, pace, delay)
                step_lanes_once(work, width, begin, h, pace, late, history, tables)
            if pushed:
                push(work, width, push_basis, sample - 1, push_column, -push_size, first, count)
            keep = math.exp(-span / wrench_decay_s)
            for j in range(6):
                for k in range(width):
                    work[(WRENCH + j) * width + k] *= keep
        for k in range(count):
            lane = first + k
            for i in range(channels):
                predicted = gain[i, lane] * channel(work, width, k, codes[i]) + bias[i, lane]
                e[i] = innovation(measured[sample, i], predicted, codes[i])
            for i in range(channels):
                total = 0.0
                for j in range(i + 1):
                    total += w_in[sample, i, j] * e[j]
                out[lane, sample, i] = total
            for i in range(N_ERROR):
                total = 0.0
                for j in range(channels):
                    total += k_in[sample, i, j] * e[j]
                error[i] = total
            move(work, width, k, error, 1.0)


@entry_point
def filter_lanes(
    states0, par, pace, delay, gain, bias, clock, substeps, times, values, measured, codes, k_in,
    w_in, wrench_decay_s, history_rows, push_basis, push_column, push_size, tables, out, first,
    last,
):  # fmt: skip
    """Whitened innovations of many parameter sets on one run, with the gains of one of them.

    Args:
        states0: (states, N) initial states.
        par: (parameters, N) records, the wrench last (zero).
        pace: (N,); delay: (N,); gain: (C, N); bias: (C, N): measurement, see ``ekf_run``.
        delay: see pace.
        gain: see pace.
        bias: see pace.
        clock: (T,) sample times.
        substeps: (T,).
        times: (m,) command times.
        values: (m, 5) commands.
        measured: (T, C).
        codes: (C,).
        k_in: (T, 19, C) gains.
        w_in: (T, C, C) whitening.
        wrench_decay_s: correlation time of the wrench.
        history_rows: room for late tail commands, 0 for none.
        push_basis: (T, J) functions of time that scale an extra wrench, or no rows.
        push_column: (N,) 6 * function + direction for each lane.
        push_size: (N,) N or N m; zero for none.
        tables: packed coefficient curves.
        out: (N, T, C) whitened innovations.
        first: first lane.
        last: one past the last.
    """
    for block in range(first, last, FILTER_LANES):
        filter_block(
            states0, par, pace, delay, gain, bias, clock, substeps, times, values, measured, codes,
            k_in, w_in, wrench_decay_s, history_rows, push_basis, push_column, push_size, tables,
            out, block, min(FILTER_LANES, last - block),
        )  # fmt: skip
    return 0

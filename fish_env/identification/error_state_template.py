"""Lanes of fish as the filter moves them: commands, steps, channels, small changes of the state.

Completed by :mod:`fish_env.model.compose` behind the rollout template; :mod:`filter_template`
builds on it. Error state, 19 numbers: position (3, inertial), small rotation (3, body), velocity
(3, body), angular velocity (3), wrench (6, body), tail phase. Loops over lanes are innermost, so
that the compiler takes them all at once.
"""

from __future__ import annotations

import numpy as np

from fish_env.identification.filter_algebra import BASE, PHASE, angle, innovation
from fish_env.identification.state_blocks import N_ERROR, PHASE_COLUMN, first_column

# --- completed by compose ---
from fish_env.model.composed import (
    ANGLE,
    DX,
    N_PARAMETERS,
    N_STATES,
    PAR,
    SUM,
    TAIL_RATES,
    TAIL_ROWS,
    TIME,
    U_RATE,
    X0,
    U,
    X,
    kernel,
    lane_initialise,
    rk4_step,
)
from fish_env.model.history import HEARD, RECORD

# --- end ---

WRENCH = PAR + N_PARAMETERS - 6
STATE, EULER, DRIVE = 0, 1, 2  # kinds of channels
RATE = 10  # first row of the angular velocity
ROTATION, RATES = first_column("rotation"), first_column("rate")
VELOCITIES = first_column("velocity")
BODY = 13  # rows of the state that channels of the body follow from: pose and velocities
MOUNT, MARKER, TILT, BENT, IRON = 0, 9, 12, 18, 20  # rows of a lens (see sensing.geometry)
PERTURB = 1e-5
DIVERGED = 1e4
MOST_SWING = 1.2  # swing of a soft tail over the told one, below its resonance
TOLD_PHASE = 1 + HEARD.index("phase")  # its row in a slot of a history
STEP_S = 0.01
SETTLING_STEPS = 100
SETTLING_S = STEP_S * SETTLING_STEPS
"""A tail that was beating before its run has done so for this long: what rings has died away."""


@kernel
def set_commands(work, width, times, values, at, start, length, skew, delay, shared):
    """Mean command over each lane's own interval on the commands' clock: switches act smoothly."""
    for k in range(1 if shared else width):
        begin = skew[k] * start - delay[k]
        end = begin + skew[k] * length
        row = at[k]
        while (row + 1 < times.shape[0]) and (times[row + 1] <= begin + 1e-9):
            row += 1
        at[k] = row
        last = row
        while (last + 1 < times.shape[0]) and (times[last + 1] < end - 1e-9):
            last += 1
        for j in range(5):
            total = values[row, j]
            if last > row:
                total = 0.0
                left = begin
                for i in range(row, last + 1):
                    right = times[i + 1] if i < last else end
                    total += (right - left) / (end - begin) * values[i, j]
                    left = right
            work[(U + j) * width + k] = total
    if shared:
        for j in range(5):
            for k in range(1, width):
                work[(U + j) * width + k] = work[(U + j) * width]


@kernel
def step_lanes_once(work, width, elapsed, h, pace, late, history, tables):
    """One RK4 step of every lane, kept where it stays finite."""
    for k in range(width):  # true time since the run began is `pace` times the recorded one
        work[TIME * width + k] = (pace[k] - 1.0) * elapsed
    rk4_step(work, width, elapsed, h, tables, late, history, 0, width, pace)
    for k in range(width):
        qw, qx = work[(X + 3) * width + k], work[(X + 4) * width + k]
        qy, qz = work[(X + 5) * width + k], work[(X + 6) * width + k]
        scale = 1.0 / np.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
        work[(X + 3) * width + k] = qw * scale
        work[(X + 4) * width + k] = qx * scale
        work[(X + 5) * width + k] = qy * scale
        work[(X + 6) * width + k] = qz * scale
    for n in range(BODY * width):  # what the step has changed, see keep_step
        work[SUM * width + n] = work[X * width + n] - work[X0 * width + n]
    for n in range(N_STATES * width):
        value = work[X * width + n]
        work[X0 * width + n] = value if abs(value) < DIVERGED else work[X0 * width + n]


@kernel
def keep_step(work, width, path, step):
    """Keep how the body's state changed in a step, and its slope at the end.

    Args:
        work: the lanes, just after the step.
        width: lanes.
        path: (steps, 26, width) what was kept of the steps of this interval, or no rows.
        step: number of the step.
    """
    if path.shape[0] > 0:
        for j in range(BODY):
            for k in range(width):
                path[step, j, k] = work[(SUM + j) * width + k]
                path[step, BODY + j, k] = work[(DX + j) * width + k]


@kernel
def put_earlier(work, width, age, h, steps, path):
    """Put the body's state ``age`` (width,) seconds before the end of an interval into the X rows.

    The steps of h seconds are gone back, the last one in part: to second order about its end, from
    its slope there and the change over it.
    """
    for k in range(width):
        left, step = age[k], steps - 1
        for j in range(BODY):
            work[(X + j) * width + k] = work[(X0 + j) * width + k]
        while (left > h) & (step > 0):
            for j in range(BODY):
                work[(X + j) * width + k] -= path[step, j, k]
            left -= h
            step -= 1
        for j in range(BODY):
            slope = path[step, BODY + j, k]
            bend = (slope * h - path[step, j, k]) * (2.0 / (h * h))
            work[(X + j) * width + k] -= left * (slope - 0.5 * left * bend)
        qw, qx = work[(X + 3) * width + k], work[(X + 4) * width + k]
        qy, qz = work[(X + 5) * width + k], work[(X + 6) * width + k]
        scale = 1.0 / np.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
        work[(X + 3) * width + k] = qw * scale
        work[(X + 4) * width + k] = qx * scale
        work[(X + 5) * width + k] = qy * scale
        work[(X + 6) * width + k] = qz * scale


@kernel
def room_for_path(ages, substeps):
    """Room for the steps of an interval where a device shows an earlier state; no rows else."""
    rows = 0
    for i in range(ages.shape[0]):
        for k in range(ages.shape[1]):
            if ages[i, k] != 0.0:
                rows = 1
    for sample in range(substeps.shape[0] if rows > 0 else 0):
        rows = max(rows, substeps[sample])
    return np.zeros((rows, 2 * BODY, ages.shape[1]))


@kernel
def turn_of(work, width, k, base):
    """Rotation matrix of a lane, body to inertial, row by row; its state begins at row ``base``."""
    qw = work[(base + 3) * width + k]
    qx = work[(base + 4) * width + k]
    qy = work[(base + 5) * width + k]
    qz = work[(base + 6) * width + k]
    return (
        (1.0 - 2.0 * (qy * qy + qz * qz), 2.0 * (qx * qy - qw * qz), 2.0 * (qx * qz + qw * qy)),
        (2.0 * (qx * qy + qw * qz), 1.0 - 2.0 * (qx * qx + qz * qz), 2.0 * (qy * qz - qw * qx)),
        (2.0 * (qx * qz - qw * qy), 2.0 * (qy * qz + qw * qx), 1.0 - 2.0 * (qx * qx + qy * qy)),
    )


@kernel
def mounted(row, lens, k, column):
    """An element of R M: a row of R times a column of the sensor's mounting M."""
    return (
        row[0] * lens[MOUNT + column, k]
        + row[1] * lens[MOUNT + 3 + column, k]
        + row[2] * lens[MOUNT + 6 + column, k]
    )


@kernel
def magnified(work, width, lens, k, base):
    """How large a camera shows horizontal distances at the depth of a lane."""
    depth = max(work[(base + 2) * width + k], 0.0)
    return lens[BENT + 1, k] / (1.0 + lens[BENT, k] * depth)


@kernel
def seen_place(work, width, lens, k, axis, base):
    """x or y of a lane's marker as a camera shows it (m)."""
    turn = turn_of(work, width, k, base)
    mx, my, mz = lens[MARKER, k], lens[MARKER + 1, k], lens[MARKER + 2, k]
    x = work[base * width + k] + (turn[0][0] * mx + turn[0][1] * my + turn[0][2] * mz)
    y = work[(base + 1) * width + k] + (turn[1][0] * mx + turn[1][1] * my + turn[1][2] * mz)
    z = work[(base + 2) * width + k] + (turn[2][0] * mx + turn[2][1] * my + turn[2][2] * mz)
    row = TILT + 3 * axis
    shown = lens[row, k] * x + lens[row + 1, k] * y + lens[row + 2, k] * z
    return shown * magnified(work, width, lens, k, base)


@kernel
def seen_rate(work, width, lens, k, axis, base):
    """Component of M^T omega of a lane (rad/s)."""
    return (
        lens[MOUNT + axis, k] * work[(base + RATE) * width + k]
        + lens[MOUNT + 3 + axis, k] * work[(base + RATE + 1) * width + k]
        + lens[MOUNT + 6 + axis, k] * work[(base + RATE + 2) * width + k]
    )


@kernel
def seen_angle(work, width, lens, k, index, base):
    """Roll, pitch or yaw of R M of a lane, the yaw bent by iron (rad)."""
    turn = turn_of(work, width, k, base)
    if index == 0:
        return angle(mounted(turn[2], lens, k, 1), mounted(turn[2], lens, k, 2))
    if index == 1:
        sine = min(max(-mounted(turn[2], lens, k, 0), -1.0), 1.0)
        return angle(sine, np.sqrt(1.0 - sine * sine))
    sine, cosine = mounted(turn[1], lens, k, 0), mounted(turn[0], lens, k, 0)
    scale = 1.0 / max(sine * sine + cosine * cosine, 1e-12)
    twice = lens[IRON, k] * (2.0 * sine * cosine)
    twice += lens[IRON + 1, k] * (cosine * cosine - sine * sine)
    return angle(sine, cosine) + scale * twice


@kernel
def innovations_of(work, width, measured, codes, gain, bias, ages, h, steps, path, lens, e):
    """Measured minus predicted channels of every lane, e (C, width).

    A channel's code is its kind, its index, its column and its device (see ``channels``). Each
    device shows the state of ``ages`` (devices, width) seconds ago, which the path of the last
    interval tells: so many steps of h seconds, none before the first sample.
    """
    aged, last = (path.shape[0] > 0) & (steps > 0), -1
    base = X if aged else X0
    for i in range(codes.shape[0]):
        kind, index, device = codes[i, 0], codes[i, 1], codes[i, 3]
        if aged & (device != last):
            put_earlier(work, width, ages[device], h, steps, path)
            last = device
        for k in range(width):
            if kind == EULER:
                shown = seen_angle(work, width, lens, k, index, base)
            elif kind == DRIVE:
                shown = work[ANGLE * width + k]
            elif index < 2:
                shown = seen_place(work, width, lens, k, index, base)
            elif index >= RATE:
                shown = seen_rate(work, width, lens, k, index - RATE, base)
            else:
                shown = work[(base + index) * width + k]
            predicted = gain[i, k] * shown + bias[i, k]
            e[i, k] = innovation(measured[i], predicted, (kind == EULER) & (index != 1))


@kernel
def turn_told(width, error, history):
    """Apply the error of the phase to all that a late tail was told and has yet to hear."""
    slots = (history.shape[0] - 1) // RECORD
    for slot in range(slots):
        row = 1 + RECORD * slot + TOLD_PHASE
        for k in range(width):
            history[row, k] += error[PHASE_COLUMN, k]


@kernel
def share_told(width, history):
    """Let all lanes have been told what the first one was."""
    for row in range(history.shape[0]):
        for k in range(1, width):
            history[row, k] = history[row, 0]


@kernel
def turn_tail(work, width, error, late, history):
    """Apply the error of the phase, to the phase and to what follows it.

    A tail that is late, bends or lags has been out of phase all along, so its states are where they
    would be that much later in the beat. Else the phase would seem to act only once they have
    followed, and would be corrected twice. They move no further with the phase than a beat of the
    told amplitude does: after a jump of the command they move fast, and not with the phase.
    """
    if late:
        turn_told(width, error, history)
    for j in range(TAIL_ROWS.shape[0]):
        row = TAIL_ROWS[j]
        for k in range(width):
            turning = work[(DX + PHASE) * width + k]
            if (turning > 0.0) & (error[PHASE_COLUMN, k] != 0.0):
                most = MOST_SWING * work[(U + 1) * width + k]
                most *= turning if TAIL_RATES[j] else 1.0
                per_phase = min(max(work[(DX + row) * width + k] / turning, -most), most)
                work[(X0 + row) * width + k] += per_phase * error[PHASE_COLUMN, k]
    for k in range(width):
        work[(X0 + PHASE) * width + k] += error[PHASE_COLUMN, k]


@kernel
def move(work, width, error, late, history):
    """Apply error states (19, width) to all lanes, and to what late tails (see history) heard."""
    for j in range(3):
        for k in range(width):
            work[(X0 + j) * width + k] += error[j, k]
    for k in range(width):
        ax, ay, az = 0.5 * error[3, k], 0.5 * error[4, k], 0.5 * error[5, k]
        qw = work[(X0 + 3) * width + k]
        qx = work[(X0 + 4) * width + k]
        qy = work[(X0 + 5) * width + k]
        qz = work[(X0 + 6) * width + k]
        nw = qw - qx * ax - qy * ay - qz * az
        nx = qx + qw * ax + qy * az - qz * ay
        ny = qy + qw * ay + qz * ax - qx * az
        nz = qz + qw * az + qx * ay - qy * ax
        scale = 1.0 / np.sqrt(nw * nw + nx * nx + ny * ny + nz * nz)
        work[(X0 + 3) * width + k] = nw * scale
        work[(X0 + 4) * width + k] = nx * scale
        work[(X0 + 5) * width + k] = ny * scale
        work[(X0 + 6) * width + k] = nz * scale
    for j in range(6):
        for k in range(width):
            work[(X0 + 7 + j) * width + k] += error[6 + j, k]
            work[(WRENCH + j) * width + k] += error[12 + j, k]
    turn_tail(work, width, error, late, history)


@kernel
def difference(work, width, into):
    """Moving part of the error state of every lane relative to lane 0, (12, width)."""
    for j in range(3):
        for k in range(width):
            into[j, k] = work[(X0 + j) * width + k] - work[(X0 + j) * width]
            into[6 + j, k] = work[(X0 + 7 + j) * width + k] - work[(X0 + 7 + j) * width]
            into[9 + j, k] = work[(X0 + 10 + j) * width + k] - work[(X0 + 10 + j) * width]
    aw = work[(X0 + 3) * width]
    ax = -work[(X0 + 4) * width]
    ay = -work[(X0 + 5) * width]
    az = -work[(X0 + 6) * width]
    for k in range(width):
        bw = work[(X0 + 3) * width + k]
        bx = work[(X0 + 4) * width + k]
        by = work[(X0 + 5) * width + k]
        bz = work[(X0 + 6) * width + k]
        sign = 2.0 if aw * bw - ax * bx - ay * by - az * bz > 0.0 else -2.0
        into[3, k] = sign * (aw * bx + ax * bw + ay * bz - az * by)
        into[4, k] = sign * (aw * by + ay * bw + az * bx - ax * bz)
        into[5, k] = sign * (aw * bz + az * bw + ax * by - ay * bx)


@kernel
def place_row(work, width, lens, size, axis, base, row):
    """d(x or y as shown)/d(error state) of lane 0; the camera's scale is taken for constant."""
    turn = turn_of(work, width, 0, base)
    m = (lens[MARKER, 0], lens[MARKER + 1, 0], lens[MARKER + 2, 0])
    for j in range(3):
        part = size * magnified(work, width, lens, 0, base) * lens[TILT + 3 * axis + j, 0]
        row[j] += part
        # A small rotation a of the body moves its marker by R (a x m).
        row[ROTATION] += part * (turn[j][2] * m[1] - turn[j][1] * m[2])
        row[ROTATION + 1] += part * (turn[j][0] * m[2] - turn[j][2] * m[0])
        row[ROTATION + 2] += part * (turn[j][1] * m[0] - turn[j][0] * m[1])


@kernel
def angle_row(work, width, lens, size, index, base, row):
    """d(roll, pitch or yaw as shown)/d(error state) of lane 0."""
    turn = turn_of(work, width, 0, base)
    zx, zy = mounted(turn[2], lens, 0, 0), mounted(turn[2], lens, 0, 1)
    zz = mounted(turn[2], lens, 0, 2)
    cosine = np.sqrt(max(1.0 - zx * zx, 1e-6))
    sin_roll, cos_roll, tan_pitch = zy / cosine, zz / cosine, -zx / cosine
    if index == 0:
        own = (size, size * sin_roll * tan_pitch, size * cos_roll * tan_pitch)
    elif index == 1:
        own = (0.0, size * cos_roll, -size * sin_roll)
    else:
        xx, yx = mounted(turn[0], lens, 0, 0), mounted(turn[1], lens, 0, 0)
        level = 1.0 / max(xx * xx + yx * yx, 1e-12)
        twice = lens[IRON, 0] * (xx * xx - yx * yx) - lens[IRON + 1, 0] * (2.0 * xx * yx)
        bent = size * (1.0 + 2.0 * level * twice)
        own = (0.0, bent * sin_roll / cosine, bent * cos_roll / cosine)
    for j in range(3):  # the sensor turns with the body: a' = M^T a
        for axis in range(3):
            row[ROTATION + j] += lens[MOUNT + 3 * j + axis, 0] * own[axis]


@kernel
def carry_back(work, width, age, base, row):
    """Let a row, taken at a state some time ago, tell the error of the state now.

    Seen from now, a place and an attitude were earlier by the age times the velocities.
    """
    turn = turn_of(work, width, 0, base)
    for j in range(3):
        row[RATES + j] -= age * row[ROTATION + j]
        for i in range(3):
            row[VELOCITIES + j] -= age * row[i] * turn[i][j]


@kernel
def observation_rows(work, width, codes, gain, ages, h, steps, path, lens, measured, rows):
    """d(channel)/d(error state) of lane 0, (C, 19); zero for a missing sample.

    What drives the fish shows its phase alone. That stays as it is over an interval, so the lane
    that began with another phase shows the slope, that of what follows the phase included.
    """
    aged, last = (path.shape[0] > 0) & (steps > 0), -1
    base = X if aged else X0
    for i in range(codes.shape[0]):
        for j in range(N_ERROR):
            rows[i, j] = 0.0
        kind, index, column, device = codes[i, 0], codes[i, 1], codes[i, 2], codes[i, 3]
        if aged & (device != last):
            put_earlier(work, width, ages[device], h, steps, path)
            last = device
        size = gain[i] if measured[i] == measured[i] else 0.0
        if kind == DRIVE:
            gap = work[ANGLE * width + column + 1] - work[ANGLE * width]
            rows[i, column] = size * gap * (1.0 / PERTURB)
        elif kind == EULER:
            angle_row(work, width, lens, size, index, base, rows[i])
        elif index < 2:
            place_row(work, width, lens, size, index, base, rows[i])
        elif index >= RATE:
            for j in range(3):
                rows[i, RATES + j] = size * lens[MOUNT + 3 * j + index - RATE, 0]
        else:
            rows[i, column] = size
        if aged & (kind != DRIVE):
            carry_back(work, width, ages[device, 0], base, rows[i])


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
def initialise_effects(work, width):
    """Effect states at rest (they live in the X rows)."""
    for n in range(N_STATES * width):
        work[X * width + n] = work[X0 * width + n]
    for k in range(width):
        lane_initialise(k, width, work)
    for n in range(N_STATES * width):
        work[X0 * width + n] = work[X * width + n]


@kernel
def start_effects(work, width, begin, swimming, pace, late, history, tables):
    """Effect states where the start of a run leaves them, or where beating before it has."""
    initialise_effects(work, width)
    if swimming & (TAIL_ROWS.shape[0] > 0):
        base = work[X0 * width : (X0 + BASE) * width].copy()
        step_lanes_once(work, width, begin, STEP_S, pace, late, history, tables)
        for n in range(BASE * width):
            work[X0 * width + n] = base[n]
        for k in range(width):  # as much earlier as the beat is going to last
            work[(X0 + PHASE) * width + k] -= SETTLING_S * work[(DX + PHASE) * width + k]
        initialise_effects(work, width)
        for i in range(SETTLING_STEPS):
            earlier = begin - SETTLING_S + i * STEP_S
            step_lanes_once(work, width, earlier, STEP_S, pace, late, history, tables)
        for n in range(BASE * width):
            work[X0 * width + n] = base[n]

"""What sensors show of lanes of fish: channels of the state now or earlier, and their slopes.

Completed by :mod:`fish_env.model.compose` behind the rollout template; :mod:`error_state_template`
and :mod:`filter_template` build on it. Loops over lanes are innermost, so that the compiler takes
them all at once.
"""

from __future__ import annotations

import numpy as np

from fish_env.identification.filter_algebra import angle, innovation
from fish_env.identification.state_blocks import N_ERROR, first_column

# --- completed by compose ---
from fish_env.model.composed import ANGLE, DX, SUM, X0, X, kernel

# --- end ---

STATE, EULER, DRIVE = 0, 1, 2  # kinds of channels
RATE = 10  # first row of the angular velocity
ROTATION, RATES = first_column("rotation"), first_column("rate")
VELOCITIES = first_column("velocity")
BODY = 13  # rows of the state that channels of the body follow from: pose and velocities
MOUNT, MARKER, TILT, BENT, IRON = 0, 9, 12, 18, 20  # rows of a lens (see sensing.geometry)
LEFT, PART = SUM, SUM + 1
PERTURB = 1e-5  # of each error state for its slopes, but of the phase, see slopes_of_interval
TURN = 0.05  # of the phase to either side (rad): about what it is uncertain by


@kernel
def normalise(work, width, lanes):
    """Make the quaternions of these lanes' X rows unit ones."""
    for k in range(lanes):
        qw, qx = work[(X + 3) * width + k], work[(X + 4) * width + k]
        qy, qz = work[(X + 5) * width + k], work[(X + 6) * width + k]
        scale = 1.0 / np.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
        work[(X + 3) * width + k] = qw * scale
        work[(X + 4) * width + k] = qx * scale
        work[(X + 5) * width + k] = qy * scale
        work[(X + 6) * width + k] = qz * scale


@kernel
def begin_step(work, width, lanes, path, step):
    """Note the body's state before a step; arguments as of :func:`keep_step`."""
    if path.shape[0] > 0:
        for j in range(BODY):
            for k in range(lanes):
                path[step, j, k] = work[(X0 + j) * width + k]


@kernel
def keep_step(work, width, lanes, pace, path, step):
    """Keep how the body's state changed in a step, and its slope at the end.

    Args:
        work: all lanes, just after the step.
        width: how many these are.
        lanes: how many of them to keep.
        pace: (width,) true seconds per recorded second.
        path: (steps, 26, width) what was kept of the steps of this interval, or no rows.
        step: number of the step.
    """
    if path.shape[0] > 0:
        for j in range(BODY):
            for k in range(lanes):
                path[step, j, k] = work[(X0 + j) * width + k] - path[step, j, k]
                path[step, BODY + j, k] = pace[k] * work[(DX + j) * width + k]


@kernel
def put_earlier(work, width, lanes, age, h, steps, path):
    """Put the body's state ``age`` (width,) seconds before the end of an interval into the X rows.

    The steps of h seconds are gone back, the last one in part: to second order about its end, from
    its slope there and the change over it. All of a step is then just that change. Two of the SUM
    rows, which are free after a step, hold what time is left and the part of it in this step.
    """
    for k in range(lanes):
        work[LEFT * width + k] = age[k]
    for j in range(BODY):
        for k in range(lanes):
            work[(X + j) * width + k] = work[(X0 + j) * width + k]
    step, on = steps - 1, True
    while on:
        on = False
        for k in range(lanes):
            left = work[LEFT * width + k]
            part = min(left, h) if step > 0 else left
            work[PART * width + k] = part
            work[LEFT * width + k] = left - part
            on |= left > part
        for j in range(BODY):
            for k in range(lanes):
                part, slope = work[PART * width + k], path[step, BODY + j, k]
                bend = (slope * h - path[step, j, k]) * (2.0 / (h * h))
                work[(X + j) * width + k] -= part * (slope - 0.5 * part * bend)
        step -= 1
    normalise(work, width, lanes)


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
def seen_roll(work, width, lens, k, base):
    """Roll of R M of a lane (rad)."""
    turn = turn_of(work, width, k, base)
    return angle(mounted(turn[2], lens, k, 1), mounted(turn[2], lens, k, 2))


@kernel
def seen_pitch(work, width, lens, k, base):
    """Pitch of R M of a lane (rad)."""
    turn = turn_of(work, width, k, base)
    sine = min(max(-mounted(turn[2], lens, k, 0), -1.0), 1.0)
    return angle(sine, np.sqrt(1.0 - sine * sine))


@kernel
def seen_yaw(work, width, lens, k, base):
    """Yaw of R M of a lane, bent by iron (rad)."""
    turn = turn_of(work, width, k, base)
    sine, cosine = mounted(turn[1], lens, k, 0), mounted(turn[0], lens, k, 0)
    scale = 1.0 / max(sine * sine + cosine * cosine, 1e-12)
    twice = lens[IRON, k] * (2.0 * sine * cosine)
    twice += lens[IRON + 1, k] * (cosine * cosine - sine * sine)
    return angle(sine, cosine) + scale * twice


@kernel
def show(work, width, lanes, kind, index, base, lens, shown):
    """What a channel of these lanes shows of the state in the rows from ``base``, (width,).

    A loop of its own for each kind: in one for all, every lane would compute every kind.
    """
    if kind == DRIVE:
        for k in range(lanes):
            shown[k] = work[ANGLE * width + k]
    elif kind == EULER:
        if index == 0:
            for k in range(lanes):
                shown[k] = seen_roll(work, width, lens, k, base)
        elif index == 1:
            for k in range(lanes):
                shown[k] = seen_pitch(work, width, lens, k, base)
        else:
            for k in range(lanes):
                shown[k] = seen_yaw(work, width, lens, k, base)
    elif index < 2:
        for k in range(lanes):
            shown[k] = seen_place(work, width, lens, k, index, base)
    elif index >= RATE:
        for k in range(lanes):
            shown[k] = seen_rate(work, width, lens, k, index - RATE, base)
    else:
        for k in range(lanes):
            shown[k] = work[(base + index) * width + k]


@kernel
def innovations_of(work, width, lanes, measured, codes, gain, bias, ages, h, steps, path, lens, e):
    """Measured minus predicted channels of these lanes, e (C, width).

    A channel's code is its kind, its index, its column and its device (see ``channels``). Each
    device shows the state of ``ages`` (devices, width) seconds ago, which the path of the last
    interval tells: so many steps of h seconds, none before the first sample.
    """
    aged, last = (path.shape[0] > 0) & (steps > 0), -1
    base = X if aged else X0
    for i in range(codes.shape[0]):
        kind, index, device = codes[i, 0], codes[i, 1], codes[i, 3]
        if aged & (device != last):
            put_earlier(work, width, lanes, ages[device], h, steps, path)
            last = device
        show(work, width, lanes, kind, index, base, lens, e[i])
        turns = (kind == EULER) & (index != 1)
        for k in range(lanes):
            e[i, k] = innovation(measured[i], gain[i, k] * e[i, k] + bias[i, k], turns)


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

    What drives the fish shows its phase alone. That stays as it is over an interval, so the lanes
    that began with another phase show the slope, that of what follows the phase included.
    """
    aged, last = (path.shape[0] > 0) & (steps > 0), -1
    base = X if aged else X0
    for i in range(codes.shape[0]):
        for j in range(N_ERROR):
            rows[i, j] = 0.0
        kind, index, column, device = codes[i, 0], codes[i, 1], codes[i, 2], codes[i, 3]
        if aged & (device != last):
            put_earlier(work, width, 1, ages[device], h, steps, path)
            last = device
        size = gain[i] if measured[i] == measured[i] else 0.0
        if kind == DRIVE:
            gap = work[ANGLE * width + column + 1] - work[ANGLE * width + N_ERROR + 1]
            rows[i, column] = size * gap * (0.5 / TURN)
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

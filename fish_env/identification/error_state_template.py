"""Lanes of fish as the filter moves them: commands, steps, small changes of the state.

Completed by :mod:`fish_env.model.compose` behind the rollout and observation templates;
:mod:`filter_template` builds on it. Error state, 19 numbers: position (3, inertial), small
rotation (3, body), velocity (3, body), angular velocity (3), wrench (6, body), tail phase. Loops
over lanes are innermost, so that the compiler takes them all at once.
"""

from __future__ import annotations

import numpy as np

from fish_env.identification.filter_algebra import BASE, PHASE
from fish_env.identification.state_blocks import N_ERROR, PHASE_COLUMN
from fish_env.identification.vectors import lanes_at_once

# --- completed by compose ---
from fish_env.model.composed import (
    BEGUN,
    DX,
    FAILED,
    N_PARAMETERS,
    N_STATES,
    NEXT,
    PAR,
    SWITCH,
    TAIL_CORNERS,
    TAIL_MEMORIES,
    TAIL_RATES,
    TAIL_ROWS,
    TIME,
    TURN,
    U_RATE,
    X0,
    U,
    X,
    kernel,
    lane_initialise,
    past_matters,
    prepare_parts,
    shared_kernel,
    step_in_parts,
    switch_effects,
)
from fish_env.model.history import HEARD, RECORD

# --- end ---

BLOCK = 24  # lanes: a fish's coefficients, an effect or two; 20 states; whole vector registers
VECTOR = lanes_at_once()  # more lanes are computed in whole vectors
WRENCH = PAR + N_PARAMETERS - 6
MOST_SWING = 1.2  # swing of a soft tail over the told one, below its resonance
TOLD_PHASE = 1 + HEARD.index("phase")  # its row in a slot of a history
STEP_S = 0.005
SETTLING_STEPS = 200
SETTLING_S = STEP_S * SETTLING_STEPS
"""A tail that was beating before its run has done so for this long: what rings has died away. Steps
are as long as those of motion with corners: a lag that these follow diverges in longer ones."""


@kernel
def set_commands(work, width, times, values, at, start, length, pace, skew, delay, shared):
    """Commands of each lane in a step, and when in it they switch, on the commands' clock.

    Args:
        work: all lanes.
        width: how many.
        times: (m,) command times (s).
        values: (m, 5) commands.
        at: (width,) which command holds at the last step, updated.
        start: when the step begins (s).
        length: of the step (s).
        pace: (width,) true seconds per recorded second.
        skew: (width,) seconds of the commands' clock per recorded second.
        delay: (width,) what the commands' clock is behind (s).
        shared: whether these are the same for all lanes.
    """
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
        switch = (times[row + 1] - begin) / skew[k] if last > row else np.inf
        changed = False
        for j in range(5):
            after = values[last, j]
            if last > row + 1:  # their mean, behind the first of several switches
                after = 0.0
                for i in range(row + 1, last + 1):
                    right = times[i + 1] if i < last else end
                    after += (right - times[i]) / (end - times[row + 1]) * values[i, j]
            work[(U + j) * width + k] = values[row, j]
            work[(NEXT + j) * width + k] = after
            changed |= after != values[row, j]
        work[SWITCH * width + k] = switch if changed else np.inf
    for k in range(1, width if shared else 1):
        for j in range(5):
            work[(U + j) * width + k] = work[(U + j) * width]
            work[(NEXT + j) * width + k] = work[(NEXT + j) * width]
        work[SWITCH * width + k] = work[SWITCH * width]
    for k in range(width):
        work[SWITCH * width + k] *= pace[k]


@shared_kernel
def step_lanes_once(work, elapsed, h, pace, late, history, tables):
    """One step of every lane, of h seconds by the clock of the record.

    A lane that diverges stays where it is for the rest of the step.
    """
    width = BLOCK
    for k in range(pace.shape[0]):  # true time since the run began is `pace` times the recorded one
        work[TIME * width + k] = (pace[k] - 1.0) * elapsed
        work[FAILED * width + k] = np.inf
    step_in_parts(work, width, elapsed, h, tables, late, history, 0, width, pace)


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
def turn_memories(work, width, error):
    """Apply the error of the phase to what a tail with corners remembers of itself.

    It is where it would be that much later in the beat. Were it left behind, it would have to catch
    up with its command at every sample, at its largest rate.
    """
    for j in range(TAIL_MEMORIES.shape[0]):
        angle = X0 + TAIL_MEMORIES[j]
        rate, acceleration = angle + 1, angle + 2
        for k in range(width):
            turning = work[(DX + PHASE) * width + k]
            if (turning > 0.0) & (error[PHASE_COLUMN, k] != 0.0):
                later = error[PHASE_COLUMN, k] / turning
                most = MOST_SWING * work[(U + 1) * width + k] * turning
                speed = min(max(work[rate * width + k], -most), most)
                bent = min(max(work[acceleration * width + k], -most * turning), most * turning)
                work[angle * width + k] += later * (speed + 0.5 * later * bent)
                work[rate * width + k] += later * bent


@kernel
def secants_of_phase(work, width, per_phase):
    """What the tail states of lane 0 change with its phase (F,); zero of those with corners.

    By the lanes that began with another phase, in what they were last time and since: so it is what
    they change with all of the phase's past. Their rate in time does not tell it once a command has
    jumped.
    """
    for j in range(TAIL_ROWS.shape[0]):
        row = (X0 + TAIL_ROWS[j]) * width
        apart = work[row + PHASE_COLUMN + 1] - work[row + N_ERROR + 1]
        per_phase[j] = 0.0 if TAIL_CORNERS[j] else apart * (0.5 / TURN)


@kernel
def turn_tail(work, width, error, per_phase, late, history):
    """Apply the error of the phase, to the phase and to what follows it.

    A tail that is late, bends or lags has been out of phase all along, so its states change with
    it, as far as that is known (F,). Else they are where they would be that much later in the beat,
    and move no further with the phase than a beat of the told amplitude does. Were they left where
    they are, the phase would seem to act only once they have followed, and be corrected twice.
    """
    if late:
        turn_told(width, error, history)
    for j in range(TAIL_ROWS.shape[0]):
        row = TAIL_ROWS[j]
        known = per_phase[j] if per_phase.shape[0] > 0 else 0.0
        for k in range(width):
            turning = work[(DX + PHASE) * width + k]
            most = MOST_SWING * work[(U + 1) * width + k]
            most *= turning if TAIL_RATES[j] else 1.0
            gone = work[(DX + row) * width + k] / (turning if turning > 0.0 else 1.0)
            own = min(max(gone, -most), most) if turning > 0.0 else 0.0
            moved = (known if known != 0.0 else own) * error[PHASE_COLUMN, k]
            work[(X0 + row) * width + k] += moved
    turn_memories(work, width, error)
    for k in range(width):
        work[(X0 + PHASE) * width + k] += error[PHASE_COLUMN, k]


@kernel
def move(work, width, error, per_phase, late, history):
    """Apply error states (19, width) to all lanes, and to what late tails (see history) heard.

    ``per_phase`` (F,) is what the tail's states change with its phase, zero where that is unknown.
    """
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
    turn_tail(work, width, error, per_phase, late, history)


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


@shared_kernel
def initialise_effects(work):
    """Effect states at rest (they live in the X rows)."""
    width = BLOCK
    for k in range(width):
        work[BEGUN * width + k] = 0.0
    for n in range(N_STATES * width):
        work[X * width + n] = work[X0 * width + n]
    for k in range(width):
        lane_initialise(k, width, work)
    for n in range(N_STATES * width):
        work[X0 * width + n] = work[X * width + n]


@kernel
def whole_vectors(lanes, width):
    """So many lanes, and those that are computed together with them."""
    return min(width, VECTOR * ((lanes + VECTOR - 1) // VECTOR))


@kernel
def start_effects(work, lanes, width, begin, swimming, pace, late, history, tables):
    """Which effects are on, and their states where the start of a run or beating before it has.

    Only so many lanes will move; the others stay where they are.
    """
    switch_effects(whole_vectors(lanes, width), width, work)
    prepare_parts(work, width)
    initialise_effects(work)
    if swimming & past_matters(width, work):
        base = work[X0 * width : (X0 + BASE) * width].copy()
        step_lanes_once(work, begin, STEP_S, pace, late, history, tables)
        for n in range(BASE * width):
            work[X0 * width + n] = base[n]
        for k in range(width):  # as much earlier as the beat is going to last
            work[(X0 + PHASE) * width + k] -= SETTLING_S * pace[k] * work[(DX + PHASE) * width + k]
        initialise_effects(work)
        for i in range(SETTLING_STEPS):
            earlier = begin - SETTLING_S + i * STEP_S
            step_lanes_once(work, earlier, STEP_S, pace, late, history, tables)
        for n in range(BASE * width):
            work[X0 * width + n] = base[n]

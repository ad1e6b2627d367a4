"""Entry points of the compiled physics: RK4 rollouts, derivatives and wrenches by term.

:mod:`fish_env.model.compose` completes this text with the composed ``lane_derivative`` and
``lane_terms`` and compiles the result; it is never run as it stands. Numbers of one block of fish
lie in one flat work array, row by row, ``width`` lanes a row: the compiler then sees that no two
rows overlap and computes all lanes at once.
"""

from __future__ import annotations

import numpy as np

# --- completed by compose ---
from fish_env.model.composed import (
    LATE_TAIL,
    N_KEPT,
    N_MEMORY,
    N_PARAMETERS,
    N_STATES,
    OWN_STEPS,
    SWITCHES,
    derive_lanes,
    lane_command,
    lane_corner,
    lane_derivative,
    lane_initialise,
    lane_remember,
    lane_terms,
    lanes_in,
    memory_matters,
    prepare_parts,
    step_in_parts,
    switch_effects,
)
from fish_env.model.history import HEARD, RECORD, assume_running, remember
from fish_env.model.jit import entry_point, kernel, lean_entry_point

# --- end ---

LANES = 16
N_SLOPES = N_STATES - N_MEMORY  # rows that are integrated; the others are memory of effects
X0 = 0
X = X0 + N_STATES
DX = X + N_STATES
SUM = DX + N_STATES
SCALE, SIZE, TAKEN = SUM, SUM + 1, SUM + 2
U = SUM + N_STATES
U_RATE = U + 5
U_END = U_RATE + 5
SLEW = U_END + 5
TARGET = SLEW + 5
FAILED = TARGET + 5  # time at which a lane diverged (s), infinite where it has not
TIME = FAILED + 1
ANGLE = TIME + 1  # the tail's angle as last evaluated (rad)
BEGIN = ANGLE + 1  # time at which a step begins (s), then the tail's command (see model.history)
TOLD = BEGIN + LATE_TAIL
PAST = TOLD + LATE_TAIL * RECORD
PAST_END = PAST + LATE_TAIL * len(HEARD)
STEP = PAST_END + LATE_TAIL * len(HEARD)  # of a lane with its own steps: the length of one (s),
BEGUN = STEP + OWN_STEPS  # how much of it has been done (s),
LENGTH = BEGUN + OWN_STEPS  # the length of its present part (s),
CORNER = LENGTH + OWN_STEPS  # when in it the tail's rate jumps (s),
TURNS = CORNER + OWN_STEPS  # and whether it may jump at all
SWITCH = (
    TURNS + OWN_STEPS
)  # when in its step a lane's commands switch (s), infinite if they do not,
NEXT = SWITCH + SWITCHES  # and to what
KEPT = NEXT + 5 * SWITCHES  # what is on, and what effects hand on (see model.emit_blocks)
PAR = KEPT + N_KEPT
WORK_ROWS = PAR + N_PARAMETERS
LARGEST = 1e4  # a state beyond this many SI units has diverged
MOMENT = 1e-6  # s; how a tail goes on is how it is for this long


@kernel
def gather(work, width, row, rows, source, first, count):
    """Copy rows of lanes first..first+count into the block; spare lanes repeat the last one.

    A slice of each row, not its index: indices that might be negative are not vectorised.
    """
    for i in range(rows):
        lanes = source[i, first : first + count]
        if count == width:
            for k in range(width):
                work[(row + i) * width + k] = lanes[k]
        else:
            for k in range(width):
                work[(row + i) * width + k] = lanes[min(k, count - 1)]


@kernel
def scatter(work, width, row, rows, target, first, count):
    """Copy rows of the block back."""
    for i in range(rows):
        lanes = target[i, first : first + count]
        for k in range(count):
            lanes[k] = work[(row + i) * width + k]


@kernel
def gather_targets(work, width, commands, slot, first, count):
    """Copy the targets that hold in a segment into the block."""
    shared = commands.shape[2] == 1
    for j in range(5):
        for k in range(width):
            lane = 0 if shared else first + min(k, count - 1)
            work[(TARGET + j) * width + k] = commands[slot, j, lane]


@kernel
def plan_actuators(work, width, h):
    """Where each actuator goes in this step: at once if its slew limit is infinite."""
    per_second = 1.0 / h
    for n in range(5 * width):
        target = work[TARGET * width + n]
        slew = work[SLEW * width + n]
        position = work[U * width + n]
        ideal = slew == np.inf
        limit = slew * h
        gap = target - position
        move = min(max(gap, -limit), limit)
        end = target if abs(gap) <= limit else position + move
        work[U * width + n] = target if ideal else position
        work[U_RATE * width + n] = 0.0 if ideal else move * per_second
        work[U_END * width + n] = end


@kernel
def tell_tail(work, width, elapsed, history, first, count):
    """Remember what each tail is told from now on, at the start of a step or of a part of one."""
    for k in range(width):
        work[BEGIN * width + k] = work[TIME * width + k] + elapsed + work[BEGUN * width + k]
        lane_command(k, width, elapsed, work)
    remember(work, width, TOLD, BEGIN, history, first, count)
    for k in range(width):
        work[BEGIN * width + k] = work[TIME * width + k] + elapsed


@kernel
def rk4_step(work, width, elapsed, h, tables, count):
    """One classical Runge-Kutta step of every lane: X0 -> X. Memory follows from where it ends.

    For tails whose commands are not late; lanes of others have their own steps.
    """
    for n in range(N_STATES * width):
        work[X * width + n] = work[X0 * width + n]
    for n in range(N_SLOPES * width):
        work[SUM * width + n] = 0.0
    for stage in range(4):
        fraction = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        weight = 1.0 if (stage == 0) | (stage == 3) else 2.0
        ahead = 0.5 * h if stage < 2 else h
        derive_lanes(width, elapsed, fraction, h, work, tables)
        if stage < 3:
            for n in range(N_SLOPES * width):
                slope = work[DX * width + n]
                work[SUM * width + n] += weight * slope
                work[X * width + n] = work[X0 * width + n] + ahead * slope
        else:
            for n in range(N_SLOPES * width):
                total = work[SUM * width + n] + work[DX * width + n]
                work[X * width + n] = work[X0 * width + n] + (h / 6.0) * total
    if N_MEMORY > 0 and memory_matters(width, work):
        # Not over the width: a loop of known length would be unrolled instead of vectorised.
        for k in range(count):
            lane_remember(k, width, elapsed, h, work)


@kernel
def accept_states(work, width, elapsed):
    """Normalise the quaternion; a lane that diverged stays at its last good state for good.

    Row by row, so that it runs in vector registers however many rows there are. The rows of SUM,
    which are free by now, hold each lane's scale, its size, and whether its state is taken on.
    """
    for k in range(width):
        norm = 0.0
        for j in range(3, 7):
            component = work[(X + j) * width + k]
            norm += component * component
        work[SCALE * width + k] = 1.0 / np.sqrt(norm)
        work[SIZE * width + k] = 0.0
    for j in range(N_STATES):
        bounded = (j < 13) | ((j >= 18) & (j < N_SLOPES))
        for k in range(width):
            value = work[(X + j) * width + k]
            work[SIZE * width + k] += abs(value) if bounded else 0.0 * value
    for k in range(width):
        moved = work[LENGTH * width + k] > 0.0 if OWN_STEPS else True
        failed = work[FAILED * width + k]
        good = (work[SIZE * width + k] < LARGEST) & (failed == np.inf)
        now = work[TIME * width + k] + elapsed
        work[FAILED * width + k] = min(failed, now) if moved & (not good) else failed
        work[TAKEN * width + k] = 1.0 if good & moved else 0.0
    if SWITCHES:  # in blocks, whose rows are many: nearly always all lanes are taken
        every = True
        for k in range(lanes_in(width, work)):
            every &= work[TAKEN * width + k] > 0.0
        if every:
            for j in range(3, 7):
                for k in range(width):
                    work[(X + j) * width + k] *= work[SCALE * width + k]
            for n in range(N_STATES * width):
                work[X0 * width + n] = work[X * width + n]
            return
    for j in range(N_STATES):
        turned = (j >= 3) & (j < 7)
        for k in range(width):
            value = work[(X + j) * width + k]
            value = value * work[SCALE * width + k] if turned else value
            taken = work[TAKEN * width + k] > 0.0
            work[(X0 + j) * width + k] = value if taken else work[(X0 + j) * width + k]


@kernel
def accept_actuators(work, width):
    """Leave the actuators where they are at the end of a step."""
    for n in range(5 * width):
        work[U * width + n] = work[U_END * width + n]


@kernel
def advance_block(
    work, width, state, inputs, par, slew, time, commands, turn, slots, starts, steps, sizes,
    every, trace_row, trace_at, trace, failed_at, history, tables, first, count,
):  # fmt: skip
    """Advance lanes first..first+count through all segments (see :func:`advance_lanes`).

    Slots are counted from ``turn``, around the end of ``commands``.
    """
    gather(work, width, X0, N_STATES, state, first, count)
    gather(work, width, U, 5, inputs, first, count)
    gather(work, width, SLEW, 5, slew, first, count)
    gather(work, width, PAR, N_PARAMETERS, par, first, count)
    switch_effects(width, width, work)
    for k in range(width):
        lane = first + min(k, count - 1)
        work[TIME * width + k] = time[lane]
        work[FAILED * width + k] = failed_at[lane]
    late = LATE_TAIL & (history.shape[0] > 0)
    same_pace = work[:0]
    if OWN_STEPS:
        prepare_parts(work, width)
    stored = trace_at
    for segment in range(steps.shape[0]):
        h = sizes[segment]
        slot = (slots[segment] + turn) % commands.shape[0]
        gather_targets(work, width, commands, slot, first, count)
        for i in range(steps[segment]):
            elapsed = starts[segment] + i * h
            plan_actuators(work, width, h)
            if OWN_STEPS:
                step_in_parts(
                    work, width, elapsed, h, tables, late, history, first, count, same_pace
                )  # fmt: skip
            else:
                rk4_step(work, width, elapsed, h, tables, count)
                accept_states(work, width, elapsed + h)
            accept_actuators(work, width)
            if (trace.shape[0] > 0) & ((i + 1) % every[segment] == 0):
                sample = stored % trace.shape[0]
                for j in range(trace.shape[1]):
                    for k in range(count):
                        trace[sample, j, first + k] = work[(X0 + trace_row + j) * width + k]
                stored += 1
    scatter(work, width, X0, N_STATES, state, first, count)
    scatter(work, width, U, 5, inputs, first, count)
    for k in range(count):
        failed_at[first + k] = work[FAILED * width + k]


@lean_entry_point
def advance_lanes(
    state, inputs, par, slew, time, commands, slots, starts, steps, sizes, every, trace_row,
    trace_at, trace, failed_at, history, tables, first, last, work,
):  # fmt: skip
    """Advance fish first..last in place, sixteen at a time.

    Args:
        state: (states, N). Rows as :data:`fish_env.model.state.BASE_STATES`, then effect states.
        inputs: (5, N) actuator positions, in place.
        par: (parameters, N) records.
        slew: (5, N) slew limits (per second); infinite = ideal actuator.
        time: (N,) time at the start (s).
        commands: (slots, 5, N or 1) targets.
        slots: (segments,) which targets hold in each segment.
        starts: (segments,) time since the start at which each segment begins (s).
        steps: (segments,) physics steps in each segment.
        sizes: (segments,) step size of each segment (s).
        every: (segments,) store into ``trace`` after every this many steps of the segment.
        trace_row: first state row that is stored.
        trace_at: slot of the first stored sample; slots wrap around.
        trace: (slots, rows, N) stored samples; no slots = nothing is stored.
        failed_at: (N,) time at which a fish diverged (s), infinite where none did.
        history: (rows, N) what tails were told (see :mod:`fish_env.model.history`), in place; no
            rows = no tail's command is late.
        tables: packed coefficient curves.
        first: first fish.
        last: one past the last fish.
        work: scratch, (WORK_ROWS * LANES,).
    """
    for block in range(first, last, LANES):
        advance_block(
            work, LANES, state, inputs, par, slew, time, commands, 0, slots, starts, steps, sizes,
            every, trace_row, trace_at, trace, failed_at, history, tables, block,
            min(LANES, last - block),
        )  # fmt: skip


@lean_entry_point
def advance_one(
    state, inputs, par, slew, time, commands, slots, starts, steps, sizes, every, trace_row,
    trace_at, trace, failed_at, history, tables, first, last, work,
):  # fmt: skip
    """As :func:`advance_lanes`, one fish at a time: for a single fish."""
    for lane in range(first, last):
        advance_block(
            work, 1, state, inputs, par, slew, time, commands, 0, slots, starts, steps, sizes,
            every, trace_row, trace_at, trace, failed_at, history, tables, lane, 1,
        )  # fmt: skip


@kernel
def presume_told(work, width):
    """Presume that tails whose command is late were always told what they are told now.

    How a tail whose rate jumps goes on from now is looked up too.
    """
    if LATE_TAIL:
        for k in range(width):
            lane_command(k, width, 0.0, work)
        assume_running(work, width, TOLD, PAST)
    if LATE_TAIL & OWN_STEPS:
        assume_running(work, width, TOLD, PAST_END)
    if OWN_STEPS:
        for k in range(width):
            work[LENGTH * width + k] = MOMENT
            lane_corner(k, width, 0.0, work)


@entry_point
def derivative_batch(work, width, tables):
    """Fill the derivative rows of a work array of ``width`` fish, in place.

    The state does not say what a late tail was told: it is taken to have been told the same.
    """
    presume_told(work, width)
    for k in range(width):
        lane_derivative(k, width, 0.0, 0.0, work, tables)


@entry_point
def terms_batch(work, width, terms, outputs, tables):
    """Wrench of every term, (terms, 6, N): force (N) and moment about O_b (N m), body frame.

    ``outputs``, (len(OUTPUTS), N), takes the quantities that compose lists as OUTPUTS.
    """
    presume_told(work, width)
    for k in range(width):
        lane_terms(k, width, 0.0, 0.0, work, tables, terms, outputs)


@entry_point
def initialise_batch(work, width):
    """Set the effect states of the X rows to where the start of a run leaves them."""
    for k in range(width):
        lane_initialise(k, width, work)

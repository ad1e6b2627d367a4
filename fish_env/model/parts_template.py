"""Steps of each lane: at its own pace, and parted where the rate of its tail or a command jumps.

Completed by :mod:`fish_env.model.compose` behind the rollout template, whose rows it uses.
"""

from __future__ import annotations

import numpy as np

# --- completed by compose ---
from fish_env.model.composed import (
    BEGIN,
    BEGUN,
    CORNER,
    DX,
    LENGTH,
    N_MEMORY,
    N_SLOPES,
    N_STATES,
    NEXT,
    PAST,
    PAST_END,
    RECORD,
    STEP,
    SUM,
    SWITCH,
    SWITCHES,
    TOLD,
    TURNS,
    X0,
    U,
    X,
    accept_states,
    corner_lanes,
    derive_lanes,
    kernel,
    lane_remember,
    lane_shift,
    lane_turns,
    lanes_in,
    memory_matters,
    tell_tail,
)
from fish_env.model.history import recall_at, told_anew

# --- end ---

SHORTEST = 1e-3  # of a step: a part as long as this is none of its own
MOST_PARTS = 32  # of a step
INSTANT = 1e-9  # s; what is told at a time is told this much later too


@kernel
def prepare_parts(work, width):
    """Find the lanes whose tail's rate may jump, when all have their parameters; none switches."""
    for k in range(lanes_in(width, work)):
        lane_turns(k, width, work)
        if SWITCHES:
            work[SWITCH * width + k] = np.inf


@kernel
def recall_in_part(work, width, past, fraction, h, history, first, count):
    """Set the ``past`` rows to what each tail was told its delay ago, at a fraction of its part.

    Where that is the very moment at which a command changed, the beginning of a part sees the new
    command and its end the old one, as for commands that act at once.
    """
    edge = INSTANT if fraction == 0.0 else -INSTANT
    for k in range(lanes_in(width, work)):
        lane = first + (k if k < count else count - 1)
        ago = work[(TOLD + RECORD - 1) * width + k]
        time = work[BEGIN * width + k] + lane_shift(k, width, fraction, h, work) - ago
        recall_at(work, width, k, past, time, edge, ago / work[STEP * width + k], history, lane)


@kernel
def find_corners(work, width, elapsed, h, late, history, first, count):
    """When in its present part the rate of each lane's tail jumps first."""
    lanes = lanes_in(width, work)
    if late:
        recall_in_part(work, width, PAST, 0.0, h, history, first, count)
        recall_in_part(work, width, PAST_END, 1.0, h, history, first, count)
    corner_lanes(width, elapsed, h, work)
    if late:
        for k in range(lanes):
            lane = first + (k if k < count else count - 1)
            ago, length = work[(TOLD + RECORD - 1) * width + k], work[LENGTH * width + k]
            time = work[BEGIN * width + k] + work[BEGUN * width + k] - ago
            anew = told_anew(time, length, ago / work[STEP * width + k], history, lane)
            corner = work[CORNER * width + k]
            work[CORNER * width + k] = min(corner, anew) if ago > 0.0 else corner


@kernel
def look_ahead(work, width, elapsed, h, late, history, first, count, turns, last):
    """End each lane's part of the step at the first corner of its tail or switch of its commands.

    ``turns`` says whether there may be corners, ``last`` that the part has to be the last one.
    """
    lanes = lanes_in(width, work)
    for k in range(lanes):
        work[LENGTH * width + k] = work[STEP * width + k] - work[BEGUN * width + k]
        work[CORNER * width + k] = np.inf
    if turns:
        find_corners(work, width, elapsed, h, late, history, first, count)
    if SWITCHES:
        for k in range(lanes):
            left = work[SWITCH * width + k] - work[BEGUN * width + k]
            work[CORNER * width + k] = min(work[CORNER * width + k], left)
    for k in range(lanes):
        length, least = work[LENGTH * width + k], SHORTEST * work[STEP * width + k]
        corner = work[CORNER * width + k]
        whole = last | (not (corner <= length - least))
        work[LENGTH * width + k] = length if whole else max(corner, least)


@kernel
def switch_commands(work, width, elapsed, late, history, first, count):
    """Give each lane that has come to its switch the commands behind it, and tell its tail."""
    switched = False
    for k in range(lanes_in(width, work)):
        near = work[SWITCH * width + k] - 0.5 * SHORTEST * work[STEP * width + k]
        reached = work[BEGUN * width + k] >= near
        switched |= reached
        for j in range(5):
            new, old = work[(NEXT + j) * width + k], work[(U + j) * width + k]
            work[(U + j) * width + k] = new if reached else old
        work[SWITCH * width + k] = np.inf if reached else work[SWITCH * width + k]
    if late & switched:
        tell_tail(work, width, elapsed, history, first, count)


@kernel
def step_in_parts(work, width, elapsed, h, tables, late, history, first, count, pace):
    """One step of every lane, as ``rk4_step`` and what accepts it, in parts between corners.

    A lane without corners in the step takes it whole, to the same bits whatever the others do.
    ``pace``, (width,), is how much faster the time of each lane runs; without entries it is one.
    """
    lanes = lanes_in(width, work)
    turns, parted = False, False
    for k in range(lanes):
        work[STEP * width + k] = h * pace[k] if pace.shape[0] > 0 else h
        work[BEGUN * width + k] = 0.0
        work[LENGTH * width + k] = work[STEP * width + k]
        turns |= work[TURNS * width + k] > 0.0
    if SWITCHES:
        for k in range(lanes):
            parted |= work[SWITCH * width + k] < np.inf
    for n in range(N_STATES * width):
        work[X * width + n] = work[X0 * width + n]
    if late:
        tell_tail(work, width, elapsed, history, first, count)
    for part in range(MOST_PARTS):
        if turns | parted:
            last = part == MOST_PARTS - 1
            look_ahead(work, width, elapsed, h, late, history, first, count, turns, last)
        rk4_part(work, width, elapsed, h, tables, late, history, first, count)
        accept_states(work, width, elapsed + h)
        unfinished = 0
        for k in range(lanes):
            step = work[STEP * width + k]
            done = work[BEGUN * width + k] + work[LENGTH * width + k]
            finished = done > step - 0.5 * SHORTEST * step
            work[BEGUN * width + k] = step if finished else done
            unfinished += 0 if finished else 1
        if unfinished == 0:
            break
        for n in range(N_STATES * width):
            work[X * width + n] = work[X0 * width + n]
        if SWITCHES:
            switch_commands(work, width, elapsed, late, history, first, count)


@kernel
def rk4_part(work, width, elapsed, h, tables, late, history, first, count):
    """One Runge-Kutta step of every lane over its own part of the step, from X = X0."""
    lanes = lanes_in(width, work)
    for n in range(N_SLOPES * width):
        work[SUM * width + n] = 0.0
    for stage in range(4):
        fraction = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        weight = 1.0 if (stage == 0) | (stage == 3) else 2.0
        ahead = 0.5 if stage < 2 else 1.0
        if late:
            recall_in_part(work, width, PAST, fraction, h, history, first, count)
        derive_lanes(width, elapsed, fraction, h, work, tables)
        if stage < 3:
            for i in range(N_SLOPES):
                for k in range(lanes):
                    slope = work[(DX + i) * width + k]
                    length = work[LENGTH * width + k]
                    work[(SUM + i) * width + k] += weight * slope
                    work[(X + i) * width + k] = (
                        work[(X0 + i) * width + k] + (ahead * length) * slope
                    )
        else:
            for i in range(N_SLOPES):
                for k in range(lanes):
                    total = work[(SUM + i) * width + k] + work[(DX + i) * width + k]
                    sixth = work[LENGTH * width + k] / 6.0
                    work[(X + i) * width + k] = work[(X0 + i) * width + k] + sixth * total
    if N_MEMORY > 0 and memory_matters(width, work):
        for k in range(min(lanes, count)):
            shift = lane_shift(k, width, 1.0, h, work)
            lane_remember(k, width, elapsed, shift, work)

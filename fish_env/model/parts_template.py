"""Steps of a rollout that are parted, for each lane by itself, where the rate of its tail jumps.

Completed by :mod:`fish_env.model.compose` behind the rollout template, whose rows it uses.
"""

from __future__ import annotations

# --- completed by compose ---
from fish_env.model.composed import (
    BEGIN,
    BEGUN,
    CORNER,
    DX,
    LENGTH,
    N_SLOPES,
    N_STATES,
    PAST,
    PAST_END,
    RECORD,
    SUM,
    TOLD,
    X0,
    X,
    accept_actuators,
    accept_states,
    kernel,
    lane_corner,
    lane_derivative,
    lane_remember,
    tell_tail,
)
from fish_env.model.history import recall_at, told_anew

# --- end ---

SHORTEST = 1e-3  # of a step: a part as long as this is none of its own
MOST_PARTS = 32  # of a step
INSTANT = 1e-9  # s; what is told at a time is told this much later too


@kernel
def recall_in_part(work, width, past, share, h, history, first, count):
    """As ``recall``, at a share of each lane's part of the step."""
    edge = INSTANT if share == 0.0 else -INSTANT
    for k in range(width):
        lane = first + (k if k < count else count - 1)
        ago = work[(TOLD + RECORD - 1) * width + k]
        shift = work[BEGUN * width + k] + share * work[LENGTH * width + k]
        time = work[BEGIN * width + k] + shift - ago
        recall_at(work, width, k, past, time, edge, ago / h, history, lane)


@kernel
def look_ahead(work, width, elapsed, h, late, history, first, count, last):
    """End each lane's part of the step where the rate of its tail jumps first."""
    for k in range(width):
        work[LENGTH * width + k] = h - work[BEGUN * width + k]
    if late:
        recall_in_part(work, width, PAST, 0.0, h, history, first, count)
        recall_in_part(work, width, PAST_END, 1.0, h, history, first, count)
    for k in range(width):
        lane_corner(k, width, elapsed, work)
    if late:
        for k in range(width):
            lane = first + (k if k < count else count - 1)
            ago, length = work[(TOLD + RECORD - 1) * width + k], work[LENGTH * width + k]
            time = work[BEGIN * width + k] + work[BEGUN * width + k] - ago
            anew = told_anew(time, length, ago / h, history, lane)
            corner = work[CORNER * width + k]
            work[CORNER * width + k] = min(corner, anew) if ago > 0.0 else corner
    for k in range(width):
        length, least = work[LENGTH * width + k], SHORTEST * h
        corner = work[CORNER * width + k]
        whole = last | (not (corner <= length - least))
        work[LENGTH * width + k] = length if whole else max(corner, least)


@kernel
def step_in_parts(work, width, elapsed, h, tables, late, history, first, count, turns):
    """One step of every lane, as ``rk4_step`` and what accepts it, in parts between corners.

    A lane without corners in the step takes it whole, to the same bits whatever the others do.
    """
    for k in range(width):
        work[BEGUN * width + k] = 0.0
        work[LENGTH * width + k] = h
    for n in range(N_STATES * width):
        work[X * width + n] = work[X0 * width + n]
    if late:
        tell_tail(work, width, elapsed, history, first, count)
    for part in range(MOST_PARTS):
        if turns:
            last = part == MOST_PARTS - 1
            look_ahead(work, width, elapsed, h, late, history, first, count, last)
        rk4_part(work, width, elapsed, h, tables, late, history, first, count)
        accept_states(work, width, elapsed + h)
        unfinished = 0
        for k in range(width):
            done = work[BEGUN * width + k] + work[LENGTH * width + k]
            finished = done > h - 0.5 * SHORTEST * h
            work[BEGUN * width + k] = h if finished else done
            unfinished += 0 if finished else 1
        if unfinished == 0:
            break
        for n in range(N_STATES * width):
            work[X * width + n] = work[X0 * width + n]
    accept_actuators(work, width)


@kernel
def rk4_part(work, width, elapsed, h, tables, late, history, first, count):
    """One Runge-Kutta step of every lane over its own part of the step, from X = X0."""
    for n in range(N_SLOPES * width):
        work[SUM * width + n] = 0.0
    for stage in range(4):
        fraction = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        weight = 1.0 if (stage == 0) | (stage == 3) else 2.0
        ahead = 0.5 if stage < 2 else 1.0
        if late:
            recall_in_part(work, width, PAST, fraction, h, history, first, count)
        for k in range(width):
            shift = work[BEGUN * width + k] + fraction * work[LENGTH * width + k]
            lane_derivative(k, width, elapsed, shift, work, tables)
        if stage < 3:
            for i in range(N_SLOPES):
                for k in range(width):
                    slope = work[(DX + i) * width + k]
                    length = work[LENGTH * width + k]
                    work[(SUM + i) * width + k] += weight * slope
                    work[(X + i) * width + k] = (
                        work[(X0 + i) * width + k] + (ahead * length) * slope
                    )
        else:
            for i in range(N_SLOPES):
                for k in range(width):
                    total = work[(SUM + i) * width + k] + work[(DX + i) * width + k]
                    sixth = work[LENGTH * width + k] / 6.0
                    work[(X + i) * width + k] = work[(X0 + i) * width + k] + sixth * total
    for k in range(count):
        shift = work[BEGUN * width + k] + work[LENGTH * width + k]
        lane_remember(k, width, elapsed, shift, work)

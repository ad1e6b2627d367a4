"""Dormand-Prince 5 with fixed steps between every time at which something jumps."""

from __future__ import annotations

import math

import numpy as np

from tests.hidden.foreign import flip_fin
from tests.hidden.jit import entry_point, helper
from tests.hidden.motion import derivative
from tests.hidden.servo import (
    BLOCK,
    FASTEST,
    FREE_SPEED,
    KICK,
    LAST,
    LIMIT,
    PLAY,
    ROW,
    SHIFT,
    TURN,
    close_step,
    is_limited,
    jump_of_rate,
    plan_limit,
    plan_play,
    plan_side,
    sent,
)
from tests.hidden.vectors import orthonormalise

NODES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0])
STAGES = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    ]
)
WEIGHTS = np.array([35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84])


@helper
def step(t, h, y, trial, slopes, row, late, fish, e, table, push, drive, matrix, wrench):
    size = y.shape[0]
    for stage in range(6):
        for n in range(size):
            rise = 0.0
            for earlier in range(stage):
                rise += STAGES[stage, earlier] * slopes[earlier, n]
            trial[n] = y[n] + h * rise
        derivative(t + NODES[stage] * h, trial, slopes[stage], row, late, fish, e, table, push,
                   drive, matrix, wrench)  # fmt: skip
    for n in range(size):
        rise = 0.0
        for stage in range(6):
            rise += WEIGHTS[stage] * slopes[stage, n]
        y[n] += h * rise
    orthonormalise(y)


@helper
def kick(jump, t, y, trial, slopes, row, late, fish, e, table, push, drive, matrix, wrench):
    """The body's velocities after a jump of the tail's rate, which the carried water resists.

    Acceleration of the body is linear in that of the tail: a jump is an acceleration without end
    for no time, and its impulse follows from the difference of two accelerations.
    """
    for i in range(2):
        drive[KICK] = i * jump
        derivative(t, y, slopes[i], row, late, fish, e, table, push, drive, matrix, wrench)
    drive[KICK] = 0.0
    for n in range(12, 18):
        y[n] += slopes[1, n] - slopes[0, n]


@helper
def switch(row, e, table, drive):
    """A new row of commands: the block moves within its play."""
    if row == int(drive[ROW]):
        return
    half = 0.5 * e.block_hysteresis_play
    goal = table[row, SHIFT] * e.block_scale_scale
    drive[BLOCK] = min(max(drive[BLOCK], goal - half), goal + half)
    drive[ROW] = row


@entry_point
def begin(y, fish, e, table, drive):
    """Servo, block and remembered forces as the first row of commands leaves them."""
    angle = sent(table[0, 0], -1, e, table, drive)[0]
    drive[LIMIT] = angle
    drive[PLAY] = angle
    drive[BLOCK] = table[0, SHIFT] * e.block_scale_scale
    drive[ROW] = 0.0
    drive[LAST] = 0.0
    drive[FASTEST] = FREE_SPEED
    y[18] = angle
    y[19] = angle
    y[21] = drive[BLOCK]
    y[33] = drive[BLOCK]
    y[35] = table[0, TURN]


@entry_point
def advance(y, edges, rows, lates, store, out, fish, e, table, push, drive, longest):
    """Integrates through all edges, in place; `store[i]` is the row of `out` for edge i, or -1."""
    matrix, wrench = np.empty((6, 6)), np.empty(6)
    trial, slopes = np.empty(y.shape[0]), np.empty((6, y.shape[0]))
    if store[0] >= 0:
        out[store[0]] = y
    for i in range(len(edges) - 1):
        row, late = rows[i], lates[i]
        switch(row, e, table, drive)
        count = max(1, math.ceil((edges[i + 1] - edges[i]) / longest - 1e-9))
        h = (edges[i + 1] - edges[i]) / count
        for k in range(count):
            t = edges[i] + k * h
            plan_side(t + 0.5 * h, late, e, table, drive)
            plan_limit(t, h, late, e, table, drive)
            plan_play(t, h, late, e, table, drive)
            told = is_limited(e) or e.servo_backlash_gap != 0.0
            told |= k > 0 or (i > 0 and rows[i - 1] == row and lates[i - 1] == late)
            jump = jump_of_rate(t, late, e, table, drive) if told else 0.0
            if jump != 0.0 and e.tail_reactive_scale != 0.0:
                kick(jump, t, y, trial, slopes, row, late, fish, e, table, push, drive, matrix,
                     wrench)  # fmt: skip
            step(t, h, y, trial, slopes, row, late, fish, e, table, push, drive, matrix, wrench)
            close_step(t + h, late, e, table, drive)
            flip_fin(y[17], e, drive)
        if store[i + 1] >= 0:
            out[store[i + 1]] = y

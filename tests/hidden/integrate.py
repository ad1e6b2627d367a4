"""Dormand-Prince 5 with fixed steps between every time at which something jumps."""

from __future__ import annotations

import math

import numpy as np

from tests.hidden.foreign import flip_fin
from tests.hidden.hull import block_place, centre_of_mass, inertia_about_origin, rigid_matrix
from tests.hidden.jit import entry_point, helper
from tests.hidden.motion import derivative
from tests.hidden.servo import (
    BLOCK,
    LIMIT,
    PLAY,
    ROW,
    SHIFT,
    block_goal,
    close_step,
    plan_limit,
    plan_play,
    sent,
)
from tests.hidden.vectors import add, cross, orthonormalise, rotate, scale, solve6, to_inertial

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
def body_inertia(shift, turn, fish, e, matrix):
    place = block_place(shift, turn, fish)
    rigid_matrix(
        centre_of_mass(place, fish, e), inertia_about_origin(place, fish), fish.mass, matrix
    )
    for i in range(6):
        matrix[i, i] += (
            e.added_mass_surge,
            e.added_mass_sway,
            e.added_mass_heave,
            e.added_mass_roll,
            e.added_mass_pitch,
            e.added_mass_yaw,
        )[i]


@helper
def block_jump(y, old, new, fish, e, matrix, wrench):
    """A block that is moved at once: the fish recoils by a finite shift and turn.

    No force is finite against the jump, so the momentum in the inertial frame is kept: during
    it the hull moves by -M^-1 S dC, S dC the momentum of the block; after it the same momentum
    is carried by the new inertia. The scale shares between this and no reaction at all.
    """
    s = e.block_reaction_scale
    pieces = 40
    kept = np.empty(6)
    body_inertia(old[0], old[1], fish, e, matrix)
    for i in range(6):
        kept[i] = 0.0
        for j in range(6):
            kept[i] += matrix[i, j] * y[12 + j]
    for piece in range(pieces):
        middle = (piece + 0.5) / pieces
        shift = old[0] + middle * (new[0] - old[0])
        turn = old[1] + middle * (new[1] - old[1])
        angle_step = (new[1] - old[1]) / pieces
        move = (
            -(new[0] - old[0]) / pieces,
            fish.d2 * math.cos(turn) * angle_step,
            -fish.d2 * math.sin(turn) * angle_step,
        )
        run = scale(fish.block_mass, move)
        angular = cross(block_place(shift, turn, fish), run)
        for i in range(3):
            wrench[i] = -s * run[i]
            wrench[3 + i] = -s * angular[i]
        body_inertia(shift, turn, fish, e, matrix)
        solve6(matrix, wrench)
        go = (wrench[0], wrench[1], wrench[2])
        twist = (wrench[3], wrench[4], wrench[5])
        path = to_inertial(y, go)
        for i in range(3):
            y[i] += path[i]
        rotate(y, twist)
        # Momentum fixed in space, seen from the moved and turned body.
        p = (kept[0], kept[1], kept[2])
        h = (kept[3], kept[4], kept[5])
        h = add(h, scale(-1.0, add(cross(twist, h), cross(go, p))))
        p = add(p, scale(-1.0, cross(twist, p)))
        for i in range(3):
            kept[i], kept[3 + i] = p[i], h[i]
    body_inertia(new[0], new[1], fish, e, matrix)
    solve6(matrix, kept)
    for i in range(6):
        y[12 + i] += s * (kept[i] - y[12 + i])


@helper
def rate_jump(y, change, turn, fish, e, matrix, wrench):
    """The block's speed along the hull jumps: the fish takes up the momentum."""
    run = (-fish.block_mass * change, 0.0, 0.0)
    angular = cross(block_place(y[21], turn, fish), run)
    for i in range(3):
        wrench[i] = -e.block_reaction_scale * run[i]
        wrench[3 + i] = -e.block_reaction_scale * angular[i]
    body_inertia(y[21], turn, fish, e, matrix)
    solve6(matrix, wrench)
    for i in range(6):
        y[12 + i] += wrench[i]


@helper
def switch(y, row, fish, e, table, drive, matrix, wrench):
    """A new row of commands: the block's play and its reaction to being moved."""
    last = int(drive[ROW])
    if row == last:
        return
    old = block_goal(last, e, table, drive)
    half = 0.5 * e.block_hysteresis_play
    goal = table[row, SHIFT] * e.block_scale_scale
    drive[BLOCK] = min(max(drive[BLOCK], goal - half), goal + half)
    new = block_goal(row, e, table, drive)
    drive[ROW] = row
    if e.block_reaction_scale == 0.0:
        return
    lag = e.block_lag_time_constant
    if lag == 0.0:
        if old[0] != new[0] or old[1] != new[1]:
            block_jump(y, old, new, fish, e, matrix, wrench)
        return
    if old[1] != new[1]:
        block_jump(y, (y[21], old[1]), (y[21], new[1]), fish, e, matrix, wrench)
    if old[0] != new[0]:
        rate_jump(y, (new[0] - old[0]) / lag, new[1], fish, e, matrix, wrench)


@entry_point
def begin(y, fish, e, table, drive):
    """Servo, block and remembered forces as the first row of commands leaves them."""
    angle = sent(table[0, 0], -1, e, table)[0]
    drive[LIMIT] = angle
    drive[PLAY] = angle
    drive[BLOCK] = table[0, SHIFT] * e.block_scale_scale
    drive[ROW] = 0.0
    y[18] = angle
    y[19] = angle
    y[21] = drive[BLOCK]


@entry_point
def advance(y, edges, rows, lates, store, out, fish, e, table, push, drive, longest):
    """Integrates through all edges, in place; `store[i]` is the row of `out` for edge i, or -1."""
    matrix, wrench = np.empty((6, 6)), np.empty(6)
    trial, slopes = np.empty(y.shape[0]), np.empty((6, y.shape[0]))
    if store[0] >= 0:
        out[store[0]] = y
    for i in range(len(edges) - 1):
        row, late = rows[i], lates[i]
        switch(y, row, fish, e, table, drive, matrix, wrench)
        count = max(1, math.ceil((edges[i + 1] - edges[i]) / longest - 1e-9))
        h = (edges[i + 1] - edges[i]) / count
        for k in range(count):
            t = edges[i] + k * h
            plan_limit(t, h, late, e, table, drive)
            plan_play(t, h, late, e, table, drive)
            step(t, h, y, trial, slopes, row, late, fish, e, table, push, drive, matrix, wrench)
            close_step(t + h, late, e, table, drive)
            flip_fin(y[17], e, drive)
        if store[i + 1] >= 0:
            out[store[i + 1]] = y

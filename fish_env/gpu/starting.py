"""Start of an episode on the device, fish by fish: what ``FishBatch.reset`` does in bulk.

Each function reads the uniform numbers of one fish, a column of ``draws``, in the order in which
:mod:`fish_env.envs.start` uses them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr

from fish_env.envs.guides import HEADING
from fish_env.envs.layout import GOAL, Setup
from fish_env.envs.randomization import TRUNCATE
from fish_env.envs.start import POSE_DRAWS
from fish_env.envs.tasks import GOAL_DRAWS
from fish_env.gpu.goals import (
    N_POINTS,
    TASK_PATH,
    TASK_STATION,
    TASK_TRACK,
    between,
    hold_goal,
    path_goal,
    station_goal,
    track_goal,
)
from fish_env.gpu.random import normal_quantile, philox, unit
from fish_env.gpu.ranges import at
from fish_env.model.state import INTEGRAL_ROW
from fish_env.params.packing import RECORD_FIELDS

if TYPE_CHECKING:  # what a composed module defines
    from fish_env.model.composed import (
        FLOW_EAST_ROW,
        FLOW_NORTH_ROW,
        N_PARAMETERS,
        N_STATES,
        PAR,
        ROW_ACTION,
        ROW_FAILED,
        ROW_GOAL,
        ROW_INPUTS,
        ROW_PAR,
        ROW_POINTS,
        ROW_REWARD,
        ROW_SLEW,
        ROW_TIME,
        ROW_WITHIN,
        TASK,
        TRACE_ROW,
        TRACE_ROWS,
        U_RATE,
        WORK_ROWS,
        U,
        X,
        lane_initialise,
    )

STREAM_START = np.uint64(1)
_WORD = np.uint64(0xFFFFFFFF)

TANK, SURGE, TILT = at("tank"), at("surge"), at("tilt")
DEPTH_OFFSET, HEADING_OFFSET = at("depth_offset"), at("heading_offset")
N_GOAL = len(GOAL)
FLOW_NORTH, FLOW_EAST = GOAL.index("flow_north"), GOAL.index("flow_east")
PARAMETER_DRAWS = GOAL_DRAWS + POSE_DRAWS
DT, CENTRE, HALF_RANGE = int(Setup.DT), int(Setup.CENTRE), int(Setup.HALF_RANGE)
PI = math.pi

EDGE = float(ndtr(TRUNCATE))
DRAWN_ROWS = ("uniform", "first", "second", "lower", "upper")
"""Rows of ``drawn`` for each parameter; rows of the correlation's factor follow."""
CORRELATION = len(DRAWN_ROWS)

MASS, MASS_BLOCK = RECORD_FIELDS.index("mass_total"), RECORD_FIELDS.index("mass_block")
STATIC, INVERSE = RECORD_FIELDS.index("static_x"), RECORD_FIELDS.index("inverse_mass")
REST, ABOUT_OB = RECORD_FIELDS.index("inertia_rest_x"), RECORD_FIELDS.index("inertia_rest_ob_x")


def fill_draws(draws, lane, number, seed):
    """The uniform numbers of a fish for its episode of this number."""
    for i in range(0, draws.shape[0], 4):
        words = philox(
            np.uint64(i), np.uint64(lane), np.uint64(number) & _WORD, STREAM_START, seed[0], seed[1]
        )
        draws[i, lane] = unit(words[0])
        if i + 1 < draws.shape[0]:
            draws[i + 1, lane] = unit(words[1])
        if i + 2 < draws.shape[0]:
            draws[i + 2, lane] = unit(words[2])
        if i + 3 < draws.shape[0]:
            draws[i + 3, lane] = unit(words[3])


def start_goal(data, lane, draws, ranges):
    """Draw the goal of the task."""
    for row in range(N_GOAL):
        data[ROW_GOAL + row, lane] = 0.0
    hold_goal(data, lane, ROW_GOAL, draws, ranges)
    if TASK == TASK_TRACK:
        track_goal(data, lane, ROW_GOAL, draws, ranges)
    if TASK == TASK_PATH:
        for row in range(N_POINTS):
            data[ROW_POINTS + row, lane] = 0.0
        path_goal(data, lane, ROW_GOAL, ROW_POINTS, draws, ranges)
    if TASK == TASK_STATION:
        station_goal(data, lane, ROW_GOAL, draws, ranges)


def start_pose(data, lane, draws, ranges):
    """Draw the base states near the goal."""
    for row in range(N_STATES):
        data[row, lane] = 0.0
    top, bottom = ranges[TANK], ranges[TANK + 1]
    margin = 0.05 * (bottom - top)
    depth = data[ROW_GOAL, lane] + ranges[DEPTH_OFFSET] * (2.0 * draws[GOAL_DRAWS, lane] - 1.0)
    heading = data[ROW_GOAL + HEADING, lane]
    heading += ranges[HEADING_OFFSET] * (2.0 * draws[GOAL_DRAWS + 1, lane] - 1.0)
    roll = 0.5 * ranges[TILT] * (2.0 * draws[GOAL_DRAWS + 2, lane] - 1.0)
    pitch = 0.5 * ranges[TILT] * (2.0 * draws[GOAL_DRAWS + 3, lane] - 1.0)
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(0.5 * heading), math.sin(0.5 * heading)
    data[2, lane] = min(max(depth, top + margin), bottom - margin)
    data[3, lane] = cr * cp * cy + sr * sp * sy
    data[4, lane] = sr * cp * cy - cr * sp * sy
    data[5, lane] = cr * sp * cy + sr * cp * sy
    data[6, lane] = cr * cp * sy - sr * sp * cy
    data[7, lane] = between(ranges, SURGE, draws[GOAL_DRAWS + 4, lane])
    data[13, lane] = 2.0 * PI * draws[GOAL_DRAWS + 5, lane]


def start_parameters(data, lane, draws, nominal, drawn_rows, drawn):
    """Draw the parameter record: the nominal one, with what the randomisation changes.

    The uniform numbers of normal parameters are replaced by normal ones, from the last parameter to
    the first, because each draws on those before it alone.
    """
    for row in range(N_PARAMETERS):
        data[ROW_PAR + row, lane] = nominal[row]
    count = drawn_rows.shape[0]
    for i in range(count):
        if drawn[0, i] == 0.0:
            p = (1.0 - EDGE) + (2.0 * EDGE - 1.0) * draws[PARAMETER_DRAWS + i, lane]
            draws[PARAMETER_DRAWS + i, lane] = normal_quantile(p)
    for i in range(count):
        number = draws[PARAMETER_DRAWS + i, lane]
        if drawn[0, i] == 0.0:
            number *= 0.0
            for j in range(i + 1):
                number += drawn[CORRELATION + i, j] * draws[PARAMETER_DRAWS + j, lane]
            value = drawn[1, i] + drawn[2, i] * number
        else:
            value = drawn[1, i] + (drawn[2, i] - drawn[1, i]) * number
        data[ROW_PAR + drawn_rows[i], lane] = min(max(value, drawn[3, i]), drawn[4, i])
    if count > 0:
        derive(data, lane)
    if TASK == TASK_STATION and FLOW_NORTH_ROW >= 0:
        data[ROW_GOAL + FLOW_NORTH, lane] = data[ROW_PAR + FLOW_NORTH_ROW, lane]
        data[ROW_GOAL + FLOW_EAST, lane] = data[ROW_PAR + FLOW_EAST_ROW, lane]


def derive(data, lane):
    """The derived fields of a record: as :func:`fish_env.params.packing.derive`."""
    mass = data[ROW_PAR + MASS, lane]
    rest = mass - data[ROW_PAR + MASS_BLOCK, lane]
    x = data[ROW_PAR + STATIC, lane] / rest
    y = data[ROW_PAR + STATIC + 1, lane] / rest
    z = data[ROW_PAR + STATIC + 2, lane] / rest
    data[ROW_PAR + INVERSE, lane] = 1.0 / mass
    data[ROW_PAR + ABOUT_OB, lane] = data[ROW_PAR + REST, lane] + rest * (y * y + z * z)
    data[ROW_PAR + ABOUT_OB + 1, lane] = data[ROW_PAR + REST + 1, lane] + rest * (x * x + z * z)
    data[ROW_PAR + ABOUT_OB + 2, lane] = data[ROW_PAR + REST + 2, lane] + rest * (x * x + y * y)


def start_drive(data, lane, slew, queue, setup):
    """Actuators at rest, or as near to it as they go, and the action that says so."""
    for j in range(5):
        centre, half = setup[CENTRE + j], setup[HALF_RANGE + j]
        position = min(max(0.0 * centre, centre - half), centre + half)
        data[ROW_INPUTS + j, lane] = position
        data[ROW_SLEW + j, lane] = slew[j]
        data[ROW_ACTION + j, lane] = (position - centre) / half
        for slot in range(queue.shape[0]):
            queue[slot, j, lane] = position


def start_effects(work, data, lane):
    """States and memory of effects, where the start of a run leaves them."""
    for row in range(WORK_ROWS):
        work[row] = 0.0
    for row in range(N_STATES):
        work[X + row] = data[row, lane]
    for j in range(5):
        work[U + j] = data[ROW_INPUTS + j, lane]
        work[U_RATE + j] = 0.0
    for row in range(N_PARAMETERS):
        work[PAR + row] = data[ROW_PAR + row, lane]
    lane_initialise(0, 1, work)
    for row in range(N_STATES):
        data[row, lane] = work[X + row]


def clear_results(data, lane):
    """No time has passed, and nothing was achieved yet."""
    data[ROW_TIME, lane] = 0.0
    data[ROW_FAILED, lane] = np.inf
    data[ROW_WITHIN, lane] = 0.0
    data[ROW_REWARD, lane] = 0.0


def fill_ring(data, lane, ring, ring_at, setup):
    """As if the fish had kept its first heading and speed since long before the start."""
    qw, qx, qy, qz = data[3, lane], data[4, lane], data[5, lane], data[6, lane]
    north = 1.0 - 2.0 * (qy * qy + qz * qz)
    east = 2.0 * (qx * qy + qw * qz)
    level = math.sqrt(north * north + east * east)
    slots = ring.shape[0]
    age = ring_at - 1
    for slot in range(slots):
        past = -setup[DT] * np.float64(age if age >= 0 else age + slots)
        age -= 1
        if TRACE_ROW == 0:
            for row in range(TRACE_ROWS):
                ring[slot, row, lane] = data[row, lane]
        ring[slot, INTEGRAL_ROW - TRACE_ROW, lane] = past * (north / level)
        ring[slot, INTEGRAL_ROW + 1 - TRACE_ROW, lane] = past * (east / level)
        ring[slot, INTEGRAL_ROW + 2 - TRACE_ROW, lane] = past * data[7, lane]

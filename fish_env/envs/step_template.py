"""The compiled environment step, for one fish or a batch: actions in, observations out.

Completed and compiled by :mod:`fish_env.model.compose` behind the rollout template, whose
``advance_block`` it calls. All numbers of a fish that last through an episode lie in one column
of ``data``; the rows follow :data:`fish_env.envs.layout`.
"""

# The composer keeps imports between numpy and its marks, so they cannot be sorted.
# ruff: noqa: I001
from __future__ import annotations

import math

import numpy as np

from fish_env.envs.guides import set_goal
from fish_env.envs.layout import (
    GOAL,
    GUIDE,
    MAX_BEAT_S,
    OBSERVATION_LIMIT,
    OUTPUTS,
    GoalKind,
    Setup,
)
from fish_env.envs.rewards import saturating, tolerance
from fish_env.model.state import INTEGRAL_ROW
from fish_env.model.trigonometry import sincos

# --- completed by compose ---
from fish_env.model.composed import (
    LANES,
    N_PARAMETERS,
    N_STATES,
    advance_block,
    entry_point,
    kernel,
    lean_entry_point,
)

# --- end ---

ROW_INPUTS = N_STATES
ROW_SLEW = ROW_INPUTS + 5
ROW_PAR = ROW_SLEW + 5
ROW_TIME = ROW_PAR + N_PARAMETERS
ROW_GOAL = ROW_TIME + 1
ROW_FAILED = ROW_GOAL + len(GOAL)
ROW_ACTION = ROW_FAILED + 1
ROW_WITHIN = ROW_ACTION + 5
ROW_REWARD = ROW_WITHIN + 1
ROW_OUTPUT = ROW_REWARD + 1
ROW_CHANGE = ROW_OUTPUT + len(OUTPUTS)
ROW_ENERGY = ROW_CHANGE + 1
ROW_GUIDE = ROW_ENERGY + 1
ROW_POINTS = ROW_GUIDE + len(GUIDE)
DATA_ROWS = ROW_POINTS
KIND = ROW_GOAL + GOAL.index("kind")
PLACE = float(GoalKind.PLACE)

DT = int(Setup.DT)
CENTRE = int(Setup.CENTRE)
HALF_RANGE = int(Setup.HALF_RANGE)
TOP, BOTTOM = int(Setup.TOP), int(Setup.BOTTOM)
WALLS = int(Setup.NORTH_MIN)
TUMBLE = int(Setup.TUMBLE_COSINE)
WEIGHTS = int(Setup.WEIGHT_DEPTH)
MARGINS = int(Setup.MARGIN_DEPTH)
POWER_SCALE = int(Setup.POWER_SCALE)
TOLERANCES = int(Setup.TOLERANCE_DEPTH)
SUCCESS_TIME = int(Setup.SUCCESS_TIME)
WEIGHT_PLACE, MARGIN_PLACE = int(Setup.WEIGHT_PLACE), int(Setup.MARGIN_PLACE)
TOLERANCE_CROSS_TRACK = int(Setup.TOLERANCE_CROSS_TRACK)
TOLERANCE_PLACE = int(Setup.TOLERANCE_PLACE)
WEIGHT_WITHIN = int(Setup.WEIGHT_WITHIN)


@kernel
def within(data, lane, depth_error, heading_error, speed_error, setup):
    """Whether the errors that count for the kind of goal are within their tolerances."""
    goal_speed = data[ROW_GUIDE + 4, lane]
    allowed = max(setup[TOLERANCES + 2] * goal_speed, setup[TOLERANCES + 3])
    level = abs(depth_error) <= setup[TOLERANCES]
    paced = abs(speed_error) <= allowed
    kind = data[KIND, lane]
    if kind == 0.0:
        inside = level & (abs(heading_error) <= setup[TOLERANCES + 1]) & paced
    elif kind == PLACE:
        inside = data[ROW_GUIDE + 7, lane] <= setup[TOLERANCE_PLACE]
    else:
        inside = level & (abs(data[ROW_GUIDE + 5, lane]) <= setup[TOLERANCE_CROSS_TRACK]) & paced
    return inside


@kernel
def beat_means(data, lane, ring, newest, back, offset, dt):
    """Mean heading vector and surge speed over the tail beat that ends ``back`` steps ago."""
    slots = ring.shape[0]
    frequency = data[ROW_INPUTS + 2, lane]
    window = MAX_BEAT_S if frequency * MAX_BEAT_S < 1.0 else 1.0 / frequency
    steps = window / dt
    whole = int(steps)
    fraction = steps - whole
    now = (newest - back) % slots
    late = (newest - back - whole) % slots
    early = (newest - back - whole - 1) % slots
    per_second = 1.0 / window
    cosine = ring[now, offset, lane] - (
        ring[late, offset, lane] * (1.0 - fraction) + ring[early, offset, lane] * fraction
    )
    sine = ring[now, offset + 1, lane] - (
        ring[late, offset + 1, lane] * (1.0 - fraction) + ring[early, offset + 1, lane] * fraction
    )
    surge = ring[now, offset + 2, lane] - (
        ring[late, offset + 2, lane] * (1.0 - fraction) + ring[early, offset + 2, lane] * fraction
    )
    norm = math.sqrt(cosine * cosine + sine * sine)
    scale = 1.0 / norm if norm > 0.0 else 0.0
    return cosine * scale, sine * scale, surge * per_second


@kernel
def turn(cosine, sine, by_cosine, by_sine):
    """Cosine and sine of the sum of two angles."""
    return cosine * by_cosine - sine * by_sine, sine * by_cosine + cosine * by_sine


@kernel
def clipped(value):
    """An observation within its finite space."""
    return np.float32(min(max(value, -OBSERVATION_LIMIT), OBSERVATION_LIMIT))


@kernel
def failure_of(data, lane, z_cosine, setup):
    """Failure code of the present state (layout.Failure)."""
    code = 0.0
    if z_cosine < setup[TUMBLE]:
        code = 4.0
    x, y, z = data[0, lane], data[1, lane], data[2, lane]
    outside = (x < setup[WALLS]) | (x > setup[WALLS + 1]) | (y < setup[WALLS + 2])
    if outside | (y > setup[WALLS + 3]):
        code = 3.0
    if z > setup[BOTTOM]:
        code = 2.0
    if z < setup[TOP]:
        code = 1.0
    if data[ROW_FAILED, lane] < np.inf:
        code = 5.0
    return code


@kernel
def judge(data, lane, ring, newest, offset, energy_before, change, period, setup):
    """Errors, reward terms, tolerance clock and failure of the true state after a step."""
    time = data[ROW_TIME, lane]
    goal_depth = data[ROW_GUIDE, lane]
    goal_heading = data[ROW_GUIDE + 2, lane]
    goal_speed = data[ROW_GUIDE + 4, lane]
    qw, qx, qy, qz = data[3, lane], data[4, lane], data[5, lane], data[6, lane]
    heading = math.atan2(2.0 * (qx * qy + qw * qz), 1.0 - 2.0 * (qy * qy + qz * qz))
    cosine, sine, surge = beat_means(data, lane, ring, newest, 0, offset, setup[DT])
    goal_sine, goal_cosine = sincos(goal_heading)
    error_cosine, error_sine = turn(goal_cosine, goal_sine, cosine, -sine)
    now_sine, now_cosine = sincos(heading)
    instant_cosine, instant_sine = turn(goal_cosine, goal_sine, now_cosine, -now_sine)
    depth_error = goal_depth - data[2, lane]
    heading_error = math.atan2(error_sine, error_cosine)
    speed_error = goal_speed - surge
    power = (data[17, lane] - energy_before) / period
    z_cosine = 1.0 - 2.0 * (qx * qx + qy * qy)
    failure = failure_of(data, lane, z_cosine, setup)

    inside = within(data, lane, depth_error, heading_error, speed_error, setup) & (failure == 0.0)
    data[ROW_WITHIN, lane] = data[ROW_WITHIN, lane] + period if inside else 0.0
    out = ROW_OUTPUT
    data[out, lane] = setup[WEIGHTS] * tolerance(depth_error, setup[MARGINS])
    data[out + 1, lane] = setup[WEIGHTS + 1] * tolerance(heading_error, setup[MARGINS + 1])
    data[out + 2, lane] = setup[WEIGHTS + 2] * tolerance(speed_error, setup[MARGINS + 2])
    data[out + 3, lane] = setup[WEIGHTS + 3] * saturating(power, setup[POWER_SCALE])
    data[out + 4, lane] = setup[WEIGHTS + 4] * change
    data[out + 5, lane] = depth_error
    data[out + 6, lane] = heading_error
    data[out + 7, lane] = math.atan2(instant_sine, instant_cosine)
    data[out + 8, lane] = speed_error
    data[out + 9, lane] = data[2, lane]
    data[out + 10, lane] = math.atan2(sine, cosine)
    data[out + 11, lane] = surge
    data[out + 12, lane] = goal_depth
    data[out + 13, lane] = goal_heading
    data[out + 14, lane] = goal_speed
    data[out + 15, lane] = data[0, lane]
    data[out + 16, lane] = data[1, lane]
    data[out + 17, lane] = power
    data[out + 18, lane] = data[ROW_WITHIN, lane]
    held = data[ROW_WITHIN, lane] >= setup[SUCCESS_TIME] - 1e-9
    data[out + 19, lane] = 1.0 if held else 0.0
    data[out + 20, lane] = failure
    data[out + 21, lane] = time
    cross_track, place_error = data[ROW_GUIDE + 5, lane], data[ROW_GUIDE + 7, lane]
    away = place_error if data[KIND, lane] == PLACE else cross_track
    data[out + 22, lane] = setup[WEIGHT_PLACE] * tolerance(away, setup[MARGIN_PLACE])
    data[out + 23, lane] = cross_track
    data[out + 24, lane] = data[ROW_GUIDE + 6, lane]
    data[out + 25, lane] = place_error
    terms = data[out, lane] + data[out + 1, lane] + data[out + 2, lane] + data[out + 22, lane]
    bonus = setup[WEIGHT_WITHIN] if inside else 0.0
    data[ROW_REWARD, lane] = terms - data[out + 3, lane] - data[out + 4, lane] + bonus


@kernel
def observe(data, lane, ring, newest, back, trace_row, noise, obs, setup):
    """Write the observation of one fish: what its sensors saw ``back`` physics steps ago."""
    offset = INTEGRAL_ROW - trace_row
    slot = (newest - back) % ring.shape[0]
    pose = ring[slot] if back > 0 else data
    goal_depth, goal_depth_rate = data[ROW_GUIDE, lane], data[ROW_GUIDE + 1, lane]
    goal_heading, goal_heading_rate = data[ROW_GUIDE + 2, lane], data[ROW_GUIDE + 3, lane]
    goal_speed = data[ROW_GUIDE + 4, lane]
    noisy = noise.shape[0] > 0

    qw, qx, qy, qz = pose[3, lane], pose[4, lane], pose[5, lane], pose[6, lane]
    xx = 1.0 - 2.0 * (qy * qy + qz * qz)
    yx = 2.0 * (qx * qy + qw * qz)
    zx = 2.0 * (qx * qz - qw * qy)
    zy = 2.0 * (qy * qz + qw * qx)
    zz = 1.0 - 2.0 * (qx * qx + qy * qy)
    u, v, w = pose[7, lane], pose[8, lane], pose[9, lane]
    depth = pose[2, lane]
    depth_rate = zx * u + zy * v + zz * w
    level = math.sqrt(xx * xx + yx * yx)
    per_level = 1.0 / level if level > 0.0 else 0.0
    pitch_sine, pitch_cosine = -zx, level
    roll_sine, roll_cosine = zy * per_level, zz * per_level
    now_cosine, now_sine = xx * per_level, yx * per_level
    cosine, sine, surge = beat_means(data, lane, ring, newest, back, offset, setup[DT])
    p, q, r = pose[10, lane], pose[11, lane], pose[12, lane]
    if noisy:
        depth += noise[0, lane]
        depth_rate += noise[1, lane]
        s, c = sincos(noise[2, lane])
        roll_cosine, roll_sine = turn(roll_cosine, roll_sine, c, s)
        s, c = sincos(noise[3, lane])
        pitch_cosine, pitch_sine = turn(pitch_cosine, pitch_sine, c, s)
        s, c = sincos(noise[4, lane])
        now_cosine, now_sine = turn(now_cosine, now_sine, c, s)
        cosine, sine = turn(cosine, sine, c, s)
        u += noise[5, lane]
        surge += noise[5, lane]
        v += noise[6, lane]
        w += noise[7, lane]
        p += noise[8, lane]
        q += noise[9, lane]
        r += noise[10, lane]
    goal_sine, goal_cosine = sincos(goal_heading)
    error_cosine, error_sine = turn(goal_cosine, goal_sine, cosine, -sine)
    instant_cosine, instant_sine = turn(goal_cosine, goal_sine, now_cosine, -now_sine)
    phase_sine, phase_cosine = sincos(data[13, lane])
    half = 0.5 * (setup[BOTTOM] - setup[TOP])
    middle = 0.5 * (setup[BOTTOM] + setup[TOP])
    obs[lane, 0] = clipped((goal_depth - depth) / 0.3)
    obs[lane, 1] = clipped(depth_rate / 0.1)
    obs[lane, 2] = clipped(goal_depth_rate / 0.1)
    obs[lane, 3] = clipped((depth - middle) / half)
    obs[lane, 4] = clipped(error_sine)
    obs[lane, 5] = clipped(error_cosine)
    obs[lane, 6] = clipped(instant_sine)
    obs[lane, 7] = clipped(instant_cosine)
    obs[lane, 8] = clipped(goal_heading_rate / 0.5)
    obs[lane, 9] = clipped((goal_speed - surge) / 0.1)
    obs[lane, 10] = clipped(goal_speed / 0.1)
    obs[lane, 11] = clipped(roll_sine)
    obs[lane, 12] = clipped(roll_cosine)
    obs[lane, 13] = clipped(pitch_sine)
    obs[lane, 14] = clipped(pitch_cosine)
    obs[lane, 15] = clipped(u / 0.2)
    obs[lane, 16] = clipped(v / 0.2)
    obs[lane, 17] = clipped(w / 0.2)
    obs[lane, 18] = clipped(p)
    obs[lane, 19] = clipped(q)
    obs[lane, 20] = clipped(r)
    obs[lane, 21] = clipped(phase_sine)
    obs[lane, 22] = clipped(phase_cosine)
    for j in range(5):
        centred = data[ROW_INPUTS + j, lane] - setup[CENTRE + j]
        obs[lane, 23 + j] = clipped(centred / setup[HALF_RANGE + j])
        obs[lane, 28 + j] = clipped(data[ROW_ACTION + j, lane])


@kernel
def step_block(
    work, width, data, actions, queue, queue_at, slots, starts, steps, sizes, every, ring, ring_at,
    noise, obs, setup, n_sub, back, trace_row, history, tables, first, count,
):  # fmt: skip
    """Step lanes first..first+count (see :func:`step_lanes`)."""
    period = n_sub * setup[DT]
    bad = 0
    for k in range(count):
        lane = first + k
        total = 0.0
        for j in range(5):
            asked = np.float64(actions[lane, j])
            action = min(max(asked, -1.0), 1.0)
            if asked != asked:
                action = 0.0
                bad += 1
            step = action - data[ROW_ACTION + j, lane]
            total += step * step
            data[ROW_ACTION + j, lane] = action
            queue[queue_at, j, lane] = setup[CENTRE + j] + setup[HALF_RANGE + j] * action
        data[ROW_CHANGE, lane] = total / 20.0
        data[ROW_ENERGY, lane] = data[17, lane]
    advance_block(
        work, width, data[:ROW_INPUTS], data[ROW_INPUTS:ROW_SLEW], data[ROW_PAR:ROW_TIME],
        data[ROW_SLEW:ROW_PAR], data[ROW_TIME], queue, queue_at, slots, starts, steps, sizes, every,
        trace_row, ring_at, ring, data[ROW_FAILED], history, tables, first, count,
    )  # fmt: skip
    newest = ring_at + n_sub - 1
    for k in range(count):
        lane = first + k
        # A whole number of periods, so that rounding does not add up over an episode.
        data[ROW_TIME, lane] = math.floor(data[ROW_TIME, lane] / period + 1.5) * period
        offset = INTEGRAL_ROW - trace_row
        change, energy_before = data[ROW_CHANGE, lane], data[ROW_ENERGY, lane]
        set_goal(data, lane, ROW_GOAL, ROW_TIME, ROW_GUIDE, ROW_POINTS, period, setup, False)
        judge(data, lane, ring, newest, offset, energy_before, change, period, setup)
        observe(data, lane, ring, newest, back, trace_row, noise, obs, setup)
    return bad


@lean_entry_point
def step_lanes(
    data, actions, queue, queue_at, slots, starts, steps, sizes, every, ring, ring_at, noise, obs,
    setup, n_sub, back, trace_row, history, tables, first, last, work,
):  # fmt: skip
    """One control step of fish first..last, in place.

    Args:
        data: (DATA_ROWS or more, N), everything about each fish; waypoints may follow.
        actions: (N, 5) float32 in [-1, 1]; clipped, NaN counts as 0 and is reported.
        queue: (Q, 5, N) past targets of the actuators; slot ``queue_at`` is written now.
        queue_at: slot of this step's targets.
        slots: (segments,) slot of the targets that hold in each segment, counted from queue_at.
        starts: (segments,) as for ``advance_lanes``; so are
        steps: (segments,),
        sizes: (segments,) and
        every: (segments,).
        ring: (L, rows, N) samples after every physics step, the last L of them.
        ring_at: slot of this step's first sample (not wrapped).
        noise: (sensors, N) added to what sensors see, or no rows.
        obs: (N, observations) float32, written.
        setup: shared numbers, see layout.Setup.
        n_sub: physics steps in a control step.
        back: observation delay in physics steps.
        trace_row: first state row that the ring holds.
        history: (rows, N) what tails were told (see :mod:`fish_env.model.history`), or no rows.
        tables: packed coefficient curves.
        first: first fish.
        last: one past the last.
        work: scratch, (WORK_ROWS * LANES,).

    Returns:
        How many action values were NaN.
    """
    bad = 0
    for block in range(first, last, LANES):
        bad += step_block(
            work, LANES, data, actions, queue, queue_at, slots, starts, steps, sizes, every, ring,
            ring_at, noise, obs, setup, n_sub, back, trace_row, history, tables, block,
            min(LANES, last - block),
        )  # fmt: skip
    return bad


@lean_entry_point
def step_one(
    data, actions, queue, queue_at, slots, starts, steps, sizes, every, ring, ring_at, noise, obs,
    setup, n_sub, back, trace_row, history, tables, first, last, work,
):  # fmt: skip
    """As :func:`step_lanes`, one fish at a time: for a single fish."""
    bad = 0
    for lane in range(first, last):
        bad += step_block(
            work, 1, data, actions, queue, queue_at, slots, starts, steps, sizes, every, ring,
            ring_at, noise, obs, setup, n_sub, back, trace_row, history, tables, lane, 1,
        )  # fmt: skip
    return bad


@entry_point
def observe_batch(data, lanes, ring, newest, back, trace_row, noise, obs, setup):
    """Judge and observe some fish without moving them: what a reset returns."""
    for i in range(lanes.shape[0]):
        lane = lanes[i]
        set_goal(data, lane, ROW_GOAL, ROW_TIME, ROW_GUIDE, ROW_POINTS, 0.0, setup, True)
        judge(data, lane, ring, newest, INTEGRAL_ROW - trace_row, data[17, lane], 0.0, 1.0, setup)
        data[ROW_WITHIN, lane] = 0.0
        data[ROW_OUTPUT + 18, lane] = 0.0
        data[ROW_OUTPUT + 19, lane] = 0.0
        observe(data, lane, ring, newest, back, trace_row, noise, obs, setup)

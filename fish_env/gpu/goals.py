"""Goals of an episode on the device, fish by fish: what :mod:`fish_env.envs.tasks` draws in bulk.

Each function reads the uniform numbers of one fish, a column of ``draws``, as the task of the same
name does, and writes the rows ``goal`` and ``points`` of its column of ``data``. The same numbers
give the same goal, which a test holds both to.
"""

from __future__ import annotations

import math

from fish_env.envs.guides import (
    CRUISE,
    EAST,
    HEADING,
    KIND,
    LENGTH,
    NORTH,
    PITCH,
    POINTS,
    RADIUS,
    SWING,
)
from fish_env.envs.layout import GOAL, WAYPOINTS, GoalKind
from fish_env.envs.tasks.path import (
    DRAWN_LEGS,
    DRAWS_PER_LEG,
    FIRST_DRAW,
    WALL_MARGIN,
    WAYS_ROUND,
)
from fish_env.gpu.ranges import at

TASK_TRACK, TASK_PATH, TASK_STATION = 1, 2, 3
TASK_NUMBERS = {"hold": 0, "track": TASK_TRACK, "path": TASK_PATH, "station": TASK_STATION}

DEPTH, CRUISE_SPEED, TANK = at("depth"), at("cruise_speed"), at("tank")
DEPTH_SIGNAL, HEADING_SIGNAL = at("depth_step"), at("heading_step")
STEP_TIME, RAMP_TIME, RAMP_DURATION = at("step_time"), at("ramp_time"), at("ramp_duration")
SINE_PERIOD = at("sine_period")
HELIX_RADIUS, HELIX_PITCH, HELIX_TURNS = at("helix_radius"), at("helix_pitch"), at("helix_turns")
LEG, TURN, SLOPE = at("leg"), at("turn"), at("slope")
FIGURE_RADIUS, FIGURE_SWING = at("figure_radius"), at("figure_swing")
DISTANCE, WALLED, WALLS_NORTH = at("station_distance"), at("walled"), at("walls_north")
WALLS_EAST, SHAPE_ENDS = at("walls_east"), at("shape_ends")

N_GOAL, N_POINTS = len(GOAL), len(WAYPOINTS)
CIRCLE, LEGS, PLACE = float(GoalKind.CIRCLE), float(GoalKind.LEGS), float(GoalKind.PLACE)
PI = math.pi


def between(ranges, first, draw):
    """A uniform draw in [0, 1) mapped to a range."""
    return ranges[first] + (ranges[first + 1] - ranges[first]) * draw


def hold_goal(data, lane, goal, draws, ranges):
    """Constant references."""
    data[goal, lane] = between(ranges, DEPTH, draws[0, lane])
    data[goal + HEADING, lane] = PI * (2.0 * draws[1, lane] - 1.0)
    data[goal + CRUISE, lane] = between(ranges, CRUISE_SPEED, draws[2, lane])


def signal(data, lane, row, draws, first, ranges, sizes):
    """A step, a ramp or a sine of random sign, into the rows of a reference behind its base."""
    kind = math.floor(3.0 * draws[first, lane])
    sign = -1.0 if draws[first + 1, lane] < 0.5 else 1.0
    size, when = draws[first + 2, lane], draws[first + 3, lane]
    length = draws[first + 4, lane]
    start = between(ranges, RAMP_TIME, when)
    data[row + 1, lane] = sign * between(ranges, sizes, size) if kind == 0 else 0.0
    data[row + 2, lane] = between(ranges, STEP_TIME, when)
    data[row + 3, lane] = sign * between(ranges, sizes + 2, size) if kind == 1 else 0.0
    data[row + 4, lane] = start
    data[row + 5, lane] = start + between(ranges, RAMP_DURATION, length)
    data[row + 6, lane] = sign * between(ranges, sizes + 4, size) if kind == 2 else 0.0
    data[row + 7, lane] = 1.0 / between(ranges, SINE_PERIOD, length)
    data[row + 8, lane] = 0.0


def track_goal(data, lane, goal, draws, ranges):
    """A signal for depth and one for heading; depth stays inside the tank."""
    signal(data, lane, goal, draws, 3, ranges, DEPTH_SIGNAL)
    signal(data, lane, goal + HEADING, draws, 9, ranges, HEADING_SIGNAL)
    low = (ranges[DEPTH] + ranges[TANK]) / 2.0
    high = (ranges[DEPTH + 1] + ranges[TANK + 1]) / 2.0
    base, step, rate = data[goal, lane], data[goal + 1, lane], data[goal + 3, lane]
    one_way = step + rate * (data[goal + 5, lane] - data[goal + 4, lane])
    up, down = base - low, high - base
    sign = -1.0 if (one_way > down) & (up > down) else 1.0
    sign = -1.0 if (-one_way > up) & (down > up) else sign
    room = down if one_way * sign > 0.0 else up
    size = abs(one_way)
    shrink = (room / size if size > room else 1.0) * sign
    swing = abs(data[goal + 6, lane])
    fit = min(up, down) / (swing if swing > 0.0 else 1.0)
    data[goal + 1, lane] = step * shrink
    data[goal + 3, lane] = rate * shrink
    data[goal + 6, lane] = data[goal + 6, lane] * min(fit, 1.0)


def station_goal(data, lane, goal, draws, ranges):
    """A place in any direction; the heading is the bearing to it."""
    bearing = data[goal + HEADING, lane]
    distance = between(ranges, DISTANCE, draws[3, lane])
    north, east = distance * math.cos(bearing), distance * math.sin(bearing)
    data[goal + KIND, lane] = PLACE
    data[goal + NORTH, lane] = north
    data[goal + EAST, lane] = east
    data[goal + HEADING, lane] = math.atan2(east, north)


def path_goal(data, lane, goal, points, draws, ranges):
    """A helix, legs between waypoints, or a figure of eight, by their shares."""
    shape = draws[3, lane]
    if shape < ranges[SHAPE_ENDS]:
        helix(data, lane, goal, draws, ranges)
    elif shape < ranges[SHAPE_ENDS + 1]:
        waypoints(data, lane, goal, points, draws, ranges)
    else:
        figure(data, lane, goal, draws, ranges)


def helix(data, lane, goal, draws, ranges):
    """Down or up around a circle at a constant rate."""
    low, high = ranges[DEPTH], ranges[DEPTH + 1]
    radius = between(ranges, HELIX_RADIUS, draws[5, lane])
    turns = between(ranges, HELIX_TURNS, draws[6, lane])
    way = min(turns * between(ranges, HELIX_PITCH, draws[7, lane]), high - low)
    top = low + (high - low - way) * draws[0, lane]
    down = -1.0 if draws[8, lane] < 0.5 else 1.0
    data[goal + KIND, lane] = CIRCLE
    data[goal + RADIUS, lane] = -radius if draws[4, lane] < 0.5 else radius
    data[goal, lane] = top if down > 0.0 else top + way
    data[goal + PITCH, lane] = down * way / turns
    data[goal + LENGTH, lane] = turns * 2.0 * PI * radius


def figure(data, lane, goal, draws, ranges):
    """Around a circle while the depth swings twice in a turn."""
    low, high = ranges[DEPTH], ranges[DEPTH + 1]
    radius = between(ranges, FIGURE_RADIUS, draws[5, lane])
    swing = min(between(ranges, FIGURE_SWING, draws[6, lane]), (high - low) / 2.0)
    data[goal + KIND, lane] = CIRCLE
    data[goal + RADIUS, lane] = -radius if draws[4, lane] < 0.5 else radius
    data[goal, lane] = low + swing + (high - low - 2.0 * swing) * draws[0, lane]
    data[goal + SWING, lane] = -swing if draws[7, lane] < 0.5 else swing
    data[goal + LENGTH, lane] = 2.0 * PI * radius


def waypoints(data, lane, goal, points, draws, ranges):
    """Legs that turn to either side and go up and down, inside the tank."""
    low, high = ranges[DEPTH], ranges[DEPTH + 1]
    first_depth = data[goal, lane]
    course, depth = data[goal + HEADING, lane], first_depth
    north, east = 0.0 * course, 0.0 * course
    for leg in range(DRAWN_LEGS):
        row = FIRST_DRAW + DRAWS_PER_LEG * leg
        length = between(ranges, LEG, draws[row, lane])
        bend, slope = draws[row + 1, lane], draws[row + 2, lane]
        turn = between(ranges, TURN, abs(2.0 * bend - 1.0)) if leg > 0 else 0.0 * bend
        turn = -turn if (bend < 0.5) & (leg > 0) else turn
        course = course_inside(ranges, north, east, length, course, turn)
        north += length * math.cos(course)
        east += length * math.sin(course)
        step = between(ranges, SLOPE, abs(2.0 * slope - 1.0)) * length
        wanted = depth - step if slope < 0.5 else depth + step
        turned = 2.0 * depth - wanted if (wanted < low) | (wanted > high) else wanted
        depth = min(max(turned, low), high)
        if leg == 0:
            data[goal + HEADING, lane] = course
        data[points + 3 * leg, lane] = north
        data[points + 3 * leg + 1, lane] = east
        data[points + 3 * leg + 2, lane] = depth - first_depth
    data[goal + KIND, lane] = LEGS
    data[goal + POINTS, lane] = DRAWN_LEGS + 1.0


def course_inside(ranges, north, east, length, course, turn):
    """Course of a leg that ends inside the walls: as drawn, else the first that does (rad).

    Where none does, the one that ends farthest from the walls.
    """
    best = course + turn
    if ranges[WALLED] > 0.0:
        widest = -1e9 + 0.0 * turn
        for way in range(WAYS_ROUND):
            step = way * (2.0 * PI / WAYS_ROUND)
            tried = course + (turn - step if turn < 0.0 else turn + step)
            ends_north = north + length * math.cos(tried)
            ends_east = east + length * math.sin(tried)
            room = min(
                min(ends_north - ranges[WALLS_NORTH], ranges[WALLS_NORTH + 1] - ends_north),
                min(ends_east - ranges[WALLS_EAST], ranges[WALLS_EAST + 1] - ends_east),
            )
            if (room > widest) & (widest < WALL_MARGIN):
                widest, best = room, tried
    return best

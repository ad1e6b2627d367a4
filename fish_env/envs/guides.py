"""The goal of each fish as it is now: from signals, from a path or from a place, step by step.

``goal``, ``guide`` and ``points`` are the first rows of ``layout.GOAL``, ``layout.GUIDE`` and
``layout.WAYPOINTS`` in the data of a batch. Guidance knows the true position of the fish and its
velocity over ground, as a camera above the tank would measure them. The velocity is smoothed over
about a tail beat.
"""

from __future__ import annotations

import math

from fish_env.envs.guidance import (
    against_flow,
    corner,
    crab,
    drift_rate,
    heading_rate,
    leg_of,
    on_circle,
    on_leg,
    steer,
    wrapped,
)
from fish_env.envs.layout import GOAL, GUIDE, GoalKind, Setup
from fish_env.model.jit import kernel
from fish_env.model.trigonometry import sincos

SMOOTHING_S = 1.0
"""Time constant of the velocity that rates of goals follow from."""
LEAST_ROOM = 0.3
"""Least distance from the centre of a bend (share of its radius) that rates are computed for."""

HEADING = GOAL.index("heading_base")
CRUISE = GOAL.index("cruise_speed")
KIND = GOAL.index("kind")
NORTH = GOAL.index("place_north")
EAST = GOAL.index("place_east")
RADIUS = GOAL.index("path_radius")
PITCH = GOAL.index("path_pitch")
SWING = GOAL.index("path_swing")
LENGTH = GOAL.index("path_length")
POINTS = GOAL.index("path_points")
FLOW_NORTH = GOAL.index("flow_north")
FLOW_EAST = GOAL.index("flow_east")

CROSS_TRACK = GUIDE.index("cross_track")
PROGRESS = GUIDE.index("progress")
PLACE_ERROR = GUIDE.index("place_error")
ALONG = GUIDE.index("along")
LEG = GUIDE.index("leg")
LEG_START = GUIDE.index("leg_start")
DRIFT = GUIDE.index("drift")
VELOCITY_NORTH = GUIDE.index("velocity_north")
VELOCITY_EAST = GUIDE.index("velocity_east")
SIDE = GUIDE.index("side")
GUIDE_ROWS = len(GUIDE)

CIRCLE = float(GoalKind.CIRCLE)
PLACE = float(GoalKind.PLACE)
LEGS = float(GoalKind.LEGS)
LOOKAHEAD = int(Setup.LOOKAHEAD)
INTEGRAL = int(Setup.INTEGRAL)
CORNER = int(Setup.CORNER)
STATION_GAIN = int(Setup.STATION_GAIN)
STATION_CIRCLE = int(Setup.STATION_CIRCLE)
STATION_CALM = int(Setup.STATION_CALM)


@kernel
def reference(data, row, lane, time):
    """Value and rate of a reference signal at a time (see layout.REFERENCE)."""
    base = data[row, lane]
    step = data[row + 1, lane] if time >= data[row + 2, lane] else 0.0
    rate = data[row + 3, lane]
    start = data[row + 4, lane]
    end = data[row + 5, lane]
    ramped = min(max(time - start, 0.0), max(end - start, 0.0))
    omega = 6.283185307179586 * data[row + 7, lane]
    sine, cosine = sincos(omega * time + data[row + 8, lane])
    amplitude = data[row + 6, lane]
    ramping = (time >= start) & (time < end)
    value = base + step + rate * ramped + amplitude * sine
    return value, (rate if ramping else 0.0) + amplitude * omega * cosine


@kernel
def set_goal(data, lane, goal, time_row, guide, points, period, setup, fresh):
    """Write the goal of now into the rows of ``GUIDE``; a fresh episode begins its guidance."""
    kind = data[goal + KIND, lane]
    if kind == 0.0:
        time = data[time_row, lane]
        depth, depth_rate = reference(data, goal, lane, time)
        heading, turn_rate = reference(data, goal + HEADING, lane, time)
        data[guide, lane] = depth
        data[guide + 1, lane] = depth_rate
        data[guide + 2, lane] = heading
        data[guide + 3, lane] = turn_rate
        data[guide + 4, lane] = data[goal + CRUISE, lane]
    else:
        if fresh:
            begin(data, lane, goal, guide, points, setup)
        smooth_velocity(data, lane, guide, period)
        if kind == PLACE:
            to_place(data, lane, goal, guide, period, setup)
        else:
            along_path(data, lane, goal, guide, points, period, setup)


@kernel
def ground_velocity(data, lane):
    """Velocity over ground to the north and to the east (m/s)."""
    qw, qx, qy, qz = data[3, lane], data[4, lane], data[5, lane], data[6, lane]
    u, v, w = data[7, lane], data[8, lane], data[9, lane]
    north = (1.0 - 2.0 * (qy * qy + qz * qz)) * u
    north += 2.0 * (qx * qy - qw * qz) * v + 2.0 * (qx * qz + qw * qy) * w
    east = 2.0 * (qx * qy + qw * qz) * u
    east += (1.0 - 2.0 * (qx * qx + qz * qz)) * v + 2.0 * (qy * qz - qw * qx) * w
    return north, east


@kernel
def begin(data, lane, goal, guide, points, setup):
    """Forget the last episode; measure the legs, and choose the side to go round a place."""
    for row in range(GUIDE_ROWS):
        data[guide + row, lane] = 0.0
    north, east = ground_velocity(data, lane)
    data[guide + VELOCITY_NORTH, lane] = north
    data[guide + VELOCITY_EAST, lane] = east
    if data[goal + KIND, lane] == PLACE:
        bearing = math.atan2(
            data[goal + EAST, lane] - data[1, lane], data[goal + NORTH, lane] - data[0, lane]
        )
        qw, qx, qy, qz = data[3, lane], data[4, lane], data[5, lane], data[6, lane]
        heading = math.atan2(2.0 * (qx * qy + qw * qz), 1.0 - 2.0 * (qy * qy + qz * qz))
        # With the place to port, the way round it is to port too.
        data[guide + SIDE, lane] = -1.0 if wrapped(heading - bearing) > 0.0 else 1.0
    if data[goal + KIND, lane] == LEGS:
        length = 0.0
        for leg in range(int(data[goal + POINTS, lane]) - 1):
            _, tangent, _, _, size, turn, radius, leave = leg_at(
                data, lane, goal, points, leg, setup[CORNER]
            )
            length += size - tangent - leave + radius * abs(turn)
        data[goal + LENGTH, lane] = length


@kernel
def smooth_velocity(data, lane, guide, period):
    """Follow the velocity over ground with a time constant of about a tail beat."""
    north, east = ground_velocity(data, lane)
    share = min(period / SMOOTHING_S, 1.0)
    data[guide + VELOCITY_NORTH, lane] += share * (north - data[guide + VELOCITY_NORTH, lane])
    data[guide + VELOCITY_EAST, lane] += share * (east - data[guide + VELOCITY_EAST, lane])


@kernel
def waypoint(data, lane, points, number):
    """North, east and depth of a waypoint, from the start of the path (m)."""
    row = points + 3 * (number - 1)
    if number == 0:
        return 0.0, 0.0, 0.0
    return data[row, lane], data[row + 1, lane], data[row + 2, lane]


@kernel
def leg_at(data, lane, goal, points, leg, radius):
    """A leg and the arcs at its ends.

    Returns:
        Course (rad), length that the arc before takes up (m), unit vector north and east, length
        (m), and of the arc behind: turn (rad), radius (m, 0: none) and length that it takes up (m).
    """
    north, east, _ = waypoint(data, lane, points, leg)
    to_north, to_east, _ = waypoint(data, lane, points, leg + 1)
    length, course, ahead_north, ahead_east = leg_of(to_north - north, to_east - east)
    enter, leave, turn, bend = 0.0, 0.0, 0.0, 0.0
    if leg > 0:
        from_north, from_east, _ = waypoint(data, lane, points, leg - 1)
        before, course_before, _, _ = leg_of(north - from_north, east - from_east)
        _, _, enter = corner(before, course_before, length, course, radius)
    if leg + 2 < data[goal + POINTS, lane]:
        next_north, next_east, _ = waypoint(data, lane, points, leg + 2)
        after, course_after, _, _ = leg_of(next_north - to_north, next_east - to_east)
        turn, bend, leave = corner(length, course, after, course_after, radius)
    return course, enter, ahead_north, ahead_east, length, turn, bend, leave


@kernel
def depth_at(data, lane, goal, points, leg, share):
    """Depth (m) of a leg a share of its length behind its beginning."""
    _, _, begins = waypoint(data, lane, points, leg)
    _, _, ends = waypoint(data, lane, points, leg + 1)
    return data[goal, lane] + begins + (ends - begins) * min(max(share, 0.0), 1.0)


@kernel
def on_legs(data, lane, goal, guide, points, setup):
    """Where a fish is on the present leg or on the arc behind it.

    Returns:
        Course of the path abeam (rad), distance to starboard of it (m), its curvature (1/m), its
        depth (m), slope, distance along the path (m), and whether the leg and its arc lie behind;
        ``leg_start`` is what is along the path then (m).
    """
    leg = int(data[guide + LEG, lane])
    course, enter, ahead_north, ahead_east, length, turn, radius, leave = leg_at(
        data, lane, goal, points, leg, setup[CORNER]
    )
    north, east, begins = waypoint(data, lane, points, leg)
    _, _, ends = waypoint(data, lane, points, leg + 1)
    north = data[0, lane] - data[goal + NORTH, lane] - north
    east = data[1, lane] - data[goal + EAST, lane] - east
    along, across = on_leg(north, east, ahead_north, ahead_east)
    straight = length - enter - leave
    ahead = data[guide + LEG_START, lane] + straight + radius * abs(turn)
    last = leg + 2 >= data[goal + POINTS, lane]
    beyond = along - (length - leave)
    depth = depth_at(data, lane, goal, points, leg, along / length)
    slope = (ends - begins) / length if (along >= 0.0) & (along <= length) else 0.0
    curvature, behind = 0.0, False
    where = data[guide + LEG_START, lane] + max(along - enter, 0.0)
    if (beyond > 0.0) & (not last):
        behind = True
        if radius > 0.0:
            side = 1.0 if turn > 0.0 else -1.0
            bent, across_arc = on_circle(beyond, across - side * radius, side * radius)
            swept = side * bent
            if swept < abs(turn):
                behind = False
                first = depth_at(data, lane, goal, points, leg, 1.0 - leave / length)
                north, east, _ = waypoint(data, lane, points, leg + 1)
                to_north, to_east, _ = waypoint(data, lane, points, leg + 2)
                following, _, _, _ = leg_of(to_north - north, to_east - east)
                second = depth_at(data, lane, goal, points, leg + 1, leave / following)
                course += bent
                across = across_arc
                curvature = side / radius
                slope = (second - first) / (radius * abs(turn))
                depth = first + slope * radius * swept
                where = data[guide + LEG_START, lane] + straight + radius * swept
    return course, across, curvature, depth, slope, where, behind, ahead


@kernel
def around_circle(data, lane, goal, guide):
    """Where a fish is on a path around a circle; returns as :func:`on_legs`, but for the end."""
    radius, start = data[goal + RADIUS, lane], data[goal + HEADING, lane]
    sine, cosine = sincos(start)
    north = data[0, lane] - data[goal + NORTH, lane] + radius * sine
    east = data[1, lane] - data[goal + EAST, lane] - radius * cosine
    course, across = on_circle(north, east, radius)
    where = data[guide + ALONG, lane]
    where += radius * wrapped(course - start - where / radius)
    size = abs(radius)
    per_metre = data[goal + PITCH, lane] / (6.283185307179586 * size)
    length = data[goal + LENGTH, lane]
    swing = data[goal + SWING, lane]
    sine, cosine = sincos(2.0 * where / size)
    depth = data[goal, lane] + per_metre * min(max(where, 0.0), length) + swing * sine
    sloping = (where >= 0.0) & (where < length)
    slope = (per_metre if sloping else 0.0) + 2.0 * swing / size * cosine
    return course, across, 1.0 / radius, depth, slope, where


@kernel
def along_path(data, lane, goal, guide, points, period, setup):
    """Line of sight along a path: depth, heading, their rates, and speed."""
    if data[goal + KIND, lane] == CIRCLE:
        course, across, curvature, depth, slope, where = around_circle(data, lane, goal, guide)
    else:
        behind = True
        while behind:
            course, across, curvature, depth, slope, where, behind, ahead = on_legs(
                data, lane, goal, guide, points, setup
            )
            if behind:
                data[guide + LEG, lane] += 1.0
                data[guide + LEG_START, lane] = ahead
    data[guide + ALONG, lane] = where
    data[guide, lane] = depth
    data[guide + 4, lane] = data[goal + CRUISE, lane]
    data[guide + CROSS_TRACK, lane] = across
    length = data[goal + LENGTH, lane]
    done = where / length if length > 0.0 else 0.0
    data[guide + PROGRESS, lane] = min(max(done, 0.0), 1.0)
    speed = line_of_sight(data, lane, guide, course, across, curvature, period, setup)
    data[guide + 1, lane] = slope * speed


@kernel
def line_of_sight(data, lane, guide, course, across, curvature, period, setup):
    """Write heading and its rate; returns the speed along the path (m/s)."""
    lookahead = setup[LOOKAHEAD]
    drift = data[guide + DRIFT, lane]
    drift += period * drift_rate(across, drift, lookahead, setup[INTEGRAL])
    data[guide + DRIFT, lane] = drift
    sine, cosine = sincos(course)
    north, east = data[guide + VELOCITY_NORTH, lane], data[guide + VELOCITY_EAST, lane]
    speed = (north * cosine + east * sine) / max(1.0 - curvature * across, LEAST_ROOM)
    across_rate = east * cosine - north * sine
    data[guide + 2, lane] = wrapped(steer(course, across, drift, lookahead))
    data[guide + 3, lane] = heading_rate(curvature * speed, across_rate, across, drift, lookahead)
    return speed


@kernel
def to_place(data, lane, goal, guide, period, setup):
    """Towards a place: against a flow that is strong enough, else around the place."""
    north = data[goal + NORTH, lane] - data[0, lane]
    east = data[goal + EAST, lane] - data[1, lane]
    down = data[goal, lane] - data[2, lane]
    flow_north, flow_east = data[goal + FLOW_NORTH, lane], data[goal + FLOW_EAST, lane]
    cruise = data[goal + CRUISE, lane]
    data[guide, lane] = data[goal, lane]
    data[guide + PLACE_ERROR, lane] = math.sqrt(north * north + east * east + down * down)
    if math.sqrt(flow_north * flow_north + flow_east * flow_east) < setup[STATION_CALM]:
        radius = data[guide + SIDE, lane] * setup[STATION_CIRCLE]
        course, across = on_circle(-north, -east, radius)
        line_of_sight(data, lane, guide, course, across, 1.0 / radius, period, setup)
        heading = crab(data[guide + 2, lane], flow_north, flow_east, cruise)
        data[guide + 2, lane] = wrapped(heading)
        data[guide + 4, lane] = cruise
    else:
        gain = setup[STATION_GAIN]
        heading, speed = against_flow(north, east, down, flow_north, flow_east, gain, cruise)
        data[guide + 2, lane] = heading
        data[guide + 4, lane] = speed

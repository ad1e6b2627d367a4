"""Guidance: from a path or a place and where the fish is, to what it should steer for.

Lateral guidance is line of sight with an integral. With a lookahead distance D, a fish at
cross-track error e of a path with course c steers for c - atan((e + d) / D) (Fossen, Handbook of
Marine Craft and Motion Control, section 12.3); the integral d grows at a bounded rate and takes out
what a current makes (Borhaug, Pavlov and Pettersen, "Integral LOS Control for Path Following of
Underactuated Marine Surface Vessels in the Presence of Constant Ocean Currents", CDC 2008).
Vertically the reference is the depth of the path abeam of the fish, and the rate at which that
changes. All angles in rad, lengths in m, frame north, east, down.
"""

from __future__ import annotations

import math

from fish_env.model.jit import kernel
from fish_env.model.trigonometry import sincos

SHARPEST = 3.0
"""Largest turn (rad) at a waypoint that an arc is put into."""
SHARE_OF_LEG = 0.45
"""Of a leg that one of its arcs may take up."""


@kernel
def wrapped(angle):
    """An angle in -pi..pi."""
    return angle - 6.283185307179586 * math.floor(angle / 6.283185307179586 + 0.5)


@kernel
def on_leg(north, east, ahead_north, ahead_east):
    """Distances along a leg and to starboard of it, from an offset and the leg's unit vector."""
    along = ahead_north * north + ahead_east * east
    return along, ahead_north * east - ahead_east * north


@kernel
def on_circle(north, east, radius):
    """Course and cross-track error on a circle.

    Args:
        north: of the fish from the centre, and
        east: (m).
        radius: positive where the path turns to starboard (m).

    Returns:
        Course of the path abeam of the fish (rad), distance to starboard of the path (m).
    """
    side = 1.0 if radius > 0.0 else -1.0
    away = math.sqrt(north * north + east * east)
    return math.atan2(side * north, -side * east), radius - side * away


@kernel
def steer(course, across, drift, lookahead):
    """Heading (rad) that leads back to a path with this course."""
    return course - math.atan((across + drift) / lookahead)


@kernel
def drift_rate(across, drift, lookahead, gain):
    """Rate of the integral (m/s): of the sign of the error, bounded by half the gain."""
    error = across + drift
    return gain * lookahead * across / (lookahead * lookahead + error * error)


@kernel
def heading_rate(course_rate, across_rate, across, drift, lookahead):
    """Rate (rad/s) at which the heading of :func:`steer` changes."""
    ratio = (across + drift) / lookahead
    return course_rate - across_rate / lookahead / (1.0 + ratio * ratio)


@kernel
def corner(length, course, next_length, next_course, radius):
    """The arc that rounds a waypoint.

    Args:
        length: of the leg that ends there (m).
        course: of it (rad).
        next_length: of the leg that begins there (m).
        next_course: of it (rad).
        radius: of the arc, where the legs are long enough (m).

    Returns:
        Turn (rad, positive to starboard), radius (m, 0 where the turn stays sharp), and distance
        from the waypoint at which the arc begins and ends (m).
    """
    turn = wrapped(next_course - course)
    size = abs(turn)
    room = SHARE_OF_LEG * min(length, next_length)
    tangent = math.tan(0.5 * min(size, SHARPEST))
    begin = min(radius * tangent, room)
    rounded = (size > 1e-9) & (size < SHARPEST)
    return turn, (begin / tangent if rounded else 0.0), (begin if rounded else 0.0)


@kernel
def leg_of(north, east):
    """Length of a leg (m), course (rad) and unit vector, from its end seen from its beginning."""
    length = math.sqrt(north * north + east * east)
    share = 1.0 / length if length > 0.0 else 0.0
    return length, math.atan2(east, north), share * north, share * east


@kernel
def crab(heading, flow_north, flow_east, speed):
    """Heading (rad) at which the way over ground is along ``heading`` in spite of a flow (m/s)."""
    sine, cosine = sincos(heading)
    share = (flow_east * cosine - flow_north * sine) / speed if speed > 0.0 else 0.0
    return heading - math.asin(min(max(share, -0.9), 0.9))


@kernel
def against_flow(north, east, down, flow_north, flow_east, gain, cruise):
    """What to steer for to reach a place in a flow, and to stay there by swimming against it.

    The wanted velocity through the water is towards the place, less the flow. Near the place the
    flow is all that is left, so that the fish heads against it and falls back by swimming slower.

    Args:
        north: from the fish to the place,
        east: and
        down: (m).
        flow_north: of the water (m/s), and
        flow_east: to the east.
        gain: speed over ground for a distance (1/s).
        cruise: largest speed over ground (m/s).

    Returns:
        Heading (rad) and speed over ground along it (m/s), negative to fall back.
    """
    level = math.sqrt(north * north + east * east)
    away = math.sqrt(level * level + down * down)
    speed = min(gain * away, cruise)
    share = speed / level if level > 1e-9 else 0.0
    to_north, to_east = share * north, share * east
    heading = math.atan2(to_east - flow_east, to_north - flow_north)
    sine, cosine = sincos(heading)
    return heading, to_north * cosine + to_east * sine

"""Gains of the teacher: those of the PID controller, and those of its additional information."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields

from robofish_agents.controllers.pid import Gain, PIDGains, tuned_gains


@dataclass(frozen=True)
class TeacherGains(PIDGains):
    """Gains of the PID controller, and these.

    Attributes:
        depth_ahead: time ahead of the depth error, with present rates of goal and fish (s).
        climb_ahead: time ahead of the desired climb rate (s).
        turn_ahead: time ahead of the desired turn rate (s).
        trim_moment: block action to begin with, per kg m of moment beyond the nominal fish's.
        trim_lift: the same per kg of displaced water beyond the nominal fish's.
        hurry: largest speed beyond the goal where the block is at its end (m/s).
        saving: speed below the goal where nothing asks for more (m/s).
        swing_from: rate of the goal depth, at its fastest, from which it hurries (m/s).
        swing_speed: speed beyond the goal per rate beyond that.
        turn_from: heading error from which it hurries (rad).
        turn_range: heading error over which that becomes whole (rad).
        turn_speed: speed beyond the goal when it is whole (m/s).
        far_from: depth error from which it hurries (m).
        far_speed: speed beyond the goal per depth error beyond that (1/s).
        far_limit: most of it (m/s).
    """

    depth_ahead: Gain
    climb_ahead: Gain
    turn_ahead: Gain
    trim_moment: Gain
    trim_lift: Gain
    hurry: Gain
    saving: Gain
    swing_from: Gain
    swing_speed: Gain
    turn_from: Gain
    turn_range: Gain
    turn_speed: Gain
    far_from: Gain
    far_speed: Gain
    far_limit: Gain


TEACHER_GAIN_NAMES = tuple(field.name for field in fields(TeacherGains))
NOTHING_BEYOND = {
    "depth_ahead": 0.0,
    "climb_ahead": 0.0,
    "turn_ahead": 0.0,
    "trim_moment": 0.0,
    "trim_lift": 0.0,
    "hurry": 0.015,
    "saving": 0.0,
    "swing_from": 0.0,
    "swing_speed": 0.0,
    "turn_from": 0.2,
    "turn_range": 0.3,
    "turn_speed": 0.0,
    "far_from": 0.0,
    "far_speed": 0.0,
    "far_limit": 0.0,
}
"""With these the teacher foresees and hurries no more than the PID controller."""


def teacher_gains(changes: Mapping[str, Gain]) -> TeacherGains:
    """Returns the tuned gains of the PID controller, with changes; all others are zero."""
    return TeacherGains(**{**asdict(tuned_gains()), **NOTHING_BEYOND, **changes})

"""Start of an episode: goal, pose, parameters, from uniform draws and from what a user fixes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.effects.extended import PREFIX
from fish_env.envs.layout import GOAL, MOST_WAYPOINTS, REFERENCE, WAYPOINTS, GoalKind
from fish_env.envs.options import EnvOptions
from fish_env.envs.randomization import with_effects
from fish_env.envs.tasks import GOAL_DRAWS, SIGNAL_TASKS
from fish_env.envs.tasks.hold import between
from fish_env.errors import ConfigError
from fish_env.model.frames import quaternion_from_euler
from fish_env.model.state import BASE_STATES
from fish_env.reading import is_number, shown

POSE_DRAWS = 6
STATE_KEYS = {
    "position": 3,
    "euler": 3,
    "velocity_body": 3,
    "angular_velocity_body": 3,
    "tail_phase": 1,
}
GOAL_KEYS = {
    "depth": "depth_base",
    "heading": "heading_base",
    "cruise_speed": "cruise_speed",
    "north": "place_north",
    "east": "place_east",
}
ROWS = (*GOAL, *WAYPOINTS)
GUIDED = GOAL[GOAL.index("kind") :]
"""Fields of a goal that signals do not have."""
SMALLEST_RADIUS = 0.05
FLOW = ("effects.current.north", "effects.current.east")
OPTION_KEYS = ("state", "goal", "parameters")


def draw_count(options: EnvOptions) -> int:
    """Uniform numbers that one episode needs."""
    random = 0 if options.random is None else len(options.random.paths)
    return GOAL_DRAWS + POSE_DRAWS + random


def check_reset_options(given: Mapping[str, Any] | None) -> Mapping[str, Mapping[str, Any]]:
    """Reset options with known keys only.

    Raises:
        ConfigError: an unknown key, or a value that is not a mapping.
    """
    given = reset_mapping(given)
    unknown = [key for key in given if key not in OPTION_KEYS]
    if unknown:
        raise ConfigError(
            f"reset options {shown(unknown)} are unknown; use {', '.join(OPTION_KEYS)}"
        )
    for key, value in given.items():
        if not isinstance(value, Mapping):
            raise ConfigError(f"reset option '{key}' must be a mapping of names to numbers")
    return given


def reset_mapping(given: Mapping[str, Any] | None) -> Mapping[str, Any]:
    """Reset options, none as an empty mapping.

    Raises:
        ConfigError: no mapping.
    """
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise ConfigError(f"reset options {shown(given)}: a mapping of {', '.join(OPTION_KEYS)}")
    return given


def goals(options: EnvOptions, draws: FloatArray, given: Mapping[str, Any]) -> FloatArray:
    """Goal rows (len(GOAL) + len(WAYPOINTS), N): the task's draw, changed by ``options["goal"]``.

    A goal may name depth (m), heading (rad) and cruise_speed (m/s), north and east (m) of a place
    or of the start of a path, waypoints, or any field of layout.GOAL. A constant given for depth
    or heading replaces the whole drawn signal, waypoints or path_radius the whole drawn path.
    """
    fields = options.goals(options.config, draws[:GOAL_DRAWS])
    count = draws.shape[1]
    rows = np.zeros((len(ROWS), count))
    for name, values in fields.items():
        rows[ROWS.index(name)] = values
    wanted = dict(given.get("goal", {}))
    waypoints = wanted.pop("waypoints", None)
    if waypoints is not None:
        _put_waypoints(options, rows, waypoints)
    elif options.task == "path" and "path_radius" in wanted:
        _put_circle(rows, wanted["path_radius"])
    for key, value in wanted.items():
        if GOAL_KEYS.get(key, key) not in GOAL or not is_number(value):
            raise ConfigError(
                f"goal '{key}' = {value!r}: finite numbers for {', '.join([*GOAL_KEYS, *GOAL])}"
            )
    for key in ("depth", "heading"):
        if key in wanted:
            first = GOAL.index(GOAL_KEYS[key])
            rows[first : first + len(REFERENCE)] = 0.0
    for key, value in wanted.items():
        rows[GOAL.index(GOAL_KEYS.get(key, key))] = value
    _check_goal(options, wanted)
    if options.task == "station" and "heading" not in wanted:
        north, east = rows[GOAL.index("place_north")], rows[GOAL.index("place_east")]
        rows[GOAL.index("heading_base")] = np.arctan2(east, north)
    return rows


def _put_waypoints(options: EnvOptions, rows: FloatArray, given: Any) -> None:
    """Replace the drawn path by legs between given waypoints (n, 3): north, east, depth (m)."""
    if options.task != "path":
        raise ConfigError(f"goal 'waypoints' belongs to task path, and this is {options.task}")
    try:
        points = np.array(given, float)
    except (ValueError, TypeError):
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != 3 or not 2 <= len(points) <= MOST_WAYPOINTS:
        raise ConfigError(f"goal 'waypoints': 2 to {MOST_WAYPOINTS} of north, east, depth (m)")
    level = np.hypot(*np.diff(points[:, :2], axis=0).T)
    if not np.isfinite(points).all() or level.min() < 1e-6:
        raise ConfigError("goal 'waypoints': finite, and no leg may go straight up or down")
    config = options.config
    if points[:, 2].min() < config.top or points[:, 2].max() > config.bottom:
        raise ConfigError(
            f"goal 'waypoints': the fish may swim from {config.top} to {config.bottom} m deep"
        )
    rows[len(GOAL) :] = 0.0
    offsets = (points[1:] - points[0]).reshape(-1)
    rows[len(GOAL) : len(GOAL) + len(offsets)] = offsets[:, None]
    first = points[1] - points[0]
    values = {
        "kind": GoalKind.LEGS,
        "path_points": len(points),
        "place_north": points[0, 0],
        "place_east": points[0, 1],
        "depth_base": points[0, 2],
        "heading_base": np.arctan2(first[1], first[0]),
    }
    for name, value in values.items():
        rows[GOAL.index(name)] = value


def _put_circle(rows: FloatArray, radius: Any) -> None:
    """Replace the drawn path by one turn of a level circle, which other fields may change."""
    if not is_number(radius) or abs(radius) < SMALLEST_RADIUS:
        raise ConfigError(
            f"goal 'path_radius' = {radius!r}: at least {SMALLEST_RADIUS} m, negative to port"
        )
    values = {
        "kind": float(GoalKind.CIRCLE),
        "path_pitch": 0.0,
        "path_swing": 0.0,
        "path_length": 2.0 * np.pi * abs(radius),
    }
    for name, value in values.items():
        rows[GOAL.index(name)] = value


def _check_goal(options: EnvOptions, wanted: Mapping[str, float]) -> None:
    config = options.config
    if options.task in SIGNAL_TASKS:
        foreign = [key for key in wanted if GOAL_KEYS.get(key, key) in GUIDED]
        if foreign:
            raise ConfigError(f"goal {foreign}: of the tasks path and station, not {options.task}")
    elif "kind" in wanted:
        raise ConfigError("goal 'kind' follows from the task; give waypoints or path_radius")
    depth, speed = wanted.get("depth", config.top), wanted.get("cruise_speed", 0.0)
    if not config.top <= depth <= config.bottom:
        raise ConfigError(
            f"goal depth {depth} m: the fish may swim from {config.top} to {config.bottom} m"
        )
    if speed < 0:
        raise ConfigError(f"goal cruise_speed {speed} m/s: 0 or more")


def poses(
    options: EnvOptions, draws: FloatArray, goal: FloatArray, given: Mapping[str, Any]
) -> FloatArray:
    """Base states (18, N) at the start: near the goal by draw, changed by ``options["state"]``."""
    config = options.config
    ranges = config.tree["start"]
    u = draws[GOAL_DRAWS : GOAL_DRAWS + POSE_DRAWS]
    count = draws.shape[1]
    depth_goal, heading_goal = goal[0], goal[len(REFERENCE)]
    margin = 0.05 * (config.bottom - config.top)
    depth = depth_goal + ranges["depth_offset"] * (2.0 * u[0] - 1.0)
    state = np.zeros((len(BASE_STATES), count))
    state[2] = np.clip(depth, config.top + margin, config.bottom - margin)
    euler = np.stack(
        [
            ranges["tilt"] * (2.0 * u[2] - 1.0),
            ranges["tilt"] * (2.0 * u[3] - 1.0),
            heading_goal + ranges["heading_offset"] * (2.0 * u[1] - 1.0),
        ],
        axis=-1,
    )
    state[7] = between(ranges["surge"], u[4])
    state[13] = 2.0 * np.pi * u[5]
    fixed = given.get("state", {})
    for key, value in fixed.items():
        size = STATE_KEYS.get(key, 0)
        numbers = np.reshape(np.array(value, object), -1)
        if not size or numbers.size != size or not all(map(is_number, numbers)):
            raise ConfigError(
                f"state '{key}' = {value!r}: finite numbers, as many as here: {STATE_KEYS}"
            )
        rows = {"position": 0, "velocity_body": 7, "angular_velocity_body": 10, "tail_phase": 13}
        if key == "euler":
            euler[:] = numbers
        else:
            state[rows[key] : rows[key] + size] = numbers[:, None]
    state[3:7] = quaternion_from_euler(euler).T
    return state


def parameters(
    options: EnvOptions, draws: FloatArray, given: Mapping[str, Any]
) -> dict[str, FloatArray]:
    """Parameters that differ from the fish's own, path -> (N,): drawn, then fixed by the user.

    Raises:
        ConfigError: not a number.
        ParameterError, EffectError: an unknown path, or a value that is not possible.
    """
    wanted = given.get("parameters", {})
    for path, value in wanted.items():
        if not is_number(value):
            raise ConfigError(f"parameter '{path}' = {value!r}: give a finite number")
    fish = {path: value for path, value in wanted.items() if not path.startswith(PREFIX)}
    if fish:
        options.model.fish.replace(fish)
    with_effects(options.model, wanted).check_step(options.config.dt)
    random = options.random
    drawn = random.draw(draws[GOAL_DRAWS + POSE_DRAWS :]) if random is not None else {}
    fixed = {path: np.full(draws.shape[1], float(value)) for path, value in wanted.items()}
    return {**drawn, **fixed}


def put_flow(
    options: EnvOptions,
    goal: FloatArray,
    changes: Mapping[str, FloatArray],
    given: Mapping[str, Any],
) -> None:
    """Write the steady current (m/s) of each fish into its goal: a place is kept against it.

    Args:
        options: the environment; its effect ``current`` holds where nothing is changed.
        goal: (rows, N), changed.
        changes: parameter path -> (N,), see :func:`parameters`.
        given: reset options; a flow that the goal names stays.
    """
    if options.task != "station":
        return
    steady = options.model.effects.get("current", {})
    for path, field in zip(FLOW, ("flow_north", "flow_east"), strict=True):
        if field not in given.get("goal", {}):
            goal[GOAL.index(field)] = changes.get(path, steady.get(path.rsplit(".", 1)[1], 0.0))


def records(options: EnvOptions, changes: Mapping[str, FloatArray], count: int) -> FloatArray:
    """Parameter records (parameters, N) of N fish with these changes."""
    record = options.model.records(changes)
    return np.broadcast_to(record, (len(record), count))

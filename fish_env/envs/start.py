"""Start of an episode: goal, pose, parameters, from uniform draws and from what a user fixes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.effects.extended import PREFIX
from fish_env.envs.config import EnvConfig
from fish_env.envs.layout import GOAL, REFERENCE
from fish_env.envs.options import EnvOptions
from fish_env.envs.randomization import with_effects
from fish_env.envs.tasks import GOAL_DRAWS
from fish_env.envs.tasks.hold import between
from fish_env.errors import ConfigError
from fish_env.model.frames import quaternion_from_euler
from fish_env.model.state import BASE_STATES
from fish_env.reading import is_number

POSE_DRAWS = 6
STATE_KEYS = {
    "position": 3,
    "euler": 3,
    "velocity_body": 3,
    "angular_velocity_body": 3,
    "tail_phase": 1,
}
GOAL_KEYS = {"depth": "depth_base", "heading": "heading_base", "cruise_speed": "cruise_speed"}
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
    given = given or {}
    unknown = [key for key in given if key not in OPTION_KEYS]
    if unknown:
        raise ConfigError(f"reset options {unknown} are unknown; use {', '.join(OPTION_KEYS)}")
    for key, value in given.items():
        if not isinstance(value, Mapping):
            raise ConfigError(f"reset option '{key}' must be a mapping of names to numbers")
    return given


def goals(options: EnvOptions, draws: FloatArray, given: Mapping[str, Any]) -> FloatArray:
    """Goal rows (len(GOAL), N): the task's draw, changed by ``options["goal"]``.

    A goal may name depth (m), heading (rad) and cruise_speed (m/s), or any field of layout.GOAL.
    A constant given for depth or heading replaces the whole drawn signal.
    """
    fields = options.goals(options.config, draws[:GOAL_DRAWS])
    count = draws.shape[1]
    rows = np.zeros((len(GOAL), count))
    for name, values in fields.items():
        rows[GOAL.index(name)] = values
    wanted = given.get("goal", {})
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
    _check_goal(options.config, wanted)
    return rows


def _check_goal(config: EnvConfig, wanted: Mapping[str, float]) -> None:
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


def records(options: EnvOptions, changes: Mapping[str, FloatArray], count: int) -> FloatArray:
    """Parameter records (parameters, N) of N fish with these changes."""
    record = options.model.records(changes)
    return np.broadcast_to(record, (len(record), count))

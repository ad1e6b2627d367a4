"""Start of an episode: goal, pose, parameters, from uniform draws and from what a user fixes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.envs.layout import GOAL, REFERENCE
from fish_env.envs.options import EnvOptions
from fish_env.envs.tasks import GOAL_DRAWS
from fish_env.envs.tasks.hold import between
from fish_env.errors import ConfigError
from fish_env.model.frames import quaternion_from_euler
from fish_env.model.state import BASE_STATES

FloatArray = npt.NDArray[np.float64]
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


def check_reset_options(given: Mapping[str, Any] | None) -> Mapping[str, Any]:
    """Reset options with known keys only.

    Raises:
        ConfigError: an unknown key.
    """
    given = given or {}
    unknown = [key for key in given if key not in OPTION_KEYS]
    if unknown:
        raise ConfigError(f"reset options {unknown} are unknown; use {', '.join(OPTION_KEYS)}")
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
    for key, value in given.get("goal", {}).items():
        name = GOAL_KEYS.get(key, key)
        if name not in GOAL or not np.isfinite(value):
            raise ConfigError(
                f"goal '{key}' = {value!r}: finite numbers for {', '.join([*GOAL_KEYS, *GOAL])}"
            )
        if key in ("depth", "heading"):
            first = GOAL.index(name)
            rows[first : first + len(REFERENCE)] = 0.0
        rows[GOAL.index(name)] = float(value)
    speed = rows[GOAL.index("cruise_speed")]
    if np.any(speed < 0):
        raise ConfigError(f"goal cruise_speed {speed.min()} m/s: 0 or more")
    return rows


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
        size = STATE_KEYS.get(key)
        numbers = np.asarray(value, float).reshape(-1)
        if size is None or numbers.size != size or not np.all(np.isfinite(numbers)):
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


def records(options: EnvOptions, draws: FloatArray, given: Mapping[str, Any]) -> FloatArray:
    """Parameter records (parameters, N): drawn, then changed by ``options["parameters"]``."""
    changes: dict[str, npt.ArrayLike] = {}
    if options.random is not None:
        changes |= options.random.draw(draws[GOAL_DRAWS + POSE_DRAWS :])
    changes |= given.get("parameters", {})
    record = options.model.records(changes)
    if record.shape[1] not in (1, draws.shape[1]):
        raise ConfigError("parameters in reset options must be single numbers")
    return np.broadcast_to(record, (len(record), draws.shape[1]))

"""Environments, actions and goals that the conformance tests share."""

from __future__ import annotations

from typing import Any

import numpy as np

from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv

RICH: dict[str, Any] = {
    "task": "track",
    "config": {"tank": {"depth": 1.2, "walls": [-0.9, 0.9, -0.9, 0.9]}},
    "cruise_speed": (0.05, 0.15),
    "effects": {"servo_lag": {"time_constant": 0.06}, "servo_delay": {"delay": 0.03}},
    "current": (0.05, -0.08, 0.02),
    "wave": {"amplitude": 0.03, "frequency": 0.8, "phase": 0.5, "heading": 0.7},
    "observation_noise": {"depth": 0.01, "heading": 0.02, "velocity": 0.01, "rates": 0.02},
    "observation_delay_s": 0.13,
    "action_delay_s": 0.07,
    "randomization": {
        "tail.area": {"relative": 0.05},
        "effects.current.north": [-0.1, 0.1],
        "effects.servo_delay.delay": [0.0, 0.15],
    },
}
"""Every option at once."""

OPTIONS: dict[str, dict[str, Any]] = {
    task: {"task": task} for task in ("hold", "track", "path", "station")
}
ALL_OPTIONS = {
    **OPTIONS,
    "everything": RICH,
    "everything-path": RICH | {"task": "path"},
    "everything-station": RICH | {"task": "station"},
}

IDEAL = {
    "actuators": {
        name: {"slew": None}
        for name in (
            "tail_offset",
            "tail_amplitude",
            "tail_frequency",
            "block_displacement",
            "block_angle",
        )
    }
}
"""Actuators that are at once where they are told to be, like those of the bare simulator."""

STILL = {"position": [0.0, 0.0, 0.5], "euler": [0.0, 0.0, 0.0], "tail_phase": 0.0}
REST = {**STILL, "velocity_body": [0.0, 0.0, 0.0], "angular_velocity_body": [0.0, 0.0, 0.0]}
STEADY = {"depth": 0.5, "heading": 0.0, "cruise_speed": 0.1}
START = {"state": REST, "goal": STEADY}
"""Reset options: at rest, level, at the goal."""

MOVING_GOAL = {
    "depth": 0.45,
    "depth_step": 0.08,
    "depth_step_time": 0.6,
    "depth_ramp_rate": 0.03,
    "depth_ramp_start": 0.4,
    "depth_ramp_end": 1.3,
    "depth_sine_amplitude": 0.05,
    "depth_sine_frequency": 0.3,
    "depth_sine_phase": 0.7,
    "heading": 2.8,
    "heading_step": 0.5,
    "heading_step_time": 0.9,
    "heading_ramp_rate": -0.2,
    "heading_ramp_start": 0.2,
    "heading_ramp_end": 1.1,
    "heading_sine_amplitude": 0.4,
    "heading_sine_frequency": 0.5,
    "heading_sine_phase": -0.3,
    "cruise_speed": 0.12,
}
"""Every field of a goal."""

REST_ACTION = np.array([0.0, -1.0, -1.0, 0.0, 0.0], np.float32)
"""Tail still and straight, block in the middle."""


def swim_action(config, **commands: float) -> np.ndarray:
    """The action that asks for these physical commands, 0 where not named."""
    names = list(config.tree["actuators"])
    values = np.array([commands.get(name, 0.0) for name in names])
    middle, half = (config.high + config.low) / 2, (config.high - config.low) / 2
    return ((values - middle) / half).astype(np.float32)


def random_actions(count: int, seed: int = 0, lanes: int | None = None) -> np.ndarray:
    """(count, 5) or (count, lanes, 5) actions, some of them beyond the space."""
    shape = (count, 5) if lanes is None else (count, lanes, 5)
    return np.random.default_rng(seed).uniform(-1.2, 1.2, shape).astype(np.float32)


def run(env: RoboticFish3DEnv, actions: np.ndarray, seed: int | None = 0, **options: Any):
    """Step a whole episode: observations (T+1, n), rewards (T,), infos."""
    obs, info = env.reset(seed=seed, options=options or None)
    seen, rewards, infos = [obs], [], [info]
    for action in actions:
        obs, reward, _, _, info = env.step(action)
        seen.append(obs)
        rewards.append(reward)
        infos.append(info)
    return np.array(seen), np.array(rewards), infos


def table(heading: str) -> list[list[str]]:
    """Rows of the table under a heading of the class docstring."""
    section = RoboticFish3DEnv.__doc__.split(f"## {heading}")[1].split("##")[0]
    rows = [line.strip(" |").split(" | ") for line in section.splitlines() if "|" in line]
    return [row for row in rows if row[0][0].isdigit()]

"""The observation once more, in plain NumPy, from what the environment shows of its true state.

Scales are read from the table that the layout declares, so table and code are compared too.
"""

from __future__ import annotations

import numpy as np

from fish_env.envs.layout import MAX_BEAT_S, OBSERVATION, REFERENCE
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv

INTEGRALS = ("heading_cosine_integral", "heading_sine_integral", "surge_integral")


def rotation(w: float, x: float, y: float, z: float) -> np.ndarray:
    """Body to inertial."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def wrapped(angle: float) -> float:
    """An angle in -pi..pi."""
    return float(np.angle(np.exp(1j * angle)))


def reference(goal: dict[str, float], channel: str, time: float) -> tuple[float, float]:
    """Value and rate of a goal signal; ``goal`` as in reset options."""
    g = {name: goal.get(f"{channel}_{name}", 0.0) for name in REFERENCE}
    since = np.clip(time, g["ramp_start"], g["ramp_end"]) - g["ramp_start"]
    omega = 2 * np.pi * g["sine_frequency"]
    angle = omega * time + g["sine_phase"]
    value = goal[channel] + g["step"] * (time >= g["step_time"]) + g["ramp_rate"] * since
    rate = g["ramp_rate"] * (g["ramp_start"] <= time < g["ramp_end"])
    swing = g["sine_amplitude"]
    return value + swing * np.sin(angle), rate + swing * omega * np.cos(angle)


class Observer:
    """Follows an environment whose control rate is its physics rate, sample by sample."""

    def __init__(self, env: RoboticFish3DEnv, goal: dict[str, float], delay_steps: int = 0):
        self.env, self.goal, self.delay = env, goal, delay_steps
        self.dt = env.options.config.dt
        self.states: list[dict[str, float]] = [env.state]

    def watch(self) -> None:
        """Note the state after a step."""
        self.states.append(self.env.state)

    def state_at(self, index: int) -> dict[str, float]:
        """State ``index`` steps after the start; the first one before that."""
        return self.states[max(index, 0)]

    def integral(self, name: str, index: int) -> float:
        """Running integral at a step; before the start, first heading and speed went on forever."""
        if index >= 0:
            return self.states[index][name]
        first = self.states[0]
        level = rotation(*(first[f"q{a}"] for a in "wxyz"))[:2, 0]
        rates = dict(zip(INTEGRALS, (*level / np.hypot(*level), first["u"]), strict=True))
        return index * self.dt * rates[name]

    def beat_means(self, index: int) -> tuple[float, float]:
        """Heading (rad) of the mean heading vector over the last beat, and mean surge (m/s)."""
        frequency = self.env.actuators[2]
        window = min(1 / frequency, MAX_BEAT_S) if frequency > 0 else MAX_BEAT_S
        back = index - window / self.dt
        whole = int(np.floor(back))
        means = {}
        for name in INTEGRALS:
            pair = [self.integral(name, i) for i in (whole, whole + 1)]
            begin = np.interp(back - whole, [0.0, 1.0], pair)
            means[name] = (self.integral(name, index) - begin) / window
        cosine, sine, surge = (means[name] for name in INTEGRALS)
        return float(np.arctan2(sine, cosine)), surge

    def physical(self, action: np.ndarray) -> np.ndarray:
        """The 33 observations in SI units, before scaling and clipping."""
        now, config, goal = len(self.states) - 1, self.env.options.config, self.goal
        time = now * self.dt
        seen = self.state_at(now - self.delay)
        turn = rotation(*(seen[f"q{a}"] for a in "wxyz"))
        velocity = np.array([seen[n] for n in "uvw"])
        heading, surge = self.beat_means(now - self.delay)
        depth_goal, depth_rate = reference(goal, "depth", time)
        heading_goal, heading_rate = reference(goal, "heading", time)
        errors = [heading_goal - heading, heading_goal - np.arctan2(turn[1, 0], turn[0, 0])]
        roll, pitch = np.arctan2(turn[2, 1], turn[2, 2]), np.arcsin(-turn[2, 0])
        half = (config.high - config.low) / 2
        middle = (config.high + config.low) / 2
        both = [
            (np.sin(a), np.cos(a)) for a in (*errors, roll, pitch, self.states[-1]["tail_phase"])
        ]
        return np.array(
            [
                depth_goal - seen["z"],
                turn[2] @ velocity,
                depth_rate,
                (seen["z"] - (config.top + config.bottom) / 2) / ((config.bottom - config.top) / 2),
                *both[0],
                *both[1],
                heading_rate,
                goal["cruise_speed"] - surge,
                goal["cruise_speed"],
                *both[2],
                *both[3],
                *velocity,
                *(seen[n] for n in "pqr"),
                *both[4],
                *(self.env.actuators - middle) / half,
                *np.clip(action, -1, 1),
            ]
        )

    def truth(self) -> dict[str, float]:
        """What ``info`` says of goal, errors and place: now, without delay or noise."""
        now, goal = len(self.states) - 1, self.goal
        state = self.states[-1]
        turn = rotation(*(state[f"q{a}"] for a in "wxyz"))
        heading, surge = self.beat_means(now)
        depth_goal, _ = reference(goal, "depth", now * self.dt)
        heading_goal, _ = reference(goal, "heading", now * self.dt)
        return {
            "depth_error": depth_goal - state["z"],
            "heading_error": wrapped(heading_goal - heading),
            "heading_error_instant": wrapped(heading_goal - np.arctan2(turn[1, 0], turn[0, 0])),
            "speed_error": goal["cruise_speed"] - surge,
            "depth": state["z"],
            "heading": heading,
            "speed": surge,
            "goal_depth": depth_goal,
            "goal_heading": heading_goal,
            "goal_speed": goal["cruise_speed"],
            "north": state["x"],
            "east": state["y"],
            "time_s": now * self.dt,
        }

    def expected(self, action: np.ndarray) -> np.ndarray:
        """The observation, scaled as the layout's table says and clipped to the space."""
        scaled = self.physical(action) / declared_scales()
        return np.clip(scaled, self.env.observation_space.low, self.env.observation_space.high)


def declared_scales() -> np.ndarray:
    """(33,) numbers of the second column of layout.OBSERVATION; 1 where it names a range."""
    words = [scale.split()[0] for _, scale in OBSERVATION]
    return np.array([float(w) if w[0].isdigit() else 1.0 for w in words])

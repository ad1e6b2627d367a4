"""Who a training may begin from: the PID controller, told more than any fish can know.

It sees the true state, without noise or delay, and where the goal depth is going; it hurries while
the weight block or the turn is at its limit, and saves speed otherwise. A network that is fitted to
its actions but sees only what sensors show has to work all that out from the past (learning by
cheating, Chen et al. 2019).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from agents.controllers.pid import LARGEST_EXTRA_SPEED, PIDController, tuned_gains
from agents.controllers.seen import Seen
from agents.training.config import Imitation
from fish_env.envs.batch import FishBatch
from fish_env.envs.layout import OBSERVATION, OUTPUTS
from fish_env.envs.sb3 import FishVecEnv

FloatArray = npt.NDArray[np.float64]
Float32Array = npt.NDArray[np.float32]
GOAL_DEPTH_RATE = 2
"""Index of the rate of the goal depth in an observation."""
FASTEST_BEND = 0.5
"""Largest change of the goal's depth rate that is looked ahead for, scaled units a second; more is
a step."""
TURN_FROM, TURN_RANGE = 0.2, 0.3
"""Heading error (rad) from which it hurries, and over which that becomes whole."""


class HurryingPID(PIDController):
    """The PID controller with a speed goal that is higher where control is short of force.

    Args:
        hurry: speed beyond the goal when it is (m/s).
        saving: speed below the goal when it is not (m/s).
        **gains: gains other than the tuned ones.
    """

    def __init__(self, hurry: float, saving: float, **gains: float) -> None:
        self.hurry, self.saving = hurry, saving
        super().__init__(replace(tuned_gains(), **gains))

    def _tail_frequency(self, seen: Seen, extra: FloatArray) -> FloatArray:
        turn = np.clip((np.abs(seen.heading_error) - TURN_FROM) / TURN_RANGE, 0.0, 1.0)
        share = np.maximum(extra / LARGEST_EXTRA_SPEED, turn)
        return super()._tail_frequency(seen, share * self.hurry - (1.0 - share) * self.saving)


class Teacher:
    """Acts on true states.

    Args:
        parts: the fish, in the order of the observations.
        settings: see :class:`agents.training.config.Imitation`.
    """

    def __init__(self, parts: tuple[FishVecEnv, ...], settings: Imitation) -> None:
        self._parts = parts
        self._lead_s = settings.lead_s
        self._pid = HurryingPID(settings.hurry, settings.saving, **settings.gains)
        self._rate: FloatArray | None = None

    def reset(self, count: int) -> None:
        """Episodes of all fish begin."""
        self._pid.reset(count)
        self._rate = None

    def act(self, observations: Float32Array) -> Float32Array:
        """What it would do (N, 5), for the fish as they are and what their sensors show (N, 33)."""
        ends = np.cumsum([part.num_envs for part in self._parts])[:-1]
        rows = zip(np.split(observations, ends), self._parts, strict=True)
        true = np.concatenate([true_observations(seen, part.env.batch) for seen, part in rows])
        rate = true[:, GOAL_DEPTH_RATE].copy()
        if self._rate is not None:
            bend = (rate - self._rate) / self._pid.period_s
            true[:, GOAL_DEPTH_RATE] += self._lead_s * np.clip(bend, -FASTEST_BEND, FASTEST_BEND)
        self._rate = rate
        return self._pid.act(true)


def true_observations(observations: Float32Array, batch: FishBatch) -> FloatArray:
    """Observations (N, 33) as sensors without noise and delay would show them now."""
    outputs = dict(zip(OUTPUTS, batch.outputs, strict=True))
    qw, qx, qy, qz = batch.state[3:7]
    u, v, w, p, q, r = batch.state[7:13]
    zx, zy = 2.0 * (qx * qz - qw * qy), 2.0 * (qy * qz + qw * qx)
    zz = 1.0 - 2.0 * (qx * qx + qy * qy)
    level = np.sqrt(1.0 - zx * zx)
    heading, instant = outputs["heading_error"], outputs["heading_error_instant"]
    now = {
        "depth error (goal - depth)": outputs["depth_error"] / 0.3,
        "rate of depth": (zx * u + zy * v + zz * w) / 0.1,
        "sine of the heading error over the last beat": np.sin(heading),
        "cosine of the heading error over the last beat": np.cos(heading),
        "sine of the instantaneous heading error": np.sin(instant),
        "cosine of the instantaneous heading error": np.cos(instant),
        "speed error (goal - surge speed over the last beat)": outputs["speed_error"] / 0.1,
        "sine of roll": zy / level,
        "cosine of roll": zz / level,
        "sine of pitch": -zx,
        "cosine of pitch": level,
        "surge speed over ground, body frame": u / 0.2,
        "sway speed over ground, body frame": v / 0.2,
        "heave speed over ground, body frame": w / 0.2,
        "roll rate": p,
        "pitch rate": q,
        "yaw rate": r,
    }
    true = np.array(observations, float)
    names = [name for name, _ in OBSERVATION]
    for name, values in now.items():
        true[:, names.index(name)] = values
    return true

"""The teacher of an imitation: a controller with more information than any policy has.

It is the PID controller on the true state, without noise or delay. It knows the trim of the fish,
predicts the goals, and swims faster where the block or the turn is at its limit. The learner has to
estimate from past observations what the teacher knows.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import ModuleType
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.envs.batch import FishBatch
from fish_env.envs.layout import OBSERVATION, OUTPUTS
from fish_env.envs.options import EnvOptions
from fish_env.envs.sb3 import FishVecEnv
from robofish_agents.controllers.pid import PIDController
from robofish_agents.controllers.seen import Seen
from robofish_agents.training.course import Course
from robofish_agents.training.settings import Imitation
from robofish_agents.training.teacher_gains import TeacherGains, teacher_gains

Float32Array = npt.NDArray[np.float32]
JUMP_OF_DEPTH, JUMP_OF_HEADING = 0.05, 0.3
"""Largest smooth change of a goal's rate (m/s^2, rad/s^2)."""
MOMENT, LIFT = "mass.static_moment_rest[0]", "mass.buoyancy"


class TrueFish(Protocol):
    """What is true of N fish: arrays of NumPy, or tensors of the device they swim on.

    Attributes:
        options: what the environment is.
        count: N.
        outputs: (len(OUTPUTS), N).
    """

    options: EnvOptions
    count: int
    outputs: Any

    @property
    def state(self) -> Any:
        """States (states, N)."""

    @property
    def goal(self) -> Any:
        """Goals (len(GOAL), N)."""

    @property
    def time(self) -> Any:
        """Time (N,) since the start of the episode (s)."""

    @property
    def drawn(self) -> Mapping[str, Any]:
        """Path -> (N,) randomised parameters."""
        ...


class ForesightPID(PIDController):
    """The PID controller with prediction of the goals and an adapted speed goal.

    Args:
        gains: see :class:`TeacherGains`.
    """

    gains: TeacherGains
    speed_window = 0.04

    def __init__(self, gains: TeacherGains) -> None:
        self._depth_goal = Course(JUMP_OF_DEPTH, 0.1)
        self._heading_goal = Course(JUMP_OF_HEADING, 0.1)
        super().__init__(gains)

    def reset(self, count: int) -> None:
        """Resets integrals and predicted goals at the start of the episodes of ``count`` fish."""
        super().reset(count)
        self._depth_goal.reset(count)
        self._heading_goal.reset(count)

    def trim(self, moment: FloatArray, lift: FloatArray) -> None:
        """Sets the initial position of the block that the trim of the fish requires.

        Args:
            moment: (N,) static moment beyond the nominal fish's (kg m).
            lift: (N,) displaced water beyond the nominal fish's (kg).
        """
        given = self.gains
        block = given.trim_moment * moment + given.trim_lift * lift
        self._depth = np.clip(block, -given.depth_windup, given.depth_windup)

    def _block_displacement(self, seen: Seen) -> FloatArray:
        given, goal = self.gains, self._depth_goal
        goal.see(seen.goal_depth_rate)
        later = goal.change_in(given.depth_ahead) - given.depth_ahead * seen.depth_rate
        foreseen = seen._replace(
            depth_error=seen.depth_error + later, goal_depth_rate=goal.rate_in(given.climb_ahead)
        )
        return self._for_pitch(self._wanted_pitch(foreseen), seen) + self._for_depth(seen)

    def _tail_offset(self, seen: Seen) -> FloatArray:
        goal = self._heading_goal
        goal.see(seen.goal_heading_rate)
        rate = goal.rate_in(self.gains.turn_ahead)
        return super()._tail_offset(seen._replace(goal_heading_rate=rate))

    def _tail_frequency(self, seen: Seen, extra: FloatArray) -> FloatArray:
        given = self.gains
        haste = self._haste(seen, extra)
        haste = haste - given.saving * (1.0 - np.minimum(haste / given.hurry, 1.0))
        return super()._tail_frequency(seen, haste)

    def _haste(self, seen: Seen, extra: FloatArray) -> FloatArray:
        """Returns the additional speed (m/s) above the goal."""
        given = self.gains
        swing = given.swing_speed * (self._depth_goal.fastest - given.swing_from)
        turn = (np.abs(seen.heading_error) - given.turn_from) / given.turn_range
        far = given.far_speed * (np.abs(seen.depth_error) - given.far_from)
        asked = (
            np.minimum(extra, given.hurry),
            np.clip(swing, 0.0, given.hurry),
            given.turn_speed * np.clip(turn, 0.0, 1.0),
            np.clip(far, 0.0, given.far_limit),
        )
        return np.asarray(np.maximum.reduce(asked))


class Teacher:
    """Acts on true states.

    Args:
        parts: the fish, in the order of the observations.
        settings: see :class:`robofish_agents.training.settings.Imitation`.
    """

    def __init__(self, parts: tuple[FishVecEnv, ...], settings: Imitation) -> None:
        self._batches = tuple(part.env.batch for part in parts)
        self._pid = ForesightPID(teacher_gains(settings.gains))

    def reset(self, count: int) -> None:
        """Begins the episodes of all fish."""
        self._pid.reset(count)
        moment, lift = (
            np.concatenate([beyond(path, batch) for batch in self._batches])
            for path in (MOMENT, LIFT)
        )
        self._pid.trim(moment, lift)

    def act(self, observations: Float32Array) -> Float32Array:
        """Returns actions (N, 5) for the true states and observations (N, 33) of the fish."""
        ends = np.cumsum([batch.count for batch in self._batches])[:-1]
        rows = zip(np.split(observations, ends), self._batches, strict=True)
        return self._pid.act(np.concatenate([true_observations(*row) for row in rows]))


def beyond(path: str, batch: FishBatch) -> FloatArray:
    """Returns the deviation (N,) of a parameter of each fish from the nominal value."""
    nominal = batch.options.model.fish.get(path)
    drawn = batch.drawn.get(path)
    return np.zeros(batch.count) if drawn is None else drawn - nominal


def true_observations(observations: Any, batch: TrueFish, xp: ModuleType = np) -> Any:
    """Returns observations (N, 33) of sensors without noise and delay.

    Args:
        observations: (N, 33) of the environment: goals, commands and actuators are taken from them.
        batch: the fish.
        xp: ``numpy``, or ``torch`` if these are tensors.
    """
    outputs = dict(zip(OUTPUTS, batch.outputs, strict=True))
    qw, qx, qy, qz = batch.state[3:7]
    u, v, w, p, q, r = batch.state[7:13]
    zx, zy = 2.0 * (qx * qz - qw * qy), 2.0 * (qy * qz + qw * qx)
    zz = 1.0 - 2.0 * (qx * qx + qy * qy)
    level = xp.sqrt(1.0 - zx * zx)
    heading, instant = outputs["heading_error"], outputs["heading_error_instant"]
    now = {
        "depth error (goal - depth)": outputs["depth_error"] / 0.3,
        "rate of depth": (zx * u + zy * v + zz * w) / 0.1,
        "sine of the heading error over the last beat": xp.sin(heading),
        "cosine of the heading error over the last beat": xp.cos(heading),
        "sine of the instantaneous heading error": xp.sin(instant),
        "cosine of the instantaneous heading error": xp.cos(instant),
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
    names = (name for name, _ in OBSERVATION)
    return xp.stack([now.get(name, observations[:, i]) for i, name in enumerate(names)], 1)

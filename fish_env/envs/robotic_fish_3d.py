"""The Gymnasium environment ``RoboticFish3D-v0``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.spaces import Box

from fish_env.arrays import FloatArray
from fish_env.effects.extended import EffectValues
from fish_env.envs.batch import FishBatch, real_actions
from fish_env.envs.layout import OBSERVATION, OBSERVATION_LIMIT, OUTPUTS
from fish_env.envs.options import env_options
from fish_env.envs.viewing import Frame, Viewer, Watched
from fish_env.params.schema import FishParams
from fish_env.rendering import Scene

FAILURE = OUTPUTS.index("failure")
ACTION_SHAPE = (5,)
PARAMETER = "parameter/"
"""Prefix of the keys of ``info`` that report randomised parameters."""
ONE = np.zeros(1, np.int64)


def action_space() -> Box[np.float32]:
    """Five actuators, -1 to 1."""
    return Box(-1.0, 1.0, ACTION_SHAPE, np.float32)


def observation_space() -> Box[np.float32]:
    """Observations, clipped to a finite range."""
    return Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (len(OBSERVATION),), np.float32)


class RoboticFish3DEnv(Watched, gym.Env[npt.NDArray[np.float32], npt.NDArray[np.float32]]):
    """A 29 cm robotic fish that holds or tracks depth and heading, follows paths or keeps a place.

    One servo swings a rigid tail. Inside, a weight block slides fore and aft and swings sideways.
    Inertial frame: x north, y east, z down (depth). Body frame: x forward, y starboard, z down.
    The control rate is 10 Hz and the physics rate 100 Hz (RK4). Both can be set.

    ## Action space

    ``Box(-1, 1, (5,), float32)``, mapped linearly to physical ranges; values beyond are clipped.
    Actuators move towards their targets at limited rates (configs/env/robotic-fish-3d.yaml).

    | index | actuator | -1 | +1 | slew limit |
    | --- | --- | --- | --- | --- |
    | 0 | tail offset (positive turns to port, yaw rate negative) | -0.6 rad | 0.6 rad | 2 rad/s |
    | 1 | tail amplitude | 0 | 0.6 rad | 1.5 rad/s |
    | 2 | tail frequency | 0 | 3 Hz | 4 Hz/s |
    | 3 | block displacement (positive aft: nose up, climbs) | -12 mm | 12 mm | 20 mm/s |
    | 4 | block angle (positive: rolls to starboard) | -0.7 rad | 0.7 rad | 2 rad/s |

    ## Observation space

    ``Box(-10, 10, (33,), float32)``; each number is divided by the scale given here.

    | index | observation | scale |
    | --- | --- | --- |
    | 0 | depth error (goal - depth) | 0.3 m |
    | 1 | rate of depth | 0.1 m/s |
    | 2 | rate of the goal depth | 0.1 m/s |
    | 3 | depth, -1 at the top and 1 at the bottom of the tank | half of the tank |
    | 4 | sine of the heading error over the last beat | 1 |
    | 5 | cosine of the heading error over the last beat | 1 |
    | 6 | sine of the instantaneous heading error | 1 |
    | 7 | cosine of the instantaneous heading error | 1 |
    | 8 | rate of the goal heading | 0.5 rad/s |
    | 9 | speed error (goal - surge speed over the last beat) | 0.1 m/s |
    | 10 | goal speed | 0.1 m/s |
    | 11-12 | sine and cosine of roll | 1 |
    | 13-14 | sine and cosine of pitch | 1 |
    | 15-17 | surge, sway, heave speed over ground, body frame | 0.2 m/s |
    | 18-20 | roll, pitch, yaw rate | 1 rad/s |
    | 21-22 | sine and cosine of the tail phase | 1 |
    | 23-27 | actuator positions in the order of the action | action range |
    | 28-32 | last action | 1 |

    Errors are goal minus measured. The tail swings the heading by some degrees in every stroke.
    The reward therefore uses the error of the mean heading vector over the last tail beat (at most
    1.5 s). The instantaneous error is observed too. In the first beat of an episode, the means
    assume that the fish kept its first heading and speed before the start.

    ## Tasks

    Every task gives its goal as depth, heading and speed, so an agent of one task runs on all.

    * ``hold``: constant depth and heading. ``track``: signals that step, ramp or oscillate.
    * ``path``: a helix, legs between waypoints, or a figure of eight seen from the side. The
      figure is a circle on which the depth oscillates twice a turn. A vertical loop would make
      the fish tumble.
      Line-of-sight guidance computes depth, heading and their rates from path and position. It
      does not know the current; its integral removes the error that a current causes.
    * ``station``: a place to keep. The fish cannot stop, because it coasts for a metre. In a
      current of at least 2 cm/s it heads against the flow and swims as fast as the flow. In slower
      water it swims around the place on a circle of 0.4 m, near its smallest turning radius.
      Guidance knows the effect ``current``, but not waves.

    Guidance knows the true position of the fish, as a camera above the tank would measure it.

    ## Reward

    With tolerance(e, m) = 1 / (1 + (e/m)^2): ``0.4 tolerance(depth error, 0.10 m)
    + 0.4 tolerance(heading error, 0.20 rad) + 0.2 tolerance(speed error, 0.04 m/s)
    - 0.05 P/(P + 0.1 W) - 0.05 mean((change of action)^2)/4``. P is the mean mechanical power of
    the tail servo over the step. The reward is at most 1 per step. Each term is in ``info``.

    The tasks ``path`` and ``station`` add a term for the position: tolerance(cross-track error,
    10 cm) and tolerance(place error, 30 cm). They have other weights (``reward.path`` and
    ``reward.station`` in the settings).

    ## Start

    The fish starts at (0, 0), with its depth within 0.2 m and its heading within 90 degrees of the
    goal. Its speed is up to 0.1 m/s, it is slightly tilted, its tail phase is random, and its
    actuators are at zero. Paths begin at (0, 0). A place to keep is up to 1 m away, and the
    heading is within 90 degrees of the bearing to it.

    ## End

    An episode is terminated if one of these conditions holds:

    * the fish leaves the tank (surface, bottom, walls if set);
    * it tumbles by more than 80 degrees;
    * the simulation diverges.

    ``info["failure"]`` says which (:class:`fish_env.envs.layout.Failure`). An episode is truncated
    only by the time limit (400 steps).

    ## Info

    | key | meaning |
    | --- | --- |
    | ``reward_*``, ``cost_*`` | terms of the reward |
    | ``depth_error`` | m |
    | ``heading_error`` | rad, over the last beat |
    | ``heading_error_instant`` | rad |
    | ``speed_error`` | m/s |
    | ``depth``, ``north``, ``east`` | m |
    | ``heading`` | rad, over the last beat |
    | ``speed`` | m/s |
    | ``goal_depth``, ``goal_heading``, ``goal_speed`` | the goal |
    | ``power`` | W |
    | ``within_tolerance_s`` | s for which depth, heading, speed are within 5 cm, 5 degrees, 20 % |
    | ``is_success`` | 1 as soon as ``within_tolerance_s`` is 10 s |
    | ``failure``, ``time_s`` | why the episode terminated; time (s) |

    The task ``path`` adds ``cross_track_error`` (m, to starboard of the path, seen from above) and
    ``path_progress`` (0 to 1, the completed share of the path). The task ``station`` adds
    ``place_error`` (m, distance in three dimensions). They are 0 in other tasks. On a path
    ``within_tolerance_s`` counts depth within 5 cm, cross-track error within 5 cm and speed within
    20 %. At a place it counts a place error within 45 cm, 1.5 body lengths, because a circling
    fish is 40 cm away.

    ``reset`` also reports each randomised parameter as ``parameter/<path>``.

    ## Reset options

    ``reset(options={"state": {...}, "goal": {...}, "parameters": {...}})`` takes

    * ``state``: ``position`` (m), ``euler`` (roll, pitch, yaw, rad), ``velocity_body`` (m/s),
      ``angular_velocity_body`` (rad/s), ``tail_phase`` (rad);
    * ``goal``: ``depth`` (m), ``heading`` (rad), ``cruise_speed`` (m/s) or any field of
      :data:`fish_env.envs.layout.GOAL`;
    * ``goal`` of a path through points: 2 to 32 ``waypoints`` (n, 3): north, east, depth (m);
    * ``goal`` of a round path: ``path_radius`` (m, negative to port) with ``path_pitch`` (m deeper
      in a turn), ``path_swing`` and ``path_length`` (m);
    * ``goal`` of a place, or the start of a path: ``north`` and ``east`` (m);
    * ``parameters``: values by path, as in the fish file.

    ## Versions

    * v0: first version. The tasks ``path`` and ``station`` were added later, without changing any
      bit of ``hold`` and ``track``. Effects of a tail whose rate jumps or lags were later computed
      more accurately, without changing any bit of fish without them.

    Args:
        task: ``"hold"`` (constant references), ``"track"`` (steps, ramps, sines), ``"path"``
            (helix, waypoints, figure of eight) or ``"station"`` (keep a place).
        fish: name of a shipped fish, path of a parameter file (extended models included), or
            parameters. Sensor effects of a fitted file (delays, biases) belong to its recordings
            and are not simulated here.
        render_mode: None, ``"rgb_array"`` (``render`` returns pictures, no screen is needed) or
            ``"human"`` (a window that runs in real time; without a screen, a warning instead).
            Both need the extra ``render``.
        config: YAML file or mapping that changes configs/env/robotic-fish-3d.yaml.
        control_hz: actions a second.
        physics_hz: physics steps a second, a whole multiple of ``control_hz``.
        cruise_speed: goal speed (m/s) or range; default 0.10, 0 is allowed.
        effects: effects to switch on: name -> parameters (fish_env.effects).
        current: steady flow towards (north, east, down) (m/s).
        wave: parameters of the wave effect: ``amplitude`` (m/s), ``frequency`` (Hz), ``heading``
            (rad), ``tank_depth`` (m), and ``phase`` (rad) at the start of each episode.
        observation_noise: standard deviations (SI) for ``depth``, ``depth_rate``, ``attitude``,
            ``heading``, ``velocity``, ``rates``, or single sensors.
        observation_delay_s: delay of the sensors (s); commands are observed without delay.
        action_delay_s: time until an action reaches the actuators (s).
        randomization: parameters drawn in each episode: ``"prior"``, ``"posterior"``, or
            path -> ``{"relative": sd}``, ``{"sd": sd}`` or ``[low, high]``.
        trust_effects: run the effect files (Python code) beside the fish's file that it names;
            without it they are refused.
        render_size: width and height of a picture (pixels).

    Raises:
        ConfigError, ParameterError, EffectError: if an option is wrong, with the fix.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": ["human", "rgb_array"],
        "render_fps": 10,
    }

    def __init__(
        self,
        task: str = "hold",
        fish: str | Path | FishParams = "zheng-2021-a",
        render_mode: str | None = None,
        *,
        config: str | Path | Mapping[str, Any] | None = None,
        control_hz: float | None = None,
        physics_hz: float | None = None,
        cruise_speed: float | tuple[float, float] | None = None,
        effects: EffectValues | None = None,
        current: tuple[float, float, float] | None = None,
        wave: Mapping[str, float] | None = None,
        observation_noise: Mapping[str, float] | None = None,
        observation_delay_s: float = 0.0,
        action_delay_s: float = 0.0,
        randomization: str | Mapping[str, Any] | None = None,
        trust_effects: bool = False,
        render_size: tuple[int, int] = (640, 480),
    ) -> None:
        self.render_mode = render_mode
        self.options = env_options(
            task,
            fish,
            config=config,
            control_hz=control_hz,
            physics_hz=physics_hz,
            cruise_speed=cruise_speed,
            effects=effects,
            current=current,
            wave=wave,
            observation_noise=observation_noise,
            observation_delay_s=observation_delay_s,
            action_delay_s=action_delay_s,
            randomization=randomization,
            trust_effects=trust_effects,
        )
        self.metadata = {**self.metadata, "render_fps": 1.0 / self.options.config.control_period}
        self.action_space = action_space()
        self.observation_space = observation_space()
        self._batch = FishBatch(self.options, 1)
        modes = self.metadata["render_modes"]
        self._viewer = Viewer(self.options, render_mode, modes, render_size)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Start an episode; see the class for ``options``."""
        super().reset(seed=seed)
        batch = self._batch
        batch.reset(ONE, [self.np_random], options)
        _, *outputs = batch.results
        info = dict(zip(OUTPUTS, outputs, strict=True))
        info |= {PARAMETER + path: float(value[0]) for path, value in batch.drawn.items()}
        self._viewer.after_step(batch)
        return batch.obs[0].copy(), info

    def step(
        self, action: npt.NDArray[np.float32]
    ) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """One control step.

        Raises:
            ConfigError: not five real numbers, one of them NaN, or a step before the first reset.
        """
        batch = self._batch
        batch.step(real_actions(action, ACTION_SHAPE))
        reward, *outputs = batch.results
        info = dict(zip(OUTPUTS, outputs, strict=True))
        self._viewer.after_step(batch)
        return batch.obs[0].copy(), reward, info["failure"] > 0, False, info

    @property
    def state(self) -> dict[str, float]:
        """The true state by name (see :data:`fish_env.model.state.BASE_STATES`)."""
        names = self.options.model.kernels.state_names
        return dict(zip(names, self._batch.state[:, 0].tolist(), strict=True))

    @property
    def actuators(self) -> FloatArray:
        """(5,) actuator positions (rad, rad, Hz, m, rad)."""
        return self._batch.inputs[:, 0].copy()

    def render(self) -> Frame | None:
        """A picture (height, width, 3), uint8, in mode "rgb_array"; else nothing.

        The window of mode "human" shows every step by itself.

        Raises:
            ConfigError: before the first reset.
        """
        if self._viewer.mode == "rgb_array":
            return self._viewer.frames(self._batch)[0]
        return None

    def close(self) -> None:
        """Close the window, if there is one; may be called again."""
        self._viewer.close()

    def scene(self) -> Scene:
        """The fish as it is now, to be drawn by :mod:`fish_env.rendering` at any time.

        Its wake is kept if there is a ``render_mode``.

        Raises:
            ConfigError: before the first reset.
        """
        return self._viewer.scene(self._batch)

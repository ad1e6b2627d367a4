"""Path following for any agent: guidance replaces the goal that the agent observes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from robofish_agents.controllers.line_of_sight import Guided, LineOfSight
from robofish_agents.registry import Agent

Float32Array = npt.NDArray[np.float32]


def with_goal(
    observation: Float32Array, depth_by: float, depth_rate: float, heading_by: float
) -> Float32Array:
    """Returns an observation (33,) with another goal.

    Args:
        observation: of an environment whose goals are constant.
        depth_by: how much deeper the other goal is (m).
        depth_rate: its rate (m/s).
        heading_by: how far to starboard its heading is (rad).
    """
    seen = np.array(observation, float)
    seen[0] += depth_by / 0.3
    seen[2] = depth_rate / 0.1
    for sine in (4, 6):
        error = np.arctan2(seen[sine], seen[sine + 1]) + heading_by
        seen[sine : sine + 2] = np.sin(error), np.cos(error)
    return np.asarray(np.clip(seen, -10.0, 10.0), np.float32)


class PathFollower:
    """Lets an agent follow a path in one environment, whose goals must be constant.

    It reads the fish's position from the environment, as a camera above the tank would measure it.

    Args:
        agent: what swims.
        path: where to.
        env: in which.
    """

    def __init__(self, agent: Agent, path: LineOfSight, env: RoboticFish3DEnv) -> None:
        self.agent, self.path, self.env = agent, path, env
        self.guided: list[Guided] = []

    def reset(self, count: int) -> None:
        """Begins an episode of one fish."""
        assert count == 1
        self.agent.reset(1)
        self.path.reset()
        self.guided = []

    def act(self, observations: Float32Array) -> Float32Array:
        """Returns the action (1, 5) for an observation (1, 33)."""
        (observation,) = observations
        state = self.env.state
        place = [state[name] for name in "xyz"]
        speed = 0.1 * float(observation[10] - observation[9])
        period = self.env.options.config.control_period
        guided = self.path.guide(place, speed, period)
        self.guided.append(guided)
        heading_error = float(np.arctan2(observation[6], observation[7]))
        goal_heading = heading_of(state) + heading_error
        depth_by = guided.depth - (place[2] + 0.3 * float(observation[0]))
        turn = guided.heading - goal_heading
        shown = with_goal(observation, depth_by, guided.depth_rate, turn)
        return self.agent.act(shown[None])


def heading_of(state: dict[str, float]) -> float:
    """Returns the heading (rad, NED) of a state."""
    w, x, y, z = (state[name] for name in ("qw", "qx", "qy", "qz"))
    return float(np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z)))

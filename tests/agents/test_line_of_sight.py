"""Guidance along straight legs: signs, switching, and a path that is swum."""

import gymnasium as gym
import numpy as np
import pytest

import fish_env  # noqa: F401
from fish_env.envs.registration import ENV_ID
from fish_env.errors import ConfigError
from robofish_agents.controllers import PIDController
from robofish_agents.controllers.line_of_sight import LineOfSight
from robofish_agents.controllers.path import PathFollower, with_goal
from robofish_agents.episode import swim

NORTH = [[0.0, 0.0, 0.4], [3.0, 0.0, 0.7]]
CORNER = [[0.0, 0.0, 0.4], [2.0, 0.0, 0.4], [2.0, 2.0, 0.5]]


@pytest.mark.parametrize("east", [-0.5, 0.5])
def test_it_steers_back_to_the_leg(east):
    guided = LineOfSight(NORTH, lookahead=0.5, integral=0.0).guide([1.0, east, 0.5], 0.1, 0.1)
    assert guided.cross_track == pytest.approx(east)
    assert guided.heading == pytest.approx(-np.arctan(east / 0.5))


def test_depth_follows_the_slope():
    guided = LineOfSight(NORTH).guide([1.5, 0.0, 0.5], 0.1, 0.1)
    assert guided.depth == pytest.approx(0.55)
    assert guided.depth_rate == pytest.approx(0.01)


def test_it_turns_at_a_waypoint_and_says_when_it_is_there():
    path = LineOfSight(CORNER, radius=0.2)
    assert path.guide([1.7, 0.0, 0.4], 0.1, 0.1).leg == 0
    corner = path.guide([1.9, 0.0, 0.4], 0.1, 0.1)
    assert corner.leg == 1
    assert corner.heading == pytest.approx(np.pi / 2 - np.arctan(0.1 / 0.8), abs=0.01)
    assert not corner.finished
    assert path.guide([2.0, 2.1, 0.5], 0.1, 0.1).finished


@pytest.mark.parametrize(
    ("waypoints", "message"),
    [
        ([[0, 0, 1]], "at least two"),
        ([[0, 0], [1, 1]], "north, east, depth"),
        ([[0, 0, 0.3], [0, 0, 0.6]], "straight up or down"),
        ([[0, 0, 0.3], [np.nan, 0, 0.6]], "finite"),
    ],
)
def test_what_is_no_path_is_refused(waypoints, message):
    with pytest.raises(ConfigError, match=message):
        LineOfSight(waypoints)


def test_an_observation_with_another_goal_is_that_of_an_environment_with_it():
    env = gym.make(ENV_ID)
    start = {"position": (0, 0, 0.5), "euler": (0.05, 0.02, 0.3), "velocity_body": (0.1, 0, 0)}
    first, other = (
        env.reset(seed=0, options={"state": start, "goal": {"depth": d, "heading": h}})[0]
        for d, h in ((0.4, 0.1), (0.6, -3.0))
    )
    np.testing.assert_allclose(with_goal(first, 0.2, 0.0, -3.1), other, atol=1e-6)


def followed(integral: float) -> float:
    """How far (RMS, m) a fish swims beside a leg, once it is on it, across a flow of 2 cm/s."""
    env = gym.make(ENV_ID, max_episode_steps=500, current=(0.0, 0.02, 0.0))
    path = LineOfSight([[0, 0, 0.4], [8, 0, 0.6]], integral=integral)
    follower = PathFollower(PIDController(), path, env.unwrapped)
    options = {
        "state": {"position": (0, 0, 0.4), "euler": (0, 0, 0)},
        "goal": {"depth": 0.4, "heading": 0.0},
    }
    swim(env, follower, 0, options)
    away = np.array([guided.cross_track for guided in follower.guided])
    return float(np.sqrt(np.mean(away[300:] ** 2)))


def test_the_integral_takes_out_what_a_current_makes():
    without, integral = followed(0.0), followed(0.03)
    assert without > 0.1
    assert integral < 0.06

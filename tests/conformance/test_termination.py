"""Ends of episodes: each failure reached on purpose, and told from the time limit."""

import gymnasium as gym
import numpy as np
import pytest

from fish_env.envs.layout import Failure
from fish_env.envs.registration import ENV_ID
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.vector import RoboticFish3DVectorEnv
from tests.conformance.cases import REST, REST_ACTION, random_actions, run

WALLS = {"tank": {"walls": [-0.5, 0.6, -0.4, 0.7]}}
LEVEL = {"euler": [0.0, 0.0, 0.0]}
WAYS = {
    "surface": (
        Failure.SURFACE,
        {**LEVEL, "position": [0, 0, 0.06], "velocity_body": [0, 0, -0.5]},
    ),
    "bottom": (Failure.BOTTOM, {**LEVEL, "position": [0, 0, 0.94], "velocity_body": [0, 0, 0.5]}),
    "south": (Failure.WALL, {**LEVEL, "position": [-0.49, 0, 0.5], "velocity_body": [-1, 0, 0]}),
    "north": (Failure.WALL, {**LEVEL, "position": [0.59, 0, 0.5], "velocity_body": [1, 0, 0]}),
    "west": (Failure.WALL, {**LEVEL, "position": [0, -0.39, 0.5], "velocity_body": [0, -1, 0]}),
    "east": (Failure.WALL, {**LEVEL, "position": [0, 0.69, 0.5], "velocity_body": [0, 1, 0]}),
    "tumbled": (
        Failure.TUMBLED,
        {"euler": [1.35, 0, 0], "position": [0, 0, 0.5], "angular_velocity_body": [20.0, 0, 0]},
    ),
    "diverged": (Failure.DIVERGED, {**REST, "velocity_body": [5000.0, 0, 0]}),
}


@pytest.mark.parametrize(("failure", "state"), WAYS.values(), ids=WAYS)
def test_each_failure_ends_the_episode_with_its_code(failure, state):
    """terminated, not truncated, in the single environment and in its lane of a batch."""
    single = gym.make(ENV_ID, config=WALLS)
    _, info = single.reset(seed=0, options={"state": state})
    assert info["failure"] == Failure.NONE
    obs, reward, terminated, truncated, info = single.step(REST_ACTION)
    assert (terminated, truncated) == (True, False)
    assert info["failure"] == failure
    assert obs in single.observation_space
    assert -0.1 <= reward <= 1
    batch = RoboticFish3DVectorEnv(3, config=WALLS, autoreset_mode="Disabled")
    batch.reset(seed=0)
    mask = np.array([False, True, False])
    batch.reset(options={"reset_mask": mask, "state": state})
    _, _, terminated, truncated, infos = batch.step(np.tile(REST_ACTION, (3, 1)))
    np.testing.assert_array_equal(terminated, mask)
    assert not truncated.any()
    np.testing.assert_array_equal(infos["failure"], mask * float(failure))


def test_without_walls_there_are_none():
    """The default tank has a surface and a bottom only."""
    env = RoboticFish3DEnv()
    env.reset(seed=0, options={"state": {**REST, "position": [500.0, -500.0, 0.5]}})
    assert env.step(REST_ACTION)[4]["failure"] == Failure.NONE


def test_a_diverged_fish_stays_finite_and_diverged():
    """Its last good state is shown, and going on without a reset changes nothing."""
    env = RoboticFish3DEnv()
    state = {**REST, "velocity_body": [5000.0, 0, 0]}
    obs, rewards, infos = run(env, random_actions(20), state=state)
    assert np.all(np.isfinite(obs))
    assert np.all(np.isfinite(rewards))
    assert all(info["failure"] == Failure.DIVERGED for info in infos[1:])
    assert all(np.isfinite(list(env.state.values())))


def test_a_diverged_fish_leaves_the_rest_of_its_batch_untouched():
    """All other lanes have the bits they have beside a tame fish."""
    mask = np.arange(20) == 4
    seen = []
    for speed in (0.0, 5000.0):
        env = RoboticFish3DVectorEnv(20, autoreset_mode="SameStep")
        env.reset(seed=0)
        state = {**REST, "velocity_body": [speed, 0, 0]}
        env.reset(options={"reset_mask": mask, "state": state})
        seen.append([env.step(row)[0][~mask] for row in random_actions(10, lanes=20)])
    np.testing.assert_array_equal(*seen)


def test_tolerance_does_not_count_for_a_failed_fish():
    """A fish at its goal that fails is not a success."""
    env = RoboticFish3DEnv()
    goal = {"depth": 0.06, "heading": 0.0, "cruise_speed": 0.0}
    state = {**REST, "position": [0, 0, 0.052], "velocity_body": [0, 0, -0.05]}
    env.reset(seed=0, options={"state": state, "goal": goal})
    *_, info = env.step(REST_ACTION)
    assert info["failure"] == Failure.SURFACE
    assert info["within_tolerance_s"] == 0.0


def test_only_the_time_limit_truncates():
    """The bare environment never does, Gymnasium's wrapper does at 400 steps."""
    env = gym.make(ENV_ID)
    env.reset(seed=0)
    ends = [env.step(REST_ACTION)[2:4] for _ in range(400)]
    assert ends == [(False, False)] * 399 + [(False, True)]
    bare = env.unwrapped
    assert not any(bare.step(REST_ACTION)[3] for _ in range(500))


def test_never_both():
    """Over many random episodes that crash: an end has one reason."""
    env = RoboticFish3DVectorEnv(
        64,
        max_episode_steps=20,
        config={
            "tank": {"depth": 0.62},
            "goal": {"depth": [0.3, 0.31]},
            "start": {"surge": [0.3, 0.6], "tilt": 0.6},
        },
    )
    env.reset(seed=0)
    seen = np.zeros(2, int)
    for row in random_actions(200, lanes=64):
        _, _, terminated, truncated, infos = env.step(row)
        assert not np.any(terminated & truncated)
        np.testing.assert_array_equal(terminated, infos["failure"] > 0)
        seen += terminated.sum(), truncated.sum()
    assert np.all(seen > 50)

"""Minari records swims, gives the environment back, and d3rlpy learns from the record."""

import d3rlpy
import gymnasium as gym
import minari
import numpy as np
import pytest
from minari import DataCollector

from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from robofish_agents.registry import load_agents
from tests.clients.running import ENV

EPISODES, STEPS = 4, 120


@pytest.fixture
def recorded(tmp_path, monkeypatch):
    """Some swims of the PID controller in a folder of its own."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    env = DataCollector(gym.make(ENV, task="track", cruise_speed=0.08, max_episode_steps=STEPS))
    (agent,) = load_agents("pid", "track")
    for episode in range(EPISODES):
        seen, _ = env.reset(seed=episode)
        agent.reset(1)
        over = False
        while not over:
            seen, _, terminated, truncated, _ = env.step(agent.act(seen[None])[0])
            over = terminated or truncated
    return env.create_dataset("fish/pid-v0", algorithm_name="pid", requirements=["robotic-fish"])


def test_the_record_is_what_was_swum_and_the_environment_comes_back(recorded):
    dataset = minari.load_dataset("fish/pid-v0")
    assert (dataset.total_episodes, dataset.total_steps) == (EPISODES, EPISODES * STEPS)
    env = dataset.recover_environment()
    fish = env.unwrapped
    assert isinstance(fish, RoboticFish3DEnv)
    assert (fish.options.task, env.spec.max_episode_steps) == ("track", STEPS)
    for number, episode in enumerate(dataset.iterate_episodes()):
        seen, _ = env.reset(seed=number)
        np.testing.assert_array_equal(seen, episode.observations[0])
        for action, after in zip(episode.actions, episode.observations[1:], strict=True):
            np.testing.assert_array_equal(env.step(action)[0], after)


def test_a_policy_learns_offline_from_the_record(recorded):
    episodes = list(recorded.iterate_episodes())
    env = recorded.recover_environment()
    buffer = d3rlpy.dataset.create_infinite_replay_buffer(env=env)
    for one in episodes:
        for i, action in enumerate(one.actions):
            buffer.append(one.observations[i], action, float(one.rewards[i]))
        buffer.clip_episode(bool(one.terminations[-1]))
    learner = d3rlpy.algos.BCConfig(batch_size=64, learning_rate=1e-3).create(device="cpu:0")
    learner.build_with_dataset(buffer)
    seen = np.concatenate([one.observations[:-1] for one in episodes])
    done = np.concatenate([one.actions for one in episodes])
    before = np.mean((learner.predict(seen) - done) ** 2)
    learner.fit(buffer, n_steps=600, n_steps_per_epoch=300, show_progress=False,
                logger_adapter=d3rlpy.logging.NoopAdapterFactory())  # fmt: skip
    assert np.mean((learner.predict(seen) - done) ** 2) < 0.3 * before
    seen, _ = env.reset(seed=0)
    assert env.action_space.contains(learner.predict(seen[None])[0].astype(np.float32))

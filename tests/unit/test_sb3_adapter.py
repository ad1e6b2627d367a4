"""The adapter to Stable-Baselines3: its VecEnv contract, and a policy that trains on it."""

import subprocess
import sys

import numpy as np
import pytest
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from fish_env.envs.layout import OUTPUTS
from fish_env.envs.sb3 import FishVecEnv
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError
from tests.conformance.cases import REST, START, random_actions

FALLING = {"position": [0, 0, 0.949], "euler": [0, 0, 0], "velocity_body": [0, 0, 0.5]}


def test_ends_report_their_own_last_observation():
    """terminal_observation is one row, that of the fish that ended; obs is its next first one."""
    ours = FishVecEnv(4, max_episode_steps=5)
    twin = RoboticFish3DVectorEnv(4, max_episode_steps=5, autoreset_mode="Disabled")
    ours.seed(3)
    np.testing.assert_array_equal(ours.reset(), twin.reset(seed=3)[0])
    for row in random_actions(5, lanes=4):
        obs, rewards, dones, infos = ours.step(row)
        expected, reward, _, truncated, _ = twin.step(row)
        np.testing.assert_array_equal(dones, truncated)
        np.testing.assert_array_equal(rewards, reward.astype(np.float32))
    first, _ = twin.reset()
    np.testing.assert_array_equal(obs, first)
    for lane in range(4):
        np.testing.assert_array_equal(infos[lane]["terminal_observation"], expected[lane])
        assert infos[lane]["TimeLimit.truncated"] is True
        assert isinstance(infos[lane]["is_success"], bool)
        assert set(OUTPUTS) <= set(infos[lane])
    assert rewards.dtype == np.float32


def test_a_failure_is_not_a_time_limit():
    """TimeLimit.truncated is False for a fish that hit the bottom, even at its last step."""
    env = FishVecEnv(2, max_episode_steps=1)
    env.set_options({"state": FALLING})
    env.reset()
    _, _, dones, infos = env.step(np.zeros((2, 5), np.float32))
    assert dones.all()
    assert [info["TimeLimit.truncated"] for info in infos] == [False, False]
    assert [info["failure"] for info in infos] == [2.0, 2.0]


def test_seeds_hold_for_one_reset_and_are_one_each():
    """seed(n) then reset gives fish i the seed n + i, as in SB3's own vectors."""
    env = FishVecEnv(3)
    assert list(env.seed(5)) == [5, 6, 7]
    first = env.reset()
    assert not np.array_equal(env.reset(), first)
    env.seed(5)
    np.testing.assert_array_equal(env.reset(), first)
    assert len(np.unique(first, axis=0)) == 3


def test_reset_options_hold_for_one_reset():
    """set_options reaches the fish once; fish cannot be told apart."""
    env = FishVecEnv(2)
    env.set_options(START)
    env.reset()
    assert [info["depth_error"] for info in env.reset_infos] == [0.0, 0.0]
    env.reset()
    assert env.reset_infos[0]["depth_error"] != 0.0
    env.set_options([START, {"state": REST}])
    with pytest.raises(ConfigError, match="same options"):
        env.reset()


def test_info_is_empty_unless_asked_for():
    """Named keys are reported at every step; unknown ones are refused."""
    quiet, loud = FishVecEnv(2), FishVecEnv(2, info_keys=("depth", "power"))
    for env in (quiet, loud):
        env.reset()
    action = np.zeros((2, 5), np.float32)
    assert quiet.step(action)[3] == [{}, {}]
    infos = loud.step(action)[3]
    assert [set(info) for info in infos] == [{"depth", "power"}] * 2
    with pytest.raises(ConfigError, match="unknown info_keys"):
        FishVecEnv(2, info_keys=("deep",))


def test_the_monitor_counts_episodes():
    """SB3's VecMonitor reports length and return of each episode."""
    env = VecMonitor(FishVecEnv(3, max_episode_steps=10))
    env.reset()
    total = np.zeros(3)
    for row in random_actions(10, lanes=3):
        _, rewards, dones, infos = env.step(row)
        total += rewards
    assert dones.all()
    for lane in range(3):
        assert infos[lane]["episode"]["l"] == 10
        assert infos[lane]["episode"]["r"] == pytest.approx(total[lane], abs=1e-4)


def test_attributes_and_methods_answer_once_for_each_fish():
    """What SB3 asks of its vectors."""
    env = FishVecEnv(3)
    assert env.get_attr("render_mode") == [None] * 3
    assert env.get_attr("num_envs", [0, 2]) == [3, 3]
    assert env.env_is_wrapped(VecMonitor) == [False] * 3
    assert env.render_mode is None
    env.close()


@pytest.mark.slow
def test_ppo_trains_on_it():
    """Two thousand steps of PPO without an error, twice the same with the same seed."""
    weights = []
    for _ in range(2):
        env = VecMonitor(FishVecEnv(8, max_episode_steps=50))
        model = PPO("MlpPolicy", env, n_steps=32, batch_size=128, n_epochs=2, seed=1, device="cpu")
        model.learn(2000)
        assert model.num_timesteps >= 2000
        assert len(model.ep_info_buffer) > 20
        weights.append(model.policy.state_dict()["action_net.weight"].numpy())
    assert np.all(np.isfinite(weights[0]))
    np.testing.assert_array_equal(*weights)


CODE = """
import sys
sys.modules["stable_baselines3"] = None  # what an import meets where it is not installed
import fish_env
try:
    import fish_env.envs.sb3
except ImportError as error:
    print(type(error).__name__, error)
"""


def test_without_the_extra_the_error_says_what_to_install():
    """The package itself works; the adapter names its extra."""
    result = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, check=True
    )
    assert "MissingExtraError" in result.stdout
    assert 'pip install "stable-baselines3' in result.stdout

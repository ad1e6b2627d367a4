"""Stable-Baselines3 and rl_zoo3 train, save, load and swim."""

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

from fish_env.envs.sb3 import FishVecEnv
from tests.clients.running import ENV, ROOT, run


@pytest.mark.parametrize("vectorised", ["make_vec_env", "FishVecEnv"])
@pytest.mark.parametrize("algorithm", [PPO, SAC])
def test_sb3_learns_saves_and_loads(algorithm, vectorised, tmp_path):
    envs = FishVecEnv(4) if vectorised == "FishVecEnv" else make_vec_env(ENV, 4, seed=0)
    few = {"n_steps": 64} if algorithm is PPO else {"learning_starts": 64, "buffer_size": 1000}
    model = algorithm("MlpPolicy", envs, batch_size=64, seed=0, device="cpu", **few)
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(512)
    assert any((a != b).any() for a, b in zip(before, model.policy.parameters(), strict=True))
    model.save(tmp_path / "model.zip")
    loaded = algorithm.load(tmp_path / "model.zip", device="cpu")
    seen = envs.reset()
    np.testing.assert_array_equal(
        loaded.predict(seen, deterministic=True)[0], model.predict(seen, deterministic=True)[0]
    )
    env = gym.make(ENV)
    check_env(env, warn=True)
    mean, _ = evaluate_policy(loaded, env, 1, warn=False)
    assert -500 < mean < 400


def test_rl_zoo3_trains_with_our_hyper_parameters_and_enjoys(tmp_path):
    chosen = ("--algo", "ppo", "--env", "RoboticFish3D-v0", "--gym-packages", "fish_env")
    settings = ROOT / "configs" / "rl_zoo3" / "ppo.yml"
    shown = run(
        tmp_path, "-m", "rl_zoo3.train", *chosen, "-conf", settings, "-n", "4096", "-f", "logs",
        "--device", "cpu", "--eval-freq", "-1", "--num-threads", "1",
    )  # fmt: skip
    assert "Normalization activated" in shown
    assert list((tmp_path / "logs").rglob("vecnormalize.pkl"))
    shown = run(
        tmp_path, "-m", "rl_zoo3.enjoy", *chosen, "-f", "logs", "-n", "800", "--no-render",
        "--device", "cpu",
    )  # fmt: skip
    assert "Mean reward" in shown or "Episode Reward" in shown

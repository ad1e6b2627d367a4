"""Tianshou's PPO trains on vectors of environments."""

import gymnasium as gym
import numpy as np
import torch
from tianshou.algorithm import PPO
from tianshou.algorithm.modelfree.reinforce import ProbabilisticActorPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv
from tianshou.trainer import OnPolicyTrainerParams
from tianshou.utils.net.common import Net
from tianshou.utils.net.continuous import ContinuousActorProbabilistic, ContinuousCritic
from torch.distributions import Independent, Normal

from tests.clients.running import ENV


def test_tianshou_trains_ppo():
    torch.manual_seed(0)
    env = gym.make(ENV)
    train, test = (DummyVectorEnv([lambda: gym.make(ENV)] * 2) for _ in range(2))
    shape, actions = env.observation_space.shape, env.action_space.shape
    actor = ContinuousActorProbabilistic(
        preprocess_net=Net(state_shape=shape, hidden_sizes=[32]), action_shape=actions,
        unbounded=True,
    )  # fmt: skip
    critic = ContinuousCritic(preprocess_net=Net(state_shape=shape, hidden_sizes=[32]))
    policy = ProbabilisticActorPolicy(
        actor=actor,
        dist_fn=lambda both: Independent(Normal(*both), 1),
        action_space=env.action_space,
    )
    algorithm = PPO(policy=policy, critic=critic, optim=AdamOptimizerFactory(lr=1e-3))
    before = [p.detach().clone() for p in actor.parameters()]
    result = algorithm.run_training(
        OnPolicyTrainerParams(
            training_collector=Collector(algorithm, train, VectorReplayBuffer(1000, 2)),
            test_collector=Collector(algorithm, test),
            max_epochs=1,
            epoch_num_steps=600,
            collection_step_num_env_steps=300,
            batch_size=100,
            test_step_num_episodes=2,
            update_step_num_repetitions=2,
            show_progress=False,
            verbose=False,
        )
    )
    assert any((a != b).any() for a, b in zip(before, actor.parameters(), strict=True))
    assert np.isfinite(result.best_score)

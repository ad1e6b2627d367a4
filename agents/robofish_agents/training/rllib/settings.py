"""Converts a training configuration to one of RLlib."""

from __future__ import annotations

from typing import Any

import torch
from ray.rllib.algorithms.ppo import PPO, PPOConfig
from ray.rllib.algorithms.ppo.torch.ppo_torch_learner import PPOTorchLearner
from ray.rllib.core.rl_module.rl_module import RLModuleSpec

from robofish_agents.training.config import TrainConfig
from robofish_agents.training.rllib.module import FishModule
from robofish_agents.training.rllib.runner import BatchRunner
from robofish_agents.training.stack import Stack

ADAM_EPSILON = 1e-5
"""As in Stable-Baselines3; RLlib has PyTorch's 1e-8."""


class FishLearner(PPOTorchLearner):  # type: ignore[misc]
    """RLlib's learner of PPO with the optimiser of Stable-Baselines3."""

    def configure_optimizers_for_module(self, module_id: str, config: Any = None) -> None:
        """Registers Adam.

        Args:
            module_id: RLlib's name of the networks.
            config: RLlib's configuration.
        """
        parameters = self.get_parameters(self._module[module_id])
        self.register_optimizer(
            module_id=module_id,
            optimizer=torch.optim.Adam(parameters, eps=ADAM_EPSILON),
            params=parameters,
            lr_or_lr_schedule=config.lr,
        )


class FishPpo(PPO):  # type: ignore[misc]
    """RLlib's PPO, without a folder of results in the user's home."""

    def _setup_logdir(self) -> None:
        self._logdir = self.config.env_config["folder"]


def build(config: TrainConfig, stack: Stack, folder: str) -> FishPpo:
    """Builds an algorithm of RLlib that learns in this process; Ray must be running.

    Args:
        config: of the training.
        stack: its fish.
        folder: where RLlib may put files.
    """
    ppo = config.ppo
    outside, rollout = stack.outside, ppo.n_steps
    network = {"layers": config.network.layers, "activation": config.network.activation}
    settings = (
        PPOConfig(algo_class=FishPpo)
        .framework("torch")
        .environment(
            observation_space=outside.observation_space, action_space=outside.action_space,
            env_config={"folder": folder},
        )
        .env_runners(
            env_runner_cls=BatchRunner, num_env_runners=0, num_envs_per_env_runner=config.num_envs,
            rollout_fragment_length=rollout,
        )
        .learners(num_learners=0, num_gpus_per_learner=0)
        .rl_module(rl_module_spec=RLModuleSpec(module_class=FishModule, model_config=network))
        .training(
            learner_class=FishLearner,
            lr=ppo.learning_rate.start, gamma=ppo.gamma, lambda_=ppo.gae_lambda,
            clip_param=ppo.clip_range, entropy_coeff=ppo.ent_coef, vf_loss_coeff=ppo.vf_coef,
            grad_clip=ppo.max_grad_norm, grad_clip_by="global_norm",
            train_batch_size_per_learner=rollout * config.num_envs,
            minibatch_size=ppo.batch_size, num_epochs=ppo.n_epochs, shuffle_batch_per_epoch=True,
            use_kl_loss=False, vf_clip_param=float("inf"),
        )
        .debugging(seed=config.seed, log_level="ERROR")
    )  # fmt: skip
    built: FishPpo = settings.build_algo()
    built.env_runner.swim(stack, rollout)
    return built

"""One training of `scripts.bench.training` by SBX, the JAX version of Stable-Baselines3.

    python -m scripts.bench.sbx_training ppo "shipped, SBX" 0

The last line of its output is the row. Fish, normalisation, seeds, evaluations and configuration
are those of the other engine. Compiling counts as training; JAX keeps what it compiled in the
folder JAX_COMPILATION_CACHE_DIR.
"""

from __future__ import annotations

import argparse
import copy
import json
import os
from dataclasses import asdict
from typing import Any

os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")

import flax.linen
import numpy as np
import sbx
from stable_baselines3.common import logger

from robofish_agents.training.books import Books, Quiet
from robofish_agents.training.callback import Between
from robofish_agents.training.checkpoint import Progress
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.run import best_of
from robofish_agents.training.stack import Stack, make_stack, seed_episodes
from robofish_agents.training.trial import try_policy
from scripts.bench.training import configuration, row_of


class Policy:
    """The present policy of a learner with its normalisation; `restore` takes a former one."""

    def __init__(self, model: Any, stack: Stack) -> None:
        self.model, self.outside = model, stack.outside

    def reset(self, count: int) -> None:
        """Nothing is remembered."""

    def act(self, observations: np.ndarray) -> np.ndarray:
        """Mean actions (N, 5)."""
        seen = self.outside.normalize_obs(observations)
        actions = self.model.predict(seen, deterministic=True)[0]
        return np.clip(actions, -1.0, 1.0).astype(np.float32)

    def state(self) -> tuple[Any, Any]:
        """What :meth:`restore` takes."""
        return self.model.policy.actor_state, copy.deepcopy(self.outside.obs_rms)

    def restore(self, state: tuple[Any, Any]) -> None:
        """Become a former policy."""
        self.model.policy.actor_state, self.outside.obs_rms = state


def make_model(config: TrainConfig, stack: Stack) -> Any:
    """An untrained learner."""
    network = config.network
    kwargs: dict[str, Any] = {
        "net_arch": list(network.layers),
        "activation_fn": getattr(flax.linen, network.activation),
    }
    settings = asdict(config.ppo if config.algorithm == "ppo" else config.sac)
    rate = settings.pop("learning_rate")
    start, end = rate["start"], rate["end"]
    settings["learning_rate"] = start if end is None else lambda left: end + left * (start - end)
    if config.algorithm == "ppo":
        kwargs["log_std_init"] = network.log_std_init
        return sbx.PPO(
            "MlpPolicy", stack.outside, policy_kwargs=kwargs, seed=config.seed, **settings
        )
    return sbx.SAC("MlpPolicy", stack.outside, policy_kwargs=kwargs, seed=config.seed, **settings)


def trained(config: TrainConfig) -> dict[str, Any]:
    """Trains, and judges the policy with the best evaluation."""
    stack = make_stack(config)
    seed_episodes(stack, config)
    model = make_model(config, stack)
    model.set_logger(logger.configure(None, []))
    policy, progress, states = Policy(model, stack), Progress(), []

    def evaluate() -> dict[str, float]:
        states.append(policy.state())
        return try_policy(config, policy)

    books = Books(config, progress, Quiet(), evaluate, lambda: None, lambda *_: None)
    model.learn(config.total_steps, callback=Between(books))
    progress.env_cpu_s = stack.fish.cpu_s
    rows = list(progress.evaluations)
    policy.restore(states[rows.index(best_of(rows))])
    return row_of(progress, policy, config)


def main() -> None:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("algorithm")
    parser.add_argument("recipe")
    parser.add_argument("seed", type=int)
    options = parser.parse_args()
    row = trained(configuration(options.algorithm, options.recipe, options.seed))
    print(json.dumps(row))


if __name__ == "__main__":
    main()

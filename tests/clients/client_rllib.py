"""RLlib trains on the environment by its name, and on several of them."""

import json

import numpy as np
import pytest

from tests.clients.running import ENV, run

TRAIN = """
import json
import numpy as np
import ray
from ray.rllib.algorithms.ppo import PPO, PPOConfig
ray.init(num_cpus=1, include_dashboard=False, configure_logging=False, log_to_driver=False)
config = (
    PPOConfig().environment({env!r}, env_config={{"task": "track", "max_episode_steps": 100}})
    .env_runners(num_env_runners=0, num_envs_per_env_runner={envs})
    .training(train_batch_size_per_learner=800, minibatch_size=200, num_epochs=2)
)
def weights(algorithm):
    return [p.detach().numpy().copy() for p in algorithm.get_module().parameters()]
def same(one, other):
    return all((a == b).all() for a, b in zip(one, other, strict=True))
algorithm = config.build_algo()
begun = weights(algorithm)
result = algorithm.train()["env_runners"]
path, learned = algorithm.save_to_path({folder!r}), weights(algorithm)
algorithm.train()
later = weights(algorithm)
algorithm.stop()
algorithm = PPO.from_checkpoint(path)
shown = dict(mean=result["episode_return_mean"], steps=result["num_env_steps_sampled"])
shown |= dict(learned=not same(begun, learned), went_on=not same(learned, later))
print("SHOWN", json.dumps(shown | dict(restored=same(weights(algorithm), learned))))
algorithm.stop()
ray.shutdown()
"""


@pytest.mark.parametrize("envs", [1, 4])
def test_rllib_trains_saves_and_restores(envs, tmp_path):
    code = TRAIN.format(env=ENV, envs=envs, folder=str(tmp_path / "saved"))
    (line,) = (each for each in run(tmp_path, "-c", code).splitlines() if each.startswith("SHOWN "))
    shown = json.loads(line.removeprefix("SHOWN "))
    assert shown["steps"] >= 800
    assert np.isfinite(shown["mean"])
    assert shown["learned"]
    assert shown["went_on"]
    assert shown["restored"]

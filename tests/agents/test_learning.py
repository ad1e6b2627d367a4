"""A policy learns: in seconds of training it goes most of the way from drifting to holding.

The return of an episode is at most 400. A policy that has not learnt yet drifts, about 170; the
threshold lies where half of the distance to a trained one is done. Learning with negated rewards
or without gradients must not reach it, or the test would notice nothing.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robofish_agents.policies import PretrainedPolicy
from robofish_agents.training.books import Quiet
from robofish_agents.training.config import Evaluation, LearningRate, TrainConfig, load_train_config
from robofish_agents.training.run import train
from robofish_agents.training.stack import Shoal
from robofish_agents.training.trial import try_policy

LEARNT = 270.0
STEPS = 100_000


def short(**changes: object) -> TrainConfig:
    config = load_train_config("ppo-hold", total_steps=STEPS)
    evaluation = Evaluation(every=STEPS, episodes=32)
    return replace(config, evaluation=evaluation, checkpoint_every=STEPS, **changes)


def final_return(config: TrainConfig, folder: Path) -> float:
    """Mean return on episodes that were not trained on."""
    outcome = train(config, folder, Quiet())
    return try_policy(config, PretrainedPolicy.load(outcome.policy))["episode_return"]


@pytest.mark.slow
def test_ppo_learns_to_hold(tmp_path):
    assert final_return(short(), tmp_path) > LEARNT


@pytest.mark.slow
def test_learning_from_negated_rewards_is_noticed(tmp_path, monkeypatch):
    step = Shoal.step_wait

    def negated(fish):
        observations, rewards, dones, infos = step(fish)
        return observations, -rewards, dones, infos

    monkeypatch.setattr(Shoal, "step_wait", negated)
    assert final_return(short(), tmp_path) < LEARNT - 50.0


@pytest.mark.slow
def test_learning_without_gradients_is_noticed(tmp_path):
    config = short()
    still = replace(config, ppo=replace(config.ppo, learning_rate=LearningRate(1e-12)))
    assert final_return(still, tmp_path) < LEARNT - 50.0


@pytest.mark.slow
def test_observations_that_say_nothing_are_noticed(tmp_path, monkeypatch):
    step = Shoal.step_wait

    def blind(fish):
        observations, rewards, dones, infos = step(fish)
        return np.zeros_like(observations), rewards, dones, infos

    monkeypatch.setattr(Shoal, "step_wait", blind)
    assert final_return(short(), tmp_path) < LEARNT - 50.0

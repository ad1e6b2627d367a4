"""A training that begins from the PID controller swims like it at once."""

from dataclasses import replace

import numpy as np
import pytest

from agents.controllers import PIDController
from agents.evaluation.suites import load_suite
from agents.policies import PretrainedPolicy
from agents.policies.export import export_policy
from agents.training.config import Evaluation, Imitation, TrainConfig
from agents.training.imitation import Swim, _returns, imitate
from agents.training.model import make_model
from agents.training.stack import make_stack, seed_episodes
from agents.training.teacher import HurryingPID, true_observations
from agents.training.trial import try_policy
from fish_env.errors import ConfigError

CONFIG = TrainConfig(
    "imitation", "ppo", "hold", 100, imitate=Imitation(3, 8), evaluation=Evaluation(100, 16)
)


def score(config: TrainConfig) -> float:
    """Mean return of what imitation alone makes, on other episodes."""
    stack = make_stack(config)
    model = make_model(config, stack)
    seed_episodes(stack, config)
    imitate(model, stack, config, config.imitate)
    policy = export_policy(model, stack.outside, stack.past.history.spec, config.task, {})
    return try_policy(config, PretrainedPolicy(policy))["episode_return"]


@pytest.mark.slow
def test_it_swims_nearly_as_well_as_its_teacher():
    teacher = try_policy(CONFIG, PIDController())["episode_return"]
    assert score(CONFIG) > teacher - 15.0


@pytest.mark.slow
def test_a_teacher_that_says_nothing_is_noticed(monkeypatch):
    act = PIDController.act
    monkeypatch.setattr(PIDController, "act", lambda self, seen: 0.0 * act(self, seen))
    assert score(CONFIG) < 250.0


def test_it_is_for_ppo_alone():
    with pytest.raises(ConfigError, match="needs ppo"):
        replace(CONFIG, algorithm="sac")


def test_values_are_fitted_to_discounted_returns():
    reward = np.ones((3, 1), np.float32)
    ended = np.array([[False], [True], [False]])
    swim = Swim(np.zeros((3, 1, 1)), np.zeros((3, 1, 5)), reward, ended)
    np.testing.assert_allclose(_returns(swim, 0.5)[:, 0], [1.5, 1.0, 1.0])


@pytest.mark.parametrize("suite", ["calm", "noisy"])
def test_the_teacher_sees_what_sensors_show_without_noise_and_delay(suite):
    env = load_suite(suite).make("track", 8, 1)
    observations, _ = env.reset(seed=3)
    rng = np.random.default_rng(0)
    for _ in range(30):
        observations, *_ = env.step(rng.uniform(-1.0, 1.0, (8, 5)).astype(np.float32))
    exact = np.allclose(true_observations(observations, env.batch), observations, atol=1e-6)
    assert exact == (suite == "calm")


def test_the_teacher_hurries_in_a_turn_and_saves_speed_otherwise():
    swift, plain = HurryingPID(0.015, 0.003), HurryingPID(0.0, 0.0)
    frequency = {}
    for name, error in (("on course", 0.0), ("in a turn", 1.0)):
        seen = np.zeros((1, 33))
        seen[0, [4, 6]], seen[0, [5, 7]] = np.sin(error), np.cos(error)
        seen[0, [10, 12, 14, 15]] = 1.0, 1.0, 1.0, 0.5
        frequency[name] = [pid.act(seen)[0, 2] for pid in (swift, plain)]
    assert frequency["on course"][0] < frequency["on course"][1]
    assert frequency["in a turn"][0] > frequency["in a turn"][1]

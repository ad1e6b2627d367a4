"""A training that begins from the PID controller swims like it at once."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from fish_env.errors import ConfigError
from robofish_agents.controllers import PIDController
from robofish_agents.evaluation.suites import load_suite
from robofish_agents.policies import PretrainedPolicy
from robofish_agents.policies.export import export_policy
from robofish_agents.training.config import Evaluation, Imitation, TrainConfig
from robofish_agents.training.imitation import BLOCK, Swim, _policy, _returns, _stretch, imitate
from robofish_agents.training.model import make_model
from robofish_agents.training.stack import make_stack, seed_episodes
from robofish_agents.training.teacher import ForesightPID, beyond, true_observations
from robofish_agents.training.teacher_gains import teacher_gains
from robofish_agents.training.trial import try_policy

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
@pytest.mark.long
def test_a_teacher_that_says_nothing_is_noticed(monkeypatch):
    act = PIDController.act
    monkeypatch.setattr(PIDController, "act", lambda self, seen: 0.0 * act(self, seen))
    assert score(CONFIG) < 250.0


def test_it_is_for_ppo_alone():
    with pytest.raises(ConfigError, match="needs ppo"):
        replace(CONFIG, algorithm="sac")


def test_the_block_alone_is_stretched():
    model = make_model(CONFIG, make_stack(CONFIG))
    seen = torch.as_tensor(np.random.default_rng(0).standard_normal((7, 33)), dtype=torch.float32)
    before = _policy(model.policy, seen)
    _stretch(model, 1.5)
    factors = torch.ones(5)
    factors[BLOCK] = 1.5
    torch.testing.assert_close(_policy(model.policy, seen), before * factors)


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


def seen_on_course(**entries: float) -> np.ndarray:
    """An observation (1, 33) of a fish that cruises at its goal, but for these entries."""
    seen = np.zeros((1, 33))
    seen[0, [5, 7, 10, 12, 14]] = 1.0
    seen[0, 15] = 0.5
    names = {"depth_error": 0, "goal_depth_rate": 2}
    for name, value in entries.items():
        seen[0, names[name]] = value
    return seen


def test_without_gains_of_its_own_the_teacher_is_nearly_the_pid_controller():
    env = load_suite("calm").make("hold", 16, 1)
    observations, _ = env.reset(seed=4)
    teacher, pid = ForesightPID(teacher_gains({})), PIDController()
    for agent in (teacher, pid):
        agent.reset(16)
    for _ in range(40):
        wanted = pid.act(observations)
        np.testing.assert_allclose(
            teacher.act(observations)[:, [0, 1, 3, 4]], wanted[:, [0, 1, 3, 4]]
        )
        observations, *_ = env.step(wanted)


@pytest.mark.parametrize(
    ("gains", "why"),
    [
        ({"turn_speed": 0.01}, "turn"),
        ({"far_speed": 0.1, "far_limit": 0.03}, "far"),
        ({"swing_speed": 0.5}, "swing"),
    ],
)
def test_the_teacher_hurries_where_it_is_told_to(gains, why):
    seen = seen_on_course()
    if why == "turn":
        seen[0, [4, 6]], seen[0, [5, 7]] = np.sin(1.0), np.cos(1.0)
    elif why == "far":
        seen = seen_on_course(depth_error=0.6)
    else:
        seen = seen_on_course(goal_depth_rate=0.5)
    plain, swift = (ForesightPID(teacher_gains(changes)) for changes in ({}, gains))
    assert swift.act(seen)[0, 2] > plain.act(seen)[0, 2] + 0.01
    level = seen_on_course()
    assert swift.act(level)[0, 2] == pytest.approx(plain.act(level)[0, 2], abs=0.02)


def test_the_teacher_saves_speed_on_course():
    slow, plain = (ForesightPID(teacher_gains({"saving": x})) for x in (0.003, 0.0))
    assert slow.act(seen_on_course())[0, 2] < plain.act(seen_on_course())[0, 2]


def test_the_teacher_begins_with_the_trim_of_its_fish():
    pid = ForesightPID(teacher_gains({"trim_lift": -500.0}))
    pid.reset(3)
    pid.trim(np.zeros(3), np.array([-1e-3, 0.0, 1.0]))
    trimmed = pid._depth
    np.testing.assert_allclose(
        trimmed,
        [
            0.5 if pid.gains.depth_windup > 0.5 else pid.gains.depth_windup,
            0.0,
            -pid.gains.depth_windup,
        ],
    )


def test_what_a_fish_has_beyond_the_nominal_one_is_told():
    hard, calm = (load_suite(name).make("hold", 5, 1) for name in ("hard", "calm"))
    for env in (hard, calm):
        env.reset(seed=1)
    mass = hard.batch.drawn["mass.buoyancy"]
    np.testing.assert_allclose(beyond("mass.buoyancy", hard.batch), mass - 2.0)
    assert not beyond("mass.buoyancy", calm.batch).any()

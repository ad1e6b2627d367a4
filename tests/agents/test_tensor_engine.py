"""The engine of PPO over tensors: resumes to the bit, exports what it learnt, uses its critic."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from fish_env.errors import ConfigError
from robofish_agents.policies import PretrainedPolicy
from robofish_agents.training.books import Books
from robofish_agents.training.books import Quiet as Watcher
from robofish_agents.training.checkpoint import Progress
from robofish_agents.training.config import (
    Critic,
    Imitation,
    LearningRate,
    NetworkSettings,
    Ppo,
    Teaching,
)
from robofish_agents.training.run import train
from robofish_agents.training.stack import make_stack, seed_episodes
from robofish_agents.training.tensor_engine import TensorEngine, _ends, _set_rate
from robofish_agents.training.tensor_ppo import GROUPS, Taken, generalised
from tests.agents.test_training import PPO, Quiet, same

TENSOR = replace(
    PPO,
    engine="tensor",
    imitate=Imitation(),
    disturbances=("calm", "hard"),
    critic=Critic(privileged=True, layers=(16,)),
    ppo=replace(PPO.ppo, target_kl=0.5, ent_coef=0.001),
)


TAUGHT = replace(TENSOR, teacher=Teaching(768, 768, (16,), distil_epochs=1))
"""Three phases of six, six and four rollouts."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return train(TENSOR, tmp_path_factory.mktemp("whole"), Quiet())


@pytest.fixture(scope="module")
def taught(tmp_path_factory):
    return train(TAUGHT, tmp_path_factory.mktemp("taught"), Quiet())


@pytest.mark.parametrize("stop_at", [100, 1000, 1999])
def test_a_stopped_training_goes_on_to_the_same_bits(stop_at, whole, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        train(TENSOR, tmp_path, Quiet(stop_at))
    resumed = train(TENSOR, tmp_path, Quiet(), resume=True)
    assert same(resumed, whole)
    assert resumed.progress.steps == 2048


@pytest.mark.parametrize("stop_at", [500, 900, 1700])
def test_every_phase_goes_on_to_the_same_bits(stop_at, taught, tmp_path):
    """The teacher learns, the policy is fitted to it, the policy learns."""
    with pytest.raises(KeyboardInterrupt):
        train(TAUGHT, tmp_path, Quiet(stop_at))
    assert same(train(TAUGHT, tmp_path, Quiet(), resume=True), taught)


def test_a_policy_is_evaluated_once_it_is_fitted(taught, whole):
    assert whole.progress.evaluations[0]["steps"] == 768
    assert [row["steps"] for row in taught.progress.evaluations] == [1536, 2048]


def test_the_policy_comes_near_its_teacher():
    longer = replace(TAUGHT, total_steps=4096, teacher=Teaching(256, 3840))
    longer = replace(longer, teacher=replace(longer.teacher, distil_rate=LearningRate(3e-3)))
    learner = engine(longer)
    learner.teacher.mean[-1].bias.data[:] = torch.tensor([0.2, 0.5, 0.4, -0.3, 0.1])
    learner.learn(books(longer))
    with torch.no_grad():
        seen, judged = learner._look()
        wanted = learner.teacher.mean(judged[:, : learner._present]).clamp(-1.0, 1.0)
        distance = (learner.learner.mean(seen) - wanted).abs().mean()
    assert wanted.abs().mean() > 0.1
    assert distance < 0.1
    pairs = zip(learner.teacher.value.parameters(), learner.learner.value.parameters(), strict=True)
    assert all(torch.equal(one, other) for one, other in pairs)


def books(config):
    return Books(config, Progress(), Watcher(), dict, lambda: None, lambda name, value: None)


def test_another_seed_learns_something_else(whole, tmp_path):
    assert not same(train(replace(TENSOR, seed=1), tmp_path, Quiet()), whole)


def test_the_critic_matters(whole, tmp_path):
    """Without what is privileged, values and so the policy are others."""
    assert not same(train(replace(TENSOR, critic=Critic()), tmp_path, Quiet()), whole)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"algorithm": "sac"}, "algorithm: .* choose ppo"),
        ({"ppo": replace(TENSOR.ppo, use_sde=True)}, "ppo.use_sde: .* remove it"),
        ({"imitate": Imitation(1)}, "imitate: .* remove it"),
        ({"engine": "sb3"}, "critic: engine sb3 has none of its own"),
        ({"engine": "sb3", "critic": Critic(), "teacher": Teaching(9)}, "teacher: engine sb3 has"),
        ({"critic": Critic(), "teacher": Teaching(9)}, "teacher: needs critic.privileged: true"),
        ({"teacher": Teaching(2000, 2000)}, "within total_steps"),
    ],
)
def test_what_the_engine_does_not_have_is_refused(changes, message):
    with pytest.raises(ConfigError, match=message):
        replace(TENSOR, **changes)


def test_the_critic_is_written_with_its_engine_alone():
    assert TENSOR.tree()["critic"] == {"privileged": True, "layers": [16]}
    assert "critic" not in PPO.tree()


def engine(config):
    stack = make_stack(config)
    seed_episodes(stack, config)
    return TensorEngine(config, stack)


def test_a_policy_file_acts_as_the_learner():
    network = NetworkSettings((32, 16), first_action=(0.1, 0.2, 0.3, -0.1, 0.0))
    learner = engine(replace(TENSOR, network=network))
    seen = np.asarray(learner.stack.outside.reset())
    agent = PretrainedPolicy(learner.policy({}))
    agent.reset(TENSOR.num_envs)
    acts = agent.act(learner.stack.outside.get_original_obs()[:, :33])
    with torch.no_grad():
        expected = learner.learner.mean(torch.from_numpy(seen)).clamp(-1.0, 1.0).numpy()
    np.testing.assert_allclose(acts, expected, atol=1e-5)
    assert np.abs(acts).max() > 0.05


def test_episodes_begin_in_turn():
    config = replace(TENSOR, num_envs=2 * GROUPS, ppo=Ppo(n_steps=16, batch_size=128))
    learner = engine(config)
    learner.stack.outside.reset()
    learner._stagger()
    for part in learner.stack.fish.parts:
        assert sorted(part.env._steps) == [25 * group for group in range(GROUPS)]


def test_the_rate_falls_to_its_end():
    optimiser = torch.optim.Adam([torch.nn.Parameter(torch.zeros(1))])
    rates = []
    for done in (0.0, 0.5, 1.0, 1.1):
        _set_rate(optimiser, LearningRate(1e-2, 1e-3), done)
        rates.append(optimiser.param_groups[0]["lr"])
    assert rates == pytest.approx([1e-2, 5.5e-3, 1e-3, 1e-3])


def test_ends_tell_failures_from_time_limits():
    infos = [{}, {"TimeLimit.truncated": True}, {"TimeLimit.truncated": False}]
    reward, terminated, truncated = _ends(np.ones(3), np.array([False, True, True]), infos)
    assert reward.tolist() == [1.0, 1.0, 1.0]
    assert terminated.tolist() == [0.0, 0.0, 1.0]
    assert truncated.tolist() == [0.0, 1.0, 0.0]


def test_a_truncated_episode_counts_as_going_on():
    """By the value before its end; a failed one is worth nothing afterwards."""
    taken = Taken(
        torch.ones(1, 3), torch.tensor([[0.0, 1.0, 0.0]]), torch.tensor([[0.0, 0.0, 1.0]])
    )
    value = torch.tensor([[2.0, 2.0, 2.0], [5.0, 5.0, 5.0]])
    recipe = engine(TENSOR).recipe
    advantage, _ = generalised(taken, value, value[:-1], recipe)
    gamma = recipe.gamma
    expected = [1 + 5 * gamma - 2, 1 - 2, 1 + 2 * gamma - 2]
    assert advantage[0].tolist() == pytest.approx(expected)


@pytest.mark.slow
@pytest.mark.long
def test_it_learns_to_hold(tmp_path):
    config = replace(
        TENSOR, disturbances=("calm",), num_envs=256, total_steps=240_000,
        settings={"reward": {"margins": {"depth": 0.05, "heading": 0.1, "speed": 0.02}}},
        history=replace(TENSOR.history, frames=1, low_pass_s=()),
        critic=Critic(privileged=True),
        ppo=Ppo(16, 1024, 4, LearningRate(6e-3, 0.0)),
        evaluation=replace(TENSOR.evaluation, every=240_000, episodes=64),
        checkpoint_every=240_000,
    )  # fmt: skip
    assert train(config, tmp_path, Watcher()).best["success_rate"] >= 0.8

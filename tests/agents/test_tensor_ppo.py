"""PPO over tensors: its arithmetic against plain sums, and that it learns."""

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.spaces import Box
from torch.distributions import Normal

import fish_env  # noqa: F401  (registers the environment)
from robofish_agents.training import tensor_ppo
from robofish_agents.training.actor_critic import HOLD, HOLD_FISH
from robofish_agents.training.host_env import HostEnv
from robofish_agents.training.tensor_ppo import ActorCritic, Recipe, Rollout


class Aim:
    """The reward is greater, the nearer the first action is to the first number seen.

    Episodes last three steps. The first half of them fails in the second step; of the others, which
    are cut off in the third, every other one is a success.
    """

    def __init__(self, count=64):
        self.single_action_space = Box(-1.0, 1.0, (2,))
        self.count = count
        self.observed = torch.zeros(count, 3)
        self.final = torch.zeros(count, 3)
        self.age = torch.zeros(count)

    def reset(self, *, seed=None):
        self.generator = torch.Generator().manual_seed(seed)
        self.age[:] = 0.0
        self.observed[:] = torch.rand(self.observed.shape, generator=self.generator) - 0.5
        return self.observed, {}

    def step(self, actions):
        reward = 1.0 - (actions[:, 0] - self.observed[:, 0]).abs()
        self.age += 1.0
        index = torch.arange(self.count)
        terminated = (index < self.count // 2) & (self.age == 2.0)
        truncated = (self.age == 3.0) & ~terminated
        ended = terminated | truncated
        self.final[ended] = self.observed[ended]
        self.age[ended] = 0.0
        self.observed[:] = torch.rand(self.observed.shape, generator=self.generator) - 0.5
        infos = {"final_obs": self.final, "final_info": {"is_success": (index % 2).float()}}
        return self.observed, reward, terminated, truncated, infos


def test_densities_are_those_of_a_normal_distribution():
    torch.manual_seed(0)
    policy = ActorCritic(3, 2, Recipe(log_std=-0.3))
    observed = torch.randn(7, 3)
    actions, density = policy.act(observed)
    normal = Normal(policy.mean(observed), policy.log_std.exp())
    expected = normal.log_prob(actions).sum(-1)
    assert torch.allclose(density, expected, atol=1e-5)
    assert torch.allclose(policy.log_probability(observed, actions), expected, atol=1e-5)


def test_actions_have_the_deviation_of_the_policy():
    torch.manual_seed(0)
    policy = ActorCritic(3, 2, Recipe(log_std=-1.0))
    actions, _ = policy.act(torch.zeros(20_000, 3))
    assert torch.allclose(actions.std(0), torch.full((2,), np.exp(-1.0)), rtol=0.03)


def test_a_policy_explores_less_and_less():
    policy, recipe = ActorCritic(3, 2, Recipe()), Recipe(log_std=-0.5, log_std_end=-2.5)
    policy.limit_noise(recipe, 0.25)
    assert policy.log_std.tolist() == pytest.approx([-1.0] * 2)
    policy.log_std.data[:] = -3.0
    policy.limit_noise(recipe, 1.0)
    assert policy.log_std.tolist() == [-3.0] * 2


def summed(policy, taken, recipe):
    """Advantages (steps, N) from their definition: surprises up to the end of an episode."""
    with torch.no_grad():
        value = policy.value(taken.observed).squeeze(-1)
        final = policy.value(taken.final).squeeze(-1)
    steps, count = taken.reward.shape
    found = torch.zeros(steps, count)
    for lane in range(count):
        for start in range(steps):
            weight = 1.0
            for step in range(start, steps):
                following = value[step + 1, lane]
                if taken.terminated[step, lane]:
                    following = 0.0
                elif taken.truncated[step, lane]:
                    following = final[step, lane]
                surprise = taken.reward[step, lane] + recipe.gamma * following - value[step, lane]
                found[start, lane] += weight * surprise
                weight *= recipe.gamma * recipe.trace
                if taken.terminated[step, lane] or taken.truncated[step, lane]:
                    break
    return found, found + value[:-1]


def test_advantages_are_sums_of_surprises_up_to_the_end_of_an_episode():
    torch.manual_seed(0)
    recipe, env = Recipe(steps=8), Aim(6)
    policy = ActorCritic(3, 2, recipe)
    taken = tensor_ppo.collect(env, policy, env.reset(seed=0)[0], recipe)
    assert taken.terminated.any()
    assert taken.truncated.any()
    for ours, theirs in zip(
        tensor_ppo.advantages(policy, taken, recipe), summed(policy, taken, recipe), strict=True
    ):
        assert torch.allclose(ours, theirs, atol=1e-5)


@pytest.mark.parametrize("field", ["terminated", "truncated", "final", "reward"])
def test_what_is_left_out_of_advantages_is_noticed(field):
    torch.manual_seed(0)
    recipe, env = Recipe(steps=8), Aim(6)
    policy = ActorCritic(3, 2, recipe)
    taken = tensor_ppo.collect(env, policy, env.reset(seed=0)[0], recipe)
    wrong = taken._replace(**{field: torch.zeros_like(getattr(taken, field))})
    ours, _ = tensor_ppo.advantages(policy, wrong, recipe)
    assert not torch.allclose(ours, summed(policy, taken, recipe)[0], atol=1e-5)


def test_a_rollout_holds_what_was_seen_before_each_action():
    recipe, env = Recipe(steps=4), Aim(2)
    observed, _ = env.reset(seed=3)
    first = observed.clone()
    taken = tensor_ppo.collect(env, ActorCritic(3, 2, recipe), observed, recipe)
    assert isinstance(taken, Rollout)
    assert torch.equal(taken.observed[0], first)
    assert torch.equal(taken.observed[-1], env.observed)
    nearness = 1.0 - (taken.actions[..., 0] - taken.observed[:-1, :, 0]).abs()
    assert torch.allclose(taken.reward, nearness)


def test_it_learns_and_repeats_itself():
    recipe = Recipe(iterations=30, steps=12, minibatches=4, gamma=0.5, layers=(16,))
    trained = [tensor_ppo.train(Aim(), recipe, seed=1) for _ in range(2)]
    errors = []
    for policy in (ActorCritic(3, 2, recipe), trained[0].policy):
        env = Aim(256)
        observed, _ = env.reset(seed=9)
        with torch.no_grad():
            errors.append((policy.mean(observed)[:, 0] - observed[:, 0]).abs().mean().item())
    assert errors[1] < 0.3 * errors[0]
    assert trained[0].steps == 30 * 12 * 64
    assert trained[0].updates == 30 * 5 * 4
    for ours, theirs in zip(*(t.policy.parameters() for t in trained), strict=True):
        assert torch.equal(ours, theirs)


def test_success_is_that_of_first_episodes_that_do_not_fail():
    rate = tensor_ppo.success_rate(Aim(64), ActorCritic(3, 2, Recipe()), seed=0)
    assert rate == 0.25


def vector(count, **options):
    return gym.make_vec(
        "RoboticFish3D-v0",
        num_envs=count,
        vectorization_mode="vector_entry_point",
        autoreset_mode="SameStep",
        **options,
    )


def test_an_environment_of_the_host_gives_the_same_numbers_as_tensors():
    ours, theirs = HostEnv(vector(2, max_episode_steps=3)), vector(2, max_episode_steps=3)
    observed, _ = ours.reset(seed=4)
    expected, _ = theirs.reset(seed=4)
    actions = torch.rand(2, 5)
    for step in range(1, 5):
        assert np.array_equal(observed.numpy(), expected)
        observed, reward, terminated, truncated, infos = ours.step(actions)
        expected, reward_, terminated_, truncated_, infos_ = theirs.step(actions.numpy())
        assert np.allclose(reward.numpy(), reward_)
        assert np.array_equal(terminated.numpy(), terminated_)
        assert np.array_equal(truncated.numpy(), truncated_)
        assert truncated.all() == (step == 3)
        if step == 3:
            assert np.array_equal(infos["final_obs"].numpy(), np.stack(infos_["final_obs"]))


@pytest.mark.slow
@pytest.mark.long
def test_the_recipe_learns_to_hold():
    """A minute or two."""
    fish = HostEnv.of_fish(HOLD_FISH)
    trained = tensor_ppo.train(fish, HOLD, seed=0)
    assert tensor_ppo.success_rate(HostEnv.of_fish(256), trained.policy, seed=1000) >= 0.95
